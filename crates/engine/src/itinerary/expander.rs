//! What one request flies by: how a family goes on over a leg or a stop, and what is left for it at least.
//!
//! *Real* families keep to every window. Where hovering is free a drone waits in the air for a leg or a pad to become
//! free, with the battery it has, and stays on a pad as long as it likes: a *relaxed* family, which is at least as good as
//! every real one on the same way.

use super::active_traffic::ActiveTraffic;
use super::charging_label::ChargingLabel;
use super::entry::{Entry, Leaving};
use super::forbidden_times::ForbiddenTimes;
use super::label::How;
use super::potentials::{Potentials, energy_weight, start_weight};
use super::request::{FlightRequest, FlightWorld, Objective, Value};
use crate::airspace::Bits;
use crate::flight::FlightStart;
use crate::network::NodeIx;

/// Steps of Newton's method towards the best charge, enough for all digits.
const NEWTON_STEPS: u32 = 5;

/// A request in its world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expander<'a> {
    pub(super) world: &'a FlightWorld<'a>,
    pub(super) request: &'a FlightRequest<'a>,
    pub(super) potentials: &'a Potentials,
    pub(super) tau_s: f64,
    /// Seconds from the crossing altitude to the destination's landing site.
    pub(super) landing_s: f64,
    /// The lowest level at which a drone lands; charging is fastest there.
    pub(super) lowest: f64,
    pub(super) has_swaps: bool,
    /// The least that a stop takes beside charging, in seconds: descent, handling, climb.
    pub(super) least_stop_s: f64,
    /// Of what is missing from full at the lowest level, the share that is best charged at each of many stops.
    pub(super) best_share: f64,
}

/// Where a family is, and whether it leaves the node at which the plan begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Departure<'f> {
    pub(super) family: &'f ChargingLabel,
    pub(super) from: NodeIx,
    pub(super) leaving: Leaving,
    /// Whether it takes off there.
    pub(super) takes_off: bool,
}

/// Where new families and forbidden times are put.
pub(super) struct SearchBuffers<'r> {
    pub(super) closed: &'r Bits,
    pub(super) active: &'r ActiveTraffic,
    pub(super) intervals: &'r mut Vec<(f64, f64)>,
    pub(super) forbidden: &'r mut ForbiddenTimes,
    pub(super) offers: &'r mut Vec<(ChargingLabel, How)>,
}

/// What flying a family over a leg takes, in comparisons of two labels.
const CHECKS_PER_FLIGHT: usize = 8;

impl SearchBuffers<'_> {
    /// What the last flight over a leg took, in checks: more where other plans have it.
    #[inline]
    pub(super) fn checks_of_flight(&self) -> usize {
        CHECKS_PER_FLIGHT + self.intervals.len()
    }

    /// The times at which a leg may not be entered, in place of the intervals.
    fn forbid(
        &mut self,
        terms: &Expander<'_>,
        (entry, leg, period): (Entry, u32, usize),
        within_s: (f64, f64),
    ) {
        let flight = (entry, leg, period);
        self.forbidden.put(
            (terms.world, terms.request),
            self.active,
            flight,
            within_s,
            self.intervals,
        );
    }
}

impl<'a> Expander<'a> {
    pub(super) fn new(
        world: &'a FlightWorld<'a>,
        request: &'a FlightRequest<'a>,
        potentials: &'a Potentials,
    ) -> Self {
        let tau_s = world.charging.tau_s;
        let starts = request.starts.iter().map(|start| start.battery);
        let lowest = starts.fold(request.reserve, f64::min);
        let has_swaps = world.pads.has_swaps();
        let least_stop_s = match has_swaps {
            true => world.rules.stop_s.min(world.rules.swap_s),
            false => world.rules.stop_s,
        } + 2.0 * world.legs.least_vertical_s();
        Self {
            world,
            request,
            potentials,
            tau_s,
            landing_s: world.legs.vertical_s(request.destination),
            lowest,
            has_swaps,
            least_stop_s,
            best_share: best_share(least_stop_s / tau_s),
        }
    }

    /// True where plans have a weight beside their arrival.
    #[inline]
    pub(super) fn is_weighed(&self) -> bool {
        self.request.objective != Objective::Time
    }

