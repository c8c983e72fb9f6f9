//! A destination's table and tree: per node the distance, the next node and the segment towards it.
//!
//! On the intact network the distance is a lower bound that no closure can break, since closures only
//! lengthen ways, and it is known before anything fails. A closure that lasts is worked into a copy
//! ([`DestinationTree::with_closures`]); such a copy is a bound only while that closure stands.

use super::frontier::{Frontier, Start};
use super::way::Path;
use crate::airspace::Closed;
use crate::network::{NodeIx, SegmentIx, Topology};

/// In place of a node: the next of the destination itself, and of nodes from which there is no way.
const NO_NEXT: u32 = u32::MAX;
/// Every node knows the next one on its way whose number of hops is a multiple of this.
const EXPRESS_HOPS: u32 = 16;
/// Stretches of a way walked side by side.
const STRETCHES: usize = 8;

/// The place of a node in a numbering of the tree from the destination up: its own number and the first
/// one beyond the branch that hangs on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    first: u32,
    end: u32,
}

/// Where a node is in the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    span: Span,
    /// Hops to the destination.
    hops: u32,
    /// The next node on the way whose hops are a multiple of [`EXPRESS_HOPS`].
    express: u32,
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
    /// By node, metres to the destination; infinite without a way.
    distances_m: Vec<f64>,
    /// By node, the next one on its way. Apart from the rest, as a way is a chain of look-ups in it.
    next: Vec<u32>,
    /// By node, the segment to the next one.
    segments: Vec<u32>,
    /// By node; empty where closures are worked in, for they would change half the numbers.
    places: Vec<Place>,
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
        frontier.start(start, 0, 0.0);
        while let Some((_, node)) = frontier.take() {
            outwards.push(node);
            frontier.relax(topology, node, |_| true, |_| 0.0);
        }
        let distance_m = |node| frontier.distance_m(node).unwrap_or(f64::INFINITY);
        let next = |node| frontier.parent(node).map_or(NO_NEXT, |(next, _)| next.0);
        let segment = |node| frontier.parent(node).map_or(0, |(_, segment)| segment.0);
        let next: Vec<u32> = topology.nodes().map(next).collect();
        Self {
            destination,
            distances_m: topology.nodes().map(distance_m).collect(),
            segments: topology.nodes().map(segment).collect(),
            places: number(&next, &outwards),
            next,
        }
    }

    /// The node this tree leads to.
    pub fn destination(&self) -> NodeIx {
        self.destination
    }

    /// Metres from a node to the destination; infinite when there is no way.
    #[inline]
    pub fn distance_m(&self, node: NodeIx) -> f64 {
        self.distances_m[node.at()]
    }

    /// The first step on the way down; `None` at the destination or without a way.
    #[inline]
    pub fn next(&self, node: NodeIx) -> Option<(NodeIx, SegmentIx)> {
        let next = self.next[node.at()];
        (next != NO_NEXT).then(|| (NodeIx(next), SegmentIx(self.segments[node.at()])))
    }

    /// How many segments the way down from a node has.
    pub(super) fn hops(&self, node: NodeIx) -> usize {
        match self.places.get(node.at()) {
            Some(place) => place.hops as usize,
            None => std::iter::successors(self.next(node), |&(next, _)| self.next(next)).count(),
        }
    }

    /// Adds the way down from a node, at which `way` ends.
    ///
    /// A way is a chain of look-ups, each of which waits for memory on a large network. Where nodes know the stations
    /// ahead of them, stretches between these are walked side by side, so that the waiting overlaps.
    pub(super) fn append_descent(&self, from: NodeIx, way: &mut Path) {
        let hops = self.hops(from);
        let first_new = way.nodes.len();
        if self.places.is_empty() {
            let steps = std::iter::successors(self.next(from), |&(next, _)| self.next(next));
            way.nodes.extend(steps.map(|(next, _)| next));
        } else {
            way.nodes.resize(first_new + hops, from);
            self.walk_stretches(from, &mut way.nodes[first_new..]);
        }
        let left = std::iter::once(&from)
            .chain(&way.nodes[first_new..])
            .take(hops);
        way.segments
            .extend(left.map(|node| SegmentIx(self.segments[node.at()])));
    }

    /// Fills in the nodes of the way down from a node.
    fn walk_stretches(&self, from: NodeIx, nodes: &mut [NodeIx]) {
        let all_hops = nodes.len();
        let mut station = from.0;
        let mut hops = all_hops as u32;
        while hops > 0 {
            let mut stretches = [(0_u32, 0_usize, 0_u32); STRETCHES];
            let mut count = 0;
            while hops > 0 && count < STRETCHES {
                let hops_beyond = (hops - 1) / EXPRESS_HOPS * EXPRESS_HOPS;
                stretches[count] = (station, all_hops - hops as usize, hops - hops_beyond);
                count += 1;
                station = self.places[station as usize].express;
                hops = hops_beyond;
            }
            for step in 0..EXPRESS_HOPS {
                for (node, first, length) in &mut stretches[..count] {
                    if step < *length {
                        *node = self.next[*node as usize];
                        nodes[*first + step as usize] = NodeIx(*node);
                    }
                }
            }
        }
    }

    /// Where a node is in the numbering of the tree; `None` where there is none.
    #[inline]
    pub(super) fn span(&self, node: NodeIx) -> Option<Span> {
        self.places.get(node.at()).map(|place| place.span)
    }

    /// True where its nodes have numbers: in the tree of the intact network.
    pub(super) fn is_numbered(&self) -> bool {
        !self.places.is_empty()
    }

    /// Bytes held in memory.
    pub fn bytes(&self) -> usize {
        let per_node = size_of::<f64>() + 2 * size_of::<u32>();
        size_of::<Self>()
            + self.distances_m.len() * per_node
            + self.places.len() * size_of::<Place>()
    }

    /// A copy with closures worked in, recomputing only the nodes whose way down runs through them.
    ///
    /// `closed` must close all that this tree already has worked in, and `fresh` must hold every segment
    /// that it blocks and this tree does not know of; more does no harm. A dynamic shortest-path tree
    /// after Ramalingam and Reps (1996), for rising lengths only.
    pub(super) fn with_closures(
        &self,
        closed: &Closed<'_>,
        fresh: impl Iterator<Item = SegmentIx>,
        frontier: &mut Frontier,
    ) -> Self {
        let topology = closed.topology();
        let mut tree = Self {
            destination: self.destination,
            distances_m: self.distances_m.clone(),
            next: self.next.clone(),
            segments: self.segments.clone(),
            places: Vec::new(),
        };
        let mut cut_off = Vec::new();
        for segment in fresh {
            let ends = topology.segment(segment);
            for (node, next) in [(ends.from, ends.to), (ends.to, ends.from)] {
                if tree.next(node) == Some((next, segment)) {
                    let before_m = tree.cut(node);
                    cut_off.push((node, before_m));
                }
            }
        }
        tree.cut_branches(topology, &mut cut_off);
        frontier.clear();
        for &(node, _) in &cut_off {
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

    /// Takes a node's way away; gives the distance it had.
    fn cut(&mut self, node: NodeIx) -> f64 {
        self.next[node.at()] = NO_NEXT;
        std::mem::replace(&mut self.distances_m[node.at()], f64::INFINITY)
    }

    /// Extends the list of nodes cut off, each with the distance it had, by all whose way down runs through one of them.
    fn cut_branches(&mut self, topology: &Topology, cut_off: &mut Vec<(NodeIx, f64)>) {
        let mut done = 0;
        while let Some(&(node, cut_m)) = cut_off.get(done) {
            done += 1;
            for arc in topology.arcs(node) {
                // The distance tells most neighbours apart from the branches on this node, without their arcs.
                let may_hang_here = self.distance_m(arc.to) == cut_m + arc.length_m;
                if may_hang_here && self.next(arc.to) == Some((node, arc.segment)) {
                    let length_m = self.cut(arc.to);
                    cut_off.push((arc.to, length_m));
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
            self.distances_m[node.at()] = distance_m;
            self.next[node.at()] = next.0;
            self.segments[node.at()] = segment.0;
            let distances_m = &self.distances_m;
            frontier.relax(
                topology,
                node,
                |arc| distances_m[arc.to.at()].is_infinite() && !closed.blocks(arc.segment),
                |_| 0.0,
            );
        }
    }
}

/// Numbers the nodes so that every branch is a run of numbers, and counts hops. `outwards` has the nodes that have a
/// way, from the destination on.
fn number(next: &[u32], outwards: &[NodeIx]) -> Vec<Place> {
    let mut branch_size = vec![1_u32; next.len()];
    for node in outwards.iter().rev() {
        if next[node.at()] != NO_NEXT {
            branch_size[next[node.at()] as usize] += branch_size[node.at()];
        }
    }
    // A span's `end` holds where the next branch on its node begins; the last one brings it to the end of them all.
    let nowhere = Place {
        span: Span::EMPTY,
        hops: 0,
        express: NO_NEXT,
    };
    let mut places = vec![nowhere; next.len()];
    for node in outwards {
        let ahead = next[node.at()];
        let (mut first, mut hops, mut express) = (0, 0, NO_NEXT);
        if ahead != NO_NEXT {
            let place = &mut places[ahead as usize];
            first = place.span.end;
            place.span.end += branch_size[node.at()];
            hops = place.hops + 1;
            express = match place.hops % EXPRESS_HOPS {
                0 => ahead,
                _ => place.express,
            };
        }
        let end = first + 1;
        places[node.at()] = Place {
            span: Span { first, end },
            hops,
            express,
        };
    }
    places
}
