//! What a plan that was made before meets in another state of the world.

use super::obstacles::{Entry, Forbids};
use super::rim::FlightCause;
use super::setting::FlightSetting;
use crate::flight::{FlightPlan, StopKind};

/// What is met by less than this, in seconds, is touched: instants that were stored are rounded.
const TOUCH_S: f64 = 1e-3;

impl FlightSetting {
    /// The closures, and the legs of other plans, that a plan meets from one of its legs on, flown as it is timed.
    ///
    /// Reserved pads are not looked at: who made the plan has reserved them.
    pub fn in_the_way(&self, plan: &FlightPlan, began_s: f64, from_leg: usize) -> Vec<FlightCause> {
        let mut met = Vec::new();
        let world = self.world();
        let has_landed_first = plan
            .stops
            .first()
            .is_some_and(|stop| stop.before_leg == 0 && stop.kind != StopKind::Start);
        for (number, leg) in plan.legs.iter().enumerate().skip(from_leg) {
            let entry = Entry {
                segment: leg.segment.0,
                from: leg.from,
                to: leg.to,
                time_s: leg.leaves_s - leg.enters_s,
                leaves_start: number == 0 && !has_landed_first,
            };
            let obstacles = world.obstacles;
            obstacles.each_forbidden(&world, began_s, entry, |forbids, from_s, until_s| {
                let is_met = from_s + TOUCH_S < leg.enters_s && leg.enters_s < until_s - TOUCH_S;
                if is_met {
                    met.push(match forbids {
                        Forbids::Closure(number) => FlightCause::Closure(number),
                        Forbids::Traffic(number) => FlightCause::Traffic(number),
                    });
                }
            });
        }
        let ahead = plan.stops.iter().filter(|stop| stop.before_leg >= from_leg);
        for stop in ahead {
            let stay = (stop.lands_s + TOUCH_S, stop.takes_off_s - TOUCH_S);
            let closures = world.pads.closures(stop.node, stay.0, stay.1);
            met.extend(closures.map(FlightCause::Closure));
        }
        met
    }
}
