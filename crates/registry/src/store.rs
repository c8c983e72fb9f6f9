//! Where a registry keeps everything: what a store has to do, whatever engine is behind it.
//!
//! A store is a log of changes for each network. All changes of one revision are committed together; a revision
//! is one more than the last. What holds at a revision is, for each object, its last change up to there, so
//! that there is nothing beside the log which could disagree with it. A write states on which versions it was
//! decided: where one has moved since, nothing is written.

use super::documents::Documents;
use skyway_contract::{ChangeOperation, LoggedChange, Nack, ObjectKind};
use std::fmt::Debug;
use std::pin::Pin;
use thiserror::Error;

/// What a store gives back once it is there.
pub type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T, StoreError>> + Send + 'a>>;

/// Why a store did not do what it was asked to. Nothing was written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StoreError {
    /// It does not answer, or is busy beyond patience.
    #[error("the store does not answer: {message}")]
    Unavailable {
        /// What it, or the way to it, says.
        message: String,
    },
    /// Its disk is full or failing.
    #[error("the store takes nothing more: {message}")]
    Full {
        /// What it says.
        message: String,
    },
    /// What it gives back is not what was put in.
    #[error("the store is damaged: {message}; restore it from a backup")]
    Damaged {
        /// What is wrong, and where.
        message: String,
    },
    /// It was made by a later version of this program.
    #[error(
        "the store has schema {found}, and this version knows {known}; use the version that made it"
    )]
    Newer {
        /// Its schema.
        found: u64,
        /// The latest schema that is known here.
        known: u64,
    },
    /// It cannot be opened under this name.
    #[error("{name} is no store: {message}; name a file, or postgres://USER@HOST/DATABASE")]
    Unusable {
        /// The name.
        name: String,
        /// What is wrong with it.
        message: String,
    },
    /// Its file is there, and has nothing in it.
    #[error("{name}: {}", skyway_service::intake::EMPTY_STORE)]
    Empty {
        /// The name.
        name: String,
    },
    /// Its file is a database of something else.
    #[error("{name}: {}", skyway_service::intake::FOREIGN_STORE)]
    Foreign {
        /// The name.
        name: String,
    },
    /// Others wrote the same at the same time, again and again.
    #[error("others wrote the same at the same time; try again")]
    Contended,
}

/// Which registry this is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Random, made once.
    pub registry_id: String,
    /// From 1; one more when the store was restored from a backup.
    pub epoch: u64,
}

/// The version of an object: the revision that made it so. Revisions may come again in another epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version {
    /// The epoch of the revision.
    pub epoch: u64,
    /// The revision.
    pub revision: u64,
}

impl Version {
    /// The version as an entity tag.
    pub fn etag(self) -> String {
        format!("\"{}-{}\"", self.epoch, self.revision)
    }
}

/// How a network stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkState {
    /// Its id.
    pub id: String,
    /// The last revision.
    pub head: u64,
    /// The oldest revision whose successors are all kept.
    pub oldest: u64,
    /// The version of its nodes and segments.
    pub topology: Version,
    /// How many zones there are.
    pub zones: u64,
    /// How many closures there are.
    pub closures: u64,
}

/// A change that is to be appended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewChange {
    /// What it is about.
    pub kind: ObjectKind,
    /// Which one; at most one change of each object in a revision.
    pub id: String,
    /// What it does.
    pub operation: ChangeOperation,
    /// The text of its JSON; none for a tombstone.
    pub body: Option<String>,
}

/// On which version of an object a write was decided.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expectation {
    /// What it is.
    pub kind: ObjectKind,
    /// Which one.
    pub id: String,
    /// Its version; none where there is none.
    pub version: Option<Version>,
}

/// An answer that is kept, to be given again to the same request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptReply {
    /// Whether the object was new.
    pub created: bool,
    /// Its version as an entity tag; none where it is gone.
    pub etag: Option<String>,
    /// Its id.
    pub id: String,
    /// The answer, byte for byte.
    pub body: String,
}

/// Makes the answer to a write, once its version is known.
pub type MakeReply = Box<dyn Fn(&Identity, Version) -> KeptReply + Send + Sync>;

/// Under which key the answer to a write is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReplyKey {
    /// Who wrote.
    pub subject: String,
    /// The idempotency key.
    pub key: String,
    /// SHA-256 of the request in hexadecimal.
    pub fingerprint: String,
    /// When, in milliseconds since 1970.
    pub at_ms: i64,
}

/// A write: all of it is committed as one revision, or nothing.
pub struct Append {
    /// Which network.
    pub network: String,
    /// Whether the network is new: it must not be there, and there may be at most this many afterwards.
    pub creates: Option<u64>,
    /// Who writes.
    pub subject: String,
    /// When, RFC 3339.
    pub at: String,
    /// On which state of the whole network it was decided; none where only some objects matter.
    pub head: Option<u64>,
    /// On which objects it was decided.
    pub expects: Vec<Expectation>,
    /// What it changes; never empty.
    pub changes: Vec<NewChange>,
    /// The most zones and closures afterwards, unless it makes them fewer.
    pub zones_max: u64,
    /// See `zones_max`.
    pub closures_max: u64,
    /// Under which key to keep its answer.
    pub key: Option<ReplyKey>,
    /// What is answered.
    pub reply: MakeReply,
}

/// What became of a write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Appended {
    /// It is committed.
    Done {
        /// The version of all that it changed.
        version: Version,
        /// Its answer.
        reply: KeptReply,
    },
    /// Something it was decided on has changed, or is no longer there: decide again.
    Moved,
    /// Its key was used before, by a request with this fingerprint.
    Repeated {
        /// SHA-256 of that request in hexadecimal.
        fingerprint: String,
        /// What was answered.
        reply: KeptReply,
    },
    /// A bound would be exceeded: of networks, zones or closures.
    Bounded {
        /// Of what there may be no more.
        kind: ObjectKind,
        /// How many there may be.
        limit: u64,
    },
}

