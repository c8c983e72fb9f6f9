//! How an edge follows its registry: it reads the log, judges what it reads, hands it to the writer as one batch,
//! and tells what was changed here.
//!
//! `follower` and `listing` judge pages, purely; `task` asks for them, `taking` hands them to the writer, `forward` empties
//! the outbox, `news` tells of flights and failures and `positions` where drones are, `look` and `contact` know how current
//! the edge is. The transport is a [`RegistryClient`]; sleeping is the clock's, randomness is seeded, so that a simulation
//! runs the very same code.

mod client;
mod contact;
pub(super) mod followed;
mod follower;
mod forward;
mod ground;
mod http;
mod judging;
mod listing;
mod look;
mod news;
mod pace;
mod positions;
mod taking;
mod task;

pub use client::{ClientError, RegistryClient, RegistryWrite};
pub use contact::SyncStatus;
pub use http::{HttpAddress, HttpClient};
pub use task::{Following, SyncSettings};

pub(super) use contact::Contact;
