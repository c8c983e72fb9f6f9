//! Lower bounds of what is left to a destination: tables of the least weight, time and energy on a network, and the tree of
//! the objective.
//!
//! On the intact network they depend on airframe, payload and wind, not on closures or pads, which only make plans worse.

use super::request::{Objective, Value};
use crate::airspace::Bits;
use crate::flight::{FlightLeg, FlightLegs, FlightStart, LegCost};
use crate::network::{Heap, NodeIx};
use std::mem;

/// In place of a leg: at the destination, and where there is no way.
const NO_LEG: u32 = u32::MAX;
/// Energy as a weight is rounded to this part of a battery, 2^-40, so that equal sums are equal.
const ENERGY_STEPS: f64 = 1_099_511_627_776.0;

/// Energy as a weight: rounded so that sums do not depend on their order.
#[inline]
pub(super) fn energy_weight(energy: f64) -> f64 {
    // Beside it a double has no digits after the point: without SSE 4.1 `round` is a call.
    const WHOLE: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64 / 2.0;
    (energy * ENERGY_STEPS + WHOLE - WHOLE) / ENERGY_STEPS
}

/// What a start weighs by itself under an objective.
pub(super) fn start_weight(objective: Objective, start: &FlightStart) -> f64 {
    match objective {
        // As the legs are, so that ways through either end of a leg are equally long where they are one.
        Objective::Distance => FlightLegs::rounded_m(start.flown_m),
        Objective::Energy => energy_weight(start.drawn),
        Objective::Time => 0.0,
    }
}

/// What is left from a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remaining {
    /// The objective's weight; 0 for time.
    pub(super) weight: f64,
    /// Seconds.
    pub(super) time_s: f64,
    /// Fraction of a battery.
    pub(super) energy: f64,
    /// The next leg down the tree of the objective.
    next: u32,
}

/// The tables of one destination.
#[derive(Debug)]
pub struct Potentials {
    destination: NodeIx,
    objective: Objective,
    remaining: Vec<Remaining>,
    /// Nodes from which two ways have the least weight.
    tied: Bits,
    slowest_mps: f64,
}

impl Potentials {
    /// Works the tables out, once per destination and table of legs: a full search for the objective, and in its order the
    /// least times and energies.
    pub fn of(legs: &FlightLegs, nodes: usize, destination: NodeIx, objective: Objective) -> Self {
        Self::by_legs(legs, nodes, (destination, objective), |_| true)
    }

    /// The same on what is left of the network without some of its legs.
    pub(super) fn without(&self, legs: &FlightLegs, shut: &[u32]) -> Self {
        let mut left_out = Bits::default();
        for &leg in shut {
            left_out.insert_growing(leg);
        }
        let to = (self.destination, self.objective);
        let nodes = self.remaining.len();
        Self::by_legs(legs, nodes, to, |leg| !left_out.holds(leg))
    }

    fn by_legs(
        legs: &FlightLegs,
        nodes: usize,
        (destination, objective): (NodeIx, Objective),
        is_left: impl Fn(u32) -> bool,
    ) -> Self {
        let weight = |away: u32, leg: &FlightLeg| match objective {
            _ if !is_left(leg.twin) => f64::INFINITY,
            Objective::Distance if legs.least_back(away).is_flyable() => leg.length_m,
            Objective::Distance => f64::INFINITY,
            Objective::Time => legs.least_back(away).time_s,
            Objective::Energy => energy_weight(legs.least_back(away).energy),
        };
        let tree = distances(legs, nodes, destination, weight);
        let remaining = (0..nodes).map(|node| Remaining {
            weight: match objective {
                Objective::Time => 0.0,
                Objective::Distance | Objective::Energy => tree.left[node],
            },
            time_s: tree.least[node].time_s,
            energy: tree.least[node].energy,
            next: tree.next[node],
        });
        let remaining = remaining.collect();
        let tied = match objective {
            Objective::Time => Bits::empty(nodes),
            Objective::Distance | Objective::Energy => tree.tied(legs),
        };
        Self {
            destination,
            objective,
            remaining,
            tied,
            slowest_mps: legs.slowest_mps(),
        }
    }

    /// The node they lead to.
    pub fn destination(&self) -> NodeIx {
        self.destination
    }

    /// The objective that weight and tree are of.
    pub fn objective(&self) -> Objective {
        self.objective
    }

    /// The least weight from a node on: metres, multiples of a full battery, or nothing for time.
    pub fn least_weight(&self, node: NodeIx) -> f64 {
        self.remaining[node.at()].weight
    }

    /// The least flying time from a node on, in seconds.
    pub fn least_time_s(&self, node: NodeIx) -> f64 {
        self.remaining[node.at()].time_s
    }

