//! Orders that are held though drones are free, for one that flies for another order: which these are, and what a wait counts.

use super::batch::Waiting;
use super::fleet::{Candidate, LATE_MAX_S};
use jiff::Timestamp;
use skyway_market::matching::{SPEED_MPS, way_s};

/// What waiting for a drone that flies counts at least, in seconds: it may be late.
const UNSURE_S: f64 = 30.0;

/// For which drones an order is held. Times are in seconds from now.
pub(super) struct Holding<'a> {
    order: &'a Waiting,
    /// When the parcel is ready, and how long a drone is looked for.
    ready_s: f64,
    until_s: f64,
    /// Since when it is held.
    held_s: f64,
    /// From the free drone that it would have otherwise, and the way that follows.
    otherwise_s: f64,
    carried_s: f64,
    /// Before when it has to be picked up.
    closes_s: f64,
}

impl<'a> Holding<'a> {
    /// What decides it, beside the free drone that it would have otherwise.
    pub(super) fn of(
        order: &'a Waiting,
        otherwise: &Candidate<'_>,
        now: Timestamp,
    ) -> Option<Self> {
        let from_now = |at: Timestamp| at.duration_since(now).as_secs_f64();
        let value = &order.order.value;
        let held_since = value.dispatch.holds_since_ms;
        let held_since = held_since.and_then(|ms| Timestamp::from_millisecond(ms).ok());
        let fetch_m = order.errand.fetch_m(otherwise.home)?;
        Some(Self {
            ready_s: from_now(value.start_time()),
            until_s: from_now(value.waits_until()),
            held_s: held_since.map_or(0.0, from_now),
            otherwise_s: way_s(fetch_m),
            carried_s: way_s(fetch_m + order.errand.length_m()?) - way_s(fetch_m),
            closes_s: order.closes_at.map_or(f64::INFINITY, from_now),
            order,
        })
    }

    /// What waiting for a drone counts beside its way, in metres; none where the order is not held for it.
    ///
    /// It is held where that one is sooner at the pickup than the free one, or this can be sent in time once it is late.
    /// A fetch is flown there and back, so a second counts twice what is flown in one. It counts from when the order was first
    /// held, or the drone would have had to leave: so no order is held late for longer than a fetch takes.
    pub(super) fn wait_m(&self, drone: &Candidate<'_>) -> Option<f64> {
        let fetch_s = way_s(self.order.errand.fetch_m(drone.home)?);
        let free_s = drone.free_s?.max(0.0);
        let there_s = self.ready_s.max(free_s + fetch_s);
        let other_s = self.ready_s.max(self.otherwise_s);
        let can_be_late = LATE_MAX_S + self.otherwise_s <= self.ready_s;
        let is_sooner = there_s < other_s || (there_s <= self.ready_s && can_be_late);
        // The free one has to make it in place of one that does not come.
        let given_up_s = free_s + LATE_MAX_S;
        let picked_up_s = there_s.max(given_up_s + self.otherwise_s);
        let is_over = picked_up_s >= self.closes_s || picked_up_s + self.carried_s > self.until_s;
        if !is_sooner || is_over {
            return None;
        }
        let wait_s = free_s - (self.ready_s - fetch_s).max(self.held_s);
        Some(2.0 * SPEED_MPS * wait_s.max(UNSURE_S))
    }
}
