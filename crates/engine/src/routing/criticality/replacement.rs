//! The shortest way that avoids each edge, and each node, of a shortest way: one search from either end tells them all.
//!
//! After Malik, Mittal and Gupta (1989) for edges and Nardelli, Proietti and Widmayer (2003) for nodes. Removing
//! an edge of the way parts the tree from its start in two: what stays with the start is reached as before, and what is
//! on the goal's side still goes on to the goal as before. So the best way round is the cheapest edge between the
//! two sides, with the two distances that are known. What hangs on a removed node itself is searched once more, each
//! branch for its own node alone.

use crate::network::Heap;
use crate::network::NodeIx;

const NONE: u32 = u32::MAX;

/// An undirected graph with lengths above 0.
#[derive(Debug)]
pub(super) struct Graph {
    edges: Vec<Edge>,
    first: Vec<u32>,
    arcs: Vec<(u32, f64, u32)>,
    /// Nodes that a way may go through; it may begin and end at any.
    passable: Vec<bool>,
}

/// An edge between two nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) ends: (u32, u32),
    pub(super) length: f64,
}

/// The shortest ways from one node to all others.
#[derive(Debug)]
pub(super) struct Tree {
    root: u32,
    distances: Vec<f64>,
    /// By node, the one before it and the edge between them.
    parents: Vec<(u32, u32)>,
    /// The nodes that have a way, nearest first.
    order: Vec<u32>,
}

impl Graph {
    pub(super) fn new(edges: Vec<Edge>, passable: Vec<bool>) -> Self {
        let mut first = vec![0_u32; passable.len() + 1];
        for Edge { ends, .. } in &edges {
            first[ends.0 as usize + 1] += 1;
            first[ends.1 as usize + 1] += 1;
        }
        for node in 1..first.len() {
            first[node] += first[node - 1];
        }
        let mut next = first.clone();
        let mut arcs = vec![(0, 0.0, 0); 2 * edges.len()];
        for (number, edge) in (0..).zip(&edges) {
            let (one, other) = edge.ends;
            for (from, to) in [(one, other), (other, one)] {
                arcs[next[from as usize] as usize] = (to, edge.length, number);
                next[from as usize] += 1;
            }
        }
        Self {
            edges,
            first,
            arcs,
            passable,
        }
    }

    fn arcs(&self, node: u32) -> &[(u32, f64, u32)] {
        let node = node as usize;
        &self.arcs[self.first[node] as usize..self.first[node + 1] as usize]
    }

    /// Dijkstra's algorithm from a node to all others.
    pub(super) fn tree(&self, root: u32) -> Tree {
        let count = self.passable.len();
        let mut tree = Tree {
            root,
            distances: vec![f64::INFINITY; count],
            parents: vec![(NONE, NONE); count],
            order: Vec::new(),
        };
        let mut settled = vec![false; count];
        let mut heap = Heap::with_capacity(count);
        tree.distances[root as usize] = 0.0;
        heap.push(0.0, NodeIx(root));
        while let Some((distance, node)) = heap.pop() {
            if std::mem::replace(&mut settled[node.at()], true) {
                continue;
            }
            tree.order.push(node.0);
            if node.0 != root && !self.passable[node.at()] {
                continue;
            }
            for &(to, length, edge) in self.arcs(node.0) {
                let through = distance + length;
                if through < tree.distances[to as usize] {
                    tree.distances[to as usize] = through;
                    tree.parents[to as usize] = (node.0, edge);
                    heap.push(through, NodeIx(to));
                }
            }
        }
        tree
    }
}

impl Tree {
    /// The distance from the root; infinite without a way.
    pub(super) fn distance(&self, node: u32) -> f64 {
        self.distances[node as usize]
    }
}

/// What it takes to go without each part of a way; the memory of one pair of nodes after another.
#[derive(Debug)]
pub(super) struct Replacements {
    /// The nodes of the way, from its start.
    pub(super) nodes: Vec<u32>,
    /// Its edges.
    pub(super) edges: Vec<u32>,
    /// By edge of the way, the length of the shortest way without it; infinite where there is none.
    pub(super) without_edge: Vec<f64>,
    /// By node of the way, the same; of no meaning for its two ends.
    pub(super) without_node: Vec<f64>,
    /// By node, the last node of the way that the tree's way to it goes through.
    blocks: Vec<u32>,
    /// By node off the way, the distance from the start without the node that it hangs on.
    around: Vec<f64>,
    heap: Heap,
}

