//! Brute force in continuous time: every walk, every pattern of stops, every take-off at which anything changes.
//!
//! Take-offs that matter are the earliest possible one, the one at which the charge suffices up to the next stop, and
//! those that meet the end of something forbidden on the way, a change of wind, or a pad that becomes free at the next stop.
//! It shares no code with the search: legs come from the airframe, closures, reservations and traffic as they are stated.

use crate::world::World;
use skyway::flight::{Crossings, Vertical};
use skyway::itinerary::Objective;
use skyway::network::{NodeIx, SegmentIx};

/// Times this much apart count as equal.
const EPSILON_S: f64 = 1e-7;

/// What a plan weighs, and when it lands.
pub(crate) type Outcome = (f64, f64);

/// True where the first is better by more than rounding.
pub(crate) fn beats(one: Outcome, other: Outcome) -> bool {
    let tolerance = 1e-7 * other.0.abs().clamp(1e-3, 1e4);
    if (one.0 - other.0).abs() > tolerance {
        return one.0 < other.0;
    }
    one.1 < other.1 - 1e-4
}

pub(crate) struct Events<'a> {
    pub(crate) world: &'a World,
    objective: Objective,
    vertical: Vertical,
    pub(crate) crossings: Crossings,
    /// By node, the least time to the destination.
    time_left_s: Vec<f64>,
    /// By node, the least weight to the destination.
    weight_left: Vec<f64>,
    changes_s: Vec<f64>,
    pub(crate) best: Option<Outcome>,
    /// Flights that may still be looked at.
    pub(crate) budget: usize,
}

/// The drone on a pad, or in the air at a node.
#[derive(Clone, Copy, Debug)]
struct Standing {
    node: NodeIx,
    weight: f64,
    /// The earliest it can be at the crossing altitude again.
    ready_s: f64,
    /// The latest.
    until_s: f64,
    /// Battery there at `ready_s`.
    battery: f64,
    /// Level on the pad at the time that `ready_s` belongs to, where it charges.
    charging_from: Option<f64>,
    climb: f64,
    /// At the start of the plan, whether it stands there.
    is_start: Option<bool>,
}

/// A walk from where the drone stands.
#[derive(Clone, Debug, Default)]
struct Walk {
    legs: Vec<(NodeIx, NodeIx, SegmentIx)>,
}

impl<'a> Events<'a> {
    pub(crate) fn new(world: &'a World, objective: Objective, budget: usize) -> Self {
        let nodes = world.topology.node_count();
        let mut events = Self {
            world,
            objective,
            crossings: Crossings::of(
                &world.topology,
                &Vertical::of(&world.topology, world.rules.unknown_climb_m),
                world.rules.crossing_m,
            ),
            vertical: Vertical::of(&world.topology, world.rules.unknown_climb_m),
            time_left_s: vec![f64::INFINITY; nodes],
            weight_left: vec![f64::INFINITY; nodes],
            changes_s: world.wind.changes_s(),
            best: None,
            budget,
        };
        events.bounds();
        events
    }

    fn bounds(&mut self) {
        let topology = &self.world.topology;
        self.time_left_s[self.world.destination.at()] = 0.0;
        self.weight_left[self.world.destination.at()] = 0.0;
        let mut instants_s = vec![-1e9];
        instants_s.extend(&self.changes_s);
        for _ in topology.nodes() {
            for node in topology.nodes() {
                for arc in topology.arcs(node) {
                    for &instant_s in &instants_s {
                        let Some((time_s, energy)) =
                            self.cost((node, arc.to, arc.segment), instant_s)
                        else {
                            continue;
                        };
                        let time_s = time_s + self.time_left_s[arc.to.at()];
                        let weight =
                            self.weigh(arc.length_m, energy) + self.weight_left[arc.to.at()];
                        let place = node.at();
                        self.time_left_s[place] = self.time_left_s[place].min(time_s);
                        self.weight_left[place] = self.weight_left[place].min(weight);
                    }
                }
            }
        }
    }

