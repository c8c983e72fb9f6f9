//! Which nodes of a growing area hang together, so that searches bound to fail need not be run.

use super::local::LocalProblem;
use crate::network::{NodeIx, Topology};

/// Disjoint sets over the nodes of an area, extended node by node as the area grows.
#[derive(Debug)]
pub(super) struct Connectivity {
    /// Per node its parent in the forest of sets; valid for the nodes of the area alone.
    parent: Vec<u32>,
}

impl Connectivity {
    pub(super) fn new(topology: &Topology) -> Self {
        Self {
            parent: vec![0; topology.node_count()],
        }
    }

    /// Starts over with the nodes of the problem's area.
    pub(super) fn restart(&mut self, problem: &LocalProblem<'_>) {
        for &node in problem.area.nodes() {
            self.parent[node.at()] = node.0;
        }
        for &node in problem.area.nodes() {
            self.join_neighbours(problem, node);
        }
    }

    /// Takes in a node that has just been added to the area.
    pub(super) fn add(&mut self, problem: &LocalProblem<'_>, node: NodeIx) {
        self.parent[node.at()] = node.0;
        self.join_neighbours(problem, node);
        // A closed A is left over arcs by which no path enters it, so its neighbours do not see it.
        let from = problem.gap.from;
        if problem.gap.closed.closes_node(from)
            && problem.gap.open_arcs(from).any(|arc| arc.to == node)
        {
            self.join(from, node);
        }
    }

    /// True when a way inside the area leads from A to B.
    pub(super) fn connects(&mut self, problem: &LocalProblem<'_>) -> bool {
        self.root(problem.gap.from) == self.root(problem.gap.to)
    }

    fn join_neighbours(&mut self, problem: &LocalProblem<'_>, node: NodeIx) {
        for arc in problem.gap.open_arcs(node) {
            if problem.area.contains(arc.to) {
                self.join(node, arc.to);
            }
        }
    }

    fn join(&mut self, one: NodeIx, other: NodeIx) {
        let (one, other) = (self.root(one), self.root(other));
        self.parent[one as usize] = other;
    }

    fn root(&mut self, node: NodeIx) -> u32 {
        let mut place = node.0;
        while self.parent[place as usize] != place {
            let grandparent = self.parent[self.parent[place as usize] as usize];
            self.parent[place as usize] = grandparent;
            place = grandparent;
        }
        place
    }
}