/// Which part of the log is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangesQuery {
    /// Which network.
    pub network: String,
    /// Revisions after this one.
    pub after: u64,
    /// The page ends with the revision in which it reaches this many changes.
    pub changes: u64,
    /// Or this many bytes of bodies.
    pub bytes: u64,
}

/// A part of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangesRead {
    /// Which registry.
    pub identity: Identity,
    /// How the network stands.
    pub state: NetworkState,
    /// Whole revisions without a gap; empty where `after` is not between `oldest` and `head`.
    pub changes: Vec<LoggedChange>,
}

/// Which objects that hold are asked for; the network itself is not among them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectsQuery {
    /// Which network.
    pub network: String,
    /// At which revision; the last where none is given.
    pub at: Option<u64>,
    /// Of which kind; of all where none is given.
    pub kind: Option<ObjectKind>,
    /// After this kind and id, in the order of the store.
    pub after: Option<(ObjectKind, String)>,
    /// The most of them.
    pub limit: u64,
    /// And no more after this many bytes of bodies.
    pub bytes: u64,
}

/// Objects that hold at a revision.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectsRead {
    /// Which registry.
    pub identity: Identity,
    /// How the network stands now.
    pub state: NetworkState,
    /// The revision at which they hold.
    pub at: u64,
    /// How many hold then, on all pages.
    pub count: u64,
    /// How many of them are zones or closures.
    pub restrictions: u64,
    /// The changes that made them so.
    pub objects: Vec<LoggedChange>,
    /// Whether there are more.
    pub has_more: bool,
}

/// What makes a network at a revision: the last whole one, and the patches after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkParts {
    /// How the network stands now.
    pub state: NetworkState,
    /// The changes, the whole network first.
    pub parts: Vec<LoggedChange>,
}

/// What old revisions are dropped for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Compaction {
    /// Which network.
    pub network: String,
    /// From now on the oldest revision that can be followed from.
    pub oldest: u64,
    /// The revision of the last change of nodes and segments up to there.
    pub base_revision: u64,
    /// The whole network at that revision.
    pub base: String,
}

/// When an edge was heard, and what it said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EdgeHeard {
    /// The network it follows.
    pub network: String,
    /// Its id.
    pub edge: String,
    /// The epoch it follows.
    pub epoch: u64,
    /// The revision it has.
    pub revision: u64,
    /// When, in milliseconds since 1970.
    pub heard_ms: i64,
    /// What it refused last.
    pub nack: Option<Nack>,
    /// Where it is reached for flights; empty where it takes none, absent where it has not said since it was noted.
    pub url: Option<String>,
}

/// A store, which also keeps documents. Everything it has acknowledged survives the end of the process and of the
/// machine's power.
pub trait Store: Documents + Debug + Send + Sync {
    /// Which registry this is.
    fn identity(&self) -> Answer<'_, Identity>;

    /// Whether it answers now: at once no, where what keeps it is gone.
    fn ping(&self) -> Answer<'_, ()>;

    /// Begins a new epoch, after this one where it is later than the store's own; no edge can follow from before it.
    fn begin_epoch(&self, after: u64) -> Answer<'_, Identity>;

    /// All networks, by id.
    fn networks(&self) -> Answer<'_, Vec<NetworkState>>;

    /// How a network stands; none where there is none.
    fn network<'a>(&'a self, id: &'a str) -> Answer<'a, Option<NetworkState>>;

    /// What makes the network at a revision, the last where none is given; none where there is no network.
    fn network_parts<'a>(
        &'a self,
        id: &'a str,
        at: Option<u64>,
    ) -> Answer<'a, Option<NetworkParts>>;

    /// An object as it holds now; none where there is none.
    fn object<'a>(
        &'a self,
        network: &'a str,
        kind: ObjectKind,
        id: &'a str,
    ) -> Answer<'a, Option<LoggedChange>>;

    /// Objects that hold at a revision; none where there is no network.
    fn objects<'a>(&'a self, query: &'a ObjectsQuery) -> Answer<'a, Option<ObjectsRead>>;

    /// A part of the log; none where there is no network.
    fn changes<'a>(&'a self, query: &'a ChangesQuery) -> Answer<'a, Option<ChangesRead>>;

    /// Commits a write.
    fn append<'a>(&'a self, append: &'a Append) -> Answer<'a, Appended>;

    /// What was answered under a key, and the fingerprint of the request.
    fn reply<'a>(
        &'a self,
        subject: &'a str,
        key: &'a str,
    ) -> Answer<'a, Option<(String, KeptReply)>>;

    /// Drops answers from before an instant, in milliseconds since 1970, and the oldest beyond a size in bytes.
    fn forget_replies(&self, before_ms: i64, bytes_max: u64) -> Answer<'_, ()>;

    /// Drops what is older than a revision and superseded by then.
    fn compact<'a>(&'a self, compaction: &'a Compaction) -> Answer<'a, ()>;

    /// Keeps when edges were heard; where one is reached stays as it was where nothing was said of it. Those that were heard
    /// last before an instant are forgotten.
    fn keep_edges<'a>(&'a self, heard: &'a [EdgeHeard], before_ms: i64) -> Answer<'a, ()>;

    /// When edges were heard, by network and id.
    fn edges(&self) -> Answer<'_, Vec<EdgeHeard>>;

    /// Returns when another process may have written. Only a hint: it may come for nothing, or not at all.
    fn hint(&self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>>;

    /// Closes it; what is acknowledged is kept.
    fn close(&self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>>;
}