    /// What no plan from any of these starts beats, whatever is in the way.
    pub fn least_from(&self, starts: &[FlightStart]) -> Value {
        let weights = starts.iter().map(|start| {
            let flown = start_weight(self.objective, start);
            flown + self.least_weight(start.node)
        });
        let arrivals = starts
            .iter()
            .map(|start| start.at_s + self.least_time_s(start.node));
        Value {
            weight: weights.fold(f64::INFINITY, f64::min),
            arrives_s: arrivals.fold(f64::INFINITY, f64::min),
        }
    }

    /// No destination, and nothing known of what is left: for searches that end elsewhere.
    pub(super) fn nowhere(nodes: usize, objective: Objective) -> Self {
        let nothing = Remaining {
            weight: 0.0,
            time_s: 0.0,
            energy: 0.0,
            next: NO_LEG,
        };
        Self {
            destination: NodeIx(u32::MAX),
            objective,
            remaining: vec![nothing; nodes],
            tied: Bits::empty(nodes),
            slowest_mps: 0.0,
        }
    }

    /// The same destination without any knowledge but which nodes lead there.
    pub(super) fn blind(&self) -> Self {
        let known = |value: f64| if value.is_finite() { 0.0 } else { value };
        let remaining = self.remaining.iter().map(|remaining| Remaining {
            weight: known(remaining.weight),
            time_s: known(remaining.time_s),
            energy: known(remaining.energy),
            next: NO_LEG,
        });
        Self {
            destination: self.destination,
            objective: self.objective,
            remaining: remaining.collect(),
            tied: self.tied.clone(),
            slowest_mps: self.slowest_mps,
        }
    }

    /// No leg takes longer for its metres than at this ground speed, in any wind, changes of altitude included.
    pub(super) fn slowest_mps(&self) -> f64 {
        self.slowest_mps
    }

    /// How many bytes it takes in memory.
    pub fn bytes(&self) -> usize {
        let nodes = self.remaining.len();
        size_of::<Self>() + nodes * size_of::<Remaining>() + nodes.div_ceil(8)
    }

    /// What is left from a node.
    #[inline]
    pub(super) fn from(&self, node: NodeIx) -> &Remaining {
        &self.remaining[node.at()]
    }

    /// The next leg down the tree; `None` at the destination and without a way.
    #[inline]
    pub(super) fn next(&self, node: NodeIx) -> Option<u32> {
        let next = self.remaining[node.at()].next;
        (next != NO_LEG).then_some(next)
    }

    /// True where only the way down the tree has the least weight; never for time.
    #[inline]
    pub(super) fn is_only_way(&self, node: NodeIx) -> bool {
        self.objective != Objective::Time && !self.tied.contains(node.0)
    }
}

/// A full search backwards.
struct Table {
    /// The least sum of a weight.
    left: Vec<f64>,
    /// The least sums of time and of energy, each over its own way.
    least: Vec<LegCost>,
    next: Vec<u32>,
    /// Nodes with two legs that are equally good.
    is_even: Vec<bool>,
    settled: Vec<NodeIx>,
}

impl Table {
    /// Marks nodes from which two ways are equally light, from the destination outwards.
    fn tied(&self, legs: &FlightLegs) -> Bits {
        let mut tied = Bits::empty(self.next.len());
        for &node in &self.settled {
            let next = self.next[node.at()];
            let goes_on_tied = next != NO_LEG && tied.contains(legs.leg(next).to.0);
            if goes_on_tied || self.is_even[node.at()] {
                tied.insert(node.0);
            }
        }
        tied
    }
}

/// The least sum of `weight` over the legs to a destination, and beside it the least times and energies; infinite without a
/// way. The weight is given the leg the other way and its place, as the search goes backwards.
///
/// Nodes pass on times and energies in the order of the weight, and those whose own become less after that do so again, until
/// nothing changes any more. What is left then is what a search by these sums finds, to the last bit: each value is that of a
/// way, added up from its end, and no leg makes one smaller. Time and energy grow much as the weight does, so that few nodes do
/// so twice.
fn distances(
    legs: &FlightLegs,
    nodes: usize,
    destination: NodeIx,
    weight: impl Fn(u32, &FlightLeg) -> f64,
) -> Table {
    let mut table = Table {
        left: vec![f64::INFINITY; nodes],
        least: vec![LegCost::UNFLYABLE; nodes],
        next: vec![NO_LEG; nodes],
        is_even: vec![false; nodes],
        settled: Vec::with_capacity(nodes),
    };
    let mut has_less = vec![false; nodes];
    let mut queue = Heap::with_capacity(nodes);
    table.left[destination.at()] = 0.0;
    table.least[destination.at()] = LegCost {
        time_s: 0.0,
        energy: 0.0,
    };
    queue.push(0.0, destination);
    while let Some((left, node)) = queue.pop() {
        if left > table.left[node.at()] {
            continue;
        }
        table.settled.push(node);
        has_less[node.at()] = false;
        for away in legs.from(node) {
            let leg = legs.leg(away);
            let weight = weight(away, leg);
            if weight == f64::INFINITY {
                continue;
            }
            let (to, through) = (leg.to.at(), left + weight);
            if through < table.left[to] {
                table.left[to] = through;
                table.next[to] = leg.twin;
                table.is_even[to] = false;
                queue.push(through, leg.to);
            } else if through == table.left[to] {
                table.is_even[to] = true;
            }
            let own = table.least[node.at()];
            has_less[to] |= pass_on(own, legs.least_back(away), &mut table.least[to]);
        }
    }
    while has_less.contains(&true) {
        for &node in &table.settled {
            if !mem::take(&mut has_less[node.at()]) {
                continue;
            }
            let own = table.least[node.at()];
            for away in legs.from(node) {
                let leg = legs.leg(away);
                if weight(away, leg) < f64::INFINITY {
                    let before = &mut table.least[leg.to.at()];
                    has_less[leg.to.at()] |= pass_on(own, legs.least_back(away), before);
                }
            }
        }
    }
    table
}

