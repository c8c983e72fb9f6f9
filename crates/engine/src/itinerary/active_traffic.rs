//! Where a search keeps apart from other plans.
//!
//! Most plans meet few others. So a search first ignores them, and a plan that meets some is looked for
//! again with them, at all segments and nodes of its way. What ignores others may only be better: a plan
//! found so that meets none is the best of all.

use crate::airspace::Bits;
use crate::flight::{FlightPlan, TrafficLeg};
use crate::network::{NodeIx, SegmentIx, Topology};

/// The segments and nodes at which others count.
#[derive(Debug, Default)]
pub(super) struct ActiveTraffic {
    is_everywhere: bool,
    segments: Bits,
    nodes: Bits,
    /// The same as lists.
    listed_segments: Vec<SegmentIx>,
    listed_nodes: Vec<NodeIx>,
    /// The legs of others that the plans of this search have met so far, and how many plans of all searches did.
    met_legs: Vec<TrafficLeg>,
    met: u64,
}

impl ActiveTraffic {
    /// Others count nowhere; room for a topology.
    pub(super) fn nowhere(topology: &Topology) -> Self {
        Self {
            segments: Bits::empty(topology.segment_count()),
            nodes: Bits::empty(topology.node_count()),
            ..Self::default()
        }
    }

    /// Others count everywhere.
    pub(super) fn everywhere() -> Self {
        Self {
            is_everywhere: true,
            ..Self::default()
        }
    }

    /// Others count nowhere any more; those that were met are remembered until the next search.
    pub(super) fn clear(&mut self) {
        self.is_everywhere = false;
        for segment in self.listed_segments.drain(..) {
            self.segments.remove(segment.0);
        }
        for node in self.listed_nodes.drain(..) {
            self.nodes.remove(node.0);
        }
    }

    /// Others count everywhere from now on.
    pub(super) fn widen(&mut self) {
        self.is_everywhere = true;
    }

    #[inline]
    pub(super) fn has_segment(&self, segment: SegmentIx) -> bool {
        self.is_everywhere || self.segments.contains(segment.0)
    }

    #[inline]
    pub(super) fn has_node(&self, node: NodeIx) -> bool {
        self.is_everywhere || self.nodes.contains(node.0)
    }

    /// Whether others may forbid entries of a segment between two nodes.
    #[inline]
    pub(super) fn concerns(&self, segment: SegmentIx, from: NodeIx, to: NodeIx) -> bool {
        self.has_segment(segment) || self.has_node(to) || self.has_node(from)
    }

    /// Whether others count everywhere.
    pub(super) fn is_everywhere(&self) -> bool {
        self.is_everywhere
    }

    /// Forgets whom the plans of earlier searches have met.
    pub(super) fn forget_met(&mut self) {
        self.met_legs.clear();
    }

    /// The legs of others that the plans of the last search have met, some of them twice.
    pub(super) fn met_legs(&self) -> &[TrafficLeg] {
        &self.met_legs
    }

    /// A plan has met others: they count on all of its segments and at all of its nodes from now on.
    pub(super) fn add_way(&mut self, plan: &FlightPlan, met: &[TrafficLeg]) {
        self.met += 1;
        self.met_legs.extend_from_slice(met);
        for leg in &plan.legs {
            if self.segments.insert(leg.segment.0) {
                self.listed_segments.push(leg.segment);
            }
            for node in [leg.from, leg.to] {
                if self.nodes.insert(node.0) {
                    self.listed_nodes.push(node);
                }
            }
        }
    }

    /// Adds the segments on which others count, and those of the nodes at which they do, some of them
    /// twice.
    pub(super) fn append_segments(&self, topology: &Topology, segments: &mut Vec<u32>) {
        if self.is_everywhere {
            segments.extend(topology.segments().map(|segment| segment.0));
            return;
        }
        segments.extend(self.listed_segments.iter().map(|segment| segment.0));
        for &node in &self.listed_nodes {
            let arcs = topology.arcs(node).iter();
            segments.extend(arcs.map(|arc| arc.segment.0));
        }
    }

    /// How many plans have met others so far, whatever is cleared.
    pub(super) fn met(&self) -> u64 {
        self.met
    }

    /// The nodes at which others count.
    pub(super) fn nodes(&self, topology: &Topology) -> impl Iterator<Item = NodeIx> {
        let every = topology.nodes().filter(|_| self.is_everywhere);
        let listed = self.listed_nodes.iter().copied();
        every.chain(listed.filter(|_| !self.is_everywhere))
    }
}
