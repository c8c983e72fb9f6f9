//! What may not be flown when: closures with their windows and the legs of other plans, by segment and node.
//!
//! For a search each of them is an open interval of forbidden entry times of a directed leg; touching its ends is allowed.
//! A leg occupies its corridor from the start of a take-off at its first node to the end of a
//! landing at its last, whether the drone does so or passes.

use super::active_traffic::ActiveTraffic;
use super::closed_windows::{ClosedWindow, ClosedWindows};
use super::entry::{Entry, Leaving};
use super::occupancy::OthersOccupancy;
use super::request::FlightWorld;
use super::separation::Nearness;
use crate::flight::{FlightRules, Situation, TrafficLeg};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::planted::{self, Bug};
use std::sync::Arc;

/// Closures of a situation and the legs of other plans, compiled for searches. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Obstacles {
    closed: Arc<ClosedWindows>,
    others: OthersOccupancy,
}

/// Whether a window of a node binds a drone that leaves it.
#[inline]
fn binds(window: &ClosedWindow, leaving: Leaving) -> bool {
    match leaving {
        Leaving::OnItsWay => true,
        Leaving::FromTheAir => false,
        // The windows of zones are widened, and no others.
        Leaving::FromTheGround => window.widened,
    }
}

/// What forbids an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Forbids {
    /// A closure of the situation.
    Closure(usize),
    /// A leg of another plan.
    Traffic(TrafficLeg),
}

/// What a leg occupies around its entry.
#[derive(Clone, Copy, Debug)]
struct Span {
    began_s: f64,
    /// Before the entry.
    takes_off_s: f64,
    /// After it.
    occupied_s: f64,
}

impl Span {
    /// The entry times at which the leg would meet a window, widened by the margins of when the leg is left.
    fn forbidden(&self, window: &ClosedWindow, rules: &FlightRules) -> (f64, f64) {
        let (margin_s, growth) = match window.widened {
            true => (rules.time_margin_s, rules.time_margin_growth),
            false => (0.0, 0.0),
        };
        // Entered at t, the leg is left at l = t + occupied: the window reaches from a - m - g (l - began) to b + m + g (l - began).
        let before_s = window.from_s - margin_s + growth * self.began_s;
        let leaves_later_s = growth * (self.occupied_s - self.began_s);
        if planted::is(Bug::MarginAtEntry) {
            let after_s = window.until_s + margin_s - growth * self.began_s + self.takes_off_s;
            let until_s = after_s / (1.0 - growth);
            return ((before_s - self.occupied_s) / (1.0 + growth), until_s);
        }
        let after_s = window.until_s + margin_s + leaves_later_s + self.takes_off_s;
        // A margin that grows as fast as the time is never left behind.
        let until_s = match growth < 1.0 {
            true => after_s / (1.0 - growth),
            false => f64::INFINITY,
        };
        (before_s / (1.0 + growth) - self.occupied_s, until_s)
    }
}

impl Obstacles {
    /// Compiles the closures and the traffic of a situation.
    pub fn of(topology: &Topology, situation: &Situation) -> Self {
        Self {
            closed: Arc::new(ClosedWindows::of(topology, &situation.closures)),
            others: OthersOccupancy::from_facts(&[], &situation.traffic),
        }
    }

    /// Closures among what other plans take: nothing is compiled.
    pub(super) fn among(closed: Arc<ClosedWindows>, others: OthersOccupancy) -> Self {
        Self { closed, others }
    }

    /// The closures.
    pub(super) fn closed(&self) -> &ClosedWindows {
        &self.closed
    }

    /// True when nothing is ever in the way of a leg, of others where they count.
    #[inline]
    pub(super) fn is_clear(
        &self,
        active: &ActiveTraffic,
        segment: SegmentIx,
        from: NodeIx,
        to: NodeIx,
    ) -> bool {
        let may_meet = self.others.is_in_the_air() && active.concerns(segment, from, to);
        self.closed.is_open(segment.0, from, to) && !may_meet
    }

    /// What other plans take.
    pub(super) fn others(&self) -> &OthersOccupancy {
        &self.others
    }

