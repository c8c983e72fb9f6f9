//! What a zone does, and closures as they were recorded. Zones themselves are GeoJSON features.

use super::id::Id;
use super::outcome::{Outcome, Path};
use super::status::Stamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// What becomes of one plan under a zone or closure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct AffectedPlan<'a> {
    /// The plan.
    pub plan_id: Cow<'a, str>,
    /// Its drone, where one is named.
    pub drone_id: Option<Cow<'a, str>>,
    /// What its drone is told.
    pub outcome: Outcome,
    /// The recomposed way.
    pub path: Path<'a>,
    /// How much longer the remaining route becomes, in metres; null where it does not lead to the destination.
    pub extra_m: Option<f64>,
    /// The proposed version; null in a preview and where there is no way.
    pub version: Option<u32>,
}

/// What a zone or closure closes, and which plans it meets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ZoneEffect<'a> {
    /// Whether it is in force now, by its windows.
    pub in_force: bool,
    /// From when drones without computed times are led around it, which is `airspace.horizon` before it begins,
    /// RFC 3339; null where it is in force, or over.
    #[serde(default)]
    pub closes_from: Option<Cow<'a, str>>,
    /// How many segments it closes.
    pub segment_count: usize,
    /// Their ids; at most as many as a page has.
    pub segments: Vec<Cow<'a, str>>,
    /// How many nodes it closes.
    pub node_count: usize,
    /// Their ids; at most as many as a page has.
    pub nodes: Vec<Id<'a>>,
    /// How many active plans it meets.
    pub plan_count: usize,
    /// Those plans whose drones have been told something already; at most 100, the others by `next`.
    pub plans: Vec<AffectedPlan<'a>>,
    /// What to look at where a zone meets neither node nor segment; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<Cow<'a, str>>,
    /// How many of the plans it meets have yet to be told what to fly: events tell each, and `replanned` that all are told.
    #[serde(default)]
    pub pending: usize,
    /// Where all plans that it affects are listed, where not all stand in `plans`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next: Option<Cow<'a, str>>,
}

/// The answer to a write or a preview of a zone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ZoneAck<'a> {
    /// The zone as it is understood: a GeoJSON feature.
    #[schema(value_type = Object)]
    pub zone: Value,
    /// Its version, for `If-Match`; absent in a preview.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub etag: Option<Cow<'a, str>>,
    /// Whether drones are led around it now (when its windows say so).
    pub enforced: bool,
    /// Whether it survives a restart of this edge.
    pub durable: bool,
    /// What it closes and whom it meets.
    pub effect: ZoneEffect<'a>,
    /// The world after it.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// A page of zones, by id: a GeoJSON feature collection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ZoneList<'a> {
    /// `FeatureCollection`.
    #[serde(rename = "type")]
    pub kind: Cow<'a, str>,
    /// The zones.
    #[schema(value_type = Vec<Object>)]
    pub features: Vec<Value>,
    /// The version of each zone, in their order, for `If-Match`.
    pub etags: Vec<Cow<'a, str>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// A closure as it counted when something was answered: enough to close the same again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RecordedClosure<'a> {
    /// Its id.
    pub id: Cow<'a, str>,
    /// `zone`, `report` or `operator`.
    pub cause: Cow<'a, str>,
    /// The zone, where one is the cause: a GeoJSON feature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub zone: Option<Value>,
    /// The segments it closed, where no zone is the cause.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<Cow<'a, str>>,
    /// The nodes it closed, where no zone is the cause.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub nodes: Vec<Id<'a>>,
    /// The nodes whose pads it closed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pads: Vec<Id<'a>>,
}
