//! Bellman-Ford with a queue, as NetworkX 3 has it: only nodes whose distance has changed are looked at again, and none
//! while its predecessor waits.
//!
//! The paper says that it used that library. The engine's own Bellman-Ford goes over all segments in rounds.

use crate::network::{NodeIx, Topology};
use std::collections::VecDeque;

/// The queue and its marks, kept between searches.
pub(super) struct QueueBellmanFord {
    distances_m: Vec<f64>,
    before: Vec<Option<NodeIx>>,
    waits: Vec<bool>,
    queue: VecDeque<NodeIx>,
}

impl QueueBellmanFord {
    /// Room for the searches on a network.
    pub(super) fn new(topology: &Topology) -> Self {
        let count = topology.node_count();
        Self {
            distances_m: vec![f64::INFINITY; count],
            before: vec![None; count],
            waits: vec![false; count],
            queue: VecDeque::new(),
        }
    }

    /// The shortest distance from the beginning of a failed leg to a node without that leg, in metres.
    pub(super) fn distance_m(
        &mut self,
        topology: &Topology,
        leg: (NodeIx, NodeIx),
        goal: NodeIx,
    ) -> Option<f64> {
        self.distances_m.fill(f64::INFINITY);
        self.before.fill(None);
        let failed = topology.segment_between(leg.0, leg.1);
        self.distances_m[leg.0.at()] = 0.0;
        self.queue.push_back(leg.0);
        while let Some(node) = self.queue.pop_front() {
            self.waits[node.at()] = false;
            if self.before[node.at()].is_some_and(|before| self.waits[before.at()]) {
                continue;
            }
            for arc in topology.arcs(node) {
                let through_m = self.distances_m[node.at()] + arc.length_m;
                let to = arc.to.at();
                if Some(arc.segment) == failed || through_m >= self.distances_m[to] {
                    continue;
                }
                self.distances_m[to] = through_m;
                self.before[to] = Some(node);
                if !std::mem::replace(&mut self.waits[to], true) {
                    self.queue.push_back(arc.to);
                }
            }
        }
        let found_m = self.distances_m[goal.at()];
        found_m.is_finite().then_some(found_m)
    }
}
