//! Which drone is on which session.

use super::Line;
use jiff::Timestamp;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicI64, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The drones that are on sessions.
#[derive(Debug, Default)]
pub(crate) struct Claims {
    /// How many sessions there were.
    pub(crate) sessions: AtomicU64,
    by_drone: Mutex<BTreeMap<Arc<str>, Claim>>,
}

/// On which session a drone is.
#[derive(Clone, Debug)]
pub(crate) struct Claim {
    pub(crate) session: Arc<SessionLine>,
    pub(crate) taken_over_at: Option<Timestamp>,
}

/// What is known of a session beside its drones.
#[derive(Debug)]
pub(crate) struct SessionLine {
    pub(crate) id: Arc<str>,
    pub(crate) line: Arc<Line>,
    /// When anything was last said on it, in microseconds of the edge's clock.
    pub(crate) heard_at_us: AtomicI64,
}

impl Claims {
    // The map is whole after every statement, so a panic elsewhere cannot spoil it.
    pub(crate) fn lock(&self) -> MutexGuard<'_, BTreeMap<Arc<str>, Claim>> {
        self.by_drone.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The session that a drone is on.
    pub(crate) fn session_of(&self, drone: &str) -> Option<Arc<str>> {
        self.lock().get(drone).map(|claim| claim.session.id.clone())
    }

    /// How many drones are on sessions.
    pub(crate) fn count(&self) -> usize {
        self.lock().len()
    }
}
