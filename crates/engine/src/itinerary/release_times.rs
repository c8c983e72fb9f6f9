//! Release times: instants from which something can be flown that could not be just before.
//!
//! Where nothing opens, an earlier arrival can do all that a later one can. So a label that arrives
//! earlier, but cannot wait as long, makes another one needless unless an opening lies between them
//! that the other could still use.

use super::active_traffic::ActiveTraffic;
use super::charging_label::ChargingLabel;
use super::entry::{Entry, Leaving};
use super::expander::Expander;
use super::obstacles::join;
use super::request::{Objective, Value};
use crate::flight::FlightLegs;
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx};

/// Lengths are rounded in the table of legs; straight lines are shortened by this, in metres, to
/// stay below them.
const ROUNDING_M: f64 = 1e-3;
/// Sums of times in another order differ by less than this, in seconds.
const ROUNDING_S: f64 = 1e-3;
/// Sums of weights of energies differ by less than this, as a fraction of a battery.
const ROUNDING_ENERGY: f64 = 1e-9;

/// Of what charging takes at least there is a table, by steps of this part of a battery, up to so
/// many.
const STOPS_STEPS: f64 = 64.0;
const STOPS_ENTRIES: usize = 256;
/// Nodes that remember what parted families there.
const PARTED_BY: usize = 64;

/// Something opens at a node: a leg from it, a pad, or everything where the wind changes.
#[derive(Clone, Copy, Debug)]
struct Opening {
    /// Who is there at this instant or before finds it open, too; minus infinity for pads and the
    /// wind.
    shuts_s: f64,
    at_s: f64,
    /// `None` for everywhere.
    there: Option<There>,
}

/// Where something opens.
#[derive(Clone, Copy, Debug)]
struct There {
    place: Point,
    /// What is left from there at least.
    weight: f64,
    time_s: f64,
    energy: f64,
    /// What a stop there takes at least, in seconds; 0 for a leg.
    stop_s: f64,
}

/// The openings that a request may use, by time. They are collected when the first of them is asked
/// for.
#[derive(Debug)]
pub(super) struct ReleaseTimes {
    by_time: Vec<Opening>,
    is_collected: bool,
    intervals: Vec<(f64, f64)>,
    segments: Vec<u32>,
    /// By node, modulo the length: the opening that last parted two families there, which often
    /// parts the next two.
    parted_by: [u32; PARTED_BY],
    /// The least that the stops ahead take, by what is missing.
    stops_s: Vec<f64>,
}

impl Default for ReleaseTimes {
    fn default() -> Self {
        Self {
            by_time: Vec::new(),
            is_collected: false,
            intervals: Vec::new(),
            segments: Vec::new(),
            parted_by: [0; PARTED_BY],
            stops_s: Vec::new(),
        }
    }
}

impl ReleaseTimes {
    /// Forgets the request before, so that what a search costs does not depend on what was asked earlier.
    pub(super) fn clear(&mut self) {
        self.by_time.clear();
        self.parted_by = [0; PARTED_BY];
        self.is_collected = false;
    }

    /// Collects what opens, as far as a plan through it could still beat `best`.
    fn collect(&mut self, terms: &Expander<'_>, active: &ActiveTraffic, best: Value) {
        self.is_collected = true;
        let steps = (0..STOPS_ENTRIES).map(|step| step as f64 / STOPS_STEPS);
        self.stops_s.clear();
        self.stops_s
            .extend(steps.map(|missing| terms.stops_s(missing)));
        self.collect_entries(terms, active, best);
        self.collect_take_offs(terms, active, best);
        let (pads, legs) = (terms.world.pads, terms.world.legs);
        let nodes = pads.nodes_with_stays();
        for node in nodes.filter(|&node| may_lead_on(terms, best, node)) {
            let handling_s = terms.handling_s(node);
            let vertical_s = legs.vertical_s(node);
            for (rises_s, until_s) in pads.rises(node) {
                // No stop takes less.
                if until_s >= rises_s + handling_s - ROUNDING_S {
                    let at_s = rises_s - vertical_s;
                    let stop_s = handling_s + 2.0 * vertical_s;
                    self.add(terms, best, node, (f64::NEG_INFINITY, at_s), stop_s);
                }
            }
        }
        for &at_s in legs.changes_s() {
            self.by_time.push(Opening {
                shuts_s: f64::NEG_INFINITY,
                at_s,
                there: None,
            });
        }
        self.by_time
            .sort_unstable_by(|one, other| one.at_s.total_cmp(&other.at_s));
    }

