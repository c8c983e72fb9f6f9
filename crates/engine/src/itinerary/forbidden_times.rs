//! When legs may not be entered by who flies past their first node, kept while a request is searched.
//!
//! Where traffic is dense, a search looks at a leg for many labels, and each look at all that comes near the leg takes long.
//! So the second look keeps what forbids the leg at any time, and those that follow find their times in it. When others pass a
//! node is the same for all legs that lead there: the first of them keeps it.

use super::active_traffic::ActiveTraffic;
use super::entry::{Entry, Leaving};
use super::obstacles::join;
use super::request::{FlightRequest, FlightWorld};
use crate::network::{NodeIx, SegmentIx};
use std::ops::Range;

/// A request in its world.
type InWorld<'a> = (&'a FlightWorld<'a>, &'a FlightRequest<'a>);

/// What is known of a leg in one wind.
#[derive(Clone, Debug, Default)]
struct Known {
    /// The request that it is known for.
    generation: u32,
    /// Where others count: on the segment, and at its last node.
    others: (bool, bool),
    /// `None` after the first look.
    intervals: Option<Range<u32>>,
}

/// When others pass a node.
#[derive(Clone, Debug, Default)]
struct Passes {
    /// The request that it is known for.
    generation: u32,
    intervals: Range<u32>,
}

/// The forbidden entry times of the legs of a request, as open intervals.
#[derive(Debug, Default)]
pub(super) struct ForbiddenTimes {
    /// By period of the wind and leg.
    legs: Vec<Known>,
    /// By node.
    passes: Vec<Passes>,
    intervals: Vec<(f64, f64)>,
    /// Those of a leg that is being looked at.
    found: Vec<(f64, f64)>,
    /// Those of a node that is being looked at, which may be one of that leg's.
    passing: Vec<(f64, f64)>,
    generation: u32,
}

impl ForbiddenTimes {
    /// Forgets the request before.
    pub(super) fn clear(&mut self) {
        self.intervals.clear();
        self.generation = self.generation.wrapping_add(1);
        if self.generation == 0 {
            self.legs.clear();
            self.passes.clear();
            self.generation = 1;
        }
    }

    /// Puts the times at which a leg in a period of the wind may not be entered, as far as they meet those within which it may
    /// be, in place of the intervals: by the first of them.
    pub(super) fn put(
        &mut self,
        (world, request): InWorld<'_>,
        active: &ActiveTraffic,
        (entry, leg, period): (Entry, u32, usize),
        within_s: (f64, f64),
        intervals: &mut Vec<(f64, f64)>,
    ) {
        intervals.clear();
        let flies_past = entry.leaving == Leaving::OnItsWay && !entry.takes_off;
        if !flies_past || self.is_first_look(world, leg, period) {
            self.add((world, request), (entry, active), within_s, intervals);
            intervals.sort_by(|one, other| one.0.total_cmp(&other.0));
            return;
        }
        let known = self.always((world, request), active, (entry, leg, period));
        let first = known.partition_point(|&(_, until_s)| until_s < within_s.0);
        let met = known[first..].iter();
        intervals.extend(met.take_while(|&&(from_s, _)| from_s <= within_s.1));
    }

    /// The times, from the earliest start of the request on, at which a leg may not be entered by who flies past its first
    /// node: joined, in order.
    pub(super) fn always(
        &mut self,
        (world, request): InWorld<'_>,
        active: &ActiveTraffic,
        (entry, leg, period): (Entry, u32, usize),
    ) -> &[(f64, f64)] {
        let generation = self.generation;
        let others = (
            active.has_segment(SegmentIx(entry.segment)),
            active.has_node(entry.to),
        );
        let known = self.known(world, leg, period);
        let kept = known.intervals.clone();
        let kept = kept.filter(|_| (known.generation, known.others) == (generation, others));
        let range = kept.unwrap_or_else(|| {
            let range = self.look((world, request), active, entry);
            *self.known(world, leg, period) = Known {
                generation,
                others,
                intervals: Some(range.clone()),
            };
            range
        });
        &self.intervals[range.start as usize..range.end as usize]
    }

