//! `/v1/plans`: delivery requests, composed into plans that drones fly and take over.

use super::answer::{Answer, created, json};
use super::asked::{self, By, Named, NoParameters, Query};
use super::reading::{self, Sent};
use super::refusals;
use crate::edge::{Edge, PageRequest, PlanFilter};
use crate::wire::{Ack, Completion, Decline, DeliveryRequest, Plan, PlanState, Plans, Release};
use axum::extract::State;
use http::HeaderMap;
use serde::Deserialize;
use std::sync::Arc;
use utoipa::IntoParams;

/// Which plans are listed.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct PlansParameters {
    /// At most how many entries; 100 where none is given.
    #[param(value_type = u32, required = false, minimum = 1, maximum = 1000)]
    page_size: Option<u32>,
    /// The `next_page_token` of the page before.
    #[param(value_type = String, required = false)]
    page_token: Option<String>,
    /// Only those that this zone or closure affects.
    #[param(value_type = String, required = false)]
    affected_by: Option<String>,
    /// Only those of this drone.
    #[param(value_type = String, required = false)]
    drone_id: Option<String>,
    /// Only those in this state.
    #[param(value_type = String, required = false, example = "activated")]
    state: Option<PlanState>,
    /// Only those that are over, or are not.
    #[param(value_type = bool, required = false)]
    ended: Option<bool>,
}

/// Composes a plan: the shortest open way, or with the flight model the best one that the drone can fly; each leg with what to do if it closes.
#[utoipa::path(
    post,
    path = "/v1/plans",
    tag = "plans",
    params(
        ("Idempotency-Key" = Option<String>, Header, min_length = 1, max_length = 256, description = "The same key and body again get the same answer."),
    ),
    request_body(
        content = DeliveryRequest,
        example = json!({"source": "379", "destination": "450", "drone_id": "drone-7", "payload_kg": 1.5}),
    ),
    responses(
        (
            status = 201,
            description = "The plan.",
            body = Plan,
            headers(("Location" = String, description = "The path of the plan.")),
        ),
        (status = 409, response = refusals::Conflict),
        (status = 422, response = refusals::UnprocessableContent),
        (status = 429, response = refusals::TooManyRequests),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn create_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Query(NoParameters {}): Query<NoParameters>,
    headers: HeaderMap,
    Sent(body): Sent,
) -> Answer {
    let request: DeliveryRequest = reading::body(&body, "delivery request")?;
    let idempotency = asked::idempotency(&headers, &body)?;
    let plan = edge.compose_plan(&caller, request, idempotency).await?;
    created(&plan, "/v1/plans", &plan.id)
}

/// Lists the plans that the caller may see, by id.
#[utoipa::path(
    get,
    path = "/v1/plans",
    tag = "plans",
    params(PlansParameters),
    responses((status = 200, description = "A page of plans.", body = Plans)),
)]
pub(super) async fn list_plans(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Query(asked): Query<PlansParameters>,
) -> Answer {
    let page = PageRequest {
        size: asked.page_size,
        token: asked.page_token,
    };
    let filter = PlanFilter {
        affected_by: asked.affected_by,
        drone_id: asked.drone_id,
        state: asked.state,
        ended: asked.ended,
    };
    json(&edge.plans(&caller, &page, &filter)?)
}

/// Tells a plan, with what it is asked to fly instead, if anything.
#[utoipa::path(
    get,
    path = "/v1/plans/{id}",
    tag = "plans",
    params(("id" = String, Path, description = "`id` of a plan.")),
    responses((status = 200, description = "The plan.", body = Plan)),
)]
pub(super) async fn get_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Named(id): Named,
    Query(NoParameters {}): Query<NoParameters>,
) -> Answer {
    json(&edge.plan(&caller, &id)?)
}

/// Cancels a plan; its segments are free for others, unless it is in flight and nobody knows where.
#[utoipa::path(
    delete,
    path = "/v1/plans/{id}",
    tag = "plans",
    params(("id" = String, Path, description = "`id` of a plan.")),
    responses(
        (status = 200, description = "The cancelled plan.", body = Plan),
        (status = 409, response = refusals::Conflict),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn cancel_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Named(id): Named,
    Query(NoParameters {}): Query<NoParameters>,
) -> Answer {
    json(&edge.cancel_plan(&caller, &id).await?)
}

/// Takes over a version of a plan, whichever of those that were sent; the drone flies it from now on.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/ack",
    tag = "plans",
    params(("id" = String, Path, description = "`id` of a plan.")),
    request_body(content = Ack, example = json!({"version": 2})),
    responses(
        (status = 200, description = "The plan as it is flown now.", body = Plan),
        (status = 409, response = refusals::Conflict),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn acknowledge_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Named(id): Named,
    Query(NoParameters {}): Query<NoParameters>,
    Sent(body): Sent,
) -> Answer {
    let ack: Ack = reading::body(&body, "acknowledgement")?;
    json(&edge.acknowledge_plan(&caller, &id, ack).await?)
}

/// Declines a version of a plan: the drone flies on as it reported, and is asked to fly another one.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/decline",
    tag = "plans",
    params(("id" = String, Path, description = "`id` of a plan.")),
    request_body(content = Decline, example = json!({"version": 2, "reason": "obstacle"})),
    responses(
        (status = 200, description = "The plan, with what it is asked to fly now.", body = Plan),
        (status = 409, response = refusals::Conflict),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn decline_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Named(id): Named,
    Query(NoParameters {}): Query<NoParameters>,
    Sent(body): Sent,
) -> Answer {
    let decline: Decline = reading::body(&body, "declined version")?;
    json(&edge.decline_plan(&caller, &id, decline).await?)
}

/// Completes a plan: its drone has landed.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/complete",
    tag = "plans",
    params(("id" = String, Path, description = "`id` of a plan.")),
    request_body(content = Completion, example = json!({"location": {"node": "450"}})),
    responses(
        (status = 200, description = "The plan, which has ended.", body = Plan),
        (status = 409, response = refusals::Conflict),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn complete_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Named(id): Named,
    Query(NoParameters {}): Query<NoParameters>,
    Sent(body): Sent,
) -> Answer {
    let completion: Completion = reading::body(&body, "completion")?;
    json(&edge.complete_plan(&caller, &id, completion).await?)
}

/// Releases a plan that nobody has heard of: an operator says what became of it, and what it takes is free.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/release",
    tag = "plans",
    params(("id" = String, Path, description = "`id` of a plan.")),
    request_body(content = Release, example = json!({"ended_as": "delivered"})),
    responses(
        (status = 200, description = "The plan, which has ended.", body = Plan),
        (status = 409, response = refusals::Conflict),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn release_plan(
    State(edge): State<Arc<Edge>>,
    By(caller): By,
    Named(id): Named,
    Query(NoParameters {}): Query<NoParameters>,
    Sent(body): Sent,
) -> Answer {
    let release: Release = reading::body(&body, "release")?;
    json(&edge.release_plan(&caller, &id, release).await?)
}
