//! What edges tell their registry of flights and failures: once, in order, also after a time without it.

use crate::failure::FailureType;
use crate::plan::{EndedAs, PlanState};
use serde::{Deserialize, Serialize};

/// A batch of what happened at an edge: the body of `POST /v1/networks/{network}/edges/{id}/news`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeNews {
    /// Which life of the edge's store the numbers belong to; another one begins them anew.
    pub lineage: u64,
    /// What happened, in order; at most 500.
    #[schema(max_items = 500)]
    pub news: Vec<NewsEntry>,
}

/// One thing that happened: to a flight, or a failure that was answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewsEntry {
    /// Its number; numbers rise.
    pub number: u64,
    /// When it happened, RFC 3339.
    #[schema(format = DateTime)]
    pub at: String,
    /// How a flight stands since.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<FlightNews>,
    /// A failure that was reported and answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<FailureNews>,
}

/// How the flight of a delivery stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FlightNews {
    /// The plan.
    pub plan_id: String,
    /// The delivery that it is flown for.
    pub delivery_id: String,
    /// The drone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drone_id: Option<String>,
    /// How the plan stands.
    pub state: PlanState,
    /// What became of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_as: Option<EndedAs>,
    /// The newest version of the plan.
    pub version: u32,
    /// What the drone is to do by that version: `composed`, `rerouted`, `hold`, `diverted`, `no_route`.
    pub outcome: String,
    /// How many of its stops have been served: the first is the pickup, unless it is where the flight begins, the next the drop.
    pub stops_served: u32,
    /// How many stops there are in all.
    pub stops: u32,
    /// Whether the drone waits on a pad until its way opens.
    pub holds: bool,
    /// When it arrives at the last of its stops, or at its end where all are served, RFC 3339.
    #[schema(format = DateTime)]
    pub expected_at: String,
    /// Ids of the zones and closures that the version is for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<String>,
    /// Where the drone was last: longitude and latitude in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 2]>,
    /// The node that it has landed on, once the plan has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub landed_on: Option<String>,
}

/// A failure that was reported and answered, of any drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FailureNews {
    /// The id of the recomposition.
    pub recomposition_id: String,
    /// The drone, where it said which it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drone_id: Option<String>,
    /// What failed.
    pub failure_type: FailureType,
    /// The segment that it was on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<String>,
    /// What the drone was told to do.
    pub outcome: String,
    /// How long the answer took, in microseconds.
    pub elapsed_us: f64,
}

/// How far the registry has taken an edge's news: the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NewsTaken {
    /// The number of the last that it has.
    pub through: u64,
}

/// Positions of drones: the body of `POST /v1/networks/{network}/edges/{id}/positions`, which may be compressed with gzip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PositionBatch {
    /// The positions; at most 10,000.
    #[schema(max_items = 10000)]
    pub positions: Vec<PositionEntry>,
    /// How many were thinned out since the last batch, as the registry did not take them in time.
    #[serde(default)]
    pub left_out: u64,
}

/// Where a drone was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PositionEntry {
    /// The drone.
    pub drone_id: String,
    /// When, in milliseconds since 1970.
    pub at_ms: i64,
    /// Longitude in degrees.
    pub lon: f64,
    /// Latitude in degrees.
    pub lat: f64,
    /// Height in metres, by whatever reference the drone has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub altitude_m: Option<f64>,
    /// What was in its battery, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub battery_fraction: Option<f64>,
    /// Speed over ground in metres per second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_mps: Option<f64>,
}

/// What the registry has taken: the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PositionsTaken {
    /// How many positions are stored that were not before.
    pub stored: u64,
}

/// Where a drone was, oldest first: the answer of `GET /v1/drones/{id}/positions`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PositionHistory {
    /// The positions.
    pub positions: Vec<PositionEntry>,
    /// From when to ask for the rest, RFC 3339; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub next_from: Option<String>,
}