/// Makes the least sums of a node those over a leg to another one, where these are less; tells whether any is.
#[inline]
fn pass_on(own: LegCost, leg: LegCost, before: &mut LegCost) -> bool {
    let time_s = own.time_s + leg.time_s;
    let energy = own.energy + energy_weight(leg.energy);
    let is_less = time_s < before.time_s || energy < before.energy;
    before.time_s = before.time_s.min(time_s);
    before.energy = before.energy.min(energy);
    is_less
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{Airframe, FlightRules, Wind, WindField};
    use crate::network::{Generated, Joining, Seeded, Topology};

    fn legs(seed: u64, wind: WindField) -> (FlightLegs, usize) {
        let joinings = [Joining::Nearest, Joining::Random, Joining::Delaunay];
        let generated = Generated {
            nodes: 120,
            max_neighbours: 5,
            map_size_m: 6_000.0,
            reach_fraction: 0.2,
            joining: joinings[seed as usize % joinings.len()],
            seed,
        };
        let mut draft = generated.network().expect("in range");
        let mut seeded = Seeded::new(seed);
        for segment in &mut draft.segments {
            segment.speed_limit_mps = Some(seeded.between(2.0, 20.0));
        }
        let topology = Topology::build(draft, [0; 32]).expect("a network");
        let rules = FlightRules::default();
        let legs = FlightLegs::of(&topology, &Airframe::phantom3(), 0.5, &wind, &rules);
        (legs, topology.node_count())
    }

    /// A strong wind forbids legs, and limits of speed make short ways slow: an order by metres is not one by time.
    #[test]
    fn times_and_energies_are_those_of_searches_of_their_own() {
        for seed in 0..60 {
            let speed_mps = [0.0, 6.0, 11.0][seed as usize % 3];
            let wind = WindField::uniform(Wind::coming_from(37.0 * seed as f64, speed_mps));
            let (legs, nodes) = legs(seed, wind);
            for destination in (0..nodes as u32).step_by(17).map(NodeIx) {
                let by_time = distances(&legs, nodes, destination, |_, leg| {
                    legs.leg(leg.twin).least.time_s
                });
                let by_energy = distances(&legs, nodes, destination, |_, leg| {
                    energy_weight(legs.leg(leg.twin).least.energy)
                });
                for objective in Objective::ALL {
                    let tables = Potentials::of(&legs, nodes, destination, objective);
                    for (node, found) in tables.remaining.iter().enumerate() {
                        let least = (by_time.left[node], by_energy.left[node]);
                        let place = format!("seed {seed}, {destination:?}, {objective:?}, {node}");
                        assert_eq!((found.time_s, found.energy), least, "{place}");
                        let has_weight = found.weight.is_finite();
                        let is_weighed = objective != Objective::Time;
                        assert!(!is_weighed || has_weight == least.0.is_finite(), "{place}");
                    }
                }
            }
        }
    }

    #[test]
    fn tables_without_some_legs_are_those_of_the_legs_that_are_left() {
        let (legs, nodes) = legs(5, WindField::uniform(Wind::coming_from(0.0, 0.0)));
        let to = (NodeIx(17), Objective::Energy);
        let tables = Potentials::of(&legs, nodes, to.0, to.1);
        let energies = |tables: &Potentials| -> Vec<f64> {
            let all = tables.remaining.iter();
            all.map(|remaining| remaining.energy).collect()
        };
        for shut in [(0..40).collect::<Vec<u32>>(), (30..90).step_by(3).collect()] {
            let searched = distances(&legs, nodes, to.0, |_, leg| {
                match shut.contains(&leg.twin) {
                    true => f64::INFINITY,
                    false => energy_weight(legs.leg(leg.twin).least.energy),
                }
            });
            let found = tables.without(&legs, &shut);
            assert_eq!(energies(&found), searched.left);
            assert_ne!(energies(&found), energies(&tables));
        }
    }
}
