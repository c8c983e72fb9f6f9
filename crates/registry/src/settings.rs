//! The bounds that a registry works with, already checked.

use jiff::SignedDuration;
use std::time::Duration;

/// What a registry works with.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// At most this many networks.
    pub networks_max: u64,
    /// By how much a zone is widened where it does not say, in metres.
    pub margin_m: f64,
    /// At most this many zones over one network.
    pub zones_max: u64,
    /// At most this many closures on one network.
    pub closures_max: u64,
    /// Changes in a page where the follower does not say.
    pub page_changes: u64,
    /// Bytes of bodies after which a page ends with the revision it is in.
    pub page_bytes: u64,
    /// How long a follower may wait for changes.
    pub wait_max: Duration,
    /// How many revisions are kept.
    pub revisions_kept: u64,
    /// How often old revisions and answers are dropped.
    pub compact_every: Duration,
    /// At most this many bytes of answers to writes with idempotency keys are kept.
    pub replies_bytes_max: u64,
    /// For how long.
    pub replies_age: SignedDuration,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            networks_max: 100,
            margin_m: 10.0,
            zones_max: 20_000,
            closures_max: 20_000,
            page_changes: 500,
            page_bytes: 4 << 20,
            wait_max: Duration::from_secs(60),
            revisions_kept: 10_000,
            compact_every: Duration::from_secs(60),
            replies_bytes_max: 64 << 20,
            replies_age: SignedDuration::from_hours(24),
        }
    }
}
