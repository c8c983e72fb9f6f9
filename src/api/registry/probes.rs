//! `GET /readyz` of a registry, and `/status` for its keepers.

use crate::api::rest::answer::{Answer, json, of_bytes};
use crate::api::rest::probes::TEXT;
use crate::api::server::Drain;
use crate::refusal::{Code, Refusal};
use crate::registry::Registry;
use axum::extract::State;
use http::StatusCode;
use std::sync::Arc;

/// Says whether to send requests here: not during a drain, nor while the store does not answer.
#[utoipa::path(
    get,
    path = "/readyz",
    responses((status = 200, description = "It is ready.", body = String, content_type = "text/plain")),
)]
pub(super) async fn ready(
    State(registry): State<Arc<Registry>>,
    State(drain): State<Drain>,
) -> Answer {
    if drain.has_begun() {
        return Err(Refusal::new(Code::ShuttingDown, "the registry is draining").into());
    }
    if !registry.probe().await {
        let refusal = Refusal::new(Code::StoreUnavailable, "the store does not answer");
        return Err(refusal.retry_after_s(1).into());
    }
    Ok(of_bytes(StatusCode::OK, TEXT, "ready\n"))
}

/// Says how the registry stands.
pub(super) async fn status(State(registry): State<Arc<Registry>>) -> Answer {
    json(&registry.status().await?)
}
