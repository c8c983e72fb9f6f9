//! Who writes zones while faults happen, and who follows; each notes what it did and saw.

use crate::daemon::Address;
use crate::history::{Act, Outcome, Recorder};
use crate::registry_client::{CLOSURE, Client, PLAN, check_page};
use crate::rounds::Chance;
use skyway::wire::LoggedChange;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

/// Those who take part in a run, until it is over.
#[derive(Debug)]
pub(crate) struct Crowd {
    pub(crate) recorder: Recorder,
    stop: CancellationToken,
    tasks: Vec<JoinHandle<()>>,
    notes: Arc<Notes>,
}

/// What they found by themselves.
#[derive(Debug, Default)]
struct Notes {
    violations: Mutex<Vec<String>>,
    followed: Mutex<Vec<LoggedChange>>,
}

impl Notes {
    fn violation(&self, text: String) {
        let violations = self.violations.lock();
        violations
            .unwrap_or_else(PoisonError::into_inner)
            .push(text);
    }
}

/// What a run left behind.
#[derive(Debug)]
pub(crate) struct Left {
    pub(crate) violations: Vec<String>,
    /// The log as the follower has seen it, change by change.
    pub(crate) followed: Vec<LoggedChange>,
}

/// How writers go about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Habit {
    /// At an edge there are closures and plans too. What has no answer is left alone there: what an edge shows may not
    /// be stored yet.
    pub(crate) is_at_edge: bool,
    /// Each lets something go once it has this many.
    pub(crate) most: usize,
    /// And rests so long after each thing done.
    pub(crate) rest: Duration,
}

impl Habit {
    /// At a registry, as fast as it goes.
    pub(crate) const BUSY: Self = Self {
        is_at_edge: false,
        most: usize::MAX,
        rest: Duration::ZERO,
    };
    /// At a registry that edges follow: not more than they are to be asked around.
    pub(crate) const MODERATE: Self = Self {
        is_at_edge: false,
        most: 10,
        rest: Duration::from_millis(10),
    };
    /// At an edge.
    pub(crate) const AT_EDGE: Self = Self {
        is_at_edge: true,
        most: 12,
        rest: Duration::from_millis(8),
    };
}

impl Crowd {
    /// Writers at a registry.
    pub(crate) fn gather(address: &Address, seed: u64, writers: u64) -> Self {
        let recorder = Recorder::default();
        Self::of(
            &Client::new(address),
            "w",
            Habit::BUSY,
            (seed, writers),
            &recorder,
        )
    }

    /// Writers with this client, whose names begin so, and who note into this history.
    pub(crate) fn of(
        client: &Client,
        name: &str,
        habit: Habit,
        (seed, writers): (u64, u64),
        recorder: &Recorder,
    ) -> Self {
        let (recorder, stop) = (recorder.clone(), CancellationToken::new());
        let notes = Arc::new(Notes::default());
        let mut tasks: Vec<JoinHandle<()>> = Vec::new();
        for number in 0..writers {
            let writer = Writer {
                client: client.clone(),
                chance: Chance::of(seed, number),
                name: format!("{name}{number}"),
                habit,
                made: 0,
                known: Vec::new(),
                recorder: recorder.clone(),
                notes: notes.clone(),
            };
            tasks.push(tokio::spawn(writer.work(stop.clone())));
        }
        Self {
            recorder,
            stop,
            tasks,
            notes,
        }
    }

    /// And one who follows the log from its beginning.
    pub(crate) fn followed(mut self, address: &Address) -> Self {
        let client = Client::new(address);
        let (notes, stop) = (self.notes.clone(), self.stop.clone());
        let following = async move { follow(&client, &notes, &stop).await };
        self.tasks.push(tokio::spawn(following));
        self
    }

    /// Ends the run.
    pub(crate) async fn end(self) -> Left {
        self.stop.cancel();
        for task in self.tasks {
            task.await.expect("who takes part ends well");
        }
        let take = |list: &Mutex<Vec<String>>| {
            std::mem::take(&mut *list.lock().unwrap_or_else(PoisonError::into_inner))
        };
        let followed = self.notes.followed.lock();
        Left {
            violations: take(&self.notes.violations),
            followed: followed.unwrap_or_else(PoisonError::into_inner).clone(),
        }
    }
}

/// One who writes things of its own, one after the other.
struct Writer {
    client: Client,
    chance: Chance,
    name: String,
    habit: Habit,
    made: u64,
    /// Things that are there, as far as this one knows, and their versions.
    known: Vec<(String, String)>,
    recorder: Recorder,
    notes: Arc<Notes>,
}

impl Writer {
    async fn work(mut self, stop: CancellationToken) {
        while !stop.is_cancelled() {
            let has_enough = self.known.len() >= self.habit.most;
            match self.chance.below(100) {
                0..60 if has_enough => self.delete(&stop).await,
                0..60 => self.create(&stop).await,
                60..75 => self.replace(&stop).await,
                75..88 => self.delete(&stop).await,
                _ => {
                    if let Some((id, _)) = self.draw() {
                        self.read(&id, &stop).await;
                    }
                }
            }
            if !self.habit.rest.is_zero() {
                tokio::time::sleep(self.habit.rest).await;
            }
        }
    }

