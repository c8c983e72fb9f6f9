//! When other plans are near legs and above nodes, kept from one search to the next.
//!
//! What comes near a leg is spread over its segment and the dozens that cross it. Searches look at the same legs again and
//! again while few plans change, so their memory keeps one list for each. A list holds as long as those segments have the very
//! same legs, which their addresses tell.

use super::entry::Entry;
use super::occupancy::{OthersOccupancy, SegmentLegs};
use super::request::FlightWorld;
use super::separation::Approach;
use crate::flight::{SharedCrossings, TrafficLeg};
use crate::network::{NodeIx, SegmentIx};
use std::sync::Arc;

/// An instant on the clock of plans is rounded by less, in seconds.
const ROUNDING_S: f64 = 1e-3;

/// After a request with which more approaches and segments of lists are kept, all are forgotten: they take about 40 MB.
const MOST_KEPT: usize = 500_000;

/// An approach, and whose leg it is.
#[derive(Clone, Copy, Debug)]
struct Kept {
    approach: Approach,
    /// Of the plan whose leg it is.
    hash: u64,
    /// Which of the segments that the list is of, and which of the legs on it.
    part: u32,
    leg: u32,
}

/// What comes near a segment, or above a node.
#[derive(Debug, Default)]
struct Near {
    /// The last generation in which it holds, and that in which it was last looked at.
    holds_in: u32,
    looked_at_in: u32,
    /// The legs on the segments that it is of.
    parts: Vec<Option<Arc<SegmentLegs>>>,
    /// By when they begin.
    all: Vec<Kept>,
    /// None of them takes longer, in seconds.
    longest_s: f64,
    /// From where on they were asked for: those that are asked for next begin close by.
    first: usize,
}

/// What was near where, when it was last asked for.
#[derive(Debug, Default)]
pub(super) struct NearTraffic {
    /// What it depends on besides the legs.
    crossings: SharedCrossings,
    headways_s: [f64; 2],
    segments: Vec<Near>,
    nodes: Vec<Near>,
    /// As long as no leg changes.
    generation: u32,
    state_of_legs: Arc<()>,
    /// How many approaches, and segments of lists, are kept.
    kept: usize,
}

impl NearTraffic {
    /// Begins a request, with no more kept than there may be.
    pub(super) fn begin_request(&mut self) {
        if self.kept > MOST_KEPT {
            self.forget();
        }
    }

    fn forget(&mut self) {
        self.segments.clear();
        self.nodes.clear();
        self.generation = 1;
        self.kept = 0;
    }

    /// Where legs have changed, what is kept has to be held against them; where others keep apart by other rules, or on another
    /// network, all is forgotten.
    fn hold_against(&mut self, world: &FlightWorld<'_>) {
        let state_of_legs = world.obstacles.others().state_of_legs();
        let headways_s = [world.rules.headway_s, world.rules.node_headway_s];
        let is_there = self.crossings.is_same(world.crossings) && self.headways_s == headways_s;
        if is_there && Arc::ptr_eq(&self.state_of_legs, state_of_legs) {
            return;
        }
        self.state_of_legs = state_of_legs.clone();
        self.generation = self.generation.wrapping_add(1);
        if !is_there || self.generation == 0 {
            self.forget();
            self.crossings = world.crossings.clone();
            self.headways_s = headways_s;
        }
    }

    /// Tells `take` what forbids entries of a leg within a stretch of time, on its segment and where others cross it: as
    /// [`Separation::on_segment`](super::separation::Separation::on_segment) does.
    pub(super) fn on_segment(
        &mut self,
        world: &FlightWorld<'_>,
        entry: Entry,
        within_s: (f64, f64),
        take: &mut impl FnMut(f64, f64),
    ) {
        self.hold_against(world);
        let segment = SegmentIx(entry.segment);
        if self.segments.len() <= segment.at() {
            let count = world.topology.segment_count();
            self.segments.resize_with(count, Near::default);
        }
        let near = &mut self.segments[segment.at()];
        let others = world.obstacles.others();
        if near.holds_in != self.generation {
            let separation = world.separation();
            let crossings = separation.crossings.on(segment);
            let across = crossings.iter().map(|crossing| crossing.other);
            let parts = std::iter::once(segment).chain(across);
            if !near.holds(others, parts.clone()) {
                if near.is_first_look(self.generation) {
                    return separation.on_segment(others, entry, within_s, &mut |near| {
                        if meets((near.from_s, near.until_s), within_s) {
                            take(near.from_s, near.until_s);
                        }
                    });
                }
                self.kept -= near.kept();
                let first_node = world.topology.segment(segment).from;
                near.gather(others, parts, |part, (leg, is_uncertain), put| {
                    match part.checked_sub(1) {
                        None => {
                            let both = separation.along(first_node, leg, is_uncertain);
                            both.into_iter().for_each(put);
                        }
                        Some(place) => {
                            put(separation.across(&crossings[place], leg, is_uncertain));
                        }
                    }
                });
                self.kept += near.kept();
            }
            near.holds_in = self.generation;
        }
        let from_first = world.topology.segment(segment).from == entry.from;
        near.each(others, (from_first, entry.time_s), within_s, take);
    }

