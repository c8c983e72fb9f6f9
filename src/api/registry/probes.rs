//! `GET /livez` and `/readyz` of a registry, and `/status` for its keepers.

use crate::api::rest::answer::{Answer, json, of_bytes};
use crate::api::server::Drain;
use crate::refusal::{Code, Refusal};
use crate::registry::Registry;
use axum::extract::State;
use axum::response::Response;
use http::StatusCode;
use std::sync::Arc;

const TEXT: &str = "text/plain; charset=utf-8";

/// Says that the process lives.
#[utoipa::path(
    get,
    path = "/livez",
    responses((status = 200, description = "It lives.", body = String, content_type = "text/plain")),
)]
pub(super) async fn live() -> Response {
    of_bytes(StatusCode::OK, TEXT, "live\n")
}

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
