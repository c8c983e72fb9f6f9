//! The topology: nodes and segments in the form that searches read, immutable once built.
//!
//! Nodes are numbered along a Hilbert curve, so that neighbours on the map are neighbours in memory,
//! and their segments lie in one compact adjacency array. Indices mean nothing outside the topology;
//! ids do. What changes often (zones, closures) is not here but in [`crate::airspace`].

use super::density::DensityGrid;
use super::draft::Role;
use super::identity::{NodeIds, NodeIx, SegmentIds, SegmentIx};
use super::index::{NodeBox, SegmentBox};
use crate::geo::{Altitude, AltitudeBand, Bounds, Frame, Point};
use rstar::RTree;
use std::borrow::Cow;

/// One direction of a segment, as the adjacency array holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Length of the segment, in metres.
    pub length_m: f64,
    /// The node it leads to.
    pub to: NodeIx,
    /// The segment it is a direction of.
    pub segment: SegmentIx,
}

/// A segment: two nodes and a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Length in metres, as stated or else the straight line; finite and above 0.
    pub length_m: f64,
    /// The node that the file names first.
    pub from: NodeIx,
    /// The node that the file names second.
    pub to: NodeIx,
}

/// What is known of a node beside its position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NodeFacts {
    pub(super) altitude: Option<Altitude>,
    pub(super) pads: u16,
    pub(super) role: Role,
    pub(super) name: Option<Box<str>>,
}

/// The skyway network, checked and indexed. Built by [`Topology::build`].
#[derive(Debug)]
pub struct Topology {
    pub(super) name: String,
    pub(super) attribution: String,
    pub(super) frame: Frame,
    pub(super) node_ids: NodeIds,
    pub(super) segment_ids: SegmentIds,
    pub(super) positions: Vec<Point>,
    pub(super) facts: Vec<NodeFacts>,
    pub(super) first_arc: Vec<u32>,
    pub(super) arcs: Vec<Arc>,
    pub(super) segments: Vec<Segment>,
    /// A digest of all positions: where two topologies differ in it, nodes lie elsewhere.
    pub(super) layout: u64,
    /// One band for all segments, or one each.
    pub(super) bands: Vec<AltitudeBand>,
    /// Speed limits where there are any, in metres per second, sorted by segment.
    pub(super) speed_limits: Vec<(SegmentIx, f64)>,
    pub(super) bounds: Bounds,
    pub(super) straight_line_scale: f64,
    pub(super) density: DensityGrid,
    pub(super) nodes_nearby: RTree<NodeBox>,
    pub(super) segments_nearby: RTree<SegmentBox>,
    pub(super) fingerprint: [u8; 32],
    pub(super) fingerprint_text: String,
}

impl Topology {
    /// The name for people.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Who must be named beside every copy; empty if no one.
    pub fn attribution(&self) -> &str {
        &self.attribution
    }

    /// What the coordinates of the file mean.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// SHA-256 of the text that the network was loaded from.
    pub fn fingerprint(&self) -> &[u8; 32] {
        &self.fingerprint
    }

    /// The same in hexadecimal digits, as answers carry it.
    pub fn fingerprint_text(&self) -> &str {
        &self.fingerprint_text
    }

    /// How many nodes there are.
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// How many segments there are.
    pub fn segment_count(&self) -> usize {
        self.segments.len()
    }

