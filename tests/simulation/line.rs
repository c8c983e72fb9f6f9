//! The line between those who take part and the registry: it carries questions to the use cases as they ship, late,
//! not at all, twice, without the answer, or with another answer than was given.

use crate::bend::{self, Remembered};
use crate::central::Life;
use crate::history::Version;
use crate::places::{NETWORK, tag_of_text};
use crate::rounds::Chance;
use crate::world::{Who, World};
use serde_json::Value;
use skyway::api::problem;
use skyway::edge::Refusal;
use skyway::edge::sync::{ClientError, RegistryClient, RegistryWrite};
use skyway::registry::{Follow, Registry, Reply, SnapshotRequest, WriteOptions};
use skyway::wire::{
    ChangesPage, EdgeNews, EdgeNoted, EdgeReport, NetworkStatistics, NewsTaken, ObjectKind,
    PositionBatch, Problem, PublishedClosure, RegistrySnapshot, Written,
};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// After so long without an answer no party waits any more.
const WAIT_AT_MOST: Duration = Duration::from_secs(10);
/// Objects in a page of everything.
const PAGE: u64 = 4;

/// What becomes of a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Fine,
    /// It is never heard.
    LostBefore,
    /// Its answer is lost.
    LostAfter,
    /// It comes twice.
    Twice,
}

/// The line of one who takes part.
pub(crate) struct Line {
    world: Arc<World>,
    who: Who,
    /// Kinds of questions have chances of their own, as several are under way at once.
    chances: [Mutex<Chance>; 4],
    remembered: Mutex<Remembered>,
    taken: Taken,
}

/// The version at which a zone was put, and its tag; none where it was lifted.
type Told = (Version, Option<String>);

/// The changes of zones that the registry has taken from an edge. Copies note into the same.
#[derive(Clone, Debug, Default)]
pub(crate) struct Taken(Arc<Mutex<BTreeMap<String, Told>>>);

impl Taken {
    fn note(&self, id: &str, told: Told) {
        self.lock().insert(id.to_owned(), told);
    }

    /// Zones that came to be there after a version.
    pub(crate) fn after(&self, version: Version) -> BTreeMap<String, Option<String>> {
        let taken = self.lock();
        let later = taken.iter().filter(|(_, (at, _))| *at > version);
        later
            .map(|(id, (_, tag))| (id.clone(), tag.clone()))
            .collect()
    }

    // The map is whole after every call.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Told>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Line {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.who.name())
    }
}

impl Line {
    /// The line of a party in its given life.
    pub(crate) fn new(world: &Arc<World>, who: Who, begun: u64, taken: &Taken) -> Self {
        let chance = |number| Mutex::new(world.chance(who, 10 + 4 * begun + number));
        Self {
            world: world.clone(),
            who,
            chances: [chance(0), chance(1), chance(2), chance(3)],
            remembered: Mutex::default(),
            taken: taken.clone(),
        }
    }

