//! What an edge never forgets: its file, what is written to it, and when.
//!
//! Everything durable lies in the [`Snapshot`](crate::snapshot::Snapshot). The storekeeper writes the
//! difference between the snapshot that the file has and the newest one, in one transaction; several batches
//! may be in it, but never a part of one. Acknowledgements wait for it, enforcement never does: while a disk
//! hangs or is full, the writer goes on, and what could not be stored goes with the next transaction that
//! succeeds. Nothing is queued for that, so a disk that is mended needs no restart.

mod ahead;
mod closure_rows;
mod codec;
mod decisions;
mod detour_rows;
mod difference;
mod file;
mod flight_rows;
mod health;
mod journal;
mod keeper;
mod opening;
mod patience;
mod plan_rows;
mod reply_rows;
mod restore;
mod sqlite;
mod stretch_rows;
mod worlds;

pub(super) use ahead::{Ahead, WavesAhead};
pub use decisions::{StoredDecision, read_decision, read_network};
pub use file::{Pending, Row, StoreFault, StoreFile, Table, Transaction};
pub(super) use health::Health;
pub use health::StoreStatus;
pub(super) use journal::Entry;
pub(super) use keeper::{Keeper, Store, Waiting};
pub(super) use opening::{
    Identity, airframe_row, check_clock, network_row, open_identity, stored_network,
};
pub(super) use reply_rows::{Reply, ReportReply, WriteReply};
pub(super) use restore::{Restored, restore};
pub use sqlite::SqliteFile;
