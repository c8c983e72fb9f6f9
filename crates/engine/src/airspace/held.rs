//! A closure as an airspace holds it.

use super::closure::Closure;
use super::zone::Window;
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// How far the time may go from the instant that the windows of schedules were made around.
const SCHEDULES_STAND_FOR: SignedDuration = SignedDuration::from_hours(24);

/// A closure in an airspace, and whether it counts at the snapshot's time.
#[derive(Clone, Debug)]
pub(super) struct Held {
    pub(super) closure: Arc<Closure>,
    pub(super) in_force: bool,
    /// Of what recurs.
    pub(super) recurring: Option<Recurring>,
}

/// A closure whose zone has schedules.
#[derive(Clone, Debug)]
pub(super) struct Recurring {
    /// As it was put.
    put: Arc<Closure>,
    /// The instants that its windows were made around: those of both clocks.
    around: Option<[Timestamp; 2]>,
}

impl Held {
    pub(super) fn new(closure: Arc<Closure>) -> Self {
        let recurring = closure.recurs().then(|| Recurring {
            put: closure.clone(),
            around: None,
        });
        Self {
            closure,
            in_force: false,
            recurring,
        }
    }

    /// As it was put.
    pub(super) fn put(&self) -> &Arc<Closure> {
        self.recurring
            .as_ref()
            .map_or(&self.closure, |recurring| &recurring.put)
    }

    /// With the windows of schedules made anew, once the instants are a day away from those that they
    /// were made around.
    fn following_schedules(&self, instants: [Timestamp; 2]) -> Option<Self> {
        let recurring = self.recurring.as_ref()?;
        let is_near = |(made, now): (Timestamp, Timestamp)| {
            made.duration_since(now).abs() < SCHEDULES_STAND_FOR
        };
        if let Some(made) = recurring.around
            && made.into_iter().zip(instants).all(is_near)
        {
            return None;
        }
        let zone = recurring.put.zone()?;
        Some(Self {
            closure: Arc::new(recurring.put.around(zone, instants)),
            in_force: self.in_force,
            recurring: Some(Recurring {
                put: recurring.put.clone(),
                around: Some(instants),
            }),
        })
    }

    /// What it is at these instants, where that is not what it was.
    pub(super) fn turned(
        &self,
        instants: [Timestamp; 2],
        counts_now: impl Fn(&Window) -> bool,
    ) -> Option<Self> {
        let renewed = self.following_schedules(instants);
        let held = renewed.as_ref().unwrap_or(self);
        let windows = &held.closure.windows;
        let in_force = windows.is_empty() || windows.iter().any(counts_now);
        let has_turned = renewed.is_some() || in_force != self.in_force;
        has_turned.then(|| Self {
            in_force,
            ..held.clone()
        })
    }
}

/// The same where the closure is, in the same memory: what a difference between two airspaces leaves out.
impl PartialEq for Held {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.closure, &other.closure)
    }
}