    fn collect_entries(&mut self, terms: &Expander<'_>, active: &ActiveTraffic, best: Value) {
        let world = terms.world;
        let mut intervals = std::mem::take(&mut self.intervals);
        let mut segments = std::mem::take(&mut self.segments);
        let within_s = usable_s(terms);
        let obstacles = world.obstacles;
        obstacles.list_segments(world.topology, active, &mut segments);
        for &segment in &segments {
            let ends = world.topology.segment(SegmentIx(segment));
            for (from, to) in [(ends.from, ends.to), (ends.to, ends.from)] {
                if !may_lead_on(terms, best, from) {
                    continue;
                }
                // Who begins at a node is not bound by all that closes it: something may open while
                // the node is closed.
                let mut starts = terms.request.starts.iter();
                let is_start = starts.any(|start| start.node == from);
                for period in 0..=world.legs.changes_s().len() {
                    let Some(time_s) = time_of(world.legs, from, segment, period) else {
                        continue;
                    };
                    let entry = Entry {
                        segment,
                        from,
                        to,
                        time_s,
                        leaving: Leaving::OnItsWay,
                        takes_off: false,
                    };
                    intervals.clear();
                    let began_s = terms.request.began_s;
                    let there = (entry, active);
                    obstacles.forbidden(world, began_s, there, within_s, &mut intervals);
                    if !is_start {
                        join(&mut intervals);
                    }
                    for &(shuts_s, opens_s) in &intervals {
                        let shuts_s = if is_start { f64::NEG_INFINITY } else { shuts_s };
                        self.add(terms, best, from, (shuts_s, opens_s), 0.0);
                    }
                }
            }
        }
        self.intervals = intervals;
        self.segments = segments;
    }

    /// Who takes off waits for those who pass the node, which those who pass it themselves do not.
    fn collect_take_offs(&mut self, terms: &Expander<'_>, active: &ActiveTraffic, best: Value) {
        let world = terms.world;
        if !world.keeps_apart() {
            return;
        }
        let (separation, within_s) = (world.separation(), usable_s(terms));
        let others = world.obstacles.others();
        for node in active.nodes(world.topology) {
            let here = (node, 0.0);
            separation.at_node(others, here, within_s, &mut |near| {
                self.add(terms, best, node, (f64::NEG_INFINITY, near.until_s), 0.0);
            });
        }
    }

    /// Keeps an opening at a node that can be reached before the deadline and could lead to
    /// something better.
    fn add(
        &mut self,
        terms: &Expander<'_>,
        best: Value,
        node: NodeIx,
        (shuts_s, at_s): (f64, f64),
        stop_s: f64,
    ) {
        let remaining = terms.potentials.from(node);
        let place = terms.world.topology.position(node);
        let request = terms.request;
        let latest_s = request.deadline_s.min(match request.objective {
            Objective::Time => best.arrives_s,
            Objective::Distance | Objective::Energy => f64::INFINITY,
        });
        if !at_s.is_finite() || at_s + stop_s + remaining.time_s > latest_s {
            return;
        }
        // Nobody is there earlier than by the straight line.
        let is_reached = request.starts.iter().any(|start| {
            let straight_m = terms.world.topology.position(start.node).distance_m(place);
            start.at_s + (straight_m - ROUNDING_M).max(0.0) / terms.world.legs.fastest_mps() <= at_s
        });
        if is_reached && may_lead_on(terms, best, node) {
            self.by_time.push(Opening {
                shuts_s,
                at_s,
                there: Some(There {
                    place,
                    weight: remaining.weight,
                    time_s: remaining.time_s,
                    energy: remaining.energy,
                    stop_s,
                }),
            });
        }
    }

