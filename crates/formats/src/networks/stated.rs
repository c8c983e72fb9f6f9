//! A network as it would be stated: the way back from a topology to the draft that every format is written from.

use crate::network::{
    Coordinates, NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology,
};

/// A topology as it would be stated: nodes and segments in node order.
pub fn draft_of(topology: &Topology) -> NetworkDraft {
    let mut nodes: Vec<NodeIx> = topology.nodes().collect();
    nodes.sort_unstable_by_key(|&node| topology.rank(node));
    let mut segments: Vec<SegmentIx> = topology.segments().collect();
    segments.sort_unstable_by_key(|&segment| {
        let ends = topology.segment(segment);
        (topology.rank(ends.from), topology.rank(ends.to))
    });
    NetworkDraft {
        name: topology.name().to_owned(),
        attribution: topology.attribution().to_owned(),
        coordinates: match topology.frame().is_geographic() {
            true => Coordinates::Geographic,
            false => Coordinates::Planar,
        },
        integer_ids: topology.has_integer_ids(),
        nodes: nodes
            .into_iter()
            .map(|node| node_draft(topology, node))
            .collect(),
        segments: segments
            .into_iter()
            .map(|segment| segment_draft(topology, segment))
            .collect(),
        ..NetworkDraft::default()
    }
}

fn node_draft(topology: &Topology, node: NodeIx) -> NodeDraft {
    NodeDraft {
        id: topology.node_id(node).to_owned(),
        position: topology.frame().from_plane(topology.position(node)),
        altitude: topology.node_altitude(node),
        pads: topology.pads(node),
        role: topology.role(node),
        name: topology.node_name(node).map(str::to_owned),
    }
}

fn segment_draft(topology: &Topology, segment: SegmentIx) -> SegmentDraft {
    let stated = topology.segment(segment);
    let id = topology.segment_id(segment);
    let [from, to] = [stated.from, stated.to].map(|node| topology.node_id(node));
    let (first, second) = match topology.rank(stated.from) < topology.rank(stated.to) {
        true => (from, to),
        false => (to, from),
    };
    let is_derived = id == format!("{first}-{second}");
    SegmentDraft {
        id: (!is_derived).then(|| id.into_owned()),
        from: from.to_owned(),
        to: to.to_owned(),
        length_m: Some(stated.length_m),
        band: topology.segment_band(segment),
        speed_limit_mps: topology.speed_limit_mps(segment),
    }
}
