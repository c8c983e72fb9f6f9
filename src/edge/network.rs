//! The network as clients see it.

use super::Edge;
use super::views;
use crate::network::{NodeIx, Role, Topology};
use crate::refusal::{Code, Refusal};
use crate::wire::{self, Fault};
use bytes::Bytes;
use std::borrow::Cow;

/// At most this many nodes near a place.
const NEAREST_MAX: u32 = 100;

/// The network as text, written once.
#[derive(Debug)]
pub(super) struct NetworkDocuments {
    geojson: Bytes,
    compact: Bytes,
    etag: String,
}

impl NetworkDocuments {
    /// The documents of a network, of which `geojson` is the text it was read from.
    pub(super) fn of(topology: &Topology, geojson: Bytes) -> Self {
        // A map with text keys and finite numbers always has a JSON form.
        let compact = serde_json::to_vec(&compact(topology)).unwrap_or_default();
        let fingerprint = super::answered::hex(&topology.fingerprint()[..8]);
        Self {
            geojson,
            compact: Bytes::from(compact),
            etag: fingerprint,
        }
    }
}

fn compact(topology: &Topology) -> wire::CompactNetwork<'_> {
    let frame = topology.frame();
    let nodes = topology.nodes();
    let coordinates = nodes.flat_map(|node| frame.from_plane(topology.position(node)));
    let segments = topology.segments().flat_map(|segment| {
        let ends = topology.segment(segment);
        [ends.from.0, ends.to.0]
    });
    wire::CompactNetwork {
        name: Cow::Borrowed(topology.name()),
        attribution: Cow::Borrowed(topology.attribution()),
        geographic: frame.is_geographic(),
        ids: topology
            .nodes()
            .map(|node| views::node_id(topology, node))
            .collect(),
        coordinates: coordinates.collect(),
        pads: topology.nodes().map(|node| topology.pads(node)).collect(),
        segments: segments.collect(),
        topology_revision: 1,
    }
}

impl Edge {
    /// The network as GeoJSON, and its entity tag.
    pub fn network_geojson(&self) -> (Bytes, String) {
        let documents = &self.documents;
        (
            documents.geojson.clone(),
            format!("\"{}-g\"", documents.etag),
        )
    }

    /// The network in index form, and its entity tag.
    pub fn network_compact(&self) -> (Bytes, String) {
        let documents = &self.documents;
        (
            documents.compact.clone(),
            format!("\"{}-c\"", documents.etag),
        )
    }

    /// A node with its segments.
    ///
    /// # Errors
    /// When the network has none of this id.
    pub fn node(&self, id: &str) -> Result<wire::Node<'static>, Refusal> {
        let snapshot = self.snapshot();
        let topology = snapshot.topology();
        let node = topology
            .node(id)
            .ok_or_else(|| Refusal::not_found("node", id))?;
        let closed = snapshot.airspace.closed();
        let segments = topology.arcs(node).iter().map(|arc| wire::NodeSegment {
            id: Cow::Owned(topology.segment_id(arc.segment).into_owned()),
            to: views::node_id(topology, arc.to),
            length_m: topology.segment(arc.segment).length_m,
            closed: closed.blocks(arc.segment),
        });
        Ok(wire::Node {
            id: views::node_id(topology, node),
            name: topology.node_name(node).map(views::text),
            location: topology.frame().from_plane(topology.position(node)),
            altitude_m: topology
                .node_altitude(node)
                .map(|altitude| altitude.value_m),
            pads: topology.pads(node),
            role: Cow::Borrowed(match topology.role(node) {
                Role::DeliveryTarget => "delivery_target",
                Role::RechargingStation => "recharging_station",
                Role::Both => "both",
            }),
            closed: closed.closes_node(node),
            pads_closed: snapshot.airspace.closes_pads(node),
            segments: segments.collect(),
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// The `k` nodes nearest to a place, nearest first.
    ///
    /// # Errors
    /// When the place is none, or `k` is not between 1 and 100.
    pub fn nearest(&self, place: [f64; 2], k: u32) -> Result<wire::Nearest<'static>, Refusal> {
        if k == 0 || k > NEAREST_MAX {
            return Err(invalid(
                "?k",
                format!("{k} is not between 1 and {NEAREST_MAX}"),
                None,
            ));
        }
        let snapshot = self.snapshot();
        let topology = snapshot.topology();
        let frame = topology.frame();
        let [first, second] = place;
        if frame.is_geographic() && (first.abs() > 180.0 || second.abs() > 90.0) {
            let hint = "longitude comes first: were they swapped?".to_owned();
            return Err(invalid(
                "?lat",
                format!("[{first}, {second}] is not on Earth"),
                Some(hint),
            ));
        }
        let point = frame.to_plane(place);
        if !point.is_finite() {
            return Err(invalid("?lon", "the place is not finite".to_owned(), None));
        }
        let boxes = topology
            .node_tree()
            .nearest_neighbor_iter(&[point.x as f32, point.y as f32]);
        // The tree's boxes are rounded outwards, so neighbours in a row may come swapped: look a little further.
        let mut near: Vec<(f64, NodeIx)> = boxes
            .take(k as usize + 8)
            .map(|boxed| (topology.position(boxed.node).distance_m(point), boxed.node))
            .collect();
        near.sort_by(|left, right| left.0.total_cmp(&right.0).then(left.1.cmp(&right.1)));
        near.truncate(k as usize);
        let nodes = near.into_iter().map(|(distance_m, node)| wire::NearNode {
            id: views::node_id(topology, node),
            location: frame.from_plane(topology.position(node)),
            distance_m,
            pads: topology.pads(node),
            closed: snapshot.airspace.closed().closes_node(node),
        });
        Ok(wire::Nearest {
            nodes: nodes.collect(),
            stamp: self.stamp_of(&snapshot),
        })
    }
}

fn invalid(pointer: &str, message: String, hint: Option<String>) -> Refusal {
    let fault = Fault {
        code: "out_of_range".to_owned(),
        pointer: pointer.to_owned(),
        message,
        hint,
    };
    Refusal::at(Code::ParameterInvalid, fault)
}