    fn draw(&mut self) -> Option<(String, String)> {
        let count = self.known.len() as u64;
        let place = usize::try_from(self.chance.below(count)).ok()?;
        self.known.get(place).cloned()
    }

    fn tag(&mut self) -> String {
        self.made += 1;
        format!("{}-{}", self.name, self.made)
    }

    fn keep(&mut self, id: &str, etag: Option<String>) {
        self.known.retain(|(known, _)| known != id);
        self.known.extend(etag.map(|etag| (id.to_owned(), etag)));
    }

    async fn done(&self, act: &Act, etag: Option<&str>, key: Option<&str>) -> Ended {
        let begun = self.recorder.begin(&self.name, act.clone());
        let (outcome, etag, life) = self.client.act(act, etag, key).await;
        self.recorder.end(&begun, outcome.clone(), life);
        let is_plan = act.id().starts_with(PLAN);
        let etag = etag.or_else(|| is_plan.then(String::new));
        Ended { outcome, etag }
    }

    /// A new thing; at a registry half of them with a key, under which a request without an answer is sent again.
    async fn create(&mut self, stop: &CancellationToken) {
        let tag = self.tag();
        let kind = match self.chance.below(100) {
            0..15 if self.habit.is_at_edge => CLOSURE,
            15..30 if self.habit.is_at_edge => PLAN,
            _ => "zone-",
        };
        let id = format!("{kind}{tag}");
        let has_key = !self.habit.is_at_edge && self.chance.below(2) == 0;
        let key = has_key.then(|| format!("key-{tag}"));
        let act = Act::Put {
            id: id.clone(),
            tag,
        };
        let mut ended = self.done(&act, None, key.as_deref()).await;
        while key.is_some() && ended.outcome == Outcome::Unknown && !stop.is_cancelled() {
            ended = self.done(&act, None, key.as_deref()).await;
            match ended.outcome {
                // No server was there.
                Outcome::Refused(0) => ended.outcome = Outcome::Unknown,
                Outcome::Refused(status) => {
                    let text = format!("{act:?} again with its key is refused: {status}");
                    self.notes.violation(text);
                }
                _ => {}
            }
        }
        self.settle(&id, ended, stop).await;
    }

    async fn replace(&mut self, stop: &CancellationToken) {
        // Others are not replaced, but made and lifted.
        let drawn = self.draw().filter(|(id, _)| id.starts_with("zone-"));
        let Some((id, etag)) = drawn else {
            return;
        };
        let act = Act::Put {
            id: id.clone(),
            tag: self.tag(),
        };
        let ended = self.done(&act, Some(&etag), None).await;
        self.settle(&id, ended, stop).await;
    }

    async fn delete(&mut self, stop: &CancellationToken) {
        let Some((id, etag)) = self.draw() else {
            return;
        };
        let act = Act::Delete { id: id.clone() };
        // Plans have no versions.
        let etag = Some(&*etag).filter(|etag| !etag.is_empty());
        let ended = self.done(&act, etag, None).await;
        match ended.outcome {
            Outcome::Done(_) => self.keep(&id, None),
            _ => self.settle(&id, ended, stop).await,
        }
    }

    /// What is known after a write; where nothing is, it is read.
    async fn settle(&mut self, id: &str, ended: Ended, stop: &CancellationToken) {
        match ended.outcome {
            Outcome::Done(_) => self.keep(id, ended.etag),
            Outcome::Refused(0) => {}
            Outcome::Unknown if self.habit.is_at_edge => self.keep(id, None),
            _ => self.read(id, stop).await,
        }
    }

    async fn read(&mut self, id: &str, stop: &CancellationToken) {
        let act = Act::Read { id: id.to_owned() };
        while !stop.is_cancelled() {
            let ended = self.done(&act, None, None).await;
            if let Outcome::Seen(seen) = ended.outcome {
                self.keep(id, seen.and(ended.etag));
                return;
            }
        }
    }
}

/// How something ended, and the version that there is now.
struct Ended {
    outcome: Outcome,
    etag: Option<String>,
}

/// Follows the log from its beginning, page by page, over all that happens.
async fn follow(client: &Client, notes: &Notes, stop: &CancellationToken) {
    let mut after = 0;
    while !stop.is_cancelled() {
        let page = match client.page(after, "1s").await {
            Some(Ok(page)) => page,
            Some(Err(410)) => {
                notes.violation(format!("the log after {after} is gone"));
                return;
            }
            _ => continue,
        };
        if let Err(wrong) = check_page(&page, after) {
            notes.violation(wrong);
            return;
        }
        after = page.revision;
        let followed = notes.followed.lock();
        followed
            .unwrap_or_else(PoisonError::into_inner)
            .extend(page.changes);
    }
}