    pub(crate) fn cost(
        &self,
        leg: (NodeIx, NodeIx, SegmentIx),
        enters_s: f64,
    ) -> Option<(f64, f64)> {
        let World {
            topology,
            airframe,
            wind,
            payload_kg,
            ..
        } = self.world;
        let cost = airframe.leg(topology, &self.vertical, wind, *payload_kg, leg, enters_s);
        cost.ok().map(|cost| (cost.time_s, cost.energy))
    }

    fn weigh(&self, length_m: f64, energy: f64) -> f64 {
        match self.objective {
            Objective::Distance => length_m,
            Objective::Energy => energy,
            Objective::Time => 0.0,
        }
    }

    pub(crate) fn vertical_s(&self, node: NodeIx) -> f64 {
        self.vertical.crossing_m(node) / self.world.airframe.vertical_speed_mps
    }

    fn climb(&self, node: NodeIx) -> f64 {
        let climb_m = self.vertical.crossing_m(node);
        self.world
            .airframe
            .climb_energy(self.world.payload_kg, climb_m)
    }

    fn swaps(&self, node: NodeIx) -> bool {
        self.world.situation.swap_stations.contains(&node)
    }

    /// The best outcome; `None` where there is no plan.
    pub(crate) fn search(&mut self) {
        for start in self.world.starts.clone() {
            let flown = self.weigh(start.flown_m, start.drawn);
            let there = Standing {
                node: start.node,
                weight: flown,
                ready_s: start.at_s,
                until_s: start.at_s,
                battery: start.battery,
                charging_from: None,
                climb: 0.0,
                is_start: Some(start.on_ground),
            };
            if !start.on_ground {
                self.arrive(&there, start.at_s);
                self.go_on(&there, &mut Walk::default());
                self.stop(start.node, flown, start.battery, start.at_s);
                continue;
            }
            if start.node == self.world.destination {
                self.offer((flown, start.at_s));
                continue;
            }
            let (climb, vertical_s) = (self.climb(start.node), self.vertical_s(start.node));
            let ready_s = start.at_s + vertical_s;
            let there = Standing {
                weight: flown + self.weigh(0.0, climb),
                ready_s,
                until_s: ready_s,
                battery: start.battery - climb,
                climb,
                ..there
            };
            self.go_on(&there, &mut Walk::default());
            for until_s in self.gaps(start.node, start.at_s) {
                let until_s = until_s + vertical_s;
                let charging_from = (!self.swaps(start.node)).then_some(start.battery);
                let waiting = Standing {
                    until_s,
                    charging_from,
                    ..there
                };
                self.go_on(&waiting, &mut Walk::default());
                let swapped_s = ready_s + self.world.rules.swap_s;
                if self.swaps(start.node) && swapped_s <= until_s {
                    let swapped = Standing {
                        ready_s: swapped_s,
                        battery: self.world.airframe.full_charge - climb,
                        // The search lets nothing but the first battery leave a closed start.
                        is_start: None,
                        ..waiting
                    };
                    self.go_on(&swapped, &mut Walk::default());
                }
            }
        }
    }

    /// The ends of the gaps that hold a landing, one for each pad that is free then.
    pub(crate) fn gaps(&self, node: NodeIx, lands_s: f64) -> Vec<f64> {
        let situation = &self.world.situation;
        let pads = 0..self.world.topology.pads(node);
        let ends = pads.filter_map(|pad| {
            let reserved = situation
                .reservations
                .iter()
                .filter(|taken| taken.node == node && taken.pad == pad);
            let reserved = reserved.map(|taken| (taken.from_s, taken.until_s));
            let closures = situation.closures.iter();
            let closed = closures.filter(|closure| closure.pads.contains(&node));
            let taken: Vec<(f64, f64)> = reserved
                .chain(closed.map(|closure| (closure.from_s, closure.until_s)))
                .collect();
            let is_taken = taken.iter().any(|&(from_s, until_s)| {
                from_s <= lands_s + EPSILON_S && lands_s + EPSILON_S < until_s
            });
            let next_s = taken
                .iter()
                .filter(|taken| taken.0 > lands_s + EPSILON_S)
                .map(|taken| taken.0)
                .fold(f64::INFINITY, f64::min);
            (!is_taken).then_some(next_s)
        });
        ends.collect()
    }

