//! `/v1/networks/{network}/zones`: no-fly zones as GeoJSON features, with entity tags.

use super::extract::{OnNetwork, PathId, WriteParameters, Writing};
use super::written::{below, written};
use crate::api::rest::answer::{Answer, GEOJSON, current, json};
use crate::api::rest::extract::{Call, IdempotencyKey, PageParameters};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::api::rest::zone_schema::{self, ZoneFeature};
use crate::registry::Registry;
use crate::wire::{ObjectKind, PublishedObjects, Written};
use http::HeaderMap;

const COLLECTION: &str = "/zones";

/// Lists the zones of a network, by id.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/zones",
    params(PageParameters),
    responses((status = 200, description = "A page of zones.", body = PublishedObjects)),
)]
pub(super) async fn list_zones(
    OnNetwork(network): OnNetwork,
    Call(registry, _, page): Call<Registry, PageParameters>,
) -> Answer {
    let page = page.into_request();
    json(&registry.objects(&network, ObjectKind::Zone, &page).await?)
}

/// Tells a zone.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/zones/{id}",
    responses(
        (status = 200, description = "The zone.", body = ZoneFeature, content_type = "application/geo+json"),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_zone(
    PathId { network, id }: PathId,
    Call(registry, _, _): Call<Registry>,
    headers: HeaderMap,
) -> Answer {
    let (body, etag) = registry.object(&network, ObjectKind::Zone, &id).await?;
    Ok(current(&headers, &etag, GEOJSON, body))
}

/// Publishes a new zone, which every edge of the network then enforces.
#[utoipa::path(
    post,
    path = "/v1/networks/{network}/zones",
    params(WriteParameters, IdempotencyKey),
    request_body(
        description = "The zone.",
        content((ZoneFeature = "application/geo+json", example = json!(zone_schema::example())), (ZoneFeature = "application/json")),
    ),
    responses(
        (status = 201, description = "The zone as it is understood.", body = Written),
        (status = 200, description = "With `validate_only`: what would be written.", body = Written),
        refusals::Creation,
    ),
)]
pub(super) async fn create_zone(
    OnNetwork(network): OnNetwork,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    let feature = reading::value(&body)?;
    let reply = registry.put_zone(&network, None, feature, &manner).await?;
    Ok(written(reply, &below(&network, COLLECTION), false))
}

/// Puts a zone under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/networks/{network}/zones/{id}",
    params(WriteParameters, IdempotencyKey),
    request_body(
        description = "The zone.",
        content((ZoneFeature = "application/geo+json", example = json!(zone_schema::example_without_id())), (ZoneFeature = "application/json")),
    ),
    responses(
        (status = 200, description = "The zone as it is understood; it was there before, or `validate_only`.", body = Written),
        (status = 201, description = "The same; the zone is new.", body = Written),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_zone(
    PathId { network, id }: PathId,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    let feature = reading::value(&body)?;
    let reply = registry
        .put_zone(&network, Some(&id), feature, &manner)
        .await?;
    Ok(written(reply, &below(&network, COLLECTION), false))
}

/// Lifts a zone, of the version that `If-Match` names.
#[utoipa::path(
    delete,
    path = "/v1/networks/{network}/zones/{id}",
    params(WriteParameters, IdempotencyKey),
    responses(
        (status = 200, description = "It is lifted, or `validate_only`.", body = Written),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn delete_zone(
    PathId { network, id }: PathId,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
) -> Answer {
    let manner = writing.manner(&asked, &[])?;
    let kind = ObjectKind::Zone;
    let reply = registry.delete(&network, kind, &id, &manner).await?;
    Ok(written(reply, &below(&network, COLLECTION), false))
}
