//! Two networks side by side: which nodes and segments of one are those of the other.
//!
//! Indices mean nothing outside their topology, ids do. What is kept from an old network is carried over to a new
//! one by its ids. A drone can go on flying only where nothing has moved: that is told apart from what merely
//! bears the same id.

use super::identity::{NodeIx, SegmentIds, SegmentIx};
use super::topology::Topology;
use crate::geo::Frame;

/// A node that is farther than this from where it was has moved, in metres.
const MOVED_M: f64 = 0.01;
/// The same in degrees, which is at most a centimetre.
const MOVED_DEG: f64 = 1e-7;
/// Lengths that were worked out on two planes differ by less than this share.
const PLANES_DIFFER: f64 = 1e-3;

/// Which nodes and segments of a topology are those of another.
#[derive(Debug)]
pub struct Correspondence {
    nodes: Vec<Option<NodeIx>>,
    segments: Vec<Option<SegmentIx>>,
    unchanged: Vec<bool>,
}

impl Correspondence {
    /// Looks up everything of one topology in another by its ids. Costs a pass over the network.
    pub fn between(from: &Topology, to: &Topology) -> Self {
        let nodes: Vec<Option<NodeIx>> = from
            .nodes()
            .map(|node| to.node(from.node_id(node)))
            .collect();
        let segments: Vec<Option<SegmentIx>> = from
            .segments()
            .map(|segment| same_segment(from, to, &nodes, segment))
            .collect();
        let stays: Vec<bool> = from
            .nodes()
            .map(|node| nodes[node.at()].is_some_and(|other| is_at(from, node, to, other)))
            .collect();
        let unchanged = from.segments().map(|segment| {
            let ends = from.segment(segment);
            let stay = stays[ends.from.at()] && stays[ends.to.at()];
            let other = segments[segment.at()].filter(|_| stay);
            other.is_some_and(|other| is_flown_alike(from, segment, to, other, &nodes))
        });
        Self {
            unchanged: unchanged.collect(),
            nodes,
            segments,
        }
    }

    /// The node with the id of a node; `None` where there is none any more.
    pub fn node(&self, node: NodeIx) -> Option<NodeIx> {
        self.nodes[node.at()]
    }

    /// The segment with the id of a segment; `None` where there is none any more.
    pub fn segment(&self, segment: SegmentIx) -> Option<SegmentIx> {
        self.segments[segment.at()]
    }

    /// The segment that is flown as a segment was: between the same nodes in the same places, equally long and in the
    /// same band.
    pub fn unchanged(&self, segment: SegmentIx) -> Option<SegmentIx> {
        self.segments[segment.at()].filter(|_| self.unchanged[segment.at()])
    }
}

fn same_segment(
    from: &Topology,
    to: &Topology,
    nodes: &[Option<NodeIx>],
    segment: SegmentIx,
) -> Option<SegmentIx> {
    match (&from.segment_ids, &to.segment_ids) {
        // Ids made of the nodes need not be written out to be compared.
        (SegmentIds::Derived, SegmentIds::Derived) => {
            let ends = from.segment(segment);
            to.segment_between(nodes[ends.from.at()]?, nodes[ends.to.at()]?)
        }
        _ => to.find_segment(&from.segment_id(segment)),
    }
}

/// Whether two nodes are in the same place, whatever planes their networks are laid on.
fn is_at(from: &Topology, node: NodeIx, to: &Topology, other: NodeIx) -> bool {
    let (old, new) = (from.position(node), to.position(other));
    match (from.frame(), to.frame()) {
        (Frame::Planar, Frame::Planar) => old.distance_m(new) <= MOVED_M,
        (Frame::Geographic(_), Frame::Geographic(_)) => {
            let (old, new) = (from.frame().from_plane(old), to.frame().from_plane(new));
            let mut apart = old.iter().zip(&new).map(|(old, new)| (old - new).abs());
            apart.all(|degrees| degrees <= MOVED_DEG)
        }
        _ => false,
    }
}