    fn offer(&mut self, outcome: Outcome) {
        let is_late = outcome.1 > self.world.deadline_s + EPSILON_S;
        if !is_late && self.best.is_none_or(|best| beats(outcome, best)) {
            self.best = Some(outcome);
        }
    }

    fn arrive(&mut self, standing: &Standing, at_s: f64) {
        if standing.node == self.world.destination {
            let landing_s = self.vertical_s(standing.node);
            self.offer((standing.weight, at_s + landing_s));
        }
    }

    /// Extends the walk from where the drone stands by every leg.
    fn go_on(&mut self, from: &Standing, walk: &mut Walk) {
        let node = walk.legs.last().map_or(from.node, |leg| leg.1);
        let arcs = self.world.topology.arcs(node).to_vec();
        for arc in arcs {
            if self.world.closed_segments.contains(&arc.segment) {
                continue;
            }
            if self.budget == 0 {
                return;
            }
            walk.legs.push((node, arc.to, arc.segment));
            if self.fly(from, walk) {
                self.go_on(from, walk);
            }
            walk.legs.pop();
        }
    }

    /// Flies a walk with every take-off that matters; false where no longer walk can do either.
    fn fly(&mut self, from: &Standing, walk: &Walk) -> bool {
        let mut may_go_on = false;
        let end = walk.legs.last().map_or(from.node, |leg| leg.1);
        for departs_s in self.departures(from, walk) {
            self.budget = self.budget.saturating_sub(1);
            let Some(flight) = self.simulate(from, walk, departs_s) else {
                continue;
            };
            let weight = from.weight + flight.weight;
            let least = (
                weight + self.weight_left[end.at()],
                flight.at_s + self.time_left_s[end.at()] + self.vertical_s(self.world.destination),
            );
            let is_late = least.1 > self.world.deadline_s + EPSILON_S;
            if is_late || self.best.is_some_and(|best| !beats(least, best)) {
                continue;
            }
            may_go_on = true;
            if flight.is_forbidden {
                continue;
            }
            let arrived = Standing {
                node: end,
                weight,
                ..*from
            };
            self.arrive(&arrived, flight.at_s);
            self.stop(end, weight, flight.battery, flight.at_s);
        }
        may_go_on
    }

    /// The take-offs that matter, as times at the crossing altitude.
    fn departures(&self, from: &Standing, walk: &Walk) -> Vec<f64> {
        let mut candidates_s = vec![from.ready_s];
        // How long after take-off a leg is entered depends on the winds of the legs before.
        let mut flown = vec![(0.0, 0.0, 0)];
        for (place, &leg) in walk.legs.iter().enumerate() {
            let takes_off = place == 0 && from.is_start != Some(false);
            let mut further = Vec::new();
            for &(offset_s, energy, first_period) in &flown {
                for period in first_period..=self.changes_s.len() {
                    let begins_s = match period {
                        0 => -1e9,
                        _ => self.changes_s[period - 1],
                    };
                    candidates_s.push(begins_s - offset_s);
                    let Some((time_s, draws)) = self.cost(leg, begins_s) else {
                        continue;
                    };
                    for (_, until_s) in self.forbidden(leg, time_s, (None, takes_off)) {
                        candidates_s.push(until_s - offset_s);
                    }
                    further.push((offset_s + time_s, energy + draws, period));
                }
            }
            flown = further;
        }
        let end = walk.legs.last().map_or(from.node, |leg| leg.1);
        for (offset_s, energy, _) in flown {
            if let Some(level) = from.charging_from {
                let needed = self.world.reserve + energy + from.climb;
                let airframe = &self.world.airframe;
                if needed > level && needed <= airframe.full_charge {
                    let charging_s = airframe.charge_tau_s * ((1.0 - level) / (1.0 - needed)).ln();
                    candidates_s.push(from.ready_s + charging_s);
                }
            }
            let before_s = self.vertical_s(end) + offset_s;
            let situation = &self.world.situation;
            let reserved = situation.reservations.iter();
            let ends = reserved
                .filter(|taken| taken.node == end)
                .map(|taken| taken.until_s);
            let closed = situation.closures.iter();
            let closed = closed.filter(|closure| closure.pads.contains(&end));
            for until_s in ends.chain(closed.map(|closure| closure.until_s)) {
                candidates_s.push(until_s - before_s);
            }
        }
        candidates_s.retain(|&candidate_s| {
            candidate_s >= from.ready_s - EPSILON_S && candidate_s <= from.until_s + EPSILON_S
        });
        candidates_s.sort_by(f64::total_cmp);
        candidates_s.dedup_by(|one, other| (*one - *other).abs() < EPSILON_S / 10.0);
        candidates_s
    }

