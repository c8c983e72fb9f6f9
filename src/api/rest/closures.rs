//! `/v1/closures`: what is closed and why, and what operators close by their word.

use super::answer::{Answer, created, json, set, stamped};
use super::extract::{self, Call, IdempotencyKey, PageParameters, PathId};
use super::reading::{self, JsonBody};
use super::refusals;
use crate::edge::Edge;
use crate::wire::{Closure, ClosureChange, ClosureDraft, Closures};
use axum::response::Response;
use http::{HeaderMap, header};
use serde::Deserialize;
use utoipa::IntoParams;

fn complete(mut response: Response, closure: &Closure<'_>, edge: &Edge) -> Response {
    set(&mut response, header::ETAG, &closure.etag);
    stamped(response, &edge.stamp())
}

/// Lists everything that closes anything, by id: zones too.
#[utoipa::path(
    get,
    path = "/v1/closures",
    params(PageParameters),
    responses((status = 200, description = "A page of closures.", body = Closures)),
)]
pub(super) async fn list_closures(Call(edge, caller, page): Call<Edge, PageParameters>) -> Answer {
    json(&edge.closures(&caller, &page.into_request())?)
}

/// Tells a closure.
#[utoipa::path(
    get,
    path = "/v1/closures/{id}",
    params(("id" = String, Path, description = "`id` of a closure; that of a zone is the zone's.")),
    responses((status = 200, description = "The closure.", body = Closure)),
)]
pub(super) async fn get_closure(PathId(id): PathId, Call(edge, caller, _): Call<Edge>) -> Answer {
    let closure = edge.closure(&caller, &id)?;
    Ok(complete(json(&closure)?, &closure, &edge))
}

/// Closes segments, nodes or pads by an operator's word.
#[utoipa::path(
    post,
    path = "/v1/closures",
    params(IdempotencyKey),
    request_body(
        content = ClosureDraft,
        example = json!({"reason": "crane on the roof of Customs House", "segments": ["379-406"], "pads": ["406"]}),
    ),
    responses(
        (status = 201, description = "The closure, and which plans it meets.", body = Closure),
        refusals::Creation,
    ),
)]
pub(super) async fn create_closure(
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let draft: ClosureDraft = reading::body(&body, "closure")?;
    let idempotency = extract::idempotency(&headers, &body)?;
    let closure = edge.close(&caller, draft, idempotency).await?;
    let response = created(&closure, "/v1/closures", &closure.id)?;
    Ok(complete(response, &closure, &edge))
}

/// Confirms a closure or moves its end.
#[utoipa::path(
    patch,
    path = "/v1/closures/{id}",
    request_body(content = ClosureChange, example = json!({"confirmed": true})),
    responses(
        (status = 200, description = "The closure as it is now.", body = Closure),
        refusals::Write,
        (status = 412, response = refusals::PreconditionFailed),
    ),
)]
pub(super) async fn change_closure(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let change: ClosureChange = reading::body(&body, "change of a closure")?;
    let if_match = extract::if_match(&headers)?;
    let closure = edge.change_closure(&caller, &id, change, if_match).await?;
    Ok(complete(json(&closure)?, &closure, &edge))
}

/// How a closure is lifted.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct LiftParameters {
    /// Why, for the events and the log.
    #[param(value_type = String, required = false, max_length = 256)]
    reason: Option<String>,
}

/// Lifts a closure; what it closed alone opens again.
#[utoipa::path(
    delete,
    path = "/v1/closures/{id}",
    params(LiftParameters),
    responses(
        (status = 200, description = "What was lifted.", body = Closure),
        (status = 409, response = refusals::Conflict),
        (status = 412, response = refusals::PreconditionFailed),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn delete_closure(
    PathId(id): PathId,
    Call(edge, caller, asked): Call<Edge, LiftParameters>,
    headers: HeaderMap,
) -> Answer {
    let if_match = extract::if_match(&headers)?;
    let closure = edge
        .lift_closure(&caller, &id, if_match, asked.reason)
        .await?;
    Ok(stamped(json(&closure)?, &edge.stamp()))
}
