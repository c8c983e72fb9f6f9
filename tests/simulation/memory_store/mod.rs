//! A registry's store in memory, for simulations: it takes the time that it is told to take, and
//! the process that has it open when it crashes reaches it no more.

mod contents;
mod documents;

pub(crate) use contents::Contents;

use contents::objects;
use skyway::registry::store::{
    Answer, Append, Appended, ChangesQuery, ChangesRead, Compaction, EdgeHeard, Identity,
    KeptReply, NetworkParts, NetworkState, ObjectsQuery, ObjectsRead, Store, StoreError,
};
use skyway::wire::{ChangeOperation, LoggedChange, ObjectKind};
use std::fmt;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long each half of a commit takes: before it is done, and before it is told.
pub(crate) type Slowness = Box<dyn FnMut() -> Duration + Send>;

/// Who asks for the log more often in one run asks in a loop, and time would never pass.
const QUESTIONS_MAX: u64 = 200_000;

struct Disk {
    contents: Contents,
    /// Counts crashes: who opened the store before the last one is gone.
    crashes: u64,
    slowness: Slowness,
    /// How often the log was asked for.
    questions: u64,
}

/// A place with a store in it. Copies of it are the same place.
#[derive(Clone)]
pub(crate) struct MemoryPlace(Arc<Mutex<Disk>>);

impl MemoryPlace {
    pub(crate) fn new(registry_id: &str) -> Self {
        Self(Arc::new(Mutex::new(Disk {
            contents: Contents::new(registry_id),
            crashes: 0,
            slowness: Box::new(|| Duration::ZERO),
            questions: 0,
        })))
    }

    /// Opens the store.
    pub(crate) fn open(&self) -> Arc<dyn Store> {
        Arc::new(MemoryStore {
            place: self.clone(),
            crashes: self.lock().crashes,
        })
    }

    /// How often the log was asked for.
    pub(crate) fn questions(&self) -> u64 {
        self.lock().questions
    }

    // The contents are whole after every call, so a panic elsewhere cannot spoil them.
    fn lock(&self) -> MutexGuard<'_, Disk> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a simulation does to it.
impl MemoryPlace {
    pub(crate) fn slow_down(&self, slowness: Slowness) {
        self.lock().slowness = slowness;
    }

    /// Ends the process that has the store open.
    pub(crate) fn crash(&self) {
        self.lock().crashes += 1;
    }

    /// Looks at what is in it.
    pub(crate) fn look<T>(&self, look: impl FnOnce(&Contents) -> T) -> T {
        look(&self.lock().contents)
    }

    /// A copy of all that is in it.
    pub(crate) fn back_up(&self) -> Contents {
        self.lock().contents.clone()
    }

    /// Puts a copy in place of what is there.
    pub(crate) fn restore(&self, contents: Contents) {
        self.lock().contents = contents;
    }
}

/// The store as one registry has it open.
struct MemoryStore {
    place: MemoryPlace,
    crashes: u64,
}

impl fmt::Debug for MemoryStore {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("MemoryStore")
            .field("crashes", &self.crashes)
            .finish_non_exhaustive()
    }
}

impl MemoryStore {
    fn reach(&self) -> Result<MutexGuard<'_, Disk>, StoreError> {
        let disk = self.place.lock();
        match disk.crashes == self.crashes {
            true => Ok(disk),
            false => Err(StoreError::Unavailable {
                message: "it has crashed".to_owned(),
            }),
        }
    }

    /// Takes its time.
    async fn turn(&self) -> Result<(), StoreError> {
        let pause = {
            let mut disk = self.reach()?;
            (disk.slowness)()
        };
        if !pause.is_zero() {
            tokio::time::sleep(pause).await;
        }
        Ok(())
    }

    fn ask<'a, T: Send + 'a>(
        &'a self,
        question: impl FnOnce(&Contents) -> T + Send + 'a,
    ) -> Answer<'a, T> {
        Box::pin(async move { Ok(question(&self.reach()?.contents)) })
    }

    fn change<'a, T: Send + 'a>(
        &'a self,
        change: impl FnOnce(&mut Contents) -> T + Send + 'a,
    ) -> Answer<'a, T> {
        Box::pin(async move { Ok(change(&mut self.reach()?.contents)) })
    }
}

