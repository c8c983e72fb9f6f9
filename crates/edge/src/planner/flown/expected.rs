//! Where a version has its drone when, and with how much battery: what telemetry is held against.

use super::FlownVersion;
use crate::planner::AT_NODE_M;
use skyway_engine::geo::Point;
use skyway_engine::network::Topology;

/// What a plan has of a drone where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expected {
    /// From when until when it is there, in seconds from the departure.
    from_s: f64,
    until_s: f64,
    /// The least battery that it has there.
    battery: f64,
}

impl Expected {
    /// How much earlier or later that is, in seconds.
    pub(super) fn apart_s(&self, seen_s: f64) -> f64 {
        (self.from_s - seen_s).max(seen_s - self.until_s).max(0.0)
    }

    /// Whether a drone is earlier, later or emptier than that, by more than is tolerated in seconds and as a fraction.
    pub(super) fn is_missed(
        &self,
        seen_s: f64,
        seen_battery: Option<f64>,
        (late_s, battery): (f64, f64),
    ) -> bool {
        let is_early = seen_s < self.from_s - late_s;
        let is_late = seen_s > self.until_s + late_s;
        let is_low = seen_battery.is_some_and(|seen| seen < self.battery - battery);
        is_early || is_late || is_low
    }
}

impl FlownVersion {
    /// What a plan has of its drone at a place of a leg: on the way over it, or at one of its ends.
    pub(super) fn expected(
        &self,
        topology: &Topology,
        leg: usize,
        place: Point,
    ) -> Option<Expected> {
        let legs = &self.composition.plan.legs;
        let on = legs.get(leg)?;
        let [from, to] = [on.from, on.to].map(|node| topology.position(node));
        let [to_from_m, to_end_m] = [from, to].map(|end| place.distance_m(end));
        if to_end_m <= AT_NODE_M && to_end_m <= to_from_m {
            // It stays until the next leg begins; at the end for ever.
            let next = legs.get(leg + 1);
            return Some(Expected {
                from_s: on.leaves_s,
                until_s: next.map_or(f64::INFINITY, |next| next.enters_s),
                battery: on.battery_after,
            });
        }
        if to_from_m <= AT_NODE_M {
            let before = leg.checked_sub(1).and_then(|before| legs.get(before));
            return Some(Expected {
                from_s: before.map_or(f64::NEG_INFINITY, |before| before.leaves_s),
                until_s: on.enters_s,
                battery: before.map_or(on.battery_before, |before| before.battery_after),
            });
        }
        let share = to_from_m / (to_from_m + to_end_m);
        let at_s = on.enters_s + share * (on.leaves_s - on.enters_s);
        Some(Expected {
            from_s: at_s,
            until_s: at_s,
            battery: on.battery_before - share * (on.battery_before - on.battery_after),
        })
    }
}
