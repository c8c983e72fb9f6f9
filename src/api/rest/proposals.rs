//! `/v1/proposals`: what reports and feeds of zones brought and what an operator is to decide.

use super::answer::{Answer, json, stamped};
use super::extract::{Call, PageParameters, PathId};
use super::refusals;
use crate::access::Caller;
use crate::edge::{Decision, Edge};
use crate::wire::{Proposal, Proposals};
use std::sync::Arc;

/// Lists what reports and feeds of zones brought and was not put into force, oldest first.
#[utoipa::path(
    get,
    path = "/v1/proposals",
    params(PageParameters),
    responses((status = 200, description = "A page of proposals.", body = Proposals)),
)]
pub(super) async fn list_proposals(Call(edge, caller, page): Call<Edge, PageParameters>) -> Answer {
    json(&edge.proposals(&caller, &page.into_request())?)
}

/// Puts a proposal into force.
#[utoipa::path(
    post,
    path = "/v1/proposals/{id}/accept",
    responses(
        (status = 200, description = "The proposal, which is decided now.", body = Proposal),
        refusals::Creation,
    ),
)]
pub(super) async fn accept_proposal(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
) -> Answer {
    decide(&edge, &caller, &id, Decision::Accept).await
}

/// Drops a proposal.
#[utoipa::path(
    post,
    path = "/v1/proposals/{id}/reject",
    responses(
        (status = 200, description = "The proposal, which is decided now.", body = Proposal),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn reject_proposal(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
) -> Answer {
    decide(&edge, &caller, &id, Decision::Reject).await
}

async fn decide(edge: &Arc<Edge>, caller: &Caller, id: &str, decision: Decision) -> Answer {
    let decided = edge.decide_proposal(caller, id, decision).await?;
    Ok(stamped(json(&decided)?, &edge.stamp()))
}
