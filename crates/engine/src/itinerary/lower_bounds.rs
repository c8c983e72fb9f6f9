//! What a flight weighs, and what charging takes, at least: for the keys of labels, and for
//! openings.

use super::expander::Expander;
use super::request::Objective;

impl Expander<'_> {
    /// What a metre of straight line weighs at least.
    pub(super) fn weight_per_m(&self) -> f64 {
        let legs = self.world.legs;
        match self.request.objective {
            Objective::Distance => self.world.topology.straight_line_scale(),
            // A second of flight draws at least so much, and covers at most so many metres.
            Objective::Energy => {
                legs.least_draw_per_s() / legs.fastest_mps().max(f64::MIN_POSITIVE)
            }
            Objective::Time => 0.0,
        }
    }

    /// What a second of flight between two stops weighs at least.
    pub(super) fn weight_per_s(&self) -> f64 {
        match self.request.objective {
            Objective::Distance => self.potentials.slowest_mps(),
            Objective::Energy => self.world.legs.least_draw_per_s(),
            Objective::Time => 0.0,
        }
    }

    /// The least that charging takes, at stops that are still ahead, where so much of a battery is
    /// missing.
    pub(super) fn stops_s(&self, missing: f64) -> f64 {
        match missing > 1e-9 {
            true => self.least_stops_s(missing, false),
            false => 0.0,
        }
    }

    /// The least that charging what is missing takes, at one more stop or at several; at the last
    /// one too, where its departure is open.
    ///
    /// A charge of `x` from a level takes at least as long as from the lowest, `tau ln((1 - lowest)
    /// / (1 - lowest - x))`, which is convex in `x`: so equal parts take least, and the sum is
    /// convex in their number. The best whole number is beside the best one.
    pub(super) fn least_stops_s(&self, missing: f64, is_open: bool) -> f64 {
        if self.has_swaps {
            return self.least_stop_s;
        }
        let room = 1.0 - self.lowest;
        if self.best_share <= 0.0 {
            // Stops that take no time: charging at the highest rate all the time.
            return missing * self.tau_s / room;
        }
        let open = f64::from(is_open);
        let takes_s = |parts: f64| {
            let each = missing / parts;
            if each >= room {
                return f64::INFINITY;
            }
            let charging_s = parts * self.tau_s * (room / (room - each)).ln();
            (parts - open) * self.least_stop_s + charging_s
        };
        let best = (missing / (room * self.best_share)).max(1.0 + open);
        takes_s(best.floor()).min(takes_s(best.ceil()))
    }
}
