//! `GET /v1/clock`: the time that the edge goes by; `POST /v1/clock:confirm`: an operator believes a wall clock that has
//! stepped.

use super::answer::{Answer, json};
use super::extract::{Authenticated, NoParameters, Query};
use crate::edge::Edge;
use crate::wire::{ClockReading, ClockState};
use axum::extract::State;
use std::sync::Arc;

/// Tells the time that the edge goes by, and how fast it passes. Departures, positions and deadlines are in this time.
#[utoipa::path(
    get,
    path = "/v1/clock",
    tag = "network",
    responses((status = 200, description = "The clock.", body = ClockReading)),
)]
pub(super) async fn get_clock(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    Query(NoParameters {}): Query<NoParameters>,
) -> Answer {
    json(&edge.clock_reading(&caller))
}

/// Believes the wall clock again after it has stepped by more than five seconds; until then nothing opens by it.
#[utoipa::path(
    post,
    path = "/v1/clock:confirm",
    tag = "decisions",
    responses((status = 200, description = "The clock, which is believed now.", body = ClockState)),
)]
pub(super) async fn confirm_clock(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    Query(NoParameters {}): Query<NoParameters>,
) -> Answer {
    json(&edge.confirm_clock(&caller).await?)
}
