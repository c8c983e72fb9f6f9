//! `/v1/plans/{id}/pack` and `/v1/keys`: what a drone does when the line is gone, and by which keys it believes that.

use super::answer::{Answer, json, not_modified, of_bytes, set, stamped};
use super::extract::{Call, PathId};
use super::refusals;
use crate::edge::Edge;
use crate::wire::PackKeys;
use http::{HeaderMap, StatusCode, header};
use serde::Deserialize;
use utoipa::IntoParams;

/// The media type of packs.
const PACK: &str = "application/vnd.skyway.pack";

/// Which version of a plan is packed.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct PackParameters {
    /// The version; the one that the drone says it flies where none is given.
    #[param(value_type = u32, required = false, minimum = 1)]
    version: Option<u32>,
}

/// Tells what the drone of a plan does when the line to the edge is gone: bytes for a flight controller, signed.
///
/// `docs/pack.md` has the format. Of a leg whose contingencies are pending or void, the pack says that nothing is known.
#[utoipa::path(
    get,
    path = "/v1/plans/{id}/pack",
    params(
        PackParameters,
        ("If-None-Match" = Option<String>, Header, description = "Entity tags of the packs that the caller has."),
    ),
    responses(
        (
            status = 200,
            description = "The pack.",
            content((String = "application/vnd.skyway.pack")),
            headers(("ETag" = String, description = "Its content.")),
        ),
        (status = 304, description = "The caller has the current pack."),
        (status = 409, response = refusals::Conflict),
    ),
)]
pub(super) async fn get_pack(
    PathId(id): PathId,
    Call(edge, caller, asked): Call<Edge, PackParameters>,
    headers: HeaderMap,
) -> Answer {
    let (pack, etag) = edge.pack(&caller, &id, asked.version)?;
    if let Some(response) = not_modified(&headers, &etag) {
        return Ok(response);
    }
    let mut response = of_bytes(StatusCode::OK, PACK, pack);
    set(&mut response, header::ETAG, &etag);
    Ok(stamped(response, &edge.stamp()))
}

/// Lists the keys that packs are, or were, signed with, the oldest first.
#[utoipa::path(
    get,
    path = "/v1/keys",
    responses((status = 200, description = "The keys.", body = PackKeys)),
)]
pub(super) async fn list_keys(Call(edge, _, _): Call<Edge>) -> Answer {
    json(&edge.list_pack_keys())
}
