//! The task that follows a registry: it asks, has what it hears judged, and begins anew after a defect.

use super::client::{ClientError, RegistryClient};
use super::contact::Contact;
use super::followed::{UNREADABLE, Verdict, is_damage};
use super::follower::Follower;
use super::ground::BaseNetwork;
use super::listing::{Listing, Page};
use super::pace::Pace;
use crate::Edge;
use crate::events::Happening;
use crate::upstream::RegistryCursor;
use jiff::SignedDuration;
use serde_json::json;
use skyway_contract::{EventKind, Nack};
use skyway_service::refusal::Refusal;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

/// Pages in a row that are not as their digests say, before everything is read anew.
const BROKEN_PAGES_MAX: u32 = 3;

/// How a registry is followed.
#[derive(Clone, Debug)]
pub struct SyncSettings {
    /// The id of the network at the registry.
    pub network: String,
    /// What this edge is called there; with the number of a change it names that change for ever.
    pub edge_id: String,
    /// Where the registry reaches this edge, if it is to.
    pub advertise: Option<String>,
    /// How long to wait for news, about.
    pub poll_wait: Duration,
    /// The longest wait after failures.
    pub retry_within: Duration,
    /// What determines how waits are spread.
    pub seed: u64,
}

/// A registry that is being followed, until this is stopped.
#[derive(Debug)]
pub struct Following {
    stop: CancellationToken,
    task: JoinHandle<()>,
}

impl Following {
    /// Stops following, and waits until that is done.
    pub async fn stop(self) {
        self.stop.cancel();
        // It ends in order or with the runtime.
        let _ = self.task.await;
    }
}

/// What a question to the registry came to.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Go on at once.
    On,
    /// Go on after a while, as something failed.
    Later,
}

/// How the registry is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// The log from the cursor on.
    Log,
    /// Everything that holds.
    List,
    /// The log from after a list that cannot be taken over, for what is stricter in it, until that list may be good.
    RestrictionsOnly { epoch: u64, after: u64 },
}

/// All that the loops share.
#[derive(Debug)]
pub(super) struct Sync<C> {
    pub(super) edge: Arc<Edge>,
    pub(super) client: C,
    pub(super) settings: SyncSettings,
    pub(super) follower: Follower,
}

impl Edge {
    /// Follows a registry from now on.
    pub fn follow_registry<C: RegistryClient>(
        self: &Arc<Self>,
        client: C,
        settings: SyncSettings,
    ) -> Following {
        let stop = CancellationToken::new();
        let sync = Arc::new(Sync {
            edge: self.clone(),
            client,
            follower: Follower {
                network: Arc::from(settings.network.as_str()),
                margin_m: self.settings.margin_m,
            },
            settings,
        });
        let stopped = stop.clone();
        let task = tokio::spawn(async move {
            tokio::select! {
                () = stopped.cancelled() => {}
                () = supervise(sync) => {}
            }
        });
        Following { stop, task }
    }
}

/// Ends a task with its waiting caller.
struct Ward(JoinHandle<()>);

impl Drop for Ward {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Begins anew whenever a defect has ended it.
async fn supervise<C: RegistryClient>(sync: Arc<Sync<C>>) {
    let mut pace = sync.pace(3);
    loop {
        let working = sync.clone();
        let mut ward = Ward(tokio::spawn(async move { working.work().await }));
        let ended = (&mut ward.0).await;
        sync.contact().restarted();
        match ended {
            Ok(()) => tracing::error!("following the registry ended by itself"),
            Err(error) => tracing::error!(%error, "following the registry failed"),
        }
        sync.pause(pace.failed()).await;
    }
}

impl<C: RegistryClient> Sync<C> {
    /// Everything at once; none of it ends.
    async fn work(&self) {
        tokio::join!(
            self.follow(),
            self.forward_all(),
            self.look(),
            self.tell_news(),
            self.tell_positions(),
        );
    }

    pub(super) fn contact(&self) -> &Contact {
        &self.edge.contact
    }

    /// A pace of its own for each loop.
    pub(super) fn pace(&self, which: u64) -> Pace {
        let seed = self.settings.seed.wrapping_mul(8).wrapping_add(which);
        Pace::new(seed, self.settings.retry_within)
    }

