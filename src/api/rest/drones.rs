//! `POST /v1/telemetry` and `GET /v1/drones`: where drones are, and what they are told in return.

use super::answer::{Answer, json};
use super::extract::{Authenticated, Call, PageParameters};
use super::reading::{self, DroneJsonBody};
use crate::edge::Edge;
use crate::wire::{Drones, Telemetry, TelemetryAnswer};
use axum::extract::State;
use std::sync::Arc;

/// Takes positions; each drone is told what it is asked to fly instead of its plan, if anything.
///
/// A position that cannot be read spoils no other.
#[utoipa::path(
    post,
    path = "/v1/telemetry",
    request_body(
        content = Telemetry,
        example = json!({"positions": [
            {"drone_id": "drone-7", "location": [151.2097388, -33.862532], "battery_fraction": 0.62},
        ]}),
    ),
    responses(
        (status = 200, description = "An entry for each position, in order.", body = TelemetryAnswer),
    ),
)]
pub(super) async fn post_telemetry(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    DroneJsonBody(body): DroneJsonBody,
) -> Answer {
    let batch: Telemetry = reading::body(&body, "batch of positions")?;
    json(&edge.telemetry(&caller, batch).await?)
}

/// Lists what is last known of each drone, by id.
#[utoipa::path(
    get,
    path = "/v1/drones",
    params(PageParameters),
    responses((status = 200, description = "A page of drones.", body = Drones)),
)]
pub(super) async fn list_drones(Call(edge, caller, page): Call<Edge, PageParameters>) -> Answer {
    json(&edge.drones(&caller, &page.into_request())?)
}
