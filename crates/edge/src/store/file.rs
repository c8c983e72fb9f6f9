//! The file of an edge, as the storekeeper sees it: rows in tables, changed in transactions.

use std::fmt::Debug;
use std::pin::Pin;
use thiserror::Error;

/// What a file gives back once it has done what it was asked.
pub type Pending<'a, T> = Pin<Box<dyn Future<Output = Result<T, StoreFault>> + Send + 'a>>;

/// Why a file did not do what it was asked.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StoreFault {
    /// Its disk is full or failing.
    #[error("the store takes nothing more: {message}")]
    Full {
        /// What it says.
        message: String,
    },
    /// It does not answer, or is busy beyond patience.
    #[error("the store does not answer: {message}")]
    Unavailable {
        /// What it says.
        message: String,
    },
    /// What it gives back is not what was put in.
    #[error("the store is damaged: {message}; restore it from a backup, or start with a new one")]
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
    #[error("{name} is no store: {message}; name a file that this edge may write")]
    Unusable {
        /// The name.
        name: String,
        /// What is wrong with it.
        message: String,
    },
    /// It is there, and has nothing in it.
    #[error("{name}: {}", skyway_service::intake::EMPTY_STORE)]
    Empty {
        /// The name.
        name: String,
    },
    /// It is a database of something else.
    #[error("{name}: {}", skyway_service::intake::FOREIGN_STORE)]
    Foreign {
        /// The name.
        name: String,
    },
    /// Another process writes to it.
    #[error("another edge writes to this store; give each edge a file of its own")]
    Taken,
    /// It keeps the airspace of another network.
    #[error(
        "the store is of the network '{stored}', and this edge is to fly on '{given}'; name another file with --store"
    )]
    OtherNetwork {
        /// The name of the network that it has.
        stored: String,
        /// The name of the network that was given.
        given: String,
    },
    /// A client moved the clock of what it keeps.
    #[error(
        "the store was written by a clock that clients move, and clock.kind names another one; name another file with \
         --store, or start with --clock external"
    )]
    OfExternalClock,
    /// A client is to move the clock, and another clock has written what it keeps.
    #[error(
        "clock.kind is external, and another clock has written the store; name another file with --store, or keep \
         nothing with --no-store"
    )]
    NotOfExternalClock,
}

impl StoreFault {
    /// Something that was read cannot be what was written.
    pub(super) fn damaged(message: impl Into<String>) -> Self {
        Self::Damaged {
            message: message.into(),
        }
    }
}

/// What kind of things a row is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Table {
    /// Single facts: who this edge is, how often it has started.
    Facts,
    /// No-fly zones.
    Zones,
    /// Closures that no zone causes.
    Closures,
    /// What waits for an operator, from reports.
    Proposals,
    /// Removals that wait for an operator.
    Holds,
    /// What operators have to look at.
    Alarms,
    /// Plans with their versions.
    Plans,
    /// What the registry has to learn of.
    Outbox,
    /// Answers to requests that may be sent again.
    Replies,
    /// What was answered to failure reports.
    Decisions,
    /// What closed anything in the worlds of decisions.
    Parts,
    /// From which of these worlds to which a part counted.
    Spans,
    /// What drones have yet to be told.
    Mail,
    /// What the registry has to learn of flights and failures.
    News,
}

impl Table {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Facts,
        Self::Zones,
        Self::Closures,
        Self::Proposals,
        Self::Holds,
        Self::Plans,
        Self::Outbox,
        Self::Replies,
        Self::Decisions,
        Self::Parts,
        Self::Spans,
        Self::Alarms,
        Self::Mail,
        Self::News,
    ];

    /// The number of the table in a file; never given to another one.
    pub fn number(self) -> i64 {
        match self {
            Self::Facts => 1,
            Self::Zones => 2,
            Self::Closures => 3,
            Self::Proposals => 4,
            Self::Holds => 5,
            Self::Plans => 6,
            Self::Outbox => 7,
            Self::Replies => 8,
            Self::Decisions => 9,
            Self::Parts => 10,
            Self::Spans => 11,
            Self::Alarms => 12,
            Self::Mail => 13,
            Self::News => 14,
        }
    }
}

/// A row to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Of what.
    pub table: Table,
    /// Which one.
    pub key: String,
    /// Its JSON; none to remove the row.
    pub body: Option<String>,
}

impl Row {
    /// A row that takes the place of what was there.
    pub fn put(table: Table, key: impl Into<String>, body: String) -> Self {
        Self {
            table,
            key: key.into(),
            body: Some(body),
        }
    }

    /// A row that is to go.
    pub fn remove(table: Table, key: impl Into<String>) -> Self {
        Self {
            table,
            key: key.into(),
            body: None,
        }
    }
}

/// Rows that are written together, or not at all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transaction {
    /// One more than that of the transaction before.
    pub number: u64,
    /// The epoch of the edge that writes it: whose transaction the last one in the file is.
    pub writer: u64,
    /// The rows; of rows with the same key the last one counts.
    pub rows: Vec<Row>,
}

/// A file. What it has committed survives the end of the process and of the machine's power.
pub trait StoreFile: Debug + Send {
    /// The number of the last transaction; 0 for a new file.
    fn number(&mut self) -> Pending<'_, u64>;

    /// All rows of a table, by key.
    fn load(&mut self, table: Table) -> Pending<'_, Vec<(String, String)>>;

    /// The keys of a table in their order, each with the bytes of its row.
    fn sizes(&mut self, table: Table) -> Pending<'_, Vec<(String, u64)>>;

    /// One row.
    fn read<'a>(&'a mut self, table: Table, key: &'a str) -> Pending<'a, Option<String>>;

    /// Writes a transaction. When this fails, it is unknown whether it is in the file until it is opened anew.
    fn commit<'a>(&'a mut self, transaction: &'a Transaction) -> Pending<'a, ()>;

    /// Opens the file anew after a failure, brings what it has to the disk, and gives the number and the writer of
    /// the last transaction that is in it.
    fn reopen(&mut self) -> Pending<'_, (u64, u64)>;

    /// Closes it.
    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>>;
}