    fn chance(&self, number: usize) -> MutexGuard<'_, Chance> {
        let chance = self.chances[number].lock();
        chance.unwrap_or_else(PoisonError::into_inner)
    }

    fn is_cut(&self) -> bool {
        match self.who {
            Who::Edge(number) => self.world.troubles().cut.contains(&number),
            _ => false,
        }
    }

    /// What becomes of a question, and how long both ways take.
    fn draw(&self, number: usize) -> (Fate, Duration, Duration) {
        let (lost, twice, most_ms) = {
            let troubles = self.world.troubles();
            (troubles.lost, troubles.twice, troubles.delay_max_ms)
        };
        let mut chance = self.chance(number);
        let fate = match chance.below(100) {
            fate if fate < lost / 2 => Fate::LostBefore,
            fate if fate < lost => Fate::LostAfter,
            fate if fate < lost + twice => Fate::Twice,
            _ => Fate::Fine,
        };
        let mut delay = || Duration::from_millis(chance.below(most_ms.max(2)));
        (fate, delay(), delay())
    }

    /// Carries a question to the registry and its answer back.
    ///
    /// What is not the same when it comes twice `is_once`.
    async fn carry<T, F>(
        &self,
        number: usize,
        is_once: bool,
        what: &str,
        ask: impl Fn(Arc<Registry>) -> F,
    ) -> Result<T, ClientError>
    where
        F: Future<Output = Result<T, Refusal>>,
    {
        let (fate, out, back) = self.draw(number);
        self.world.pause(self.who, out).await;
        if fate == Fate::LostBefore || self.is_cut() {
            return self.lost(number, what, "on the way out").await;
        }
        let Some(life) = self.world.central.life() else {
            self.world.pause(self.who, back).await;
            return Err(ClientError::Transport("no server is there".to_owned()));
        };
        let mut answer = until_its_end(&life, ask(life.registry.clone())).await;
        if fate == Fate::Twice && !is_once && answer.is_some() {
            self.world.count("sent twice");
            self.world.pause(self.who, out).await;
            answer = until_its_end(&life, ask(life.registry.clone())).await;
        }
        let Some(answer) = answer else {
            self.world.pause(self.who, back).await;
            return self.lost(number, what, "with the registry").await;
        };
        self.world.pause(self.who, back).await;
        if fate == Fate::LostAfter || self.is_cut() {
            return self.lost(number, what, "on the way back").await;
        }
        answer.map_err(|refusal| told(&refusal))
    }

    /// No answer comes: some notice at once, others wait for it.
    async fn lost<T>(&self, number: usize, what: &str, place: &str) -> Result<T, ClientError> {
        self.world.count("lost messages");
        let waits = self.chance(number).below(2) == 0;
        if waits {
            self.world.pause(self.who, WAIT_AT_MOST).await;
        }
        let text = format!("{what}: lost {place}");
        self.world.tell(self.who, text.clone());
        Err(ClientError::Transport(text))
    }

    fn is_bent(&self, number: usize) -> bool {
        let bent = self.world.troubles().bent;
        self.chance(number).below(100) < bent
    }

    fn remembered(&self) -> MutexGuard<'_, Remembered> {
        let remembered = self.remembered.lock();
        remembered.unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes something under a name, and tells what came of it.
    pub(crate) async fn put(
        &self,
        kind: ObjectKind,
        id: &str,
        body: Option<&str>,
        manner: &WriteOptions,
    ) -> Result<Written, ClientError> {
        let what = format!("write {} {id}", kind.name());
        let reply = self.carry(1, manner.key.is_none(), &what, |registry| async move {
            written(&registry, kind, id, body, manner).await
        });
        let reply = reply.await?;
        serde_json::from_str(&reply.body)
            .map_err(|error| ClientError::Unreadable(error.to_string()))
    }

    /// Reads a zone: its text and entity tag.
    pub(crate) async fn zone(&self, id: &str) -> Result<(String, String), ClientError> {
        self.carry(3, false, "read", |registry| async move {
            registry.object(NETWORK, ObjectKind::Zone, id).await
        })
        .await
    }
}

/// What becomes of a question before the registry crashes; none where it crashes first.
async fn until_its_end<T>(life: &Life, question: impl Future<Output = T>) -> Option<T> {
    tokio::select! {
        biased;
        () = life.ended.cancelled() => None,
        answer = question => Some(answer),
    }
}

fn told(refusal: &Refusal) -> ClientError {
    let Problem {
        status,
        code,
        detail,
        retry_after_s,
        ..
    } = problem::document(refusal, None);
    ClientError::Refused {
        status,
        code,
        detail,
        retry_after_s,
    }
}

async fn written(
    registry: &Arc<Registry>,
    kind: ObjectKind,
    id: &str,
    body: Option<&str>,
    manner: &WriteOptions,
) -> Result<Reply, Refusal> {
    match (kind, body) {
        (kind, None) => registry.delete(NETWORK, kind, id, manner).await,
        (ObjectKind::Closure, Some(body)) => {
            let closure: PublishedClosure = serde_json::from_str(body).expect("a closure");
            registry
                .put_closure(NETWORK, Some(id), closure, manner)
                .await
        }
        (_, Some(body)) => {
            let feature: Value = serde_json::from_str(body).expect("a feature");
            registry.put_zone(NETWORK, Some(id), feature, manner).await
        }
    }
}

