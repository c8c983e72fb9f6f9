//! `GET /v1/network`, `/v1/nodes/{id}` and `/v1/nearest`: the network as clients see it.

use super::answer::{Answer, GEOJSON, JSON, json, not_modified, of_bytes, set, stamped};
use super::extract::{Call, PathId};
use crate::edge::Edge;
use crate::wire::{CompactNetwork, Nearest, Node};
use http::{HeaderMap, StatusCode, header};
use serde::Deserialize;
use serde_json::Value;
use utoipa::{IntoParams, ToSchema};

/// How the network is told.
#[derive(Clone, Copy, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum NetworkFormat {
    /// GeoJSON, as the network was given.
    #[default]
    Geojson,
    /// Indices and numbers, for drawing.
    Compact,
}

/// How the network is told.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct NetworkParameters {
    /// `geojson` where none is given.
    #[serde(default)]
    #[param(inline)]
    format: NetworkFormat,
}

/// Which nodes are asked for.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct NearestParameters {
    /// Longitude in degrees; metres east on a planar network.
    #[param(example = 151.2108551)]
    lon: f64,
    /// Latitude in degrees; metres north on a planar network.
    #[param(example = -33.862204)]
    lat: f64,
    /// How many; 1 where none is given.
    #[param(value_type = u32, required = false, minimum = 1, maximum = 100)]
    k: Option<u32>,
}

/// A GeoJSON feature collection (RFC 7946): nodes are points, segments line strings. It is the file that was loaded,
/// with ids as its author wrote them: text or integers.
#[derive(ToSchema)]
#[schema(as = Network)]
#[expect(dead_code, reason = "describes a document that is written elsewhere")]
pub(super) struct NetworkCollection {
    /// `FeatureCollection`.
    r#type: String,
    /// The nodes and segments.
    #[schema(value_type = Vec<Object>)]
    features: Vec<Value>,
}

/// Tells the network.
#[utoipa::path(
    get,
    path = "/v1/network",
    params(NetworkParameters),
    responses(
        (
            status = 200,
            description = "The network.",
            content((NetworkCollection = "application/geo+json"), (CompactNetwork = "application/json")),
            headers(("ETag" = String, description = "Its version in this format.")),
        ),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_network(
    Call(edge, _, asked): Call<Edge, NetworkParameters>,
    headers: HeaderMap,
) -> Answer {
    let (media_type, (document, etag)) = match asked.format {
        NetworkFormat::Geojson => (GEOJSON, edge.network_geojson()?),
        NetworkFormat::Compact => (JSON, edge.network_compact()?),
    };
    if let Some(response) = not_modified(&headers, &etag) {
        return Ok(response);
    }
    let mut response = of_bytes(StatusCode::OK, media_type, document);
    set(&mut response, header::ETAG, &etag);
    Ok(stamped(response, &edge.stamp()))
}

/// Tells a node and its segments, as they are now.
#[utoipa::path(
    get,
    path = "/v1/nodes/{id}",
    params(("id" = String, Path, description = "Id of a node.", example = "406")),
    responses((status = 200, description = "The node.", body = Node)),
)]
pub(super) async fn get_node(PathId(id): PathId, Call(edge, _, _): Call<Edge>) -> Answer {
    json(&edge.node(&id)?)
}

/// Tells the nodes nearest to a place, nearest first.
#[utoipa::path(
    get,
    path = "/v1/nearest",
    params(NearestParameters),
    responses((status = 200, description = "The nodes.", body = Nearest)),
)]
pub(super) async fn nearest(Call(edge, _, asked): Call<Edge, NearestParameters>) -> Answer {
    json(&edge.nearest([asked.lon, asked.lat], asked.k.unwrap_or(1))?)
}
