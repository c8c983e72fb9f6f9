//! Release times: instants from which something can be flown that could not be just before.
//!
//! Where nothing opens, an earlier arrival can do all that a later one can. So a label that arrives
//! earlier, but cannot wait as long, makes another one needless unless an opening lies between them
//! that the other could still use.

use super::active_traffic::ActiveTraffic;
use super::charging_label::ChargingLabel;
use super::entry::{Entry, Leaving};
use super::expander::Expander;
use super::forbidden_times::{ForbiddenTimes, known_until_s};
use super::opening::{At, Opening, ROUNDING_S, there};
use super::request::Value;
use super::way_on::{WayOn, list_stops_s};
use crate::network::{NodeIx, SegmentIx};
use std::ops::Range;

/// So many nodes around a node are looked at for an opening before others are.
const AROUND: usize = 24;
/// So many nodes are looked at whether their openings may be of use, before the openings of all are put in order.
const NODES_LOOKED_AT: usize = 8_192;
/// Nodes that remember what parted families there.
const PARTED_BY: usize = 64;

/// The openings that a request may use. Those at a node are collected when it is first asked for them, and all others once
/// those near at hand and in reach have often parted no two families.
#[derive(Debug)]
pub(super) struct ReleaseTimes {
    openings: Vec<Opening>,
    /// By node.
    of_nodes: Vec<Collected>,
    generation: u32,
    /// The nodes at which something may open, and where what opens everywhere is, once they are listed.
    nodes: Vec<NodeIx>,
    everywhere: Range<u32>,
    is_listed: bool,
    /// How many nodes were looked at since.
    looked_at: usize,
    /// All of them by time, once they are collected.
    by_time: Vec<(f64, u32)>,
    is_complete: bool,
    intervals: Vec<(f64, f64)>,
    segments: Vec<u32>,
    /// By node, modulo the length: the opening that last parted two families there, which often
    /// parts the next two.
    parted_by: [u32; PARTED_BY],
    /// The least that the stops ahead take, by what is missing.
    stops_s: Vec<f64>,
}

/// The openings at a node, in a generation.
#[derive(Clone, Debug, Default)]
struct Collected {
    generation: u32,
    /// Until when they are all there, in seconds.
    until_s: f64,
    /// Where they are, by time.
    range: Range<u32>,
}

/// What openings are collected for.
struct Wanted<'a> {
    terms: &'a Expander<'a>,
    active: &'a ActiveTraffic,
    forbidden: &'a mut ForbiddenTimes,
    /// A plan through one of them could still beat this.
    best: Value,
}

impl ReleaseTimes {
    /// Room for a network of so many nodes.
    pub(super) fn for_nodes(node_count: usize) -> Self {
        Self {
            openings: Vec::new(),
            of_nodes: vec![Collected::default(); node_count],
            generation: 1,
            nodes: Vec::new(),
            everywhere: 0..0,
            is_listed: false,
            looked_at: 0,
            by_time: Vec::new(),
            is_complete: false,
            intervals: Vec::new(),
            segments: Vec::new(),
            parted_by: [0; PARTED_BY],
            stops_s: Vec::new(),
        }
    }

    /// Forgets the request before, so that what a search costs does not depend on what was asked earlier.
    pub(super) fn clear(&mut self) {
        self.openings.clear();
        self.stops_s.clear();
        self.parted_by = [0; PARTED_BY];
        self.is_listed = false;
        self.looked_at = 0;
        self.is_complete = false;
        self.generation = self.generation.wrapping_add(1);
        if self.generation == 0 {
            self.of_nodes.fill(Collected::default());
            self.generation = 1;
        }
    }

    /// Lists where something may open.
    fn list(&mut self, wanted: &Wanted<'_>) {
        if self.is_listed {
            return;
        }
        self.is_listed = true;
        let world = wanted.terms.world;
        let obstacles = world.obstacles;
        obstacles.list_segments(world.topology, wanted.active, &mut self.segments);
        self.nodes.clear();
        for &segment in &self.segments {
            let ends = world.topology.segment(SegmentIx(segment));
            self.nodes.extend([ends.from, ends.to]);
        }
        self.nodes.extend(wanted.active.nodes(world.topology));
        self.nodes.extend(world.pads.nodes_with_stays());
        self.nodes.sort_unstable();
        self.nodes.dedup();
        let first = self.openings.len() as u32;
        let turns = world.legs.changes_s().iter().map(|&at_s| Opening {
            shuts_s: f64::NEG_INFINITY,
            at_s,
            there: None,
        });
        self.openings.extend(turns);
        self.everywhere = first..self.openings.len() as u32;
    }

    /// Collects all that opens, as far as a plan through it could still beat the best.
    fn complete(&mut self, wanted: &mut Wanted<'_>) {
        self.is_complete = true;
        let nodes = std::mem::take(&mut self.nodes);
        for &node in &nodes {
            self.collect_at(wanted, node, f64::INFINITY);
        }
        self.nodes = nodes;
        self.by_time.clear();
        let numbered = (0_u32..).zip(&self.openings);
        self.by_time
            .extend(numbered.map(|(number, opening)| (opening.at_s, number)));
        self.by_time
            .sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
    }

