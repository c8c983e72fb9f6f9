//! What may not be flown when: closures with their windows and the legs of other plans, by segment and node.
//!
//! For a search each of them is an open interval of forbidden entry times of a directed leg; touching its ends is allowed.
//! A leg occupies its corridor from the start of a take-off at its first node to the end of a
//! landing at its last, whether the drone does so or passes.

use super::grouped::Grouped;
use super::request::FlightWorld;
use crate::flight::{FlightRules, Situation};
use crate::network::{NodeIx, Topology};

/// Entries within the headway of another plan's, the headway itself included, conflict; this much more, in
/// seconds, does not.
const HEADWAY_STEP_S: f64 = 1e-3;

/// From when until when something is closed.
#[derive(Clone, Copy, Debug)]
struct ClosedWindow {
    from_s: f64,
    until_s: f64,
    widened: bool,
}

/// Another plan on a segment.
#[derive(Clone, Copy, Debug)]
struct Traffic {
    from: NodeIx,
    enters_s: f64,
    leaves_s: f64,
}

/// Closures and traffic of a situation, compiled for searches.
#[derive(Clone, Debug)]
pub struct Obstacles {
    by_segment: Grouped<ClosedWindow>,
    by_node: Grouped<ClosedWindow>,
    traffic: Grouped<Traffic>,
}

/// A leg that a drone may want to enter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) segment: u32,
    pub(super) from: NodeIx,
    pub(super) to: NodeIx,
    pub(super) time_s: f64,
    /// True for a drone that leaves the node where its plan begins: closures of that node let it.
    pub(super) leaves_start: bool,
}

impl Obstacles {
    /// Compiles the closures and the traffic of a situation.
    pub fn of(topology: &Topology, situation: &Situation) -> Self {
        let (mut segments, mut nodes) = (Vec::new(), Vec::new());
        for closure in &situation.closures {
            let window = ClosedWindow {
                from_s: closure.from_s,
                until_s: closure.until_s,
                widened: closure.widened,
            };
            segments.extend(closure.segments.iter().map(|segment| (segment.0, window)));
            nodes.extend(closure.nodes.iter().map(|node| (node.0, window)));
        }
        let traffic = situation.traffic.iter().map(|leg| {
            let traffic = Traffic {
                from: leg.from,
                enters_s: leg.enters_s,
                leaves_s: leg.leaves_s,
            };
            (leg.segment.0, traffic)
        });
        Self {
            by_segment: Grouped::of(topology.segment_count(), segments),
            by_node: Grouped::of(topology.node_count(), nodes),
            traffic: Grouped::of(topology.segment_count(), traffic.collect()),
        }
    }

    /// True when nothing is ever in the way of a leg.
    #[inline]
    pub(super) fn is_clear(&self, segment: u32, from: NodeIx, to: NodeIx) -> bool {
        !self.by_segment.has(segment)
            && !self.by_node.has(from.0)
            && !self.by_node.has(to.0)
            && !self.traffic.has(segment)
    }

    /// Adds the forbidden entry times of a leg, as open intervals in any order.
    pub(super) fn forbidden(
        &self,
        world: &FlightWorld<'_>,
        began_s: f64,
        entry: Entry,
        intervals: &mut Vec<(f64, f64)>,
    ) {
        let takes_off_s = world.legs.vertical_s(entry.from);
        let occupied_s = entry.time_s + world.legs.vertical_s(entry.to);
        let mut close = |windows: &[ClosedWindow]| {
            for window in windows {
                let (margin_s, growth) = match window.widened {
                    true => (world.rules.time_margin_s, world.rules.time_margin_growth),
                    false => (0.0, 0.0),
                };
                // At entry time t the window reaches from a - m - g (t - began) to b + m + g (t - began).
                let from_s =
                    (window.from_s - margin_s + growth * began_s - occupied_s) / (1.0 + growth);
                let until_s =
                    (window.until_s + margin_s - growth * began_s + takes_off_s) / (1.0 - growth);
                if from_s < until_s {
                    intervals.push((from_s, until_s));
                }
            }
        };
        close(self.by_segment.of_index(entry.segment));
        close(self.by_node.of_index(entry.to.0));
        if !entry.leaves_start {
            close(self.by_node.of_index(entry.from.0));
        }
        self.traffic_intervals(world.rules, entry, intervals);
    }

    fn traffic_intervals(
        &self,
        rules: &FlightRules,
        entry: Entry,
        intervals: &mut Vec<(f64, f64)>,
    ) {
        if rules.headway_s <= 0.0 {
            return;
        }
        for other in self.traffic.of_index(entry.segment) {
            intervals.push(match other.from == entry.from {
                true => {
                    let apart_s = rules.headway_s + HEADWAY_STEP_S;
                    (other.enters_s - apart_s, other.enters_s + apart_s)
                }
                false => (other.enters_s - entry.time_s, other.leaves_s),
            });
        }
    }

    /// The segments whose entry may be forbidden at some time.
    pub(super) fn segments(&self, topology: &Topology) -> Vec<u32> {
        let mut segments: Vec<u32> = self.by_segment.indices().collect();
        segments.extend(self.traffic.indices());
        for node in self.by_node.indices() {
            let arcs = topology.arcs(NodeIx(node)).iter();
            segments.extend(arcs.map(|arc| arc.segment.0));
        }
        segments.sort_unstable();
        segments.dedup();
        segments
    }
}
