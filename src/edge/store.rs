//! Where acknowledged changes are kept, so that a restart does not lose them.

use super::events::Happening;
use super::snapshot::Snapshot;

/// Keeps what a batch changed. Called by the writer, after the batch is in force and before it is acknowledged.
pub(super) trait Store: Send {
    /// Commits a batch; true when it survives a restart.
    fn commit(&mut self, snapshot: &Snapshot, events: &[Happening]) -> bool;
}

/// Keeps nothing: the state lives as long as the process, and every acknowledgement says so.
#[derive(Debug)]
pub(super) struct InMemory;

impl Store for InMemory {
    fn commit(&mut self, _snapshot: &Snapshot, _events: &[Happening]) -> bool {
        false
    }
}
