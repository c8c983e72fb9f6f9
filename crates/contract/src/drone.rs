//! Telemetry, and what is last known of each drone.

use super::id::{Id, Place};
use super::outcome::Warning;
use super::plan::PlanVersion;
use super::status::Stamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// Positions and battery levels: the body of `POST /v1/telemetry`.
///
/// Entries are read one by one, so that one that cannot be read does not spoil the others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Telemetry {
    /// The entries.
    #[schema(value_type = Vec<TelemetryEntry>, max_items = 1000)]
    pub positions: Vec<Value>,
}

/// Where one drone is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct TelemetryEntry {
    /// The drone.
    #[schema(min_length = 1, max_length = 128)]
    pub drone_id: String,
    /// Where it is.
    pub location: Place,
    /// When it was there, RFC 3339; now where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub timestamp: Option<String>,
    /// Height in metres above `altitude_reference`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub altitude_m: Option<f64>,
    /// What the height is measured from: `amsl` where none is given, `agl` or `wgs84`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub altitude_reference: Option<String>,
    /// Whether it is in the air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub airborne: Option<bool>,
    /// The leg of the version that it flies, counted from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leg: Option<u32>,
    /// How far it is on that leg, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub fraction: Option<f64>,
    /// What is left in the battery, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub battery_fraction: Option<f64>,
    /// Ground speed in metres per second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_speed_mps: Option<f64>,
    /// Course over ground in degrees, clockwise from north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
}

/// What a drone is told in answer to its telemetry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Position<'a> {
    /// The drone; null where the entry names none.
    pub drone_id: Option<Cow<'a, str>>,
    /// Whether the entry was taken.
    pub accepted: bool,
    /// Its active plan.
    pub plan_id: Option<Cow<'a, str>>,
    /// True when something ahead of it has closed.
    pub affected: bool,
    /// What it is asked to fly instead.
    pub wanted: Option<PlanVersion<'a>>,
    /// The answer to this entry, which showed the drone early, late or with less battery than planned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recomposition_id: Option<Cow<'a, str>>,
    /// What was passed over.
    pub warnings: Vec<Warning<'a>>,
}

/// The answer to `POST /v1/telemetry`: one entry for each position, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct TelemetryAnswer<'a> {
    /// The entries.
    pub positions: Vec<Position<'a>>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// What is last known of a drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DroneState<'a> {
    /// The drone.
    pub id: Cow<'a, str>,
    /// Where it was: longitude and latitude, or metres on a planar network.
    pub location: [f64; 2],
    /// When, RFC 3339.
    pub seen_at: Cow<'a, str>,
    /// Height in metres above `altitude_reference`.
    pub altitude_m: Option<f64>,
    /// What the height is measured from: `amsl`, `agl` or `wgs84`.
    pub altitude_reference: Option<Cow<'a, str>>,
    /// Whether it was in the air, as far as it said.
    pub airborne: Option<bool>,
    /// What was left in the battery, from 0 to 1.
    pub battery_fraction: Option<f64>,
    /// Ground speed in metres per second.
    pub ground_speed_mps: Option<f64>,
    /// Course over ground in degrees, clockwise from north.
    pub heading_deg: Option<f64>,
    /// Its active plan.
    pub plan_id: Option<Cow<'a, str>>,
    /// The node on whose pad it stands since it landed, where pads are counted.
    pub stands_at: Option<Id<'a>>,
    /// The session that it is on, where it is on one.
    pub session_id: Option<Cow<'a, str>>,
    /// How many messages it has not received yet.
    pub unreceived: u32,
}

/// A page of drones, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Drones<'a> {
    /// The drones.
    pub drones: Vec<DroneState<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}