    /// All nodes, in index order.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = NodeIx> + use<> {
        (0..self.positions.len() as u32).map(NodeIx)
    }

    /// All segments, in index order.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = SegmentIx> + use<> {
        (0..self.segments.len() as u32).map(SegmentIx)
    }

    /// The id of a node, as the file has it.
    pub fn node_id(&self, node: NodeIx) -> &str {
        self.node_ids.id(node)
    }

    /// The node of an id; an id that was merged away leads to the node that took its place.
    pub fn node(&self, id: &str) -> Option<NodeIx> {
        self.node_ids.find(id)
    }

    /// True when the file writes its ids as integers; files that are written of it then do too.
    pub fn has_integer_ids(&self) -> bool {
        self.node_ids.are_integers()
    }

    /// The place of a node in node order, from 0: numeric when all ids are integers, else by bytes.
    pub fn rank(&self, node: NodeIx) -> u32 {
        self.node_ids.rank(node)
    }

    /// True when the file states the id of a segment at least.
    pub fn has_stated_segment_ids(&self) -> bool {
        matches!(self.segment_ids, SegmentIds::Stated { .. })
    }

    /// The id of a segment: as stated, or `"A-B"` with the node first in node order first.
    pub fn segment_id(&self, segment: SegmentIx) -> Cow<'_, str> {
        match &self.segment_ids {
            SegmentIds::Stated { by_index, .. } => Cow::Borrowed(&by_index[segment.at()]),
            SegmentIds::Derived => {
                let ends = self.segment(segment);
                Cow::Owned(self.node_ids.pair(ends.from, ends.to))
            }
        }
    }

    /// The segment of an id; a segment is also found by its nodes, `"A-B"` or `"B-A"`.
    ///
    /// Ids of nodes may have hyphens themselves: what names two segments in this way names none.
    pub fn find_segment(&self, id: &str) -> Option<SegmentIx> {
        if let SegmentIds::Stated { by_id, .. } = &self.segment_ids
            && let Some(&stated) = by_id.get(id)
        {
            return Some(stated);
        }
        let mut only = None;
        let mut is_clear = true;
        for (hyphen, _) in id.match_indices('-') {
            let ends = self.node(&id[..hyphen]).zip(self.node(&id[hyphen + 1..]));
            let Some(found) = ends.and_then(|(from, to)| self.segment_between(from, to)) else {
                continue;
            };
            if self.segment_id(found) == id {
                return Some(found);
            }
            is_clear &= only.is_none_or(|other| other == found);
            only = Some(found);
        }
        only.filter(|_| is_clear)
    }

    /// The segment between two nodes, in either direction.
    pub fn segment_between(&self, from: NodeIx, to: NodeIx) -> Option<SegmentIx> {
        let arcs = self.arcs(from);
        arcs.iter().find(|arc| arc.to == to).map(|arc| arc.segment)
    }

    /// A segment's ends and length.
    pub fn segment(&self, segment: SegmentIx) -> Segment {
        self.segments[segment.at()]
    }

    /// The positions of a segment's ends.
    pub fn segment_ends(&self, segment: SegmentIx) -> (Point, Point) {
        let ends = self.segment(segment);
        (self.position(ends.from), self.position(ends.to))
    }

    /// The altitudes a segment is flown at.
    pub fn segment_band(&self, segment: SegmentIx) -> AltitudeBand {
        match self.bands.as_slice() {
            [one_for_all] => *one_for_all,
            each => each[segment.at()],
        }
    }

    /// Fastest ground speed allowed on a segment, in metres per second; `None` when there is no limit.
    pub fn speed_limit_mps(&self, segment: SegmentIx) -> Option<f64> {
        let place = self
            .speed_limits
            .binary_search_by_key(&segment, |&(limited, _)| limited)
            .ok()?;
        Some(self.speed_limits[place].1)
    }

    /// The segments at a node, as arcs away from it.
    pub fn arcs(&self, node: NodeIx) -> &[Arc] {
        let first = self.first_arc[node.at()] as usize;
        let end = self.first_arc[node.at() + 1] as usize;
        &self.arcs[first..end]
    }

    /// Where a node is, in metres of the plane.
    pub fn position(&self, node: NodeIx) -> Point {
        self.positions[node.at()]
    }

    /// Where all nodes are, by index.
    pub fn positions(&self) -> &[Point] {
        &self.positions
    }

    /// A digest of all positions: topologies that differ in it have their nodes elsewhere.
    pub fn layout(&self) -> u64 {
        self.layout
    }

    /// Altitude of a node's landing site, where known.
    pub fn node_altitude(&self, node: NodeIx) -> Option<Altitude> {
        self.facts[node.at()].altitude
    }

    /// Number of recharging pads at a node.
    pub fn pads(&self, node: NodeIx) -> u16 {
        self.facts[node.at()].pads
    }

    /// What a node is for.
    pub fn role(&self, node: NodeIx) -> Role {
        self.facts[node.at()].role
    }

    /// A node's name for people.
    pub fn node_name(&self, node: NodeIx) -> Option<&str> {
        self.facts[node.at()].name.as_deref()
    }

    /// The smallest box around all nodes, closed or not.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The paper's *network size*: the longer side of the bounding box of all nodes, in metres.
    pub fn size_m(&self) -> f64 {
        self.bounds.longer_side_m()
    }

    /// The smallest `length / straight line` of all segments; 0 where no segment has a straight line.
    ///
    /// A stated length can be shorter than the straight line (rounding, survey). The straight line times
    /// this factor is a lower bound of the way between any two nodes all the same.
    pub fn straight_line_scale(&self) -> f64 {
        self.straight_line_scale
    }

    /// Node counts on the default grid of the cell density-based strategy.
    pub fn density(&self) -> &DensityGrid {
        &self.density
    }

    /// The R-tree of all nodes.
    pub fn node_tree(&self) -> &RTree<NodeBox> {
        &self.nodes_nearby
    }

    /// The R-tree of all segments.
    pub fn segment_tree(&self) -> &RTree<SegmentBox> {
        &self.segments_nearby
    }
}
