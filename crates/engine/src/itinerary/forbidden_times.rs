//! When legs may not be entered by who flies past their first node, kept while a request is searched.
//!
//! Where traffic is dense, a search looks at a leg for many labels, and each look at all that comes near the leg takes long.
//! So the second look keeps what forbids the leg, and those that follow find their times in it. When others pass a
//! node is the same for all legs that lead there: the first of them keeps it. Most labels are soon after the start, so what is
//! kept reaches as far as has been asked for, in a few steps.

use super::active_traffic::ActiveTraffic;
use super::entry::{Entry, Leaving};
use super::near_traffic::NearTraffic;
use super::obstacles::join;
use super::request::{FlightRequest, FlightWorld};
use crate::network::{NodeIx, SegmentIx};
use std::ops::Range;

/// So far after the start of a request are the times that are kept, in seconds; or they are all.
const AHEAD_S: [f64; 2] = [128.0, 1_024.0];

/// A request in its world.
type InWorld<'a> = (&'a FlightWorld<'a>, &'a FlightRequest<'a>);

/// What is known of a leg in one wind.
#[derive(Clone, Debug, Default)]
struct Known {
    /// The request that it is known for.
    generation: u32,
    /// Where others count: on the segment, and at its last node.
    others: (bool, bool),
    /// How long the leg takes, which is less where hovering is free than where the wind counts that blows then.
    time_s: f64,
    /// Until when, in seconds.
    until_s: f64,
    /// `None` after the first look.
    intervals: Option<Range<u32>>,
}

/// When others pass a node.
#[derive(Clone, Debug, Default)]
struct Passes {
    /// The request that it is known for.
    generation: u32,
    /// Until when, in seconds.
    until_s: f64,
    intervals: Range<u32>,
}

/// The forbidden entry times of the legs of a request, as open intervals.
#[derive(Debug, Default)]
pub(super) struct ForbiddenTimes {
    /// By period of the wind and leg.
    legs: Vec<Known>,
    /// By node.
    passes: Vec<Passes>,
    near: NearTraffic,
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
        self.near.begin_request();
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
        let until_s = known_until_s(request, within_s.1);
        let known = self.known_times((world, request), active, (entry, leg, period), until_s);
        let first = known.partition_point(|&(_, until_s)| until_s < within_s.0);
        let met = known[first..].iter();
        intervals.extend(met.take_while(|&&(from_s, _)| from_s <= within_s.1));
    }

    /// The times, from the earliest start of the request until an instant, at which a leg may not be entered by who flies past
    /// its first node: joined, in order. One that ends later than the instant may go on for longer.
    pub(super) fn known_times(
        &mut self,
        (world, request): InWorld<'_>,
        active: &ActiveTraffic,
        (entry, leg, period): (Entry, u32, usize),
        until_s: f64,
    ) -> &[(f64, f64)] {
        let generation = self.generation;
        let others = (
            active.has_segment(SegmentIx(entry.segment)),
            active.has_node(entry.to),
        );
        let known = self.known(world, leg, period);
        let kept = known.intervals.clone();
        let is_known =
            (known.generation, known.others, known.time_s) == (generation, others, entry.time_s);
        let is_far = known.until_s >= until_s;
        let range = kept.filter(|_| is_known && is_far).unwrap_or_else(|| {
            let range = self.look((world, request), active, entry, until_s);
            *self.known(world, leg, period) = Known {
                generation,
                others,
                time_s: entry.time_s,
                until_s,
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

    /// Keeps what forbids a leg until an instant.
    fn look(
        &mut self,
        (world, request): InWorld<'_>,
        active: &ActiveTraffic,
        entry: Entry,
        until_s: f64,
    ) -> Range<u32> {
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        let within_s = (earliest_start_s(request), until_s);
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
            self.near.on_segment(world, entry, within_s, &mut take);
        }
        let lands = active.has_node(entry.to);
        let lands = lands.then_some((entry.to, entry.time_s));
        let takes_off = entry.takes_off && active.has_node(entry.from);
        let takes_off = takes_off.then_some((entry.from, 0.0));
        for (node, after_s) in lands.into_iter().chain(takes_off) {
            let until_s = known_until_s(request, within_s.1 + after_s);
            let passes = self.passes((world, request), node, until_s);
            let first = passes.partition_point(|&(_, until_s)| until_s - after_s < within_s.0);
            let before = passes[first..]
                .iter()
                .map(|&(from_s, until_s)| (from_s - after_s, until_s - after_s));
            intervals.extend(before.take_while(|&(from_s, _)| from_s <= within_s.1));
        }
    }

    /// When nobody may be above a node as others are, from the earliest start of the request until an instant: joined, in order.
    /// One that ends later than the instant may go on for longer.
    pub(super) fn passes(
        &mut self,
        (world, request): InWorld<'_>,
        node: NodeIx,
        until_s: f64,
    ) -> &[(f64, f64)] {
        if node.at() >= self.passes.len() {
            let node_count = world.topology.node_count();
            self.passes.resize(node_count, Passes::default());
        }
        let known = &self.passes[node.at()];
        if known.generation != self.generation || known.until_s < until_s {
            let mut found = std::mem::take(&mut self.passing);
            found.clear();
            let within_s = (earliest_start_s(request), until_s);
            let mut take = |from_s, until_s| found.push((from_s, until_s));
            if world.rules.node_headway_s > 0.0 {
                self.near.above(world, node, within_s, &mut take);
            }
            self.passes[node.at()] = Passes {
                generation: self.generation,
                until_s,
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

/// When the first start of a request is, in seconds.
fn earliest_start_s(request: &FlightRequest<'_>) -> f64 {
    let starts = request.starts.iter().map(|start| start.at_s);
    starts.fold(f64::INFINITY, f64::min)
}

/// Until when times are looked up that are asked for until an instant: few different ones, so that what is kept is seldom not far
/// enough.
pub(super) fn known_until_s(request: &FlightRequest<'_>, until_s: f64) -> f64 {
    let start_s = earliest_start_s(request);
    let ahead = AHEAD_S.iter().map(|ahead_s| start_s + ahead_s);
    ahead.fold(f64::INFINITY, |best, end_s| match end_s >= until_s {
        true => best.min(end_s),
        false => best,
    })
}