    pub(super) async fn pause(&self, wait: Duration) {
        let clock = self.edge.clock();
        let span = SignedDuration::try_from(wait).unwrap_or(SignedDuration::MAX);
        if let Ok(instant) = clock.now().checked_add(span) {
            clock.sleep_until(instant).await;
        }
    }

    pub(super) fn tell(&self, kind: EventKind, data: serde_json::Value) {
        let (edge, happening) = (&self.edge, Happening::new(kind, data));
        let revision = edge.snapshot().revision.clone();
        edge.events
            .add(vec![happening], edge.clock().now(), &revision);
    }

    pub(super) fn ground(&self) -> BaseNetwork {
        let snapshot = self.edge.snapshot();
        BaseNetwork {
            topology: snapshot.topology().clone(),
            geojson: snapshot.network.geojson.clone(),
        }
    }

    async fn follow(&self) {
        let mut pace = self.pace(0);
        let mut mode = Mode::Log;
        let mut broken_pages = 0;
        let mut is_heard = false;
        loop {
            let cursor = self.edge.snapshot().registry.clone();
            let wait = pace.spread(self.settings.poll_wait);
            let step = match (&mode, cursor) {
                (Mode::RestrictionsOnly { epoch, after }, Some(cursor)) => {
                    let (epoch, after) = (*epoch, *after);
                    self.follow_warily(&cursor, epoch, after, wait, &mut mode)
                        .await
                }
                (Mode::Log, Some(cursor)) => {
                    // Until it is known that the registry answers, and which one, nothing is told to it.
                    let is_sure = is_heard && self.contact().is_ours();
                    let wait = if is_sure { wait } else { Duration::ZERO };
                    self.follow_log(&cursor, wait, &mut mode, &mut broken_pages)
                        .await
                }
                (_, cursor) => self.follow_list(cursor.as_ref(), &mut mode).await,
            };
            is_heard = step == Step::On;
            match step {
                Step::On => pace.succeeded(),
                Step::Later => self.pause(pace.failed()).await,
            }
        }
    }

    /// Asks for the log after the cursor, and takes over what it has.
    async fn follow_log(
        &self,
        cursor: &Arc<RegistryCursor>,
        wait: Duration,
        mode: &mut Mode,
        broken_pages: &mut u32,
    ) -> Step {
        let asked = self.client.changes(cursor.epoch, cursor.revision, wait);
        let page = match asked.await {
            Ok(page) => page,
            Err(error) => return self.unanswered(error, cursor.revision, mode),
        };
        let head = page.head;
        let verdict = match self.judge(page, cursor.clone()).await {
            Ok(verdict) => verdict,
            Err(refusal) => return self.defect(&refusal),
        };
        if !matches!(verdict, Verdict::Nack(_)) {
            *broken_pages = 0;
        }
        match verdict {
            Verdict::Idle => {
                self.read_up_to(cursor.revision, head);
                Step::On
            }
            Verdict::Follow(followed) => {
                let modes = (mode, Mode::List);
                self.take_over(*followed, head, modes).await
            }
            Verdict::Resync(why) => {
                tracing::warn!(why, "the registry is read anew");
                *mode = Mode::List;
                Step::On
            }
            Verdict::Nack(rejected) => {
                *broken_pages += 1;
                // What is damaged on its way may come right; what is not valid will not by being asked again.
                let is_damage = is_damage(&rejected.nack.code);
                if !is_damage || *broken_pages >= BROKEN_PAGES_MAX {
                    *broken_pages = 0;
                    *mode = Mode::List;
                }
                self.reject(*rejected).await;
                Step::Later
            }
        }
    }

