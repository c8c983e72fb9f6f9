//! The memory of searches and the ways they find.

use super::area::Area;
use super::frontier::{Entrance, Frontier};
use super::tree::DestinationTree;
use super::way::Path;
use crate::airspace::Closed;
use crate::network::{NodeIx, SegmentIx, Topology};

/// Where a search ended: the end of a way that [`Searcher::append_way`] can tell until the next search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Metres from before the start, its offset included, to the goal.
    pub length_m: f64,
    /// The last node settled.
    pub(super) last_taken: NodeIx,
    /// True when the way goes on from there down the destination's tree.
    pub(super) follows_tree: bool,
}

impl Arrival {
    /// True for the node at which the search ended without going on from there.
    pub fn stopped_at(&self, node: NodeIx) -> bool {
        self.last_taken == node
    }
}

/// What a search scribbles on, reused by the next one. One thread uses it at a time.
#[derive(Debug)]
pub struct Searcher {
    pub(super) frontier: Frontier,
    /// Nodes whose way down the tree was found blocked.
    pub(super) dead_ends: Area,
}

impl Searcher {
    /// Room for searches on a topology.
    pub fn new(topology: &Topology) -> Self {
        Self {
            frontier: Frontier::new(topology),
            dead_ends: Area::new(topology),
        }
    }

    /// How many nodes the last search settled.
    pub fn settled(&self) -> usize {
        self.frontier.settled()
    }

    /// True when the last search settled a node.
    pub fn has_settled(&self, node: NodeIx) -> bool {
        self.frontier.is_settled(node)
    }

    /// The nodes that the last search settled, with their distances in metres, in index order.
    pub fn settled_nodes<'a>(
        &'a self,
        topology: &'a Topology,
    ) -> impl Iterator<Item = (NodeIx, f64)> + 'a {
        topology
            .nodes()
            .filter(|&node| self.frontier.is_settled(node))
            .filter_map(|node| Some((node, self.frontier.distance_m(node)?)))
    }

    /// Adds the way of the last search to `way`, which is empty or ends at the start of it; also gives which of the starts it began from.
    ///
    /// `tree` is the one that the search was guided by, if any.
    pub fn append_way(
        &self,
        arrival: Arrival,
        tree: Option<&DestinationTree>,
        way: &mut Path,
    ) -> usize {
        debug_assert!(tree.is_some() || !arrival.follows_tree);
        let steps_back = || {
            let mut node = arrival.last_taken;
            std::iter::from_fn(move || {
                let (parent, segment) = self.frontier.parent(node)?;
                let step = (segment, node);
                node = parent;
                Some((parent, step))
            })
        };
        let tree = tree.filter(|_| arrival.follows_tree);
        let hops = steps_back().count();
        let start = steps_back()
            .last()
            .map_or(arrival.last_taken, |(node, _)| node);
        if way.nodes.is_empty() {
            let on = tree.map_or(0, |tree| tree.hops(arrival.last_taken));
            let segments = hops + on;
            way.segments.reserve_exact(segments);
            way.nodes.reserve_exact(segments + 1);
            way.nodes.push(start);
        }
        let first_new = way.segments.len();
        for (_, (segment, node)) in steps_back() {
            way.push(segment, node);
        }
        way.segments[first_new..].reverse();
        let nodes_before = way.nodes.len() - hops;
        way.nodes[nodes_before..].reverse();
        if let Some(tree) = tree {
            tree.append_descent(arrival.last_taken, way);
        }
        self.frontier.start_number(start)
    }

    /// Clears everything and offers the starts; what leaves a closed start is relaxed at once.
    pub(super) fn begin(
        &mut self,
        closed: &Closed<'_>,
        starts: &[impl Entrance],
        within: Option<&Area>,
        bound_m: impl Fn(NodeIx) -> f64,
    ) {
        debug_assert!(starts.len() <= super::MAX_STARTS);
        self.frontier.clear();
        for (number, entrance) in (0..).zip(starts) {
            let start = entrance.start();
            if closed.closes_node(start.node) {
                self.frontier.settle_start(start, number);
                self.frontier.relax(
                    closed.topology(),
                    start.node,
                    |arc| closed.lets_out(arc) && within.is_none_or(|area| area.contains(arc.to)),
                    &bound_m,
                );
            } else {
                let bound = bound_m(start.node);
                self.frontier.start(start, number, bound);
            }
        }
    }

    /// The tree of a destination on the intact network.
    pub fn tree(&mut self, topology: &Topology, destination: NodeIx) -> DestinationTree {
        DestinationTree::intact(topology, destination, &mut self.frontier)
    }

    /// A copy of a tree with standing closures worked in; see [`DestinationTree`].
    ///
    /// `closed` closes all that the tree already has worked in, and `fresh` holds every segment that is
    /// blocked now and was not when the tree was made.
    pub fn tree_taking_in(
        &mut self,
        tree: &DestinationTree,
        closed: &Closed<'_>,
        fresh: impl Iterator<Item = SegmentIx>,
    ) -> DestinationTree {
        tree.with_closures(closed, fresh, &mut self.frontier)
    }
}
