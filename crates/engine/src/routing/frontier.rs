//! The search loop's state: labels of nodes, the queue, and the one step all searches are made of.
//!
//! A search is a loop a reader can follow: [`Frontier::take`] the nearest node, decide, and
//! [`Frontier::relax`] its arcs. What differs between searches is what may be passed, the lower bound
//! on the way still to go, and when to stop; each is an argument.

use crate::flight::Reentry;
use crate::network::{Arc, Heap, NodeIx, SegmentIx, Topology};

/// Marks the absence of a parent in a label.
const NO_PARENT: u32 = u32::MAX;

/// A way into the network: a node and what it takes to get there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// The node.
    pub node: NodeIx,
    /// Metres flown before the node is reached.
    pub offset_m: f64,
}

/// What a search can begin from; a search hands back which of them a way begins with.
pub trait Entrance: Copy {
    /// The node and the metres before it.
    fn start(self) -> Start;
}

impl Entrance for Start {
    #[inline]
    fn start(self) -> Start {
        self
    }
}

impl Entrance for Reentry {
    #[inline]
    fn start(self) -> Start {
        Start {
            node: self.node,
            offset_m: self.stretch.length_m,
        }
    }
}

/// What a search knows of a node it has seen.
#[derive(Clone, Copy, Debug)]
struct Label {
    distance_m: f64,
    parent: u32,
    /// The segment from the parent; without one, which of the starts this is.
    via: u32,
    /// The search this label belongs to; any other number means the node has not been seen.
    generation: u32,
    settled: bool,
}

/// The memory of a search, reused by the next one; starting afresh costs O(1).
#[derive(Debug)]
pub(super) struct Frontier {
    labels: Vec<Label>,
    heap: Heap,
    generation: u32,
    settled: usize,
}

impl Frontier {
    pub(super) fn new(topology: &Topology) -> Self {
        let unseen = Label {
            distance_m: 0.0,
            parent: NO_PARENT,
            via: 0,
            generation: 0,
            settled: false,
        };
        // A node is relaxed once, so each arc is pushed at most once, and each start once.
        let most_entries = topology.segment_count() * 2 + 2 * super::MAX_STARTS;
        Self {
            labels: vec![unseen; topology.node_count()],
            heap: Heap::with_capacity(most_entries),
            generation: 0,
            settled: 0,
        }
    }

    /// Forgets the search before.
    pub(super) fn clear(&mut self) {
        self.heap.clear();
        self.settled = 0;
        self.generation = self.generation.wrapping_add(1);
        if self.generation == 0 {
            // The counter came round: labels of 2^32 searches ago would look like today's.
            for label in &mut self.labels {
                label.generation = 0;
            }
            self.generation = 1;
        }
    }

    /// Offers a node at a distance, with a lower bound on the whole way through it as key.
    #[inline]
    fn offer(&mut self, node: NodeIx, distance_m: f64, key: f64, parent: u32, via: u32) {
        let generation = self.generation;
        let label = &mut self.labels[node.at()];
        let seen = label.generation == generation;
        if seen && (label.settled || label.distance_m <= distance_m) {
            return;
        }
        *label = Label {
            distance_m,
            parent,
            via,
            generation,
            settled: false,
        };
        self.heap.push(key, node);
    }

    /// Offers a start; an infinite bound means that the goal cannot be reached from there.
    ///
    /// `number` says which of the starts it is.
    pub(super) fn start(&mut self, start: Start, number: u32, bound_m: f64) {
        if bound_m.is_finite() {
            let key = start.offset_m + bound_m;
            self.offer(start.node, start.offset_m, key, NO_PARENT, number);
        }
    }

    /// Offers a node that something outside the search leads to: a node and a segment, at a distance in metres.
    pub(super) fn seed(&mut self, node: NodeIx, distance_m: f64, from: NodeIx, via: SegmentIx) {
        self.offer(node, distance_m, distance_m, from.0, via.0);
    }

