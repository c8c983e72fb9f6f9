//! `/v1/networks`: skyway networks, whole and patched.

use super::extract::{OnNetwork, WriteParameters, Writing};
use super::written::{below, written};
use crate::api::rest::answer::{Answer, GEOJSON, current, json};
use crate::api::rest::extract::{Call, IdempotencyKey};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::refusal::{Code, Refusal};
use crate::registry::Registry;
use crate::wire::{NetworkPatch, NetworkSummaries, Written};
use http::HeaderMap;
use serde_json::Value;
use utoipa::ToSchema;

/// A network in the native format: a GeoJSON feature collection (RFC 7946) whose points are nodes and whose line
/// strings are segments.
#[derive(ToSchema)]
#[schema(as = NetworkDocument)]
#[expect(
    dead_code,
    reason = "describes a document that is read and written elsewhere"
)]
pub(super) struct NetworkDocument {
    /// `FeatureCollection`.
    r#type: String,
    /// A name for people.
    name: Option<String>,
    /// Who must be named beside every copy.
    attribution: Option<String>,
    /// `{"format": 1, "coordinates": "geographic"}`, or `planar`.
    #[schema(value_type = Object)]
    skyway: Value,
    /// The nodes and segments.
    #[schema(value_type = Vec<Object>)]
    features: Vec<Value>,
}

/// Lists the networks that the caller may speak of, by id.
#[utoipa::path(
    get,
    path = "/v1/networks",
    responses((status = 200, description = "All of them.", body = NetworkSummaries)),
)]
pub(super) async fn list_networks(Call(registry, caller, _): Call<Registry>) -> Answer {
    let mut told = registry.networks().await?;
    told.networks.retain(|it| caller.is_of_network(&it.id));
    json(&told)
}

/// Tells a network in the native format.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}",
    responses(
        (status = 200, description = "The network.", body = NetworkDocument, content_type = "application/geo+json"),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_network(
    OnNetwork(network): OnNetwork,
    Call(registry, _, _): Call<Registry>,
    headers: HeaderMap,
) -> Answer {
    let (text, etag) = registry.network(&network).await?;
    Ok(current(&headers, &etag, GEOJSON, text.as_bytes().to_vec()))
}

/// Puts a network as a whole, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/networks/{network}",
    params(WriteParameters, IdempotencyKey),
    request_body(
        description = "The network.",
        content((NetworkDocument = "application/geo+json"), (NetworkDocument = "application/json")),
    ),
    responses(
        (status = 200, description = "It was there before, or `validate_only`.", body = Written),
        (status = 201, description = "It is new.", body = Written),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_network(
    OnNetwork(network): OnNetwork,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    reading::check_once(&body)?;
    let text = std::str::from_utf8(&body)
        .map_err(|_| Refusal::new(Code::BodyInvalid, "the body is not UTF-8 text"))?;
    let reply = registry.put_network(&network, text, &manner).await?;
    Ok(written(reply, &below(&network, ""), true))
}

/// Adds, changes and removes nodes and segments of the version that `If-Match` names.
#[utoipa::path(
    patch,
    path = "/v1/networks/{network}",
    params(WriteParameters, IdempotencyKey),
    request_body(content = NetworkPatch, description = "What is to change."),
    responses(
        (status = 200, description = "It is changed, or `validate_only`.", body = Written),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn patch_network(
    OnNetwork(network): OnNetwork,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    reading::check_once(&body)?;
    let patch: NetworkPatch = reading::body(&body, "patch of a network")?;
    let reply = registry.patch_network(&network, patch, &manner).await?;
    Ok(written(reply, &below(&network, ""), true))
}
