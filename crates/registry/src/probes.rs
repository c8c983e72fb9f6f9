//! Those who ask whether a registry is ready, one after the other.

use std::sync::atomic::AtomicU64;
use tokio::sync::Mutex;

/// Those who ask whether a registry is ready, one after the other.
#[derive(Debug, Default)]
pub(super) struct Probes {
    pub(super) turn: Mutex<()>,
    /// How many looks at the store were begun for them.
    pub(super) begun: AtomicU64,
}