impl Replacements {
    /// Room for graphs of a number of nodes.
    pub(super) fn new(nodes: usize) -> Self {
        Self {
            nodes: Vec::new(),
            edges: Vec::new(),
            without_edge: Vec::new(),
            without_node: Vec::new(),
            blocks: vec![NONE; nodes],
            around: vec![f64::INFINITY; nodes],
            heap: Heap::default(),
        }
    }

    /// Finds the way from one tree's root to the other's; false where there is none.
    pub(super) fn follow(&mut self, from: &Tree, to: &Tree) -> bool {
        self.nodes.clear();
        self.edges.clear();
        if from.distance(to.root).is_infinite() {
            return false;
        }
        let mut node = to.root;
        while node != from.root {
            let (before, edge) = from.parents[node as usize];
            self.nodes.push(node);
            self.edges.push(edge);
            node = before;
        }
        self.nodes.push(node);
        self.nodes.reverse();
        self.edges.reverse();
        true
    }

    /// Works out the ways round every part of the way that was followed.
    pub(super) fn work_out(&mut self, graph: &Graph, from: &Tree, to: &Tree) {
        self.sort_into_blocks(from);
        let mut edges = std::mem::take(&mut self.without_edge);
        let mut nodes = std::mem::take(&mut self.without_node);
        for lengths in [&mut edges, &mut nodes] {
            lengths.clear();
            lengths.resize(self.nodes.len(), f64::INFINITY);
        }
        self.around.fill(f64::INFINITY);
        self.heap.clear();
        let ends = [from.root, to.root];
        let may_pass = |node: u32| graph.passable[node as usize] || ends.contains(&node);
        for (number, edge) in (0..).zip(&graph.edges) {
            let (near, far) =
                match self.blocks[edge.ends.0 as usize] <= self.blocks[edge.ends.1 as usize] {
                    true => edge.ends,
                    false => (edge.ends.1, edge.ends.0),
                };
            let (start, end) = (self.blocks[near as usize], self.blocks[far as usize]);
            let is_open = end != NONE && may_pass(near) && may_pass(far);
            if !is_open || start == end || self.edges[start as usize] == number {
                continue;
            }
            let reached = from.distance(near) + edge.length;
            let length = reached + to.distance(far);
            let span = start as usize..end as usize;
            for least in &mut edges[span.clone()] {
                *least = least.min(length);
            }
            for least in &mut nodes[span.start + 1..span.end] {
                *least = least.min(length);
            }
            self.reach(far, reached);
        }
        self.go_around(graph, to, &mut nodes);
        (self.without_edge, self.without_node) = (edges, nodes);
    }

    fn sort_into_blocks(&mut self, from: &Tree) {
        self.blocks.fill(NONE);
        for (place, &node) in (0..).zip(&self.nodes) {
            self.blocks[node as usize] = place;
        }
        for &node in &from.order {
            if self.blocks[node as usize] == NONE {
                self.blocks[node as usize] = self.blocks[from.parents[node as usize].0 as usize];
            }
        }
    }

    /// Lowers the distance of a node that hangs on an inner node of the way.
    fn reach(&mut self, node: u32, distance: f64) {
        let block = self.blocks[node as usize] as usize;
        let hangs_on_inner =
            (1..self.nodes.len() - 1).contains(&block) && self.nodes[block] != node;
        if hangs_on_inner && distance < self.around[node as usize] {
            self.around[node as usize] = distance;
            self.heap.push(distance, NodeIx(node));
        }
    }

    /// Ways over what hangs on the removed node itself: every branch is searched for its own node.
    fn go_around(&mut self, graph: &Graph, to: &Tree, without_node: &mut [f64]) {
        while let Some((distance, NodeIx(node))) = self.heap.pop() {
            if distance > self.around[node as usize] || !graph.passable[node as usize] {
                continue;
            }
            let block = self.blocks[node as usize];
            for &(next, length, _) in graph.arcs(node) {
                let beyond = self.blocks[next as usize];
                if beyond == block {
                    self.reach(next, distance + length);
                } else if beyond != NONE
                    && beyond > block
                    && (graph.passable[next as usize] || next == to.root)
                {
                    let least = &mut without_node[block as usize];
                    *least = least.min(distance + length + to.distance(next));
                }
            }
        }
    }
}
