//! What an edge asks of its registry, whatever carries it there.

use skyway_contract::{
    ChangesPage, EdgeNews, EdgeNoted, EdgeReport, NetworkStatistics, NewsTaken, ObjectKind,
    PositionBatch, RegistrySnapshot, Written,
};
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;

/// A change to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RegistryWrite {
    /// What it is about.
    pub kind: ObjectKind,
    /// Which one.
    pub id: Arc<str>,
    /// The text of what is put; none where it is lifted.
    pub body: Option<Arc<str>>,
    /// The entity tag of the version to replace; none where there should be nothing.
    pub if_match: Option<String>,
    /// The same change sent again has the same key.
    pub idempotency_key: String,
    /// Who made it at this edge: `ROLE:SUBJECT`.
    pub on_behalf_of: Arc<str>,
}

/// Why the registry has not answered what it was asked.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ClientError {
    /// No answer: not reached, cut off, or too slow.
    #[error("the registry does not answer: {0}")]
    Transport(String),
    /// An answer that is not what it should be.
    #[error("the registry's answer cannot be read: {0}")]
    Unreadable(String),
    /// An answer that is larger than any should be.
    #[error("the registry's answer has more than {limit_bytes} bytes")]
    TooLarge {
        /// How many bytes are read.
        limit_bytes: usize,
    },
    /// A refusal.
    #[error("the registry refuses: {status}, {code}: {detail}")]
    Refused {
        /// The HTTP status.
        status: u16,
        /// The stable code of the problem; empty where there is none.
        code: String,
        /// What is wrong, for people.
        detail: String,
        /// When to ask again, in seconds.
        retry_after_s: Option<u32>,
    },
}

impl ClientError {
    /// All reasons.
    pub const REASONS: [&'static str; 4] = ["transport", "unreadable", "too_large", "refused"];

    /// The reason in one word, for metrics.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::Transport(_) => "transport",
            Self::Unreadable(_) => "unreadable",
            Self::TooLarge { .. } => "too_large",
            Self::Refused { .. } => "refused",
        }
    }
}

/// What carries questions to the registry.
///
/// Every question ends by itself within a bounded time, and every answer is bounded in bytes.
pub trait RegistryClient: Send + Sync + 'static {
    /// A page of the log after a revision of an epoch, at once or after waiting for news.
    fn changes(
        &self,
        epoch: u64,
        after: u64,
        wait: Duration,
    ) -> impl Future<Output = Result<ChangesPage, ClientError>> + Send;

    /// A page of everything that holds; the first without a token.
    fn snapshot(
        &self,
        page_token: Option<&str>,
    ) -> impl Future<Output = Result<RegistrySnapshot, ClientError>> + Send;

    /// Writes a change.
    fn write(
        &self,
        write: &RegistryWrite,
    ) -> impl Future<Output = Result<Written, ClientError>> + Send;

    /// Tells how far this edge is, and hears what every edge has to know.
    fn report(
        &self,
        report: &EdgeReport,
    ) -> impl Future<Output = Result<EdgeNoted, ClientError>> + Send;

    /// What it has worked out of all that edges have told.
    fn statistics(&self) -> impl Future<Output = Result<NetworkStatistics, ClientError>> + Send;

    /// Tells what has become of flights, and of failures.
    fn news(&self, news: &EdgeNews) -> impl Future<Output = Result<NewsTaken, ClientError>> + Send;

    /// Tells where drones were.
    fn positions(
        &self,
        batch: &Arc<PositionBatch>,
    ) -> impl Future<Output = Result<(), ClientError>> + Send;
}