    /// The latest arrival at a node that can still keep the deadline.
    #[inline]
    pub(super) fn latest_s(&self, node: NodeIx) -> f64 {
        self.request.deadline_s - self.landing_s - self.potentials.from(node).time_s
    }

    /// The value of a family that has arrived at the destination.
    pub(super) fn value(&self, family: &ChargingLabel) -> Value {
        Value {
            weight: family.weight,
            arrives_s: family.lo_s + self.landing_s,
        }
    }

    /// A lower bound of every plan that goes on from a family.
    ///
    /// What is missing for the flight to the destination has to be charged: by a longer stay at the last stop, or at another one
    /// from the lowest level on, where charging is fastest.
    pub(super) fn key(&self, family: &ChargingLabel, node: NodeIx) -> Value {
        let remaining = self.potentials.from(node);
        let direct_s = family.lo_s + remaining.time_s + self.landing_s;
        let needed = self.request.reserve + remaining.energy;
        let missing = needed - family.battery_lo();
        let mut arrives_s = direct_s;
        if missing > 1e-9 {
            arrives_s += self.least_stops_s(missing, family.hi_s > family.lo_s);
            let by_longer_stay = family.sufficient_from_s(needed, self.tau_s);
            if let Some(from_s) = by_longer_stay.filter(|&from_s| from_s <= family.hi_s) {
                arrives_s = arrives_s.min(from_s + remaining.time_s + self.landing_s);
            }
        }
        Value {
            weight: family.weight + remaining.weight,
            arrives_s,
        }
    }

    /// What a start weighs by itself.
    pub(super) fn start_weight(&self, start: &FlightStart) -> f64 {
        start_weight(self.request.objective, start)
    }

    /// Seconds on a pad of a node before a battery charges, or until it is swapped.
    pub(super) fn handling_s(&self, node: NodeIx) -> f64 {
        let rules = self.world.rules;
        match self.world.pads.swaps(node) {
            true => rules.swap_s,
            false => rules.stop_s,
        }
    }

    /// The families that a start of the request begins with: as it is, and with a swapped battery where there is one.
    pub(super) fn start(&self, start: &FlightStart) -> (ChargingLabel, Option<ChargingLabel>) {
        let legs = self.world.legs;
        let weight = self.start_weight(start);
        if !start.on_ground {
            return (
                ChargingLabel::point(weight, start.at_s, start.battery),
                None,
            );
        }
        let climb = legs.climb_energy(start.node);
        let weight = weight + self.energy_weight(climb);
        let climb_s = legs.vertical_s(start.node);
        let pads = self.world.pads;
        let stays_until_s = pads.stay_until_s(start.node, start.at_s);
        let ready_s = start.at_s + climb_s;
        let until_s = (stays_until_s + climb_s).min(self.latest_s(start.node).max(ready_s));
        if stays_until_s < start.at_s {
            return (
                ChargingLabel::point(weight, ready_s, start.battery - climb),
                None,
            );
        }
        if !pads.swaps(start.node) {
            let charging = self.world.charging;
            let level = start.battery;
            let family = ChargingLabel::charging(weight, level, ready_s, until_s, climb, charging);
            return (family, None);
        }
        let swapped_s = ready_s + self.world.rules.swap_s;
        let full = self.world.charging.full - climb;
        let swapped = (swapped_s <= until_s)
            .then(|| ChargingLabel::waiting(weight, full, swapped_s, until_s));
        let as_it_is = ChargingLabel::waiting(weight, start.battery - climb, ready_s, until_s);
        (as_it_is, swapped)
    }

    #[inline]
    pub(super) fn energy_weight(&self, energy: f64) -> f64 {
        match self.request.objective {
            Objective::Energy => energy_weight(energy),
            Objective::Distance | Objective::Time => 0.0,
        }
    }

    #[inline]
    fn leg_weight(&self, length_m: f64, energy: f64) -> f64 {
        match self.request.objective {
            Objective::Distance => length_m,
            Objective::Energy => energy_weight(energy),
            Objective::Time => 0.0,
        }
    }

