//! Which segments and nodes a zone closes.
//!
//! The network's R-trees are walked from the root: what lies under a box wholly outside the zone is
//! left out, what lies under a box wholly inside is taken, both without another look; exact geometry
//! decides along the zone's boundary only.

use super::zone::Zone;
use crate::geo::{AltitudeBand, Bounds, BoxRelation, Point};
use crate::network::{NodeBox, NodeIx, SegmentBox, SegmentIx, Topology};
use rstar::{AABB, ParentNode, RTreeNode, RTreeObject};

/// What a zone closes, whenever it counts.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Hits {
    /// The segments whose line, widened by the margin, meets the zone in its band; rising.
    pub segments: Vec<SegmentIx>,
    /// The nodes that, widened likewise, lie in the zone in its band; rising. Their segments are all hit
    /// too, unless altitudes keep them apart.
    pub nodes: Vec<NodeIx>,
}

impl Hits {
    /// Hits from lists in any order.
    pub fn new(mut segments: Vec<SegmentIx>, mut nodes: Vec<NodeIx>) -> Self {
        segments.sort_unstable();
        segments.dedup();
        nodes.sort_unstable();
        nodes.dedup();
        Self { segments, nodes }
    }

    /// What a zone closes: nothing where it is only shown. Pure and without locks, so that
    /// it can be computed beside the writer.
    pub fn of(topology: &Topology, zone: &Zone) -> Self {
        if !zone.terms().closes() {
            return Self::default();
        }
        Self::new(segment_hits(topology, zone), node_hits(topology, zone))
    }
}

fn segment_hits(topology: &Topology, zone: &Zone) -> Vec<SegmentIx> {
    let mut found = Vec::new();
    let in_band = |segment: SegmentIx| zone.band().may_meet(&topology.segment_band(segment));
    let mut take = |boxed: &SegmentBox, certainty| {
        let segment = boxed.segment;
        let is_hit = match certainty {
            Certainty::Inside => in_band(segment),
            Certainty::Unknown => {
                let (from, to) = topology.segment_ends(segment);
                zone.closes_line(from, to, &topology.segment_band(segment))
            }
        };
        if is_hit {
            found.push(segment);
        }
    };
    walk(topology.segment_tree().root(), zone, &mut take);
    found
}

fn node_hits(topology: &Topology, zone: &Zone) -> Vec<NodeIx> {
    let mut found = Vec::new();
    let mut take = |boxed: &NodeBox, certainty| {
        let node = boxed.node;
        let altitude = topology.node_altitude(node);
        let is_hit = match certainty {
            Certainty::Inside => zone.band().may_meet(&AltitudeBand::at(altitude)),
            Certainty::Unknown => zone.closes_point(topology.position(node), altitude),
        };
        if is_hit {
            found.push(node);
        }
    };
    walk(topology.node_tree().root(), zone, &mut take);
    found
}

/// What the boxes around a leaf have settled.
#[derive(Clone, Copy, PartialEq)]
enum Certainty {
    /// It lies in the zone.
    Inside,
    /// Exact geometry has to decide.
    Unknown,
}

/// Hands `take` every leaf that may lie in the zone.
fn walk<T, F>(parent: &ParentNode<T>, zone: &Zone, take: &mut F)
where
    T: RTreeObject<Envelope = AABB<[f32; 2]>>,
    F: FnMut(&T, Certainty),
{
    for child in parent.children() {
        match child {
            RTreeNode::Leaf(leaf) => take(leaf, Certainty::Unknown),
            RTreeNode::Parent(parent) => {
                let bounds = bounds_of(&parent.envelope());
                match zone.shape().relation_to_box(bounds, zone.margin_m()) {
                    BoxRelation::Outside => {}
                    BoxRelation::Inside => take_all(parent, take),
                    BoxRelation::Crosses => walk(parent, zone, take),
                }
            }
        }
    }
}

/// Hands `take` every leaf below, as lying in the zone.
fn take_all<T, F>(parent: &ParentNode<T>, take: &mut F)
where
    T: RTreeObject<Envelope = AABB<[f32; 2]>>,
    F: FnMut(&T, Certainty),
{
    for child in parent.children() {
        match child {
            RTreeNode::Leaf(leaf) => take(leaf, Certainty::Inside),
            RTreeNode::Parent(parent) => take_all(parent, take),
        }
    }
}

fn bounds_of(envelope: &AABB<[f32; 2]>) -> Bounds {
    let point = |corner: [f32; 2]| Point::new(f64::from(corner[0]), f64::from(corner[1]));
    Bounds {
        min: point(envelope.lower()),
        max: point(envelope.upper()),
    }
}