    /// True when the later of two families at a node could use an opening that the earlier one
    /// could not, for a plan that beats `best`. Also counts the openings looked at.
    ///
    /// Flying on from the node for `delta` seconds without a stop, they are there by `earlier.hi +
    /// delta` and `later.hi + delta`. The earlier one finds it shut, and the later one can wait for
    /// it, only if `shuts < earlier.hi + delta < opens <= later.hi + delta`. So `delta` is more
    /// than `shuts - earlier.hi`, at least `opens - later.hi`, at least what the straight line
    /// takes and what the tables differ by, and less than `opens - earlier.hi`. A flight of `delta`
    /// is made of whole legs: it weighs at least the least weight per second of any leg in any wind
    /// times `delta`, climbs and descents on legs included, and draws at least the least draw times
    /// `delta`; both are also at least what the tables differ by.
    pub(super) fn part(
        &mut self,
        (terms, active): (&Expander<'_>, &ActiveTraffic),
        node: NodeIx,
        earlier: &ChargingLabel,
        later: &ChargingLabel,
        best: Value,
        looked_at: &mut usize,
    ) -> bool {
        if !self.is_collected {
            self.collect(terms, active, best);
        }
        let way_on = WayOn::new(terms, &self.stops_s, node, (earlier, later), best);
        let last_s = later.hi_s + way_on.longest_s + ROUNDING_S;
        let parted_by = &mut self.parted_by[node.at() % PARTED_BY];
        *looked_at += 1;
        if let Some(opening) = self.by_time.get(*parted_by as usize)
            && earlier.hi_s < opening.at_s
            && opening.at_s <= last_s
            && way_on.may_use(opening)
        {
            return true;
        }
        let first = self
            .by_time
            .partition_point(|opening| opening.at_s <= earlier.hi_s);
        for (place, opening) in self.by_time.iter().enumerate().skip(first) {
            if opening.at_s > last_s {
                return false;
            }
            *looked_at += 1;
            if way_on.may_use(opening) {
                *parted_by = place as u32;
                return true;
            }
        }
        false
    }
}

/// Two families at a node that fly on.
struct WayOn<'a> {
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
    fn new(
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

    fn may_use(&self, opening: &Opening) -> bool {
        let missed_s = opening.at_s - self.earlier_s;
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
        let drawn = (self.draw_per_s * delta_s).max(self.energy - there.energy);
        if drawn > self.spare {
            return false;
        }
        let flown = (straight_m * self.weight_per_m)
            .max(self.weight_per_s * delta_s)
            .max(self.weight - there.weight);
        let bound = |stops_s: f64| Value {
            weight: self.spent + flown + there.weight - self.rounding,
            arrives_s: opening.at_s + stops_s + there.time_s + self.terms.landing_s - ROUNDING_S,
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

/// The times at which an opening can be of use.
fn usable_s(terms: &Expander<'_>) -> (f64, f64) {
    let starts = terms.request.starts.iter().map(|start| start.at_s);
    (
        starts.fold(f64::INFINITY, f64::min),
        terms.request.deadline_s,
    )
}

/// True where something better could come by a node: by the straight line from a start and the
/// tables.
fn may_lead_on(terms: &Expander<'_>, best: Value, node: NodeIx) -> bool {
    let remaining = terms.potentials.from(node);
    let place = terms.world.topology.position(node);
    terms.request.starts.iter().any(|start| {
        let straight_m = terms.world.topology.position(start.node).distance_m(place) - ROUNDING_M;
        straight_m * terms.weight_per_m() + remaining.weight <= best.weight
    })
}

/// Seconds on a segment from one of its ends in a period; `None` where it cannot be flown.
fn time_of(legs: &FlightLegs, from: NodeIx, segment: u32, period: usize) -> Option<f64> {
    let leg = legs
        .from(from)
        .find(|&leg| legs.leg(leg).segment.0 == segment)?;
    let cost = legs.cost(leg, period);
    cost.is_flyable().then_some(cost.time_s)
}