    /// Asks for everything that holds, and takes it over as one batch.
    async fn follow_list(&self, cursor: Option<&Arc<RegistryCursor>>, mode: &mut Mode) -> Step {
        let ground = self.ground();
        let mut listing = Listing::default();
        let mut token: Option<String> = None;
        let (epoch, revision) = loop {
            let page = match self.client.snapshot(token.as_deref()).await {
                Ok(page) => page,
                Err(error) => {
                    let revision = cursor.map_or(0, |cursor| cursor.revision);
                    return self.unanswered(error, revision, mode);
                }
            };
            let at = (page.epoch, page.revision);
            match self.add_page(&mut listing, page, cursor, &ground).await {
                Ok(Page::More(next)) => token = Some(next),
                Ok(Page::Last) => break at,
                Ok(Page::Nack(rejected)) => {
                    self.reject(*rejected).await;
                    return Step::Later;
                }
                Err(refusal) => return self.defect(&refusal),
            }
        };
        match self.judge_listing(listing, cursor, ground).await {
            Ok(Verdict::Follow(followed)) => {
                let after = revision;
                let otherwise = Mode::RestrictionsOnly { epoch, after };
                let modes = (&mut *mode, otherwise);
                let step = self.take_over(*followed, revision, modes).await;
                if step == Step::On {
                    *mode = Mode::Log;
                }
                step
            }
            Ok(Verdict::Nack(rejected)) => {
                // An object that is not valid stays so until it is changed; a list that is not whole may come right.
                let is_lasting = rejected.nack.object.is_some() && cursor.is_some();
                self.reject(*rejected).await;
                if is_lasting {
                    let after = revision;
                    *mode = Mode::RestrictionsOnly { epoch, after };
                }
                Step::Later
            }
            Ok(Verdict::Idle | Verdict::Resync(_)) => Step::Later,
            Err(refusal) => self.defect(&refusal),
        }
    }

    /// Waits for what comes after a list that cannot be taken over, takes what is stricter, and tries the list again.
    async fn follow_warily(
        &self,
        cursor: &Arc<RegistryCursor>,
        epoch: u64,
        after: u64,
        wait: Duration,
        mode: &mut Mode,
    ) -> Step {
        let page = match self.client.changes(epoch, after, wait).await {
            Ok(page) => page,
            Err(error) => return self.unanswered(error, after, mode),
        };
        let read_up_to = Arc::new(RegistryCursor {
            registry_id: cursor.registry_id.clone(),
            epoch,
            revision: after,
        });
        let strict = match self.judge(page, read_up_to).await {
            // Nothing has changed for a while; perhaps this edge was given what it needs.
            Ok(Verdict::Idle) => None,
            Ok(Verdict::Follow(followed)) => Some(followed),
            Ok(Verdict::Nack(rejected)) => rejected.restrictions,
            Ok(Verdict::Resync(_)) => None,
            Err(refusal) => return self.defect(&refusal),
        };
        if let Some(strict) = strict.filter(|strict| strict.network.is_none()) {
            self.take_strict(*strict, cursor).await;
        }
        *mode = Mode::List;
        Step::Later
    }

    /// Notes how far the edge is.
    pub(super) fn read_up_to(&self, revision: u64, head: u64) {
        let contact = self.contact();
        if revision >= head && contact.is_current(self.edge.clock()) {
            tracing::info!("the registry is heard again");
            self.tell(EventKind::RegistryBack, json!({"revision": revision}));
        }
        if contact.moved() {
            tracing::info!(revision, "the registry is followed again");
        }
    }

    /// What follows from a question without an answer.
    fn unanswered(&self, error: ClientError, revision: u64, mode: &mut Mode) -> Step {
        self.contact().failed(error.reason());
        match error {
            ClientError::Refused { status: 410, .. } => {
                *mode = Mode::List;
                return Step::Later;
            }
            ClientError::Unreadable(reason) => {
                let nack = Nack {
                    revision,
                    code: UNREADABLE.to_owned(),
                    object: None,
                    // Where in the page it is broken differs from time to time.
                    reason: "the page is no JSON, or of another shape".to_owned(),
                };
                if self.contact().refused(&nack) {
                    tracing::error!(reason, "a page of the registry cannot be read");
                    let data = serde_json::to_value(&nack).unwrap_or_default();
                    self.tell(EventKind::RegistryRefused, data);
                }
            }
            // Once for each reason: it is asked again and again.
            error if self.contact().failed_anew(&error) => {
                tracing::warn!(%error, "the registry is not followed; it is asked again and again");
            }
            error => tracing::debug!(%error, "the registry was not followed"),
        }
        Step::Later
    }

    pub(super) fn defect(&self, refusal: &Refusal) -> Step {
        self.contact().failed("defect");
        tracing::error!(%refusal, "a page of the registry could not be judged");
        Step::Later
    }
}
