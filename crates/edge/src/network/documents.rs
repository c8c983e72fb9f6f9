//! The network as text, written once.

use crate::words::node_id;
use bytes::Bytes;
use skyway_contract as wire;
use skyway_engine::network::Topology;
use std::borrow::Cow;

/// The network as text, written once.
#[derive(Debug)]
pub(crate) struct NetworkDocuments {
    /// The topology revision that the documents name.
    pub(crate) topology_revision: u64,
    /// The text that the network was read from; empty while there is no network.
    pub(crate) geojson: Bytes,
    pub(crate) compact: Bytes,
    pub(crate) etag: String,
}

impl NetworkDocuments {
    /// The network as GeoJSON.
    pub(crate) fn geojson(&self) -> &Bytes {
        &self.geojson
    }

    /// The documents of a network, of which `geojson` is the text it was read from.
    pub(crate) fn of(topology: &Topology, geojson: Bytes, topology_revision: u64) -> Self {
        // A map with text keys and finite numbers always has a JSON form.
        let compact = serde_json::to_vec(&compact(topology, topology_revision)).unwrap_or_default();
        let fingerprint = hex::encode(&topology.fingerprint()[..8]);
        Self {
            topology_revision,
            geojson,
            compact: Bytes::from(compact),
            etag: fingerprint,
        }
    }
}

fn compact(topology: &Topology, topology_revision: u64) -> wire::CompactNetwork<'_> {
    let frame = topology.frame();
    let nodes = topology.nodes();
    let coordinates = nodes.flat_map(|node| frame.from_plane(topology.position(node)));
    let segments = topology.segments().flat_map(|segment| {
        let ends = topology.segment(segment);
        [ends.from.0, ends.to.0]
    });
    let with_ids = topology
        .segments()
        .filter(|_| topology.has_stated_segment_ids());
    wire::CompactNetwork {
        name: Cow::Borrowed(topology.name()),
        attribution: Cow::Borrowed(topology.attribution()),
        geographic: frame.is_geographic(),
        ids: topology
            .nodes()
            .map(|node| node_id(topology, node))
            .collect(),
        coordinates: coordinates.collect(),
        pads: topology.nodes().map(|node| topology.pads(node)).collect(),
        segments: segments.collect(),
        segment_ids: with_ids
            .map(|segment| topology.segment_id(segment))
            .collect(),
        topology_revision,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};
    use skyway_formats::load_network;

    #[test]
    fn the_compact_form_has_ids_of_segments_where_one_is_stated() {
        let at = |id: &str, x: f64| json!({"type": "Feature", "id": id, "geometry": {"type": "Point", "coordinates": [x, 0.0]}});
        let joined = |from: &str, to: &str, x: f64, id: Value| {
            let line = json!({"type": "LineString", "coordinates": [[x, 0.0], [x + 500.0, 0.0]]});
            json!({"type": "Feature", "id": id, "geometry": line, "properties": {"from": from, "to": to}})
        };
        for (id, expected) in [
            (Value::Null, Value::Null),
            (json!("north-quay"), json!(["north-quay", "b-c"])),
        ] {
            let features = [
                at("a", 0.0),
                at("b", 500.0),
                at("c", 1000.0),
                joined("a", "b", 0.0, id),
                joined("b", "c", 500.0, Value::Null),
            ];
            let text = json!({"type": "FeatureCollection", "features": features,
                "skyway": {"format": 1, "coordinates": "planar"}});
            let network = load_network(&text.to_string()).expect("a network");
            let documents = NetworkDocuments::of(&network.topology, Bytes::new(), 1);
            let told: Value = serde_json::from_slice(&documents.compact).expect("JSON");
            assert_eq!(told["segment_ids"], expected, "{told}");
        }
    }
}
