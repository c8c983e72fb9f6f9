//! When legs may not be entered by who flies past their first node, kept while a request is searched.
//!
//! Where traffic is dense, a search looks at a leg for many labels, and each look at all that comes near the leg takes long.
//! So the second look keeps what forbids the leg at any time, and those that follow find their times in it.

use super::active_traffic::ActiveTraffic;
use super::entry::{Entry, Leaving};
use super::obstacles::join;
use super::request::{FlightRequest, FlightWorld};
use crate::network::SegmentIx;
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

/// The forbidden entry times of the legs of a request, as open intervals.
#[derive(Debug, Default)]
pub(super) struct ForbiddenTimes {
    /// By period of the wind and leg.
    legs: Vec<Known>,
    intervals: Vec<(f64, f64)>,
    /// Those of a leg that is being looked at.
    found: Vec<(f64, f64)>,
    generation: u32,
}

impl ForbiddenTimes {
    /// Forgets the request before.
    pub(super) fn clear(&mut self) {
        self.intervals.clear();
        self.generation = self.generation.wrapping_add(1);
        if self.generation == 0 {
            self.legs.clear();
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
            let began_s = request.began_s;
            let there = (entry, active);
            let obstacles = world.obstacles;
            obstacles.forbidden(world, began_s, there, within_s, intervals);
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

    /// Adds what forbids a leg at any time.
    fn look(
        &mut self,
        (world, request): InWorld<'_>,
        active: &ActiveTraffic,
        entry: Entry,
    ) -> Range<u32> {
        let starts = request.starts.iter().map(|start| start.at_s);
        let within_s = (starts.fold(f64::INFINITY, f64::min), f64::INFINITY);
        let began_s = request.began_s;
        self.found.clear();
        let obstacles = world.obstacles;
        obstacles.forbidden(world, began_s, (entry, active), within_s, &mut self.found);
        join(&mut self.found);
        let first = self.intervals.len();
        self.intervals.extend_from_slice(&self.found);
        first as u32..self.intervals.len() as u32
    }
}
