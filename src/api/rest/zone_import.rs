//! `/v1/zones:import`: a feed of zones as one batch.

use super::answer::{Answer, json};
use super::extract::{Authenticated, Query};
use super::reading::JsonBody;
use super::refusals;
use crate::edge::{Code, Edge, FeedImport, Refusal};
use crate::wire::ZoneImport;
use axum::extract::State;
use serde::Deserialize;
use std::sync::Arc;
use utoipa::IntoParams;

/// Which feed it is, and how it is imported.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct ImportParameters {
    /// The name of the feed. Zones that came from it before and are not in it now are lifted.
    #[param(min_length = 1, max_length = 100, example = "national")]
    feed: String,
    /// What is put before each identifier to make the id of a zone.
    #[serde(default)]
    #[param(required = false, max_length = 100)]
    prefix: String,
    /// Whether only to check: the same checks and the same answer, without effect.
    #[serde(default)]
    validate_only: bool,
}

/// Imports a feed of zones, as one batch: ED-269, ED-318, the fence of a plan of QGroundControl, or GeoJSON.
///
/// The format is recognised by what is in it. Each zone is imported as written or refused with its place; one that is refused
/// keeps no other out, and its last version in force.
#[utoipa::path(
    post,
    path = "/v1/zones:import",
    tag = "airspace",
    params(ImportParameters),
    request_body(
        description = "The feed; at most 64 MiB and 20,000 zones.",
        content(
            (Object = "application/json", example = json!({"fileType": "Plan", "geoFence": {"version": 2, "polygons": [], "circles": []}})),
            (Object = "application/geo+json"),
        ),
    ),
    responses(
        (status = 200, description = "What was imported and what is refused.", body = ZoneImport),
        (status = 422, response = refusals::UnprocessableContent),
        (status = 429, response = refusals::TooManyRequests),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn import_zones(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    Query(asked): Query<ImportParameters>,
    JsonBody(body): JsonBody,
) -> Answer {
    let text = String::from_utf8(body.to_vec()).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        let detail = format!("the feed is not UTF-8 text: see byte {place}");
        Refusal::new(Code::BodyInvalid, detail)
    })?;
    let import = FeedImport {
        feed: asked.feed,
        prefix: asked.prefix,
        validate_only: asked.validate_only,
    };
    json(&edge.import_zones(&caller, text, import).await?)
}
