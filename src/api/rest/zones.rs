//! `/v1/zones`: no-fly zones as GeoJSON features, with entity tags.

use super::answer::{Answer, GEOJSON, created, json, not_modified, of_bytes, set, stamped, told};
use super::extract::{self, Call, IdempotencyKey, PageParameters, PathId};
use super::reading::{self, FeedBody, JsonBody};
use super::refusals;
use super::zone_schema::{ZoneCollection, ZoneFeature};
use crate::edge::{Edge, FeedImport, ZoneWrite};
use crate::formats::ED318_MEDIA_TYPE;
use crate::wire::{ZoneAck, ZoneImport};
use axum::response::Response;
use http::{HeaderMap, StatusCode, header};
use serde::Deserialize;
use serde_json::Value;
use utoipa::IntoParams;

const COLLECTION: &str = "/v1/zones";

/// How a zone is written.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct WriteParameters {
    /// Whether only to check: the same checks and the same answer, without effect.
    #[serde(default)]
    validate_only: bool,
}

/// How a zone is lifted.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct LiftParameters {
    /// Whether only to check: the same checks and the same answer, without effect.
    #[serde(default)]
    validate_only: bool,
    /// Why, for the events and the log.
    #[param(value_type = String, required = false, max_length = 256)]
    reason: Option<String>,
}

fn tagged(mut response: Response, ack: &ZoneAck<'_>) -> Response {
    if let Some(etag) = &ack.etag {
        set(&mut response, header::ETAG, etag);
    }
    response
}

/// Puts a new zone into force.
#[utoipa::path(
    post,
    path = "/v1/zones",
    params(WriteParameters, IdempotencyKey),
    request_body(
        description = "The zone.",
        content((ZoneFeature = "application/geo+json", example = json!(super::zone_schema::example())), (ZoneFeature = "application/json")),
    ),
    responses(
        (status = 201, description = "The zone as it is understood, what it closes and which plans it meets.", body = ZoneAck),
        (status = 200, description = "With `validate_only`: what the answer would be.", body = ZoneAck),
        refusals::Creation,
    ),
)]
pub(super) async fn create_zone(
    Call(edge, caller, asked): Call<Edge, WriteParameters>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let feature = reading::value(&body)?;
    let idempotency = extract::idempotency(&headers, &body)?;
    let write = ZoneWrite {
        validate_only: asked.validate_only,
        ..ZoneWrite::default()
    };
    let ack = edge
        .create_zone(&caller, feature, write, idempotency)
        .await?;
    if asked.validate_only {
        return json(&ack);
    }
    let id = ack
        .zone
        .get("id")
        .and_then(Value::as_str)
        .unwrap_or_default();
    Ok(tagged(created(&ack, COLLECTION, id)?, &ack))
}

/// Puts a zone under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/zones/{id}",
    params(WriteParameters),
    request_body(
        description = "The zone.",
        content((ZoneFeature = "application/geo+json", example = json!(super::zone_schema::example_without_id())), (ZoneFeature = "application/json")),
    ),
    responses(
        (status = 200, description = "The zone as it is understood; it was there before, or `validate_only`.", body = ZoneAck),
        (status = 201, description = "The same; the zone is new.", body = ZoneAck),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_zone(
    PathId(id): PathId,
    Call(edge, caller, asked): Call<Edge, WriteParameters>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let feature = reading::value(&body)?;
    let write = ZoneWrite {
        id: Some(id.clone()),
        if_match: extract::if_match(&headers)?,
        validate_only: asked.validate_only,
    };
    let (ack, is_new) = edge.put_zone(&caller, feature, write).await?;
    let response = match is_new && !asked.validate_only {
        true => created(&ack, COLLECTION, &id)?,
        false => json(&ack)?,
    };
    Ok(tagged(response, &ack))
}

/// Lifts a zone; what it closed alone opens again.
#[utoipa::path(
    delete,
    path = "/v1/zones/{id}",
    params(LiftParameters),
    responses(
        (status = 200, description = "What was lifted.", body = ZoneAck),
        refusals::Version,
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn delete_zone(
    PathId(id): PathId,
    Call(edge, caller, asked): Call<Edge, LiftParameters>,
    headers: HeaderMap,
) -> Answer {
    let write = ZoneWrite {
        id: Some(id),
        if_match: extract::if_match(&headers)?,
        validate_only: asked.validate_only,
    };
    json(&edge.delete_zone(&caller, write, asked.reason).await?)
}

/// Tells what a zone would close and which plans it would meet; nothing changes.
#[utoipa::path(
    post,
    path = "/v1/zones:preview",
    request_body(
        description = "The zone.",
        content((ZoneFeature = "application/geo+json", example = json!(super::zone_schema::example())), (ZoneFeature = "application/json")),
    ),
    responses(
        (status = 200, description = "What it would do.", body = ZoneAck),
        (status = 409, response = refusals::Conflict),
        (status = 422, response = refusals::UnprocessableContent),
        (status = 429, response = refusals::TooManyRequests),
    ),
)]
pub(super) async fn preview_zone(
    Call(edge, caller, _): Call<Edge>,
    JsonBody(body): JsonBody,
) -> Answer {
    json(&edge.preview_zone(&caller, reading::value(&body)?).await?)
}

