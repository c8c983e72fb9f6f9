//! What may not be flown when: closures with their windows and the legs of other plans, by segment and node.
//!
//! For a search each of them is an open interval of forbidden entry times of a directed leg; touching its ends is allowed.
//! A leg occupies its corridor from the start of a take-off at its first node to the end of a
//! landing at its last, whether the drone does so or passes.

use super::grouped::Grouped;
use super::occupancy::OthersOccupancy;
use super::request::FlightWorld;
use crate::flight::{FlightRules, Situation, TimedClosure, TrafficLeg};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::planted::{self, Bug};
use std::sync::Arc;

/// Entries within the headway of another plan's, the headway itself included, conflict; this much more, in
/// seconds, does not.
const HEADWAY_STEP_S: f64 = 1e-3;

/// From when until when something is closed.
#[derive(Clone, Copy, Debug)]
struct ClosedWindow {
    /// Which closure of the situation, counted from 0.
    closure: u32,
    from_s: f64,
    until_s: f64,
    widened: bool,
}

/// The windows of closures, by what they close.
#[derive(Debug)]
struct ClosedWindows {
    by_segment: Grouped<ClosedWindow>,
    by_node: Grouped<ClosedWindow>,
    /// Segments whose entry may be forbidden at some time, rising.
    segments: Vec<u32>,
}

/// Closures of a situation and the legs of other plans, compiled for searches. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Obstacles {
    closed: Arc<ClosedWindows>,
    others: OthersOccupancy,
}

/// A leg that a drone may want to enter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) segment: u32,
    pub(super) from: NodeIx,
    pub(super) to: NodeIx,
    pub(super) time_s: f64,
    pub(super) leaving: Leaving,
}

/// How a drone comes to the node that a leg starts from, and so what of that node's closures binds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaving {
    /// It has come by a leg or a stop: all of them.
    OnItsWay,
    /// Its plan begins there in the air: none of them.
    FromTheAir,
    /// Its plan begins there on the ground: zones, which it waits for.
    FromTheGround,
}

impl Leaving {
    /// Whether a window of the node binds it.
    #[inline]
    fn is_bound_by(self, window: &ClosedWindow) -> bool {
        match self {
            Self::OnItsWay => true,
            Self::FromTheAir => false,
            // The windows of zones are widened, and no others.
            Self::FromTheGround => window.widened,
        }
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

/// The entry times at which a leg would come too near to one of another plan.
fn too_near(other: &TrafficLeg, entry: Entry, headway_s: f64) -> (f64, f64) {
    match other.from == entry.from {
        true => {
            let apart_s = headway_s + HEADWAY_STEP_S;
            (other.enters_s - apart_s, other.enters_s + apart_s)
        }
        false => (other.enters_s - entry.time_s, other.leaves_s),
    }
}

impl ClosedWindows {
    fn of(topology: &Topology, closures: &[TimedClosure]) -> Self {
        let (mut segments, mut nodes) = (Vec::new(), Vec::new());
        for (number, closure) in closures.iter().enumerate() {
            let window = ClosedWindow {
                closure: number as u32,
                from_s: closure.from_s,
                until_s: closure.until_s,
                widened: closure.widened,
            };
            segments.extend(closure.segments.iter().map(|segment| (segment.0, window)));
            nodes.extend(closure.nodes.iter().map(|node| (node.0, window)));
        }
        let mut closed = Self {
            by_segment: Grouped::of(topology.segment_count(), segments),
            by_node: Grouped::of(topology.node_count(), nodes),
            segments: Vec::new(),
        };
        closed.segments = closed.all_segments(topology);
        closed
    }

    fn all_segments(&self, topology: &Topology) -> Vec<u32> {
        let mut segments: Vec<u32> = self.by_segment.indices().collect();
        for node in self.by_node.indices() {
            let arcs = topology.arcs(NodeIx(node)).iter();
            segments.extend(arcs.map(|arc| arc.segment.0));
        }
        segments.sort_unstable();
        segments.dedup();
        segments
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

    /// The same closures among what other plans take.
    #[must_use]
    pub(super) fn among(&self, others: OthersOccupancy) -> Self {
        Self {
            closed: self.closed.clone(),
            others,
        }
    }

    /// True when nothing is ever in the way of a leg.
    #[inline]
    pub(super) fn is_clear(&self, segment: u32, from: NodeIx, to: NodeIx) -> bool {
        !self.closed.by_segment.has(segment)
            && !self.closed.by_node.has(from.0)
            && !self.closed.by_node.has(to.0)
            && !self.others.is_busy(segment)
    }

    /// Adds the forbidden entry times of a leg, as open intervals in any order, as far as they meet the times within which
    /// it may be entered.
    pub(super) fn forbidden(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        within_s: (f64, f64),
        intervals: &mut Vec<(f64, f64)>,
    ) {
        self.each_forbidden_by(world, began_s, entry, within_s.1, |_, from_s, until_s| {
            if from_s <= within_s.1 && until_s >= within_s.0 {
                intervals.push((from_s, until_s));
            }
        });
    }

    /// Tells `take` every interval of forbidden entry times of a leg, with what forbids it.
    pub(super) fn each_forbidden(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        take: impl FnMut(Forbids, f64, f64),
    ) {
        self.each_forbidden_by(world, began_s, entry, f64::INFINITY, take);
    }

    /// The same without legs of others that forbid nothing by the last of these times.
    fn each_forbidden_by(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        last_s: f64,
        mut take: impl FnMut(Forbids, f64, f64),
    ) {
        let span = Span {
            began_s,
            takes_off_s: world.legs.vertical_s(entry.from),
            occupied_s: entry.time_s + world.legs.vertical_s(entry.to),
        };
        let mut close = |windows: &[ClosedWindow], leaving: Leaving| {
            for window in windows.iter().filter(|window| leaving.is_bound_by(window)) {
                let (from_s, until_s) = span.forbidden(window, world.rules);
                if from_s < until_s {
                    take(Forbids::Closure(window.closure as usize), from_s, until_s);
                }
            }
        };
        let ClosedWindows {
            by_segment,
            by_node,
            ..
        } = &*self.closed;
        close(by_segment.of_index(entry.segment), Leaving::OnItsWay);
        close(by_node.of_index(entry.to.0), Leaving::OnItsWay);
        close(by_node.of_index(entry.from.0), entry.leaving);
        if world.rules.headway_s > 0.0 && self.others.is_busy(entry.segment) {
            let headway_s = world.rules.headway_s;
            // Who enters so much later forbids nothing before it.
            let reach_s = entry.time_s.max(headway_s + HEADWAY_STEP_S);
            let there = self.others.legs_on(SegmentIx(entry.segment));
            for other in there.take_while(|other| other.enters_s - reach_s <= last_s) {
                let (from_s, until_s) = too_near(&other, entry, headway_s);
                take(Forbids::Traffic(other), from_s, until_s);
            }
        }
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
        let windows = self.closed.by_node.of_index(node.0).iter();
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
        let over = self.closed.by_segment.of_index(segment).iter();
        let mut windows = over.chain(self.closed.by_node.of_index(to.0));
        windows.any(begins_meanwhile)
    }

    /// The segments whose entry may be forbidden at some time, each once.
    pub(super) fn segments(&self) -> impl Iterator<Item = u32> + '_ {
        let closed = &self.closed.segments;
        let others = self.others.busy_segments();
        let others = others.filter(|segment| closed.binary_search(segment).is_err());
        closed.iter().copied().chain(others)
    }
}