    /// The real families after a leg, added to the offers.
    #[inline]
    pub(super) fn fly(&self, departure: Departure<'_>, leg: u32, room: &mut SearchBuffers<'_>) {
        let legs = self.world.legs;
        let flight = legs.leg(leg);
        room.intervals.clear();
        if !flight.least.is_flyable() || room.closed.contains(flight.segment.0) {
            return;
        }
        let obstacles = self.world.obstacles;
        let is_clear = obstacles.is_clear(room.active, flight.segment, departure.from, flight.to);
        if is_clear && legs.changes_s().is_empty() {
            self.fly_piece(*departure.family, leg, 0, room);
            return;
        }
        let changes_s = legs.changes_s();
        for period in 0..=changes_s.len() {
            let begins_s = match period {
                0 => f64::NEG_INFINITY,
                _ => changes_s[period - 1],
            };
            let ends_s = changes_s.get(period).copied().unwrap_or(f64::INFINITY);
            let Departure { family, from, .. } = departure;
            // At the instant of a change the new period counts.
            let holds = begins_s <= family.hi_s && family.lo_s < ends_s;
            if !holds || !legs.cost(leg, period).is_flyable() {
                continue;
            }
            let last_s = family.hi_s.min(ends_s.next_down());
            let piece = family.within(begins_s, last_s, self.tau_s);
            if is_clear {
                self.fly_piece(piece, leg, period, room);
                continue;
            }
            let entry = Entry {
                segment: flight.segment.0,
                from,
                to: flight.to,
                time_s: legs.cost(leg, period).time_s,
                leaving: departure.leaving,
                takes_off: departure.takes_off,
            };
            let within_s = (piece.lo_s, piece.hi_s);
            room.forbid(self, (entry, leg, period), within_s);
            self.fly_between(piece, leg, period, room);
        }
    }

    /// What would come of a leg that nothing forbids, where the wind does not change: all that does come of it is part of it.
    pub(super) fn fly_unhindered(&self, family: &ChargingLabel, leg: u32) -> Option<ChargingLabel> {
        let flight = self.world.legs.leg(leg);
        if !flight.least.is_flyable() {
            return None;
        }
        let cost = flight.least;
        let (reserve, latest_s) = (self.request.reserve, self.latest_s(flight.to));
        let mut flown = family.flown(cost.time_s, cost.energy, reserve, latest_s, self.tau_s)?;
        flown.weight += self.leg_weight(flight.length_m, cost.energy);
        Some(flown)
    }

    /// The pieces of a family that the forbidden intervals leave; touching their ends is allowed.
    fn fly_between(
        &self,
        family: ChargingLabel,
        leg: u32,
        period: usize,
        room: &mut SearchBuffers<'_>,
    ) {
        let mut open_from_s = family.lo_s;
        for place in 0..room.intervals.len() {
            let (from_s, until_s) = room.intervals[place];
            if until_s <= open_from_s {
                continue;
            }
            if from_s >= family.hi_s {
                break;
            }
            if from_s >= open_from_s {
                let piece = family.within(open_from_s, from_s, self.tau_s);
                self.fly_piece(piece, leg, period, room);
            }
            open_from_s = until_s;
        }
        if open_from_s <= family.hi_s {
            let piece = family.within(open_from_s, family.hi_s, self.tau_s);
            self.fly_piece(piece, leg, period, room);
        }
    }

    #[inline]
    fn fly_piece(
        &self,
        family: ChargingLabel,
        leg: u32,
        period: usize,
        room: &mut SearchBuffers<'_>,
    ) {
        let flight = self.world.legs.leg(leg);
        let cost = self.world.legs.cost(leg, period);
        let latest_s = self.latest_s(flight.to);
        let reserve = self.request.reserve;
        let flown = family.flown(cost.time_s, cost.energy, reserve, latest_s, self.tau_s);
        if let Some(mut flown) = flown {
            flown.weight += self.leg_weight(flight.length_m, cost.energy);
            let period = period as u16;
            room.offers.push((flown, How::Leg { leg, period }));
        }
    }