    /// Tells `take` when nobody may be above a node within a stretch of time.
    pub(super) fn above(
        &mut self,
        world: &FlightWorld<'_>,
        node: NodeIx,
        within_s: (f64, f64),
        take: &mut impl FnMut(f64, f64),
    ) {
        self.hold_against(world);
        if self.nodes.len() <= node.at() {
            let count = world.topology.node_count();
            self.nodes.resize_with(count, Near::default);
        }
        let near = &mut self.nodes[node.at()];
        let others = world.obstacles.others();
        if near.holds_in != self.generation {
            let separation = world.separation();
            let parts = world.topology.arcs(node).iter().map(|arc| arc.segment);
            if !near.holds(others, parts.clone()) {
                if near.is_first_look(self.generation) {
                    return separation.at_node(others, (node, 0.0), within_s, &mut |near| {
                        if meets((near.from_s, near.until_s), within_s) {
                            take(near.from_s, near.until_s);
                        }
                    });
                }
                self.kept -= near.kept();
                near.gather(others, parts, |_, (leg, is_uncertain), put| {
                    put(separation.above(node, leg, is_uncertain));
                });
                self.kept += near.kept();
            }
            near.holds_in = self.generation;
        }
        near.each(others, (true, 0.0), within_s, take);
    }
}

impl Near {
    fn kept(&self) -> usize {
        self.all.len() + self.parts.len()
    }

    /// Whether it has not been looked at since legs have changed. One look is not worth gathering all.
    fn is_first_look(&mut self, generation: u32) -> bool {
        std::mem::replace(&mut self.looked_at_in, generation) != generation
    }

    /// Whether the segments have the very legs that they had.
    fn holds(
        &self,
        others: &OthersOccupancy,
        mut segments: impl Iterator<Item = SegmentIx>,
    ) -> bool {
        let mut parts = self.parts.iter();
        segments.all(|segment| match (parts.next(), others.all_on(segment)) {
            (Some(Some(kept)), Some(there)) => Arc::ptr_eq(kept, there),
            (Some(None), None) => true,
            _ => false,
        })
    }

    /// Gathers what comes near on these segments.
    fn gather(
        &mut self,
        others: &OthersOccupancy,
        segments: impl Iterator<Item = SegmentIx>,
        approaches: impl Fn(usize, (&TrafficLeg, bool), &mut dyn FnMut(Approach)),
    ) {
        let Self {
            parts,
            all,
            longest_s,
            ..
        } = self;
        parts.clear();
        all.clear();
        *longest_s = 0.0;
        for (part, segment) in segments.enumerate() {
            let there = others.all_on(segment).cloned();
            let legs = there.iter().flat_map(|legs| legs.by_entry());
            for (leg, place) in legs.zip(0..) {
                let flown = leg.since(segment, 0.0);
                approaches(part, (&flown, leg.is_uncertain), &mut |approach| {
                    *longest_s = longest_s.max(approach.lasts_s());
                    all.push(Kept {
                        approach,
                        hash: leg.plan.hash(),
                        part: part as u32,
                        leg: place,
                    });
                });
            }
            parts.push(there);
        }
        let begins_s = |kept: &Kept| kept.approach.begins_s();
        self.all
            .sort_unstable_by(|one, other| begins_s(one).total_cmp(&begins_s(other)));
    }

    /// Tells `take` when a leg that takes so long may not be entered, within a stretch of time.
    fn each(
        &mut self,
        others: &OthersOccupancy,
        (from_first, time_s): (bool, f64),
        within_s: (f64, f64),
        take: &mut impl FnMut(f64, f64),
    ) {
        let zero_s = others.zero_s();
        let earliest_s = within_s.0 + zero_s - self.longest_s - ROUNDING_S;
        let latest_s = within_s.1 + zero_s + time_s + ROUNDING_S;
        self.seek(earliest_s);
        for kept in &self.all[self.first..] {
            if kept.approach.begins_s() > latest_s {
                break;
            }
            let Some((from_s, until_s)) = kept.approach.of_entry(from_first, time_s, zero_s) else {
                continue;
            };
            if meets((from_s, until_s), within_s) && !self.is_own(others, kept) {
                take(from_s, until_s);
            }
        }
    }

    /// Finds the first that begins at an instant or later.
    fn seek(&mut self, from_s: f64) {
        let is_before = |kept: &Kept| kept.approach.begins_s() < from_s;
        let mut first = self.first.min(self.all.len());
        while first > 0 && !is_before(&self.all[first - 1]) {
            first -= 1;
        }
        while self.all.get(first).is_some_and(is_before) {
            first += 1;
        }
        self.first = first;
    }

    /// Whether it is the drone's own leg.
    #[inline]
    fn is_own(&self, others: &OthersOccupancy, kept: &Kept) -> bool {
        if !others.may_be_own(kept.hash) {
            return false;
        }
        let part = self.parts[kept.part as usize].as_ref();
        part.is_some_and(|legs| others.is_own(&legs.by_entry()[kept.leg as usize].plan))
    }
}

/// Whether an interval, ends included, has an instant of a stretch of time.
#[inline]
fn meets((from_s, until_s): (f64, f64), within_s: (f64, f64)) -> bool {
    from_s <= within_s.1 && until_s >= within_s.0
}