fn is_flown_alike(
    from: &Topology,
    segment: SegmentIx,
    to: &Topology,
    other: SegmentIx,
    nodes: &[Option<NodeIx>],
) -> bool {
    let (old, new) = (from.segment(segment), to.segment(other));
    let ends = [nodes[old.from.at()], nodes[old.to.at()]];
    let same_ends =
        ends == [Some(new.from), Some(new.to)] || ends == [Some(new.to), Some(new.from)];
    let apart_m = (old.length_m - new.length_m).abs();
    same_ends
        && apart_m <= MOVED_M.max(old.length_m * PLANES_DIFFER)
        && from.segment_band(segment) == to.segment_band(other)
        && from.speed_limit_mps(segment) == to.speed_limit_mps(other)
        && [(old.from, ends[0]), (old.to, ends[1])]
            .iter()
            .all(|&(end, other)| other.is_some_and(|other| is_as_high(from, end, to, other)))
}

/// Whether drones land at the same height at two nodes.
fn is_as_high(from: &Topology, node: NodeIx, to: &Topology, other: NodeIx) -> bool {
    from.node_altitude(node) == to.node_altitude(other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};

    fn node(id: &str, x: f64, y: f64) -> NodeDraft {
        NodeDraft {
            id: id.to_owned(),
            position: [x, y],
            ..NodeDraft::default()
        }
    }

    fn segment(from: &str, to: &str) -> SegmentDraft {
        SegmentDraft {
            from: from.to_owned(),
            to: to.to_owned(),
            ..SegmentDraft::default()
        }
    }

    fn build(nodes: &[NodeDraft], segments: &[SegmentDraft], coordinates: Coordinates) -> Topology {
        let draft = NetworkDraft {
            nodes: nodes.to_vec(),
            segments: segments.to_vec(),
            coordinates,
            ..NetworkDraft::default()
        };
        Topology::build(draft, [0; 32]).expect("a network")
    }

    #[test]
    fn what_is_gone_has_no_match_and_what_moved_is_not_flown_on() {
        let nodes = [
            node("a", 0.0, 0.0),
            node("b", 100.0, 0.0),
            node("c", 200.0, 0.0),
            node("d", 300.0, 0.0),
        ];
        let segments = [segment("a", "b"), segment("b", "c"), segment("c", "d")];
        let old = build(&nodes, &segments, Coordinates::Planar);
        let moved = [
            node("d", 300.0, 40.0),
            node("c", 200.0, 0.0),
            node("b", 100.0, 0.0),
        ];
        let new = build(&moved, &segments[1..], Coordinates::Planar);
        let found = Correspondence::between(&old, &new);
        let at = |id| found.node(old.node(id).expect("a node"));
        assert_eq!((at("a"), at("d")), (None, new.node("d")));
        let line = |id| old.find_segment(id).expect("a segment");
        assert_eq!(found.segment(line("a-b")), None);
        assert_eq!(found.unchanged(line("b-c")), new.find_segment("b-c"));
        assert_eq!(found.segment(line("c-d")), new.find_segment("c-d"));
        assert_eq!(found.unchanged(line("c-d")), None, "its end has moved");
    }

    #[test]
    fn a_plane_about_another_place_moves_nothing() {
        let nodes = [node("a", 151.2, -33.86), node("b", 151.21, -33.87)];
        let far = node("far", 151.4, -33.6);
        let old = build(&nodes, &[segment("a", "b")], Coordinates::Geographic);
        let more = [nodes[0].clone(), nodes[1].clone(), far];
        let new = build(&more, &[segment("b", "a")], Coordinates::Geographic);
        let found = Correspondence::between(&old, &new);
        let line = old.find_segment("a-b").expect("a segment");
        assert!(found.unchanged(line).is_some());
        let planar = build(&[node("a", 0.0, 0.0)], &[], Coordinates::Planar);
        let none = Correspondence::between(&planar, &new);
        assert!(none.node(NodeIx(0)).is_some());
    }
}