    /// The relaxed family after a leg.
    pub(super) fn fly_relaxed(
        &self,
        departure: Departure<'_>,
        leg: u32,
        room: &mut SearchBuffers<'_>,
    ) {
        let legs = self.world.legs;
        let flight = legs.leg(leg);
        room.intervals.clear();
        if !flight.least.is_flyable() || room.closed.contains(flight.segment.0) {
            return;
        }
        let Departure { family, from, .. } = departure;
        let obstacles = self.world.obstacles;
        let cost = flight.least;
        let mut entered_s = family.lo_s;
        if !obstacles.is_clear(room.active, flight.segment, from, flight.to) {
            let entry = Entry {
                segment: flight.segment.0,
                from,
                to: flight.to,
                time_s: cost.time_s,
                leaving: departure.leaving,
                // Who hovers there leaves as it likes.
                takes_off: false,
            };
            entered_s = self.open_from_s((entry, leg), entered_s, room);
        }
        let latest_s = self.latest_s(flight.to);
        if entered_s + cost.time_s > latest_s {
            return;
        }
        let entering = match entered_s <= family.hi_s {
            true => family.within(entered_s, family.hi_s, self.tau_s),
            false => {
                let battery = family.battery(family.hi_s, self.tau_s);
                ChargingLabel::waiting(family.weight, battery, entered_s, entered_s)
            }
        };
        let flown = entering.flown(
            cost.time_s,
            cost.energy,
            self.request.reserve,
            f64::INFINITY,
            self.tau_s,
        );
        if let Some(mut flown) = flown.filter(|flown| flown.lo_s <= latest_s) {
            flown.weight += self.leg_weight(flight.length_m, cost.energy);
            room.offers.push((flown, How::Leg { leg, period: 0 }));
        }
    }

    /// The first instant from one on at which a leg may be entered.
    fn open_from_s(
        &self,
        (entry, leg): (Entry, u32),
        mut entered_s: f64,
        room: &mut SearchBuffers<'_>,
    ) -> f64 {
        loop {
            // What forbids it later is looked up only where it is not open before.
            let known_s = entered_s;
            room.forbid(self, (entry, leg, 0), (known_s, known_s));
            for &(from_s, until_s) in room.intervals.iter() {
                if from_s < entered_s && entered_s < until_s {
                    entered_s = until_s;
                }
            }
            if entered_s == known_s || entered_s == f64::INFINITY {
                return entered_s;
            }
        }
    }

    /// Seconds of the leg that a step flies; 0 for a stop.
    pub(super) fn time_s(&self, how: How) -> f64 {
        match how {
            How::Leg { leg, period } => self.world.legs.cost(leg, usize::from(period)).time_s,
            How::Start(_) | How::Stop { .. } => 0.0,
        }
    }

    /// Whether a drone takes off from the node that it came to like this.
    #[inline]
    pub(super) fn takes_off(&self, how: How) -> bool {
        !self.may_stop(how)
    }

    /// How a drone leaves the node that it came to like this.
    #[inline]
    pub(super) fn leaving(&self, how: How) -> Leaving {
        match how {
            How::Start(start) if self.request.starts[usize::from(start)].on_ground => {
                Leaving::FromTheGround
            }
            How::Start(_) => Leaving::FromTheAir,
            How::Leg { .. } | How::Stop { .. } => Leaving::OnItsWay,
        }
    }

    /// True where a drone may land on a pad of the node it came to like this: not from where it stands already.
    pub(super) fn may_stop(&self, how: How) -> bool {
        match how {
            How::Start(start) => !self.request.starts[usize::from(start)].on_ground,
            How::Leg { .. } => true,
            How::Stop { .. } => false,
        }
    }
}

/// The share `x` of the room above the lowest level that makes `(c + tau ln(1 / (1 - x))) / x` least, by `c / tau`: with `u = x / (1 - x)`
/// where `u - ln(1 + u) = c / tau`. 0 where stops take no time.
fn best_share(stop_by_tau: f64) -> f64 {
    let mut u = (2.0 * stop_by_tau).sqrt() + 2.0 * stop_by_tau / 3.0;
    if u <= 0.0 {
        return 0.0;
    }
    for _ in 0..NEWTON_STEPS {
        u -= (u - u.ln_1p() - stop_by_tau) * (1.0 + u) / u;
    }
    u / (1.0 + u)
}

#[cfg(test)]
mod tests {
    use super::best_share;

    #[test]
    fn the_best_charge_is_better_than_its_neighbours() {
        for stop_by_tau in [1e-6, 0.01, 0.1, 1.0, 30.0] {
            let rate = |share: f64| (stop_by_tau - (1.0 - share).ln()) / share;
            let best = best_share(stop_by_tau);
            for other in [0.999 * best, 1.001 * best.min(0.998)] {
                assert!(rate(best) <= rate(other), "{stop_by_tau}: {best} {other}");
            }
        }
        assert_eq!(best_share(0.0), 0.0);
    }
}