    /// Tells `take` every interval of forbidden entry times of a leg, with what forbids it.
    pub(super) fn each_forbidden(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        mut take: impl FnMut(Forbids, f64, f64),
    ) {
        self.each_closed(world, began_s, entry, |closure, from_s, until_s| {
            take(Forbids::Closure(closure), from_s, until_s);
        });
        if world.keeps_apart() {
            let mut near = |near: Nearness<'_>| {
                take(Forbids::Traffic(near.leg), near.from_s, near.until_s);
            };
            let always_s = (f64::NEG_INFINITY, f64::INFINITY);
            let everywhere = ActiveTraffic::everywhere();
            let separation = world.separation();
            separation.each(&self.others, &everywhere, entry, always_s, &mut near);
        }
    }

    /// Tells `take` the number of every closure that forbids entries of a leg, and between which instants.
    pub(super) fn each_closed(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        mut take: impl FnMut(usize, f64, f64),
    ) {
        let span = Span {
            began_s,
            takes_off_s: world.legs.vertical_s(entry.from),
            occupied_s: entry.time_s + world.legs.vertical_s(entry.to),
        };
        let mut close = |windows: &[ClosedWindow], leaving: Leaving| {
            for window in windows.iter().filter(|window| binds(window, leaving)) {
                let (from_s, until_s) = span.forbidden(window, world.rules);
                if from_s < until_s {
                    take(window.closure as usize, from_s, until_s);
                }
            }
        };
        close(self.closed.of_segment(entry.segment), Leaving::OnItsWay);
        close(self.closed.of_node(entry.to), Leaving::OnItsWay);
        close(self.closed.of_node(entry.from), entry.leaving);
    }

    /// Whether closures leave open at least one instant of these at which a leg could be entered. What they forbid is left in
    /// the intervals, joined.
    pub(super) fn opens_within(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        (first_s, last_s): (f64, f64),
        intervals: &mut Vec<(f64, f64)>,
    ) -> bool {
        intervals.clear();
        if self.closed.is_open(entry.segment, entry.from, entry.to) {
            return true;
        }
        self.each_closed(world, began_s, entry, |_, from_s, until_s| {
            intervals.push((from_s, until_s));
        });
        join(intervals);
        let is_last = |until_s: f64| until_s > last_s || until_s == f64::INFINITY;
        let is_all = |&(from_s, until_s): &(f64, f64)| from_s < first_s && is_last(until_s);
        !intervals.iter().any(is_all)
    }

    /// True where something without an end closes a segment or one of its nodes to all who pass there from an instant on: neither
    /// direction opens after that, whatever it takes.
    pub(super) fn is_shut_for_good(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        segment: SegmentIx,
        from_s: f64,
    ) -> bool {
        // Who takes longer is forbidden earlier.
        let span = Span {
            began_s,
            takes_off_s: 0.0,
            occupied_s: 0.0,
        };
        let shuts = |window: &ClosedWindow| {
            window.until_s == f64::INFINITY && span.forbidden(window, world.rules).0 < from_s
        };
        let ends = world.topology.segment(segment);
        let over = self.closed.of_segment(segment.0).iter();
        let mut windows = over
            .chain(self.closed.of_node(ends.from))
            .chain(self.closed.of_node(ends.to));
        windows.any(shuts)
    }

    /// True where a drone above a node would land in a closed one.
    pub(super) fn forbids_landing(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        node: NodeIx,
        at_s: f64,
    ) -> bool {
        let span = Span {
            began_s,
            takes_off_s: 0.0,
            occupied_s: world.legs.vertical_s(node),
        };
        let windows = self.closed.of_node(node).iter();
        windows
            .map(|window| span.forbidden(window, world.rules))
            .any(|(from_s, until_s)| from_s < at_s && at_s < until_s)
    }

    /// True where a drone that flies over part of a segment to one of its nodes, between two instants, would still be there when something
    /// closes that is not closed at the first of them.
    pub(super) fn closes_meanwhile(
        &self,
        world: &FlightWorld<'_>,
        (segment, to): (u32, NodeIx),
        from_s: f64,
        until_s: f64,
    ) -> bool {
        let leaves_s = until_s + world.legs.vertical_s(to);
        let begins_meanwhile = |window: &ClosedWindow| {
            let (margin_s, grown_s) = match window.widened {
                true => {
                    let growth = world.rules.time_margin_growth;
                    (world.rules.time_margin_s, growth * (leaves_s - from_s))
                }
                false => (0.0, 0.0),
            };
            let begins_s = window.from_s - margin_s;
            from_s < begins_s && begins_s - grown_s < leaves_s
        };
        let over = self.closed.of_segment(segment).iter();
        let mut windows = over.chain(self.closed.of_node(to));
        windows.any(begins_meanwhile)
    }

    /// The segments whose entry may be forbidden at some time, of others where they count; rising.
    pub(super) fn list_segments(
        &self,
        topology: &Topology,
        active: &ActiveTraffic,
        segments: &mut Vec<u32>,
    ) {
        segments.clear();
        segments.extend(self.closed.segments().iter());
        if self.others.is_in_the_air() {
            active.append_segments(topology, segments);
            segments.sort_unstable();
            segments.dedup();
        }
    }
}

/// Joins open intervals that overlap; where two touch, that instant is open.
pub(super) fn join(intervals: &mut Vec<(f64, f64)>) {
    intervals.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
    intervals.dedup_by(|next, joined| {
        let overlap = next.0 < joined.1;
        if overlap {
            joined.1 = joined.1.max(next.1);
        }
        overlap
    });
}
