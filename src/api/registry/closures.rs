//! `/v1/networks/{network}/closures`: what operators and reports close, with entity tags.

use super::extract::{OnNetwork, PathId, WriteParameters, Writing};
use super::written::{below, written};
use crate::api::rest::answer::{Answer, JSON, current, json};
use crate::api::rest::extract::{Call, IdempotencyKey, PageParameters};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::registry::Registry;
use crate::wire::{ObjectKind, PublishedClosure, PublishedObjects, Written};
use http::HeaderMap;

const COLLECTION: &str = "/closures";

/// Lists the closures of a network, by id.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/closures",
    params(PageParameters),
    responses((status = 200, description = "A page of closures.", body = PublishedObjects)),
)]
pub(super) async fn list_closures(
    OnNetwork(network): OnNetwork,
    Call(registry, _, page): Call<Registry, PageParameters>,
) -> Answer {
    let page = page.into_request();
    json(
        &registry
            .objects(&network, ObjectKind::Closure, &page)
            .await?,
    )
}

/// Tells a closure.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/closures/{id}",
    responses(
        (status = 200, description = "The closure.", body = PublishedClosure, content_type = "application/json"),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_closure(
    PathId { network, id }: PathId,
    Call(registry, _, _): Call<Registry>,
    headers: HeaderMap,
) -> Answer {
    let (body, etag) = registry.object(&network, ObjectKind::Closure, &id).await?;
    Ok(current(&headers, &etag, JSON, body))
}

/// Publishes a new closure, which every edge of the network then enforces.
#[utoipa::path(
    post,
    path = "/v1/networks/{network}/closures",
    params(WriteParameters, IdempotencyKey),
    request_body(
        content = PublishedClosure,
        example = json!({"reason": "crane on the roof of Customs House", "segments": ["379-406"], "pads": ["406"]}),
    ),
    responses(
        (status = 201, description = "The closure as it is understood.", body = Written),
        (status = 200, description = "With `validate_only`: what would be written.", body = Written),
        refusals::Creation,
    ),
)]
pub(super) async fn create_closure(
    OnNetwork(network): OnNetwork,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    let closure = reading::body::<PublishedClosure>(&body, "closure")?;
    let reply = registry
        .put_closure(&network, None, closure, &manner)
        .await?;
    Ok(written(reply, &below(&network, COLLECTION), false))
}

/// Puts a closure under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/networks/{network}/closures/{id}",
    params(WriteParameters, IdempotencyKey),
    request_body(
        content = PublishedClosure,
        example = json!({"reason": "crane on the roof of Customs House", "segments": ["379-406"], "pads": ["406"]}),
    ),
    responses(
        (
            status = 200,
            description = "The closure as it is understood; it was there before, or `validate_only`.",
            body = Written,
        ),
        (status = 201, description = "The same; the closure is new.", body = Written),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_closure(
    PathId { network, id }: PathId,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    let closure = reading::body::<PublishedClosure>(&body, "closure")?;
    let reply = registry
        .put_closure(&network, Some(&id), closure, &manner)
        .await?;
    Ok(written(reply, &below(&network, COLLECTION), false))
}

/// Lifts a closure, of the version that `If-Match` names.
#[utoipa::path(
    delete,
    path = "/v1/networks/{network}/closures/{id}",
    params(WriteParameters, IdempotencyKey),
    responses(
        (status = 200, description = "It is lifted, or `validate_only`.", body = Written),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn delete_closure(
    PathId { network, id }: PathId,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
) -> Answer {
    let manner = writing.manner(&asked, &[])?;
    let kind = ObjectKind::Closure;
    let reply = registry.delete(&network, kind, &id, &manner).await?;
    Ok(written(reply, &below(&network, COLLECTION), false))
}
