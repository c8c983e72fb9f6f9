//! The network as clients see it.

use super::id::Id;
use super::status::Stamp;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A segment at a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NodeSegment<'a> {
    /// The segment.
    pub id: Cow<'a, str>,
    /// The node at its other end.
    pub to: Id<'a>,
    /// Length in metres.
    pub length_m: f64,
    /// Whether it is closed now, itself or at one of its nodes.
    pub closed: bool,
}

/// A node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Node<'a> {
    /// The node.
    pub id: Id<'a>,
    /// A name for people.
    pub name: Option<Cow<'a, str>>,
    /// Where it is: longitude and latitude, or metres on a planar network.
    pub location: [f64; 2],
    /// Height in metres, by the network's own reference; null where none is known.
    pub altitude_m: Option<f64>,
    /// Recharging pads.
    pub pads: u16,
    /// `delivery`, `recharging` or `both`.
    pub role: Cow<'a, str>,
    /// Whether it is closed now.
    pub closed: bool,
    /// Whether its pads are closed now.
    pub pads_closed: bool,
    /// Its segments.
    pub segments: Vec<NodeSegment<'a>>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// A node near a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NearNode<'a> {
    /// The node.
    pub id: Id<'a>,
    /// Where it is.
    pub location: [f64; 2],
    /// How far it is in a straight line, in metres.
    pub distance_m: f64,
    /// Recharging pads.
    pub pads: u16,
    /// Whether it is closed now.
    pub closed: bool,
}

/// The nodes nearest to a place, nearest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Nearest<'a> {
    /// The nodes.
    pub nodes: Vec<NearNode<'a>>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// The network in index form, for drawing: `GET /v1/network?format=compact`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct CompactNetwork<'a> {
    /// Name of the network.
    pub name: Cow<'a, str>,
    /// Where the data come from.
    pub attribution: Cow<'a, str>,
    /// Whether coordinates are degrees (longitude, latitude) or metres.
    pub geographic: bool,
    /// Ids of the nodes.
    pub ids: Vec<Id<'a>>,
    /// Their coordinates, two for each node.
    pub coordinates: Vec<f64>,
    /// Their recharging pads.
    pub pads: Vec<u16>,
    /// The segments: two indices into `ids` for each.
    pub segments: Vec<u32>,
    /// Ids of the segments; absent where the network states none, so that each is `A-B` after its nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segment_ids: Vec<Cow<'a, str>>,
    /// Changes with nodes and segments.
    pub topology_revision: u64,
}