/// Tells a zone as a GeoJSON feature.
#[utoipa::path(
    get,
    path = "/v1/zones/{id}",
    responses(
        (status = 200, description = "The zone.", body = ZoneFeature, content_type = "application/geo+json"),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_zone(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
) -> Answer {
    let (feature, etag) = edge.zone(&caller, &id)?;
    if let Some(response) = not_modified(&headers, &etag) {
        return Ok(response);
    }
    let mut response = told(StatusCode::OK, GEOJSON, &feature)?;
    set(&mut response, header::ETAG, &etag);
    Ok(stamped(response, &edge.stamp()))
}

/// Lists the zones, by id, as a GeoJSON feature collection; with `Accept` of ED-318 all of them, as that.
#[utoipa::path(
    get,
    path = "/v1/zones",
    params(PageParameters),
    responses((status = 200, description = "A page of zones, or all of them as ED-318.", content(
        (ZoneCollection = "application/geo+json"),
        (Object = "application/vnd.eurocae.ed318+json"),
    ))),
)]
pub(super) async fn list_zones(
    Call(edge, caller, page): Call<Edge, PageParameters>,
    headers: HeaderMap,
) -> Answer {
    if extract::accepted(&headers, &[ED318_MEDIA_TYPE]).is_some() {
        let (text, stamp) = edge.zones_as_ed318(&caller)?;
        let response = of_bytes(StatusCode::OK, ED318_MEDIA_TYPE, text);
        return Ok(stamped(response, &stamp));
    }
    let zones = edge.zones(&caller, &page.into_request())?;
    told(StatusCode::OK, GEOJSON, &zones)
}

/// Which feed it is, and how it is imported.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct ImportParameters {
    /// The name of the feed. Zones that came from it before and are not in it now are lifted.
    #[param(
        min_length = 1,
        max_length = 100,
        pattern = r"^[^\x00-\x1f\x7f-\x9f]*$",
        example = "national"
    )]
    feed: String,
    /// What is put before each identifier to make the id of a zone.
    #[serde(default)]
    #[param(
        required = false,
        max_length = 100,
        pattern = r"^[^\x00-\x1f\x7f-\x9f]*$"
    )]
    prefix: String,
    /// Which zones of the feed the drones of the network are authorized for, or meet the conditions of, so that they close
    /// nothing: `req_authorization` and `conditional` for all of the kind, and identifiers, with commas between them.
    #[serde(default)]
    #[param(
        required = false,
        max_length = 4000,
        pattern = r"^([^,\x00-\x1f\x7f-\x9f]{1,100}(,[^,\x00-\x1f\x7f-\x9f]{1,100})*)?$",
        example = "req_authorization,LPR12"
    )]
    authorized: String,
    /// Whether only to check: the same checks and the same answer, without effect.
    #[serde(default)]
    validate_only: bool,
}

/// What a list with commas between its members names.
fn listed(list: &str) -> Vec<String> {
    let members = list.split(',').filter(|_| !list.is_empty());
    members.map(str::to_owned).collect()
}

/// Imports a feed of zones, as one batch: ED-269, ED-318, KML, the fence of a plan of QGroundControl, or GeoJSON.
///
/// The format is recognised by what is in it. Each zone is imported as written or refused with its place; one that is refused
/// keeps no other out, and its last version in force.
#[utoipa::path(
    post,
    path = "/v1/zones:import",
    params(ImportParameters),
    request_body(
        description = "The feed; at most 64 MiB and 20,000 zones.",
        content(
            (Object = "application/json", example = json!({"fileType": "Plan", "geoFence": {"version": 2, "polygons": [], "circles": []}})),
            (Object = "application/geo+json"),
            (String = "application/vnd.google-earth.kml+xml"),
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
    Call(edge, caller, asked): Call<Edge, ImportParameters>,
    FeedBody(text): FeedBody,
) -> Answer {
    let import = FeedImport {
        feed: asked.feed,
        prefix: asked.prefix,
        authorized: listed(&asked.authorized),
        validate_only: asked.validate_only,
    };
    json(&edge.import_zones(&caller, text, import).await?)
}