    fn known(&mut self, world: &FlightWorld<'_>, leg: u32, period: usize) -> &mut Known {
        let leg_count = world.legs.len();
        let place = period * leg_count + leg as usize;
        if place >= self.legs.len() {
            self.legs.resize((period + 1) * leg_count, Known::default());
        }
        &mut self.legs[place]
    }

    fn is_first_look(&mut self, world: &FlightWorld<'_>, leg: u32, period: usize) -> bool {
        let generation = self.generation;
        let known = self.known(world, leg, period);
        let is_first = known.generation != generation;
        if is_first {
            *known = Known {
                generation,
                ..Known::default()
            };
        }
        is_first
    }

    /// Keeps what forbids a leg at any time.
    fn look(
        &mut self,
        (world, request): InWorld<'_>,
        active: &ActiveTraffic,
        entry: Entry,
    ) -> Range<u32> {
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        let within_s = from_the_start(request);
        self.add((world, request), (entry, active), within_s, &mut found);
        let range = self.keep(&mut found);
        self.found = found;
        range
    }

    /// Adds what forbids a leg, in any order, as far as it meets the times within which it may be entered.
    pub(super) fn add(
        &mut self,
        (world, request): InWorld<'_>,
        (entry, active): (Entry, &ActiveTraffic),
        within_s: (f64, f64),
        intervals: &mut Vec<(f64, f64)>,
    ) {
        let mut take = |from_s, until_s| {
            if from_s <= within_s.1 && until_s >= within_s.0 {
                intervals.push((from_s, until_s));
            }
        };
        let obstacles = world.obstacles;
        obstacles.each_closed(world, request.began_s, entry, |_, from_s, until_s| {
            take(from_s, until_s);
        });
        if !world.keeps_apart() {
            return;
        }
        if active.has_segment(SegmentIx(entry.segment)) {
            let (separation, others) = (world.separation(), obstacles.others());
            separation.on_segment(others, entry, within_s, &mut |near| {
                take(near.from_s, near.until_s);
            });
        }
        let lands = active.has_node(entry.to);
        let lands = lands.then_some((entry.to, entry.time_s));
        let takes_off = entry.takes_off && active.has_node(entry.from);
        let takes_off = takes_off.then_some((entry.from, 0.0));
        for (node, after_s) in lands.into_iter().chain(takes_off) {
            let passes = self.passes((world, request), node);
            let first = passes.partition_point(|&(_, until_s)| until_s - after_s < within_s.0);
            let before = passes[first..]
                .iter()
                .map(|&(from_s, until_s)| (from_s - after_s, until_s - after_s));
            intervals.extend(before.take_while(|&(from_s, _)| from_s <= within_s.1));
        }
    }

    /// When nobody may be above a node as others are, from the earliest start of the request on: joined, in order.
    pub(super) fn passes(&mut self, (world, request): InWorld<'_>, node: NodeIx) -> &[(f64, f64)] {
        if node.at() >= self.passes.len() {
            let node_count = world.topology.node_count();
            self.passes.resize(node_count, Passes::default());
        }
        if self.passes[node.at()].generation != self.generation {
            let mut found = std::mem::take(&mut self.passing);
            found.clear();
            let (separation, others) = (world.separation(), world.obstacles.others());
            separation.at_node(others, (node, 0.0), from_the_start(request), &mut |near| {
                found.push((near.from_s, near.until_s));
            });
            self.passes[node.at()] = Passes {
                generation: self.generation,
                intervals: self.keep(&mut found),
            };
            self.passing = found;
        }
        let range = &self.passes[node.at()].intervals;
        &self.intervals[range.start as usize..range.end as usize]
    }

    /// Keeps intervals, joined.
    fn keep(&mut self, found: &mut Vec<(f64, f64)>) -> Range<u32> {
        join(found);
        let first = self.intervals.len();
        self.intervals.extend_from_slice(found);
        first as u32..self.intervals.len() as u32
    }
}

/// From the earliest start of a request on.
fn from_the_start(request: &FlightRequest<'_>) -> (f64, f64) {
    let starts = request.starts.iter().map(|start| start.at_s);
    (starts.fold(f64::INFINITY, f64::min), f64::INFINITY)
}
