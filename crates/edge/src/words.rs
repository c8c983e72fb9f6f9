//! Ids, instants and outcomes in the words of the wire.

use jiff::Timestamp;
use sha2::{Digest, Sha256};
use skyway_contract as wire;
use skyway_engine::geo::AltitudeReference;
use skyway_engine::network::{NodeIx, SegmentIx, Topology};
use skyway_engine::recompose::Outcome;
use skyway_engine::routing::Path;
use std::borrow::Cow;

/// The airframe of an edge that plans by distance, in answers and settings.
pub(super) const NO_AIRFRAME: &str = "none";
/// Bytes of a weather's digest that are its version.
const VERSION_BYTES: usize = 8;

pub(super) fn node_id(topology: &Topology, node: NodeIx) -> wire::Id<'static> {
    wire::Id::new(topology.node_id(node).to_owned())
}

pub(super) fn node_ids(topology: &Topology, nodes: &[NodeIx]) -> Vec<wire::Id<'static>> {
    nodes.iter().map(|&node| node_id(topology, node)).collect()
}

pub(super) fn segment_ids(topology: &Topology, segments: &[SegmentIx]) -> Vec<Cow<'static, str>> {
    let ids = segments.iter().map(|&segment| topology.segment_id(segment));
    ids.map(|id| Cow::Owned(id.into_owned())).collect()
}

pub(super) fn text(text: &str) -> Cow<'static, str> {
    Cow::Owned(text.to_owned())
}

/// The network, as answers name it.
pub(super) fn network_name(topology: &Topology) -> wire::NetworkName<'_> {
    wire::NetworkName {
        name: Cow::Borrowed(topology.name()),
        sha256: Cow::Borrowed(topology.fingerprint_text()),
    }
}

pub(super) fn instant(instant: Timestamp) -> Cow<'static, str> {
    Cow::Owned(instant.to_string())
}

pub(super) fn path(topology: &Topology, way: &Path) -> wire::Path<'static> {
    wire::Path {
        nodes: node_ids(topology, &way.nodes),
        segments: segment_ids(topology, &way.segments),
    }
}

pub(super) fn outcome_name(outcome: Option<Outcome>) -> &'static str {
    outcome.map_or("composed", Outcome::name)
}

pub(super) fn warning(code: impl Into<Cow<'static, str>>, message: &str) -> wire::Warning<'static> {
    wire::Warning {
        code: code.into(),
        message: text(message),
    }
}

/// What a height is measured from, by its name on the wire.
pub(super) fn reference_name(reference: AltitudeReference) -> Cow<'static, str> {
    Cow::Borrowed(reference.name())
}

/// The version of a weather as an entity tag, quoted: the same weather has the same.
pub(super) fn weather_etag(text: &str) -> String {
    let digest = Sha256::digest(text.as_bytes());
    format!("\"{}\"", hex::encode(&digest[..VERSION_BYTES]))
}
