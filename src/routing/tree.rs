//! A destination's table and tree: per node the distance, the next node and the segment towards it.
//!
//! On the intact network the distance is a lower bound that no closure can break, since closures only
//! lengthen ways, and it is known before anything fails. A closure that lasts is worked into a copy
//! ([`DestinationTree::taking_in`]); such a copy is a bound only while that closure stands.

use super::frontier::{Frontier, Start};
use crate::airspace::Closed;
use crate::network::{NodeIx, SegmentIx, Topology};

/// Marks the destination itself and nodes from which there is no way.
const NO_NEXT: u32 = u32::MAX;

/// The first step from a node to the destination.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    distance_m: f64,
    next: u32,
    segment: u32,
}

const UNREACHABLE: Step = Step {
    distance_m: f64::INFINITY,
    next: NO_NEXT,
    segment: 0,
};

/// The shortest ways of all nodes to one destination.
#[derive(Clone, Debug, PartialEq)]
pub struct DestinationTree {
    destination: NodeIx,
    steps: Vec<Step>,
}

impl DestinationTree {
    /// The tree on the intact network: one full search, once per destination and topology.
    pub(super) fn intact(
        topology: &Topology,
        destination: NodeIx,
        frontier: &mut Frontier,
    ) -> Self {
        let start = Start {
            node: destination,
            offset_m: 0.0,
        };
        frontier.clear();
        frontier.start(start, 0.0);
        while let Some((_, node)) = frontier.take() {
            frontier.relax(topology, node, |_| true, |_| 0.0);
        }
        let step = |node: NodeIx| {
            let Some(distance_m) = frontier.distance_m(node) else {
                return UNREACHABLE;
            };
            let parent = frontier.parent(node);
            Step {
                distance_m,
                next: parent.map_or(NO_NEXT, |(next, _)| next.0),
                segment: parent.map_or(0, |(_, segment)| segment.0),
            }
        };
        Self {
            destination,
            steps: topology.nodes().map(step).collect(),
        }
    }

    /// The node this tree leads to.
    pub fn destination(&self) -> NodeIx {
        self.destination
    }

    /// Metres from a node to the destination; infinite when there is no way.
    #[inline]
    pub fn distance_m(&self, node: NodeIx) -> f64 {
        self.steps[node.at()].distance_m
    }

    /// The next node on the way down and the segment to it; `None` at the destination or without a way.
    #[inline]
    pub fn next(&self, node: NodeIx) -> Option<(NodeIx, SegmentIx)> {
        let step = &self.steps[node.at()];
        (step.next != NO_NEXT).then_some((NodeIx(step.next), SegmentIx(step.segment)))
    }

    /// Bytes held in memory.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.steps.len() * size_of::<Step>()
    }

    /// A copy with closures worked in, recomputing only the nodes whose way down runs through them.
    ///
    /// `closed` must close all that this tree already has worked in, and `fresh` must hold every segment
    /// that it blocks and this tree does not know of; more does no harm. A dynamic shortest-path tree
    /// after Ramalingam and Reps (1996), for rising lengths only.
    pub(super) fn taking_in(
        &self,
        closed: &Closed<'_>,
        fresh: impl Iterator<Item = SegmentIx>,
        frontier: &mut Frontier,
    ) -> Self {
        let topology = closed.topology();
        let mut tree = self.clone();
        let mut cut_off = Vec::new();
        for segment in fresh {
            let ends = topology.segment(segment);
            for (node, next) in [(ends.from, ends.to), (ends.to, ends.from)] {
                if tree.next(node) == Some((next, segment)) {
                    tree.steps[node.at()] = UNREACHABLE;
                    cut_off.push(node);
                }
            }
        }
        tree.cut_branches(topology, &mut cut_off);
        frontier.clear();
        for &node in &cut_off {
            let nearest_m = topology
                .arcs(node)
                .iter()
                .filter(|arc| !closed.blocks(arc.segment))
                .map(|arc| arc.length_m + tree.distance_m(arc.to))
                .fold(f64::INFINITY, f64::min);
            frontier.start(
                Start {
                    node,
                    offset_m: nearest_m,
                },
                if nearest_m.is_finite() {
                    0.0
                } else {
                    f64::INFINITY
                },
            );
        }
        tree.regrow(closed, frontier);
        tree
    }

    /// Extends the list of nodes cut off by all whose way down runs through one of them.
    fn cut_branches(&mut self, topology: &Topology, cut_off: &mut Vec<NodeIx>) {
        let mut done = 0;
        while let Some(&node) = cut_off.get(done) {
            done += 1;
            for arc in topology.arcs(node) {
                if self.next(arc.to) == Some((node, arc.segment)) {
                    self.steps[arc.to.at()] = UNREACHABLE;
                    cut_off.push(arc.to);
                }
            }
        }
    }

    /// Gives every node that was cut off its new distance, nearest first, and then its new next node.
    fn regrow(&mut self, closed: &Closed<'_>, frontier: &mut Frontier) {
        let topology = closed.topology();
        while let Some((_, node)) = frontier.take() {
            let Some(distance_m) = frontier.distance_m(node) else {
                continue;
            };
            self.attach(closed, node, distance_m);
            let steps = &self.steps;
            frontier.relax(
                topology,
                node,
                |arc| !closed.blocks(arc.segment) && steps[arc.to.at()].distance_m.is_infinite(),
                |_| 0.0,
            );
        }
    }

    /// Hangs a node under the neighbour that gives it the distance it was settled with.
    fn attach(&mut self, closed: &Closed<'_>, node: NodeIx, distance_m: f64) {
        let through = closed
            .topology()
            .arcs(node)
            .iter()
            .filter(|arc| !closed.blocks(arc.segment))
            .find(|arc| self.distance_m(arc.to) + arc.length_m == distance_m);
        debug_assert!(
            through.is_some(),
            "a settled node has a neighbour that explains it"
        );
        if let Some(arc) = through {
            self.steps[node.at()] = Step {
                distance_m,
                next: arc.to.0,
                segment: arc.segment.0,
            };
        }
    }
}
