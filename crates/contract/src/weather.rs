//! Weather as it is stated: wind, for the whole network or by area and time.

use super::status::Stamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// Wind over an area for a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Wind {
    /// Where: a GeoJSON polygon or multipolygon; everywhere where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub area: Option<Value>,
    /// From when, RFC 3339.
    #[schema(format = DateTime)]
    pub from: String,
    /// Until when, RFC 3339.
    #[schema(format = DateTime)]
    pub until: String,
    /// Mean speed in metres per second.
    pub speed_mps: f64,
    /// Where it comes from, in degrees from north, clockwise.
    pub from_deg: f64,
}

/// The weather over a network.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Weather {
    /// What is known of the wind; where nothing is stated it is calm, or what the edge's configuration says.
    #[schema(max_items = 1000)]
    pub wind: Vec<Wind>,
}

/// The weather over the network of an edge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct WeatherAnswer<'a> {
    /// What is known of the wind.
    pub wind: Vec<Wind>,
    /// Its version; absent where nothing was ever stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub etag: Option<Cow<'a, str>>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}
