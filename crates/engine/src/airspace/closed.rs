//! What is closed: the standing closures of a snapshot, and on top of them those of one request.
//!
//! A segment is *blocked* when it is closed itself or one of its nodes is; that one bit is all a search
//! asks for. A node that is closed may still be left, over segments that are open, by a drone that is
//! there; it is never entered.

use super::bits::Bits;
use crate::network::{Arc, NodeIx, SegmentIx, Topology};

/// Closed nodes and segments, with what they block.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ClosedSet {
    pub(super) nodes: Bits,
    pub(super) segments: Bits,
    pub(super) blocked: Bits,
    pub(super) closed_nodes: usize,
    pub(super) blocked_segments: usize,
}

impl ClosedSet {
    /// Nothing is closed.
    pub fn empty(topology: &Topology) -> Self {
        Self {
            nodes: Bits::empty(topology.node_count()),
            segments: Bits::empty(topology.segment_count()),
            blocked: Bits::empty(topology.segment_count()),
            closed_nodes: 0,
            blocked_segments: 0,
        }
    }
}

impl ClosedSet {
    /// True when a segment is closed itself.
    pub fn closes_segment(&self, segment: SegmentIx) -> bool {
        self.segments.contains(segment.0)
    }

    /// True when a segment, or one of its nodes, is closed.
    pub fn blocks(&self, segment: SegmentIx) -> bool {
        self.blocked.contains(segment.0)
    }

    /// True when a node is closed.
    pub fn closes_node(&self, node: NodeIx) -> bool {
        self.nodes.contains(node.0)
    }

    /// The blocked segments, rising.
    pub fn blocked_segments(&self) -> impl Iterator<Item = SegmentIx> + '_ {
        self.blocked.iter().map(SegmentIx)
    }

    /// How many nodes are closed.
    pub fn closed_node_count(&self) -> usize {
        self.closed_nodes
    }

    /// How many segments are blocked.
    pub fn blocked_segment_count(&self) -> usize {
        self.blocked_segments
    }
}

/// The closures of one request, kept between requests so that resetting costs what was closed, not the network.
#[derive(Debug, Default)]
pub struct RequestClosures {
    set: ClosedSet,
    nodes: Vec<NodeIx>,
    segments: Vec<SegmentIx>,
    blocked: Vec<SegmentIx>,
}

impl RequestClosures {
    /// Room for the closures of requests on a topology; nothing is closed.
    pub fn new(topology: &Topology) -> Self {
        Self {
            set: ClosedSet::empty(topology),
            nodes: Vec::with_capacity(64),
            segments: Vec::with_capacity(64),
            blocked: Vec::with_capacity(256),
        }
    }

    /// Opens again what this request has closed.
    pub fn reset(&mut self) {
        for node in self.nodes.drain(..) {
            self.set.nodes.remove(node.0);
        }
        for segment in self.segments.drain(..) {
            self.set.segments.remove(segment.0);
        }
        for segment in self.blocked.drain(..) {
            self.set.blocked.remove(segment.0);
        }
        self.set.closed_nodes = 0;
        self.set.blocked_segments = 0;
    }

    /// Closes a segment for this request.
    pub fn close_segment(&mut self, segment: SegmentIx, standing: &ClosedSet) {
        if self.set.segments.insert(segment.0) {
            self.segments.push(segment);
            self.block(segment, standing);
        }
    }

    /// Closes a node for this request, and with it blocks its segments.
    pub fn close_node(&mut self, node: NodeIx, topology: &Topology, standing: &ClosedSet) {
        if !self.set.nodes.insert(node.0) {
            return;
        }
        self.nodes.push(node);
        self.set.closed_nodes += usize::from(!standing.nodes.contains(node.0));
        for arc in topology.arcs(node) {
            self.block(arc.segment, standing);
        }
    }

    /// The segments that this request closed itself, in the order they were closed.
    pub fn segments(&self) -> &[SegmentIx] {
        &self.segments
    }

    /// The nodes that this request closed, in the order they were closed.
    pub fn nodes(&self) -> &[NodeIx] {
        &self.nodes
    }

    fn block(&mut self, segment: SegmentIx, standing: &ClosedSet) {
        if self.set.blocked.insert(segment.0) {
            self.blocked.push(segment);
            self.set.blocked_segments += usize::from(!standing.blocked.contains(segment.0));
        }
    }
}

/// Everything that is closed for one request: what a search asks.
#[derive(Clone, Copy, Debug)]
pub struct Closed<'a> {
    topology: &'a Topology,
    standing: &'a ClosedSet,
    request: &'a ClosedSet,
    request_blocked: &'a [SegmentIx],
}

impl<'a> Closed<'a> {
    /// The standing closures with those of a request on top.
    pub fn new(
        topology: &'a Topology,
        standing: &'a ClosedSet,
        request: &'a RequestClosures,
    ) -> Self {
        Self {
            topology,
            standing,
            request: &request.set,
            request_blocked: &request.blocked,
        }
    }

    /// The topology these closures are on.
    pub fn topology(&self) -> &'a Topology {
        self.topology
    }

    /// True when a segment, or one of its nodes, is closed.
    #[inline]
    pub fn blocks(&self, segment: SegmentIx) -> bool {
        self.standing.blocked.contains(segment.0) || self.request.blocked.contains(segment.0)
    }

    /// True when a segment is closed itself.
    pub fn closes_segment(&self, segment: SegmentIx) -> bool {
        self.standing.segments.contains(segment.0) || self.request.segments.contains(segment.0)
    }

    /// True when a node is closed.
    #[inline]
    pub fn closes_node(&self, node: NodeIx) -> bool {
        self.standing.nodes.contains(node.0) || self.request.nodes.contains(node.0)
    }

    /// True when a drone at a node that is closed can leave by the arc: segment and far node are open.
    pub fn lets_out(&self, arc: &Arc) -> bool {
        !self.closes_segment(arc.segment) && !self.closes_node(arc.to)
    }

    /// True when a drone at `from` can fly the arc; a closed node is left, never entered.
    #[inline]
    pub fn lets_pass(&self, from: NodeIx, arc: &Arc) -> bool {
        !self.blocks(arc.segment) || (self.closes_node(from) && self.lets_out(arc))
    }

    /// How many nodes are open.
    pub fn open_nodes(&self) -> usize {
        self.topology.node_count() - self.standing.closed_nodes - self.request.closed_nodes
    }

    /// How many segments are open at both ends and themselves.
    pub fn open_segments(&self) -> usize {
        self.topology.segment_count()
            - self.standing.blocked_segments
            - self.request.blocked_segments
    }

    /// All that is blocked, where nothing stands closed but what this request closed; else `None`.
    pub fn blocked_by_request(&self) -> Option<&'a [SegmentIx]> {
        (self.standing.blocked_segments == 0).then_some(self.request_blocked)
    }

    /// True when this request, rather than a standing closure, closes the segment or one of its nodes.
    pub fn request_blocks(&self, segment: SegmentIx) -> bool {
        self.request.blocked.contains(segment.0)
    }

    /// The closed nodes, rising.
    pub fn closed_nodes(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.topology.nodes().filter(|&node| self.closes_node(node))
    }

    /// The segments that are closed themselves, rising.
    pub fn closed_segments(&self) -> impl Iterator<Item = SegmentIx> + '_ {
        self.topology
            .segments()
            .filter(|&segment| self.closes_segment(segment))
    }
}
