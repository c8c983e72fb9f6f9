//! The bounds that a registry works with, already checked.

use jiff::SignedDuration;
use skyway_service::config::RegistryConfig;
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

impl Settings {
    /// Out of a configuration.
    pub fn of(config: &RegistryConfig) -> Self {
        let count = |count: usize| u64::try_from(count).unwrap_or(u64::MAX);
        let changes = &config.changes;
        Self {
            networks_max: count(config.airspace.networks_max),
            margin_m: config.airspace.margin_m,
            zones_max: count(config.airspace.zones_max),
            closures_max: count(config.airspace.closures_max),
            page_changes: count(changes.page),
            page_bytes: count(changes.page_bytes.bytes()),
            wait_max: changes.wait_max,
            revisions_kept: count(changes.keep),
            compact_every: changes.compact_every,
            replies_bytes_max: count(config.idempotency.bytes.bytes()),
            // Bounds on durations are checked when the configuration is read.
            replies_age: SignedDuration::try_from(config.idempotency.age)
                .unwrap_or(SignedDuration::MAX),
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::of(&RegistryConfig::default())
    }
}
