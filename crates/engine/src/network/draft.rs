//! A network as a file or a generator states it: plain data, not yet checked.
//!
//! Every importer and generator ends here, and [`Topology::build`](super::Topology::build) is the only way on.

use crate::geo::{Altitude, AltitudeBand};
use serde::{Deserialize, Serialize};

/// What a node is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// A delivery is dropped here.
    DeliveryTarget,
    /// Batteries are charged or swapped here.
    RechargingStation,
    /// Both of these.
    #[default]
    Both,
}

/// What the two numbers of a position are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Coordinates {
    /// `x` and `y` in metres.
    #[default]
    Planar,
    /// WGS 84 longitude and latitude in degrees, longitude first.
    Geographic,
}

/// A node as stated.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct NodeDraft {
    /// The node's id, unique in the network.
    pub id: String,
    /// `[x, y]` in metres or `[longitude, latitude]` in degrees; the draft says which.
    pub position: [f64; 2],
    /// Altitude of the landing site; `None` when unknown.
    pub altitude: Option<Altitude>,
    /// Number of recharging pads; 0 for none.
    pub pads: u16,
    /// What the node is for.
    pub role: Role,
    /// A name for people.
    pub name: Option<String>,
}

/// A segment as stated.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct SegmentDraft {
    /// The segment's id; `None` derives `"A-B"` from its nodes, in node order.
    pub id: Option<String>,
    /// Id of one node.
    pub from: String,
    /// Id of the other.
    pub to: String,
    /// Stated length in metres; `None` takes the straight line.
    pub length_m: Option<f64>,
    /// The altitudes it is flown at.
    pub band: AltitudeBand,
    /// Fastest ground speed allowed on it, in metres per second.
    pub speed_limit_mps: Option<f64>,
}

/// A whole network as stated.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct NetworkDraft {
    /// A name for people.
    pub name: String,
    /// Who must be named beside every copy (licence, source); empty if no one.
    pub attribution: String,
    /// What the positions are.
    pub coordinates: Coordinates,
    /// True when the file writes its ids as integers: answers then write them so too, and node order is numeric.
    pub integer_ids: bool,
    /// The nodes, in file order.
    pub nodes: Vec<NodeDraft>,
    /// The segments, in file order.
    pub segments: Vec<SegmentDraft>,
    /// Ids that were merged away, each with the id that took its place.
    pub aliases: Vec<(String, String)>,
}
