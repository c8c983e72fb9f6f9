//! What a proof is checked against: the nodes and segments of a network, by their ids.

use crate::network::Topology;
use rustc_hash::FxHashMap;

/// A segment: its id, its nodes and its length.
#[derive(Debug)]
pub(super) struct SegmentFacts {
    pub(super) id: String,
    pub(super) ends: [usize; 2],
    /// Metres; finite and above 0.
    pub(super) length_m: f64,
}

/// The facts of a network that a certificate is about, in plain lists.
///
/// Of the loaded network only ids, the ends and lengths of segments and the fingerprint are read: not the
/// adjacency, the trees or the order that searches use.
#[derive(Debug)]
pub struct NetworkFacts {
    pub(super) sha256: String,
    pub(super) node_ids: Vec<String>,
    pub(super) segments: Vec<SegmentFacts>,
    nodes_by_id: FxHashMap<String, usize>,
    segments_by_id: FxHashMap<String, usize>,
}

impl NetworkFacts {
    /// The facts of a network as its loader read them.
    pub fn of(topology: &Topology) -> Self {
        let node_ids: Vec<String> = topology
            .nodes()
            .map(|node| topology.node_id(node).to_owned())
            .collect();
        let segments: Vec<SegmentFacts> = topology
            .segments()
            .map(|segment| {
                let stated = topology.segment(segment);
                SegmentFacts {
                    id: topology.segment_id(segment).into_owned(),
                    ends: [stated.from.at(), stated.to.at()],
                    length_m: stated.length_m,
                }
            })
            .collect();
        let nodes_by_id = (0..).zip(&node_ids).map(|(node, id)| (id.clone(), node));
        let segments_by_id = (0..)
            .zip(&segments)
            .map(|(segment, facts)| (facts.id.clone(), segment));
        Self {
            sha256: topology.fingerprint_text().to_owned(),
            nodes_by_id: nodes_by_id.collect(),
            segments_by_id: segments_by_id.collect(),
            node_ids,
            segments,
        }
    }

    pub(super) fn node(&self, id: &str) -> Option<usize> {
        self.nodes_by_id.get(id).copied()
    }

    pub(super) fn segment(&self, id: &str) -> Option<usize> {
        self.segments_by_id.get(id).copied()
    }
}
