//! Dominance of labels that fly on from a node: what the later one could use that the earlier one could not.

use super::charging_label::ChargingLabel;
use super::expander::Expander;
use super::opening::{Opening, ROUNDING_M, ROUNDING_S, There};
use super::request::{Objective, Value};
use crate::geo::Point;
use crate::network::NodeIx;

/// Sums of weights of energies differ by less than this, as a fraction of a battery.
const ROUNDING_ENERGY: f64 = 1e-9;

/// Of what charging takes at least there is a table, by steps of this part of a battery, up to so
/// many.
const STOPS_STEPS: f64 = 64.0;
const STOPS_ENTRIES: usize = 256;

/// Two families at a node that fly on.
pub(super) struct WayOn<'a> {
    terms: &'a Expander<'a>,
    stops_s: &'a [f64],
    place: Point,
    /// What is left from the node.
    weight: f64,
    time_s: f64,
    energy: f64,
    earlier_s: f64,
    later_s: f64,
    /// What the later one has spent.
    spent: f64,
    /// The most that it may have above the reserve.
    spare: f64,
    best: Value,
    /// The longest flight from here that could lead to something better.
    longest_s: f64,
    draw_per_s: f64,
    weight_per_s: f64,
    weight_per_m: f64,
    /// Sums of weights in another order differ by less.
    rounding: f64,
}

impl<'a> WayOn<'a> {
    pub(super) fn new(
        terms: &'a Expander<'a>,
        stops_s: &'a [f64],
        node: NodeIx,
        (earlier, later): (&ChargingLabel, &ChargingLabel),
        best: Value,
    ) -> Self {
        let remaining = terms.potentials.from(node);
        let spare = (later.battery_most() - terms.request.reserve).max(0.0) + ROUNDING_ENERGY;
        let draw_per_s = terms.world.legs.least_draw_per_s();
        let weight_per_s = terms.weight_per_s();
        let rounding = match terms.request.objective {
            Objective::Distance => ROUNDING_M,
            Objective::Energy | Objective::Time => ROUNDING_ENERGY,
        };
        let most_weight = best.weight - later.weight + rounding;
        let by_weight_s = match weight_per_s > 0.0 {
            true => most_weight / weight_per_s,
            false => f64::INFINITY,
        };
        Self {
            terms,
            stops_s,
            place: terms.world.topology.position(node),
            weight: remaining.weight,
            time_s: remaining.time_s,
            energy: remaining.energy,
            earlier_s: earlier.hi_s,
            later_s: later.hi_s,
            spent: later.weight,
            spare,
            best,
            longest_s: (spare / draw_per_s).min(by_weight_s),
            draw_per_s,
            weight_per_s,
            weight_per_m: terms.weight_per_m(),
            rounding,
        }
    }

    /// Openings of use are later than the first of these instants, and not later than the last.
    pub(super) fn usable_s(&self) -> (f64, f64) {
        let last_s = self.later_s + self.longest_s + ROUNDING_S;
        (self.earlier_s, last_s)
    }

    pub(super) fn may_use(&self, opening: &Opening) -> bool {
        let missed_s = opening.at_s - self.earlier_s;
        if missed_s <= 0.0 {
            return false;
        }
        let delta_s = (opening.shuts_s - self.earlier_s).max(opening.at_s - self.later_s);
        let Some(there) = &opening.there else {
            return delta_s - ROUNDING_S < self.longest_s;
        };
        // First what takes no square root.
        let delta_s = delta_s.max(self.time_s - there.time_s) - ROUNDING_S;
        if delta_s >= self.longest_s.min(missed_s) {
            return false;
        }
        let straight_m = (self.place.distance_m(there.place) - ROUNDING_M).max(0.0);
        let delta_s = delta_s.max(straight_m / self.terms.world.legs.fastest_mps());
        if delta_s >= self.longest_s.min(missed_s) {
            return false;
        }
        self.may_be_better(there, (straight_m, delta_s), opening.at_s)
    }

    /// False where nothing that opens at a place is of use, whenever it does.
    pub(super) fn may_use_any(&self, there: &There) -> bool {
        let delta_s = self.time_s - there.time_s - ROUNDING_S;
        if delta_s >= self.longest_s {
            return false;
        }
        let straight_m = (self.place.distance_m(there.place) - ROUNDING_M).max(0.0);
        let delta_s = delta_s.max(straight_m / self.terms.world.legs.fastest_mps());
        // Nothing of use opens earlier.
        let opens_s = self.earlier_s;
        delta_s < self.longest_s && self.may_be_better(there, (straight_m, delta_s), opens_s)
    }

    /// Whether who is at a place after a flight of at least so many metres and seconds, and goes on from an instant or later,
    /// could arrive with something better.
    fn may_be_better(
        &self,
        there: &There,
        (straight_m, delta_s): (f64, f64),
        goes_on_s: f64,
    ) -> bool {
        let drawn = (self.draw_per_s * delta_s).max(self.energy - there.energy);
        if drawn > self.spare {
            return false;
        }
        let flown = (straight_m * self.weight_per_m)
            .max(self.weight_per_s * delta_s)
            .max(self.weight - there.weight);
        let bound = |stops_s: f64| Value {
            weight: self.spent + flown + there.weight - self.rounding,
            arrives_s: goes_on_s + stops_s + there.time_s + self.terms.landing_s - ROUNDING_S,
        };
        let is_better = |bound: Value| {
            bound.beats(self.best) && bound.arrives_s <= self.terms.request.deadline_s
        };
        if !is_better(bound(there.stop_s)) {
            return false;
        }
        let missing = there.energy + drawn - self.spare;
        let step = (missing * STOPS_STEPS) as usize;
        let stops_s = self.stops_s[step.min(self.stops_s.len() - 1)];
        stops_s <= there.stop_s || is_better(bound(stops_s))
    }
}

/// The table of what charging takes at least, into `stops_s`.
pub(super) fn list_stops_s(terms: &Expander<'_>, stops_s: &mut Vec<f64>) {
    let steps = (0..STOPS_ENTRIES).map(|step| step as f64 / STOPS_STEPS);
    stops_s.extend(steps.map(|missing| terms.stops_s(missing)));
}
