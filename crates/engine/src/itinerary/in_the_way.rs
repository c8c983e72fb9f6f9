//! What a plan that was made before meets in another state of the world.

use super::blocking_causes::FlightCause;
use super::entry::Entry;
use super::obstacles::Forbids;
use super::setting::FlightSetting;
use crate::flight::{FlightPlan, FlownLeg, LegCost, StopKind};

/// What is met by less than this, in seconds, is touched: instants that were stored are rounded.
const TOUCH_S: f64 = 1e-3;

/// Sums of the same energies in another order differ by less than this fraction of a battery.
const ROUNDED: f64 = 1e-9;

impl FlightSetting {
    /// The closures, and the legs of other plans, that a plan meets from one of its legs on, flown as it is timed.
    ///
    /// Reserved pads are not looked at: who made the plan has reserved them.
    pub fn in_the_way(&self, plan: &FlightPlan, began_s: f64, from_leg: usize) -> Vec<FlightCause> {
        let mut met = Vec::new();
        let world = self.world();
        for (enters_s, entry) in Entry::all_of(plan).skip(from_leg) {
            let obstacles = world.obstacles;
            obstacles.each_forbidden(&world, began_s, entry, |forbids, from_s, until_s| {
                let is_met = from_s + TOUCH_S < enters_s && enters_s < until_s - TOUCH_S;
                if is_met {
                    met.push(match forbids {
                        Forbids::Closure(number) => FlightCause::Closure(number),
                        Forbids::Traffic(leg) => FlightCause::Traffic(leg),
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

    /// Whether this wind leaves a plan short that was timed in another one, from one of its legs on: a leg cannot be flown any more, or the
    /// battery falls below `least`, a fraction, somewhere.
    ///
    /// Pads give back the charge that the plan has of them and no more, as it leaves them when it is timed to.
    pub fn exceeds_battery(&self, plan: &FlightPlan, from_leg: usize, least: f64) -> bool {
        let mut missing = 0.0_f64;
        for (number, leg) in plan.legs.iter().enumerate().skip(from_leg) {
            match plan.stops.iter().find(|stop| stop.before_leg == number) {
                Some(stop) if stop.kind == StopKind::Swap => missing = 0.0,
                // What was saved before a pad is not needed there.
                Some(_) => missing = missing.max(0.0),
                None => {}
            }
            let cost = self.cost_of(leg);
            if !cost.is_flyable() {
                return true;
            }
            missing += cost.energy - (leg.battery_before - leg.battery_after);
            if leg.battery_after - missing < least - ROUNDED {
                return true;
            }
        }
        false
    }

    /// What a leg of a plan takes here when it is entered as it is timed.
    fn cost_of(&self, flown: &FlownLeg) -> LegCost {
        let legs = self.legs();
        let mut there = legs.from(flown.from).filter(|&leg| {
            let leg = legs.leg(leg);
            leg.segment == flown.segment && leg.to == flown.to
        });
        let changes_s = legs.changes_s();
        let period = changes_s.partition_point(|&change_s| change_s <= flown.enters_s);
        there
            .next()
            .map_or(LegCost::UNFLYABLE, |leg| legs.cost(leg, period))
    }
}
