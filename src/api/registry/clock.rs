//! `/v1/clock`: the time that quotes, hours and arrivals are in.

use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{NoParameters, Query};
use crate::registry::Registry;
use crate::wire::ClockReading;
use axum::extract::State;
use std::sync::Arc;

/// Tells the time that the registry goes by, and how fast it passes. Quotes, hours and arrivals are in this time.
#[utoipa::path(
    get,
    path = "/v1/clock",
    responses((status = 200, description = "The clock.", body = ClockReading)),
)]
pub(super) async fn get_clock(
    State(registry): State<Arc<Registry>>,
    Query(NoParameters {}): Query<NoParameters>,
) -> Answer {
    json(&ClockReading {
        kind: registry.clock().kind(),
        time: registry.clock().now().to_string().into(),
        rate: registry.clock().rate(),
    })
}
