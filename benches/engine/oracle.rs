//! petgraph on a graph of its own: the oracle of every measured distance, and one of the peers.

use petgraph::graph::{NodeIndex, UnGraph};
use petgraph::visit::EdgeFiltered;
use skyway::airspace::Closed;
use skyway::network::{NodeIx, SegmentIx, Topology};
use std::sync::Arc;

/// The same network in petgraph; edges carry their segment and length.
pub(crate) struct Peer {
    pub(crate) graph: UnGraph<(f64, f64), (SegmentIx, f64)>,
}

impl Peer {
    pub(crate) fn new(topology: &Arc<Topology>) -> Self {
        let mut graph = UnGraph::with_capacity(topology.node_count(), topology.segment_count());
        for node in topology.nodes() {
            let position = topology.position(node);
            graph.add_node((position.x, position.y));
        }
        for segment in topology.segments() {
            let ends = topology.segment(segment);
            let (from, to) = (NodeIndex::new(ends.from.at()), NodeIndex::new(ends.to.at()));
            graph.add_edge(from, to, (segment, ends.length_m));
        }
        Self { graph }
    }

    /// petgraph's Dijkstra, stopped at the goal.
    pub(crate) fn dijkstra_m(&self, closed: &Closed<'_>, from: NodeIx, to: NodeIx) -> Option<f64> {
        let open = EdgeFiltered::from_fn(
            &self.graph,
            |edge: petgraph::graph::EdgeReference<'_, (SegmentIx, f64)>| {
                !closed.blocks(edge.weight().0)
            },
        );
        let goal = NodeIndex::new(to.at());
        let length = |edge: petgraph::graph::EdgeReference<'_, (SegmentIx, f64)>| edge.weight().1;
        let found = petgraph::algo::dijkstra(&open, NodeIndex::new(from.at()), Some(goal), length);
        found.get(&goal).copied()
    }

    /// petgraph's A* with the straight line.
    pub(crate) fn astar_m(&self, closed: &Closed<'_>, from: NodeIx, to: NodeIx) -> Option<f64> {
        let open = EdgeFiltered::from_fn(
            &self.graph,
            |edge: petgraph::graph::EdgeReference<'_, (SegmentIx, f64)>| {
                !closed.blocks(edge.weight().0)
            },
        );
        let goal = NodeIndex::new(to.at());
        let target = self.graph[goal];
        let straight_m = |node: NodeIndex| {
            let (dx, dy) = (target.0 - self.graph[node].0, target.1 - self.graph[node].1);
            (dx * dx + dy * dy).sqrt()
        };
        let length = |edge: petgraph::graph::EdgeReference<'_, (SegmentIx, f64)>| edge.weight().1;
        let start = NodeIndex::new(from.at());
        let found = petgraph::algo::astar(&open, start, |node| node == goal, length, straight_m);
        found.map(|(length_m, _)| length_m)
    }
}

/// Panics where two lengths differ by more than rounding.
pub(crate) fn assert_same(what: &str, ours_m: Option<f64>, theirs_m: Option<f64>) {
    let same = match (ours_m, theirs_m) {
        (Some(ours_m), Some(theirs_m)) => (ours_m - theirs_m).abs() <= 1e-9 * theirs_m.max(1.0),
        (None, None) => true,
        _ => false,
    };
    assert!(same, "{what}: {ours_m:?} against the oracle's {theirs_m:?}");
}
