//! `GET /metrics` and `GET /status`, for the keepers of a daemon.

use super::answer::{Answer, json, of_bytes};
use super::exposition::{OPENMETRICS, PLAIN, in_older_format, reads_openmetrics};
use crate::edge::{Code, Edge, Refusal};
use axum::Router;
use axum::extract::State;
use axum::routing::get;
use http::{HeaderMap, StatusCode};
use prometheus_client::encoding::text::encode;
use prometheus_client::registry::Registry;
use std::sync::Arc;

/// Both pages.
pub(in crate::api) fn router(edge: Arc<Edge>, registry: Arc<Registry>) -> Router {
    let status = Router::new().route("/status", get(status)).with_state(edge);
    metrics_router(registry).merge(status)
}

/// `GET /metrics` alone.
pub(in crate::api) fn metrics_router(registry: Arc<Registry>) -> Router {
    Router::new()
        .route("/metrics", get(metrics))
        .with_state(registry)
}

async fn metrics(State(registry): State<Arc<Registry>>, headers: HeaderMap) -> Answer {
    let mut text = String::new();
    encode(&mut text, &registry).map_err(|error| {
        let detail = format!("the metrics cannot be written: {error}");
        Refusal::new(Code::Internal, detail)
    })?;
    Ok(match reads_openmetrics(&headers) {
        true => of_bytes(StatusCode::OK, OPENMETRICS, text),
        false => of_bytes(StatusCode::OK, PLAIN, in_older_format(&text)),
    })
}

async fn status(State(edge): State<Arc<Edge>>) -> Answer {
    json(&edge.status())
}
