//! `GET /livez` and `GET /readyz`: whether the process lives, and whether to send it requests.

use super::answer::{Answer, of_bytes};
use crate::api::server::Drain;
use crate::edge::{Code, Edge, Refusal};
use axum::extract::State;
use axum::response::Response;
use http::StatusCode;
use std::sync::Arc;

pub(in crate::api) const TEXT: &str = "text/plain; charset=utf-8";

/// Says that the process lives.
#[utoipa::path(
    get,
    path = "/livez",
    responses((status = 200, description = "It lives.", body = String, content_type = "text/plain")),
)]
pub(in crate::api) async fn live() -> Response {
    of_bytes(StatusCode::OK, TEXT, "live\n")
}

/// Says whether to send requests here: not during a drain.
#[utoipa::path(
    get,
    path = "/readyz",
    responses((status = 200, description = "It is ready.", body = String, content_type = "text/plain")),
)]
pub(super) async fn ready(State(edge): State<Arc<Edge>>, State(drain): State<Drain>) -> Answer {
    if drain.has_begun() {
        return Err(Refusal::new(Code::ShuttingDown, "the edge is draining").into());
    }
    edge.check_ready()?;
    Ok(of_bytes(StatusCode::OK, TEXT, "ready\n"))
}