    /// Collects what opens at a node until an instant; gives where it is, and until when all of it is there.
    fn collect_at(
        &mut self,
        wanted: &mut Wanted<'_>,
        node: NodeIx,
        until_s: f64,
    ) -> (Range<usize>, f64) {
        let there = &self.of_nodes[node.at()];
        if there.generation == self.generation && there.until_s >= until_s {
            let range = there.range.start as usize..there.range.end as usize;
            return (range, there.until_s);
        }
        let first = self.openings.len();
        let at = At::of(wanted.terms, wanted.best, node, until_s);
        // Where nothing better could come by, nothing ever opens.
        let until_s = at.as_ref().map_or(f64::INFINITY, |_| until_s);
        if let Some(at) = at {
            self.collect_entries(wanted, &at);
            self.collect_take_offs(wanted, &at);
            self.collect_pads(wanted, &at);
            self.openings[first..].sort_unstable_by(|one, other| one.at_s.total_cmp(&other.at_s));
        }
        let range = first..self.openings.len();
        self.of_nodes[node.at()] = Collected {
            generation: self.generation,
            until_s,
            range: range.start as u32..range.end as u32,
        };
        (range, until_s)
    }

    /// Legs that lead from a node.
    fn collect_entries(&mut self, wanted: &mut Wanted<'_>, at: &At) {
        let (terms, active) = (wanted.terms, wanted.active);
        let world = terms.world;
        let mut intervals = std::mem::take(&mut self.intervals);
        let within_s = (at.earliest_s, at.known_until_s);
        for leg in world.legs.from(at.node) {
            let flight = world.legs.leg(leg);
            let obstacles = world.obstacles;
            if obstacles.is_clear(active, flight.segment, at.node, flight.to) {
                continue;
            }
            for period in 0..=world.legs.changes_s().len() {
                let cost = world.legs.cost(leg, period);
                if !cost.is_flyable() {
                    continue;
                }
                let entry = Entry {
                    segment: flight.segment.0,
                    from: at.node,
                    to: flight.to,
                    time_s: cost.time_s,
                    leaving: Leaving::OnItsWay,
                    takes_off: false,
                };
                let flight = (entry, leg, period);
                if !at.is_start {
                    let forbidden = wanted
                        .forbidden
                        .known_times((world, terms.request), active, flight, at.known_until_s)
                        .iter();
                    self.openings
                        .extend(forbidden.filter_map(|&forbidden| at.opening(forbidden, 0.0)));
                    continue;
                }
                // Who begins at a node is not bound by all that closes it: something may open while
                // the node is closed.
                intervals.clear();
                let request = (world, terms.request);
                wanted
                    .forbidden
                    .add(request, (entry, active), within_s, &mut intervals);
                let opens = intervals
                    .iter()
                    .map(|&(_, opens_s)| (f64::NEG_INFINITY, opens_s));
                self.openings
                    .extend(opens.filter_map(|opening| at.opening(opening, 0.0)));
            }
        }
        self.intervals = intervals;
    }

    /// Who takes off waits for those who pass the node, which those who pass it themselves do not.
    fn collect_take_offs(&mut self, wanted: &mut Wanted<'_>, at: &At) {
        let world = wanted.terms.world;
        if !world.keeps_apart() || !wanted.active.has_node(at.node) {
            return;
        }
        let request = (world, wanted.terms.request);
        let passes = wanted
            .forbidden
            .passes(request, at.node, at.known_until_s)
            .iter();
        let opens = passes.map(|&(_, until_s)| (f64::NEG_INFINITY, until_s));
        self.openings
            .extend(opens.filter_map(|opening| at.opening(opening, 0.0)));
    }

