//! What a gate lets pass: whose it is, who may, and how much at once.

use super::authentication::Authentication;
use super::queue_wait::QueueWait;
use crate::api::operations::{Class, Daemon, Listener};
use std::sync::Arc;
use std::time::Duration;

/// How many requests of each class may be in flight.
#[derive(Clone, Copy, Debug)]
pub struct Slots {
    /// Failure reports.
    pub failures: u32,
    /// Writes of airspace.
    pub zone_writes: u32,
    /// Reads.
    pub reads: u32,
    /// The rest.
    pub other: u32,
    /// Long polls.
    pub follows: u32,
    /// Streams of events.
    pub streams: u32,
    /// Sessions of drones.
    pub sessions: u32,
    /// Streams of health, which need no token.
    pub watches: u32,
}

impl Default for Slots {
    fn default() -> Self {
        Self {
            failures: 512,
            zone_writes: 32,
            reads: 256,
            other: 64,
            follows: 1024,
            streams: 256,
            sessions: 10_000,
            watches: 64,
        }
    }
}

impl Slots {
    pub(crate) fn of(self, class: Class) -> i64 {
        match class {
            Class::Failure => i64::from(self.failures),
            Class::ZoneWrite => i64::from(self.zone_writes),
            Class::Read => i64::from(self.reads),
            Class::Other => i64::from(self.other),
            Class::Follow => i64::from(self.follows),
            Class::Stream => i64::from(self.streams),
            Class::Session => i64::from(self.sessions),
            Class::Watch => i64::from(self.watches),
            Class::Health => i64::MAX,
        }
    }
}

/// What a gate lets pass.
#[derive(Clone)]
pub struct GateConfig {
    /// Whose gate it is.
    pub daemon: Daemon,
    /// Which listener it stands at.
    pub listener: Listener,
    /// How callers say who they are.
    pub authentication: Authentication,
    /// How many may be in flight. Gates that share metrics share the places.
    pub slots: Slots,
    /// How long requests wait for a worker, and when they are shed for that. Shared by the gates of a process.
    pub queue_wait: Arc<QueueWait>,
    /// How large a body may be, in bytes.
    pub body_bytes_max: usize,
    /// How large the body of an operation may be that takes a whole network or feed, in bytes.
    pub file_bytes_max: usize,
    /// How long an answer may take to begin; a `grpc-timeout` may shorten it.
    pub deadline: Duration,
    /// How much longer a long poll may take, as it waits for news.
    pub follow_wait: Duration,
}
