//! A way through the network: what a search finds and an answer says.

use crate::geo::total_m;
use crate::network::{NodeIx, SegmentIx, Topology};

/// A walk in the network: one segment fewer than nodes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Path {
    /// The nodes, from the first to the last.
    pub nodes: Vec<NodeIx>,
    /// The segments between them.
    pub segments: Vec<SegmentIx>,
}

impl Path {
    /// The sum of the segments' lengths, in metres.
    pub fn length_m(&self, topology: &Topology) -> f64 {
        let lengths = self.segments.iter();
        total_m(lengths.map(|&segment| topology.segment(segment).length_m))
    }

    /// Adds a segment and the node it leads to.
    pub fn push(&mut self, segment: SegmentIx, node: NodeIx) {
        self.segments.push(segment);
        self.nodes.push(node);
    }
}