    fn collect_pads(&mut self, wanted: &Wanted<'_>, at: &At) {
        let (pads, legs) = (wanted.terms.world.pads, wanted.terms.world.legs);
        let handling_s = wanted.terms.handling_s(at.node);
        let vertical_s = legs.vertical_s(at.node);
        for (rises_s, until_s) in pads.rises(at.node) {
            // No stop takes less.
            if until_s >= rises_s + handling_s - ROUNDING_S {
                let at_s = rises_s - vertical_s;
                let stop_s = handling_s + 2.0 * vertical_s;
                self.openings
                    .extend(at.opening((f64::NEG_INFINITY, at_s), stop_s));
            }
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
        (terms, active, forbidden): (&Expander<'_>, &ActiveTraffic, &mut ForbiddenTimes),
        node: NodeIx,
        earlier: &ChargingLabel,
        later: &ChargingLabel,
        best: Value,
        looked_at: &mut usize,
    ) -> bool {
        let mut wanted = Wanted {
            terms,
            active,
            forbidden,
            best,
        };
        if self.stops_s.is_empty() {
            list_stops_s(terms, &mut self.stops_s);
        }
        let remembered = node.at() % PARTED_BY;
        let stops_s = std::mem::take(&mut self.stops_s);
        let way_on = WayOn::new(terms, &stops_s, node, (earlier, later), best);
        *looked_at += 1;
        let parted_by = self.parted_by[remembered];
        let is_parted = self
            .openings
            .get(parted_by as usize)
            .is_some_and(|it| way_on.may_use(it));
        let found = match is_parted {
            true => Some(parted_by),
            false => self.first_usable(&mut wanted, node, &way_on, looked_at),
        };
        self.stops_s = stops_s;
        if let Some(opening) = found {
            self.parted_by[remembered] = opening;
        }
        found.is_some()
    }

    /// An opening that parts two families at a node: where traffic is dense one on the way down the tree or around the node
    /// does, and most need never be collected.
    fn first_usable(
        &mut self,
        wanted: &mut Wanted<'_>,
        node: NodeIx,
        way_on: &WayOn<'_>,
        looked_at: &mut usize,
    ) -> Option<u32> {
        if !self.is_complete {
            let mut at = Some(node);
            while let Some(node) = at {
                let found = self.usable_at(wanted, node, way_on, looked_at);
                if found.is_some() {
                    return found;
                }
                let next = wanted.terms.potentials.next(node);
                at = next.map(|leg| wanted.terms.world.legs.leg(leg).to);
            }
            let found = self.usable_around(wanted, node, way_on, looked_at);
            if found.is_some() {
                return found;
            }
            self.list(wanted);
            if self.looked_at < NODES_LOOKED_AT {
                self.looked_at += self.nodes.len();
                return self.usable_in_reach(wanted, way_on, looked_at);
            }
            self.complete(wanted);
        }
        let (first_s, last_s) = way_on.usable_s();
        let first = self.by_time.partition_point(|&(at_s, _)| at_s <= first_s);
        let mut within = self.by_time[first..]
            .iter()
            .take_while(|&&(at_s, _)| at_s <= last_s);
        let found = within.find(|&&(_, number)| {
            *looked_at += 1;
            way_on.may_use(&self.openings[number as usize])
        });
        found.map(|&(_, number)| number)
    }

    /// One at a node.
    fn usable_at(
        &mut self,
        wanted: &mut Wanted<'_>,
        node: NodeIx,
        way_on: &WayOn<'_>,
        looked_at: &mut usize,
    ) -> Option<u32> {
        let (first_s, last_s) = way_on.usable_s();
        let mut from_s = first_s;
        loop {
            let until_s = known_until_s(wanted.terms.request, from_s.next_up());
            let (range, known_until_s) = self.collect_at(wanted, node, until_s);
            let there = &self.openings[range.clone()];
            let first = there.partition_point(|opening| opening.at_s <= from_s);
            let mut within = there[first..]
                .iter()
                .take_while(|opening| opening.at_s <= last_s);
            let place = within.position(|opening| {
                *looked_at += 1;
                way_on.may_use(opening)
            });
            if let Some(place) = place {
                return Some((range.start + first + place) as u32);
            }
            if last_s <= known_until_s {
                return None;
            }
            from_s = known_until_s;
        }
    }

    /// One at the nodes that are the fewest legs away.
    fn usable_around(
        &mut self,
        wanted: &mut Wanted<'_>,
        node: NodeIx,
        way_on: &WayOn<'_>,
        looked_at: &mut usize,
    ) -> Option<u32> {
        let legs = wanted.terms.world.legs;
        let (mut around, mut found, mut looked) = ([node; AROUND], 1, 0);
        while looked < found {
            for leg in legs.from(around[looked]) {
                let to = legs.leg(leg).to;
                if found == AROUND || around[..found].contains(&to) {
                    continue;
                }
                let usable = self.usable_at(wanted, to, way_on, looked_at);
                if usable.is_some() {
                    return usable;
                }
                around[found] = to;
                found += 1;
            }
            looked += 1;
        }
        None
    }

    /// One anywhere, though only the openings of nodes are collected at which some may be of use.
    fn usable_in_reach(
        &mut self,
        wanted: &mut Wanted<'_>,
        way_on: &WayOn<'_>,
        looked_at: &mut usize,
    ) -> Option<u32> {
        let nodes = std::mem::take(&mut self.nodes);
        let found = nodes.iter().find_map(|&node| {
            *looked_at += 1;
            let there = there(wanted.terms, node);
            match way_on.may_use_any(&there) {
                true => self.usable_at(wanted, node, way_on, looked_at),
                false => None,
            }
        });
        self.nodes = nodes;
        let mut everywhere = self.everywhere.clone();
        found.or_else(|| everywhere.find(|&turn| way_on.may_use(&self.openings[turn as usize])))
    }
}