impl RegistryClient for Line {
    async fn changes(
        &self,
        epoch: u64,
        after: u64,
        wait: Duration,
    ) -> Result<ChangesPage, ClientError> {
        let follow = Follow {
            after,
            epoch: Some(epoch),
            limit: None,
            wait,
            edge: Some(self.who.name()),
        };
        let asked = self.carry(0, false, "changes", |registry| {
            let follow = follow.clone();
            async move {
                let never = std::future::pending();
                registry.changes(NETWORK, &follow, never).await
            }
        });
        let page = asked.await?;
        let (told, range) = (page.changes.len(), (page.after, page.revision, page.head));
        let page = match self.is_bent(0) {
            false => Ok(page),
            true => {
                self.world.notes().has_bent = true;
                let (how, page) = bend::bend_changes(page, &self.remembered(), &mut self.chance(0));
                self.world.count(how);
                self.world
                    .tell(self.who, format!("the page is bent: {how}"));
                page
            }
        };
        if let Ok(page) = &page {
            self.remembered().keep(page);
        }
        let text = format!("changes after {epoch}-{after}: {told} {range:?}");
        self.world.tell(self.who, text);
        page
    }

    async fn snapshot(&self, page_token: Option<&str>) -> Result<RegistrySnapshot, ClientError> {
        let request = SnapshotRequest {
            size: Some(PAGE),
            token: page_token.map(str::to_owned),
        };
        let asked = self.carry(0, false, "list", |registry| {
            let request = request.clone();
            async move { registry.snapshot(NETWORK, &request).await }
        });
        let page = asked.await?;
        let (epoch, revision, count) = (page.epoch, page.revision, page.objects.len());
        let text = format!(
            "list at {epoch}-{revision}: {count} of {}",
            page.object_count
        );
        self.world.tell(self.who, text);
        if !self.is_bent(0) {
            return Ok(page);
        }
        self.world.notes().has_bent = true;
        let (how, page) = bend::bend_list(page, &mut self.chance(0));
        self.world.count(how);
        self.world
            .tell(self.who, format!("the list is bent: {how}"));
        page
    }

    async fn write(&self, write: &RegistryWrite) -> Result<Written, ClientError> {
        let manner = WriteOptions {
            subject: self.who.name(),
            key: Some(write.idempotency_key.clone()),
            fingerprint: format!("{:?} {} {:?}", write.kind, write.id, write.body),
            if_match: write.if_match.clone(),
            validate_only: false,
            on_behalf_of: Some(write.on_behalf_of.to_string()),
        };
        let body = write.body.as_deref();
        let written = self.put(write.kind, &write.id, body, &manner).await;
        if let Ok(written) = &written
            && write.kind == ObjectKind::Zone
        {
            let version = Version {
                epoch: written.epoch,
                revision: written.revision,
            };
            self.taken.note(&write.id, (version, body.map(tag_of_text)));
        }
        let told = match &written {
            Ok(written) => format!("{}-{}", written.epoch, written.revision),
            Err(error) => error.to_string(),
        };
        let operation = if body.is_some() { "put" } else { "delete" };
        let text = format!("forwards {operation} {}: {told}", write.id);
        self.world.tell(self.who, text);
        written
    }

    async fn report(&self, report: &EdgeReport) -> Result<EdgeNoted, ClientError> {
        let name = self.who.name();
        self.carry(2, false, "report", |registry| {
            let (name, report) = (name.clone(), report.clone());
            async move {
                let noted = registry.report_edge(NETWORK, &name, report).await;
                noted.map(|()| EdgeNoted::default())
            }
        })
        .await
    }

    async fn news(&self, news: &EdgeNews) -> Result<NewsTaken, ClientError> {
        let through = news.news.last().map_or(0, |last| last.number);
        self.carry(
            2,
            false,
            "news",
            |_| async move { Ok(NewsTaken { through }) },
        )
        .await
    }

    async fn statistics(&self) -> Result<NetworkStatistics, ClientError> {
        Err(ClientError::Transport(
            "nothing is worked out here".to_owned(),
        ))
    }

    async fn positions(&self, _: &Arc<PositionBatch>) -> Result<(), ClientError> {
        self.carry(2, false, "positions", |_| async { Ok(()) })
            .await
    }
}
