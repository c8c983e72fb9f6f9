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

/// The place of a node in a numbering of the tree from the destination up: its own number and the first
/// one beyond the branch that hangs on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    first: u32,
    end: u32,
}

impl Span {
    /// Holds nothing.
    pub(super) const EMPTY: Self = Self { first: 0, end: 0 };

    /// True when the node of the other span is this one's, or hangs on it.
    pub(super) fn holds(self, other: Self) -> bool {
        self.first <= other.first && other.first < self.end
    }
}

/// The shortest ways of all nodes to one destination.
#[derive(Clone, Debug, PartialEq)]
pub struct DestinationTree {
    destination: NodeIx,
    steps: Vec<Step>,
    /// By node; empty where closures are worked in, for they would change half the numbers.
    spans: Vec<Span>,
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
        let mut outwards = Vec::with_capacity(topology.node_count());
        frontier.clear();
        frontier.start(start, 0.0);
        while let Some((_, node)) = frontier.take() {
            outwards.push(node);
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
        let steps: Vec<Step> = topology.nodes().map(step).collect();
        Self {
            destination,
            spans: number(&steps, &outwards),
            steps,
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

    /// Where a node is in the numbering of the tree; `None` where there is none.
    #[inline]
    pub(super) fn span(&self, node: NodeIx) -> Option<Span> {
        self.spans.get(node.at()).copied()
    }

    /// Bytes held in memory.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.steps.len() * size_of::<Step>()
            + self.spans.len() * size_of::<Span>()
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
        let mut tree = Self {
            destination: self.destination,
            steps: self.steps.clone(),
            spans: Vec::new(),
        };
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
            let mut nearest = (f64::INFINITY, None);
            for arc in topology.arcs(node) {
                let through_m = arc.length_m + tree.distance_m(arc.to);
                if through_m < nearest.0 && !closed.blocks(arc.segment) {
                    nearest = (through_m, Some(arc));
                }
            }
            if let (distance_m, Some(arc)) = nearest {
                frontier.seed(node, distance_m, arc.to, arc.segment);
            }
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

    /// Gives every node that was cut off its new distance and next node, nearest first.
    fn regrow(&mut self, closed: &Closed<'_>, frontier: &mut Frontier) {
        let topology = closed.topology();
        while let Some((_, node)) = frontier.take() {
            let found = frontier.distance_m(node).zip(frontier.parent(node));
            let Some((distance_m, (next, segment))) = found else {
                continue;
            };
            self.steps[node.at()] = Step {
                distance_m,
                next: next.0,
                segment: segment.0,
            };
            let steps = &self.steps;
            let is_cut_off = |to: NodeIx| steps[to.at()].distance_m.is_infinite();
            frontier.relax(
                topology,
                node,
                |arc| is_cut_off(arc.to) && !closed.blocks(arc.segment),
                |_| 0.0,
            );
        }
    }
}

/// Numbers the nodes so that every branch is a run of numbers. `outwards` has them from the destination on.
fn number(steps: &[Step], outwards: &[NodeIx]) -> Vec<Span> {
    let mut branch_size = vec![1_u32; steps.len()];
    for node in outwards.iter().rev() {
        let next = steps[node.at()].next;
        if next != NO_NEXT {
            branch_size[next as usize] += branch_size[node.at()];
        }
    }
    // `end` first holds where the next branch on a node begins; then the branches have filled it up.
    let mut spans = vec![Span::EMPTY; steps.len()];
    for node in outwards {
        let next = steps[node.at()].next;
        let first = match next {
            NO_NEXT => 0,
            next => {
                let free = &mut spans[next as usize].end;
                let first = *free;
                *free += branch_size[node.at()];
                first
            }
        };
        spans[node.at()] = Span {
            first,
            end: first + 1,
        };
    }
    spans
}
