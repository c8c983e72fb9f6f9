//! How a contingency ends, and where it lands before, in the row of its plan.

use crate::planner::{DetourEnd, DetourStop};
use serde::{Deserialize, Serialize};

/// When a contingency ends, with how much battery, whether that is below the reserve, and where it lands before.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct StoredEnd(
    f64,
    f64,
    bool,
    #[serde(default)] Option<Vec<StoredDetourStop>>,
);

/// Before which leg a contingency lands, when it takes off, and its battery before and after.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct StoredDetourStop(usize, f64, [f64; 2]);

impl StoredEnd {
    pub(super) fn of(end: DetourEnd) -> Self {
        let stop =
            |stop: &DetourStop| StoredDetourStop(stop.before_leg, stop.takes_off_s, stop.battery);
        let stops = end.stops.map(|stops| stops.iter().map(stop).collect());
        Self(end.arrives_s, end.battery, end.reserve_used, stops)
    }

    pub(super) fn read(&self) -> DetourEnd {
        let stop = |stop: &StoredDetourStop| DetourStop {
            before_leg: stop.0,
            takes_off_s: stop.1,
            battery: stop.2,
        };
        let stops = self.3.as_deref();
        DetourEnd {
            arrives_s: self.0,
            battery: self.1,
            reserve_used: self.2,
            stops: stops.map(|stops| stops.iter().map(stop).collect()),
        }
    }
}
