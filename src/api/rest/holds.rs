//! `/v1/holds`: removals that wait for an operator because they are many at once.

use super::answer::{Answer, json, stamped};
use super::extract::{Call, PageParameters, PathId};
use super::refusals;
use crate::access::Caller;
use crate::edge::{Decision, Edge};
use crate::wire::{Hold, Holds};
use std::sync::Arc;

/// Lists removals that wait for an operator, oldest first.
#[utoipa::path(
    get,
    path = "/v1/holds",
    params(PageParameters),
    responses((status = 200, description = "A page of holds.", body = Holds)),
)]
pub(super) async fn list_holds(Call(edge, caller, page): Call<Edge, PageParameters>) -> Answer {
    json(&edge.holds(&caller, &page.into_request())?)
}

/// Lets held removals go.
#[utoipa::path(
    post,
    path = "/v1/holds/{id}/release",
    responses(
        (status = 200, description = "The hold, which is decided now.", body = Hold),
        (status = 409, response = refusals::Conflict),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn release_hold(PathId(id): PathId, Call(edge, caller, _): Call<Edge>) -> Answer {
    decide(&edge, &caller, &id, Decision::Accept).await
}

/// Drops held removals; what they would have opened stays closed.
#[utoipa::path(
    post,
    path = "/v1/holds/{id}/reject",
    responses(
        (status = 200, description = "The hold, which is decided now.", body = Hold),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn reject_hold(PathId(id): PathId, Call(edge, caller, _): Call<Edge>) -> Answer {
    decide(&edge, &caller, &id, Decision::Reject).await
}

async fn decide(edge: &Arc<Edge>, caller: &Caller, id: &str, decision: Decision) -> Answer {
    let decided = edge.decide_hold(caller, id, decision).await?;
    Ok(stamped(json(&decided)?, &edge.stamp()))
}