    fn simulate(&self, from: &Standing, walk: &Walk, departs_s: f64) -> Option<Flight> {
        let battery = match from.charging_from {
            Some(level) => {
                let charging_s = (departs_s - from.ready_s).max(0.0);
                let tau_s = self.world.airframe.charge_tau_s;
                let full = self.world.airframe.full_charge;
                let charged = 1.0 - (1.0 - level) * (-charging_s / tau_s).exp();
                charged.min(full).max(level) - from.climb
            }
            None => from.battery,
        };
        let mut flight = Flight {
            at_s: departs_s,
            battery,
            weight: 0.0,
            is_forbidden: false,
        };
        for (place, &leg) in walk.legs.iter().enumerate() {
            let (time_s, energy) = self.cost(leg, flight.at_s + EPSILON_S)?;
            let leaves_start = from.is_start.filter(|_| place == 0);
            let enters_s = flight.at_s;
            let takes_off = place == 0 && from.is_start != Some(false);
            let forbidden = self.forbidden(leg, time_s, (leaves_start, takes_off));
            flight.is_forbidden |= forbidden.into_iter().any(|(from_s, until_s)| {
                from_s + EPSILON_S < enters_s && enters_s < until_s - EPSILON_S
            });
            flight.at_s += time_s;
            flight.battery -= energy;
            flight.weight += self.weigh(self.world.topology.segment(leg.2).length_m, energy);
            if flight.battery < self.world.reserve - 1e-9 {
                // A later take-off may have more.
                let level = from.charging_from?;
                let most = self.world.airframe.full_charge.max(level) - from.climb;
                let drawn = battery - flight.battery;
                flight.is_forbidden = true;
                return (most - drawn >= self.world.reserve - 1e-9)
                    .then(|| self.rest(flight, walk, place + 1));
            }
        }
        Some(flight)
    }

    /// Flies on without asking for anything.
    fn rest(&self, mut flight: Flight, walk: &Walk, first: usize) -> Flight {
        for &leg in &walk.legs[first..] {
            if let Some((time_s, energy)) = self.cost(leg, flight.at_s) {
                flight.at_s += time_s;
                flight.weight += self.weigh(self.world.topology.segment(leg.2).length_m, energy);
            }
        }
        flight
    }

    /// Lands on every pad that is free.
    fn stop(&mut self, node: NodeIx, weight: f64, battery: f64, at_s: f64) {
        if node == self.world.destination {
            return;
        }
        let vertical_s = self.vertical_s(node);
        let lands_s = at_s + vertical_s;
        let swaps = self.swaps(node);
        let rules = &self.world.rules;
        let handling_s = if swaps { rules.swap_s } else { rules.stop_s };
        let climb = self.climb(node);
        for until_s in self.gaps(node, lands_s) {
            if lands_s + handling_s > until_s + EPSILON_S {
                continue;
            }
            let level = if swaps {
                self.world.airframe.full_charge
            } else {
                battery
            };
            let standing = Standing {
                node,
                weight: weight + self.weigh(0.0, climb),
                ready_s: lands_s + handling_s + vertical_s,
                until_s: until_s + vertical_s,
                battery: level - climb,
                charging_from: (!swaps).then_some(level),
                climb,
                is_start: None,
            };
            self.go_on(&standing, &mut Walk::default());
        }
    }
}

/// A walk that was flown.
#[derive(Clone, Copy, Debug)]
struct Flight {
    at_s: f64,
    battery: f64,
    weight: f64,
    /// True where it cannot be flown from this take-off, though it might from another one.
    is_forbidden: bool,
}