    /// Settles a start at once; for one that is closed, which no way can lead to.
    pub(super) fn settle_start(&mut self, start: Start, number: u32) {
        let label = &mut self.labels[start.node.at()];
        let better = label.generation == self.generation && label.distance_m <= start.offset_m;
        if better {
            return;
        }
        *label = Label {
            distance_m: start.offset_m,
            parent: NO_PARENT,
            via: number,
            generation: self.generation,
            settled: true,
        };
        self.settled += 1;
    }

    /// Takes the node with the smallest key and settles it; also the key.
    #[inline]
    pub(super) fn take(&mut self) -> Option<(f64, NodeIx)> {
        while let Some((key, node)) = self.heap.pop() {
            let label = &mut self.labels[node.at()];
            if !label.settled {
                label.settled = true;
                self.settled += 1;
                return Some((key, node));
            }
        }
        None
    }

    /// Offers the far ends of a settled node's arcs that may be passed.
    #[inline]
    pub(super) fn relax(
        &mut self,
        topology: &Topology,
        node: NodeIx,
        may_pass: impl Fn(&Arc) -> bool,
        bound_m: impl Fn(NodeIx) -> f64,
    ) {
        let distance_m = self.labels[node.at()].distance_m;
        for arc in topology.arcs(node) {
            if !may_pass(arc) {
                continue;
            }
            let through_m = distance_m + arc.length_m;
            let bound = bound_m(arc.to);
            if bound.is_finite() {
                self.offer(arc.to, through_m, through_m + bound, node.0, arc.segment.0);
            }
        }
    }

    /// Lowers a node's distance without queueing it; true when it was lowered. For searches in rounds.
    pub(super) fn lower(
        &mut self,
        node: NodeIx,
        distance_m: f64,
        parent: NodeIx,
        via: SegmentIx,
    ) -> bool {
        let label = &mut self.labels[node.at()];
        let seen = label.generation == self.generation;
        if seen && (label.settled || label.distance_m <= distance_m) {
            return false;
        }
        *label = Label {
            distance_m,
            parent: parent.0,
            via: via.0,
            generation: self.generation,
            settled: false,
        };
        true
    }

    /// Settles every node that has been seen: a search in rounds has come to rest.
    pub(super) fn settle_everything_seen(&mut self) {
        self.settled = 0;
        for label in &mut self.labels {
            if label.generation == self.generation {
                label.settled = true;
                self.settled += 1;
            }
        }
    }

    /// Distance of a node from the starts, if it has been seen; final once it is settled.
    pub(super) fn distance_m(&self, node: NodeIx) -> Option<f64> {
        let label = &self.labels[node.at()];
        (label.generation == self.generation).then_some(label.distance_m)
    }

    /// True when the search has settled a node.
    pub(super) fn is_settled(&self, node: NodeIx) -> bool {
        let label = &self.labels[node.at()];
        label.generation == self.generation && label.settled
    }

    /// The node and segment by which a node was reached; `None` at a start.
    pub(super) fn parent(&self, node: NodeIx) -> Option<(NodeIx, SegmentIx)> {
        let label = &self.labels[node.at()];
        let reached = label.generation == self.generation && label.parent != NO_PARENT;
        reached.then_some((NodeIx(label.parent), SegmentIx(label.via)))
    }

    /// Which of the starts a node is that was reached from no other.
    pub(super) fn start_number(&self, node: NodeIx) -> usize {
        debug_assert!(self.parent(node).is_none());
        self.labels[node.at()].via as usize
    }

    /// How many nodes have been settled.
    pub(super) fn settled(&self) -> usize {
        self.settled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_an_earlier_search_are_forgotten_even_when_the_counter_comes_round() {
        let topology = crate::network::sketch("a b", &[("a", "b")]);
        let mut frontier = Frontier::new(&topology);
        let node = NodeIx(0);
        let start = Start {
            node,
            offset_m: 3.0,
        };
        frontier.generation = u32::MAX - 1;
        frontier.clear();
        frontier.start(start, 0, 0.0);
        assert_eq!(frontier.distance_m(node), Some(3.0));
        frontier.clear();
        assert_eq!(frontier.generation, 1);
        assert_eq!(frontier.distance_m(node), None);
    }
}