impl Store for MemoryStore {
    fn identity(&self) -> Answer<'_, Identity> {
        self.ask(|it| it.identity.clone())
    }

    fn ping(&self) -> Answer<'_, ()> {
        self.ask(|_| ())
    }

    fn begin_epoch(&self, after: u64) -> Answer<'_, Identity> {
        self.change(move |it| {
            it.identity.epoch = it.identity.epoch.max(after) + 1;
            for network in it.networks.values_mut() {
                network.state.oldest = network.state.head;
            }
            it.identity.clone()
        })
    }

    fn networks(&self) -> Answer<'_, Vec<NetworkState>> {
        self.ask(|it| it.networks.values().map(|it| it.state.clone()).collect())
    }

    fn network<'a>(&'a self, id: &'a str) -> Answer<'a, Option<NetworkState>> {
        self.ask(move |it| it.networks.get(id).map(|it| it.state.clone()))
    }

    fn network_parts<'a>(
        &'a self,
        id: &'a str,
        at: Option<u64>,
    ) -> Answer<'a, Option<NetworkParts>> {
        self.ask(move |it| {
            let network = it.networks.get(id)?;
            Some(NetworkParts {
                state: network.state.clone(),
                parts: network.parts(at.unwrap_or(network.state.head)),
            })
        })
    }

    fn object<'a>(
        &'a self,
        network: &'a str,
        kind: ObjectKind,
        id: &'a str,
    ) -> Answer<'a, Option<LoggedChange>> {
        self.ask(move |it| {
            let last = it.networks.get(network)?.last(kind, id, u64::MAX)?;
            (last.operation != ChangeOperation::Delete).then(|| last.clone())
        })
    }

    fn objects<'a>(&'a self, query: &'a ObjectsQuery) -> Answer<'a, Option<ObjectsRead>> {
        self.ask(move |it| {
            let network = it.networks.get(&query.network)?;
            Some(objects(&it.identity, network, query))
        })
    }

    fn changes<'a>(&'a self, query: &'a ChangesQuery) -> Answer<'a, Option<ChangesRead>> {
        Box::pin(async move {
            let mut disk = self.reach()?;
            disk.questions += 1;
            assert!(disk.questions < QUESTIONS_MAX, "someone asks in a loop");
            let it = &disk.contents;
            let network = it.networks.get(&query.network);
            Ok(network.map(|network| ChangesRead {
                identity: it.identity.clone(),
                state: network.state.clone(),
                changes: network.changes(query),
            }))
        })
    }

    fn append<'a>(&'a self, append: &'a Append) -> Answer<'a, Appended> {
        Box::pin(async move {
            self.turn().await?;
            let appended = self.reach()?.contents.append(append);
            self.turn().await?;
            Ok(appended)
        })
    }

    fn reply<'a>(
        &'a self,
        subject: &'a str,
        key: &'a str,
    ) -> Answer<'a, Option<(String, KeptReply)>> {
        self.ask(move |it| {
            let reply = it.replies.get(&(subject.to_owned(), key.to_owned()))?;
            Some((reply.fingerprint.clone(), reply.kept.clone()))
        })
    }

    fn forget_replies(&self, before_ms: i64, bytes_max: u64) -> Answer<'_, ()> {
        self.change(move |it| it.forget_replies(before_ms, bytes_max))
    }

    fn compact<'a>(&'a self, compaction: &'a Compaction) -> Answer<'a, ()> {
        self.change(move |it| {
            if let Some(network) = it.networks.get_mut(&compaction.network) {
                network.compact(compaction);
            }
        })
    }

    fn keep_edges<'a>(&'a self, heard: &'a [EdgeHeard], before_ms: i64) -> Answer<'a, ()> {
        self.change(move |it| {
            it.edges.retain(|_, edge| edge.heard_ms >= before_ms);
            for edge in heard {
                let key = (edge.network.clone(), edge.edge.clone());
                let known = it.edges.get(&key).and_then(|known| known.url.clone());
                let mut noted = edge.clone();
                noted.url = noted.url.or(known);
                it.edges.insert(key, noted);
            }
        })
    }

    fn edges(&self) -> Answer<'_, Vec<EdgeHeard>> {
        self.ask(|it| it.edges.values().cloned().collect())
    }

    fn hint(&self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>> {
        Box::pin(std::future::pending())
    }

    fn close(&self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>> {
        Box::pin(std::future::ready(()))
    }
}
