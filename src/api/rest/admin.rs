//! `GET /metrics` and `GET /status`, for the keepers of an edge.

use super::answer::{Answer, json, of_bytes};
use crate::edge::{Code, Edge, Refusal};
use axum::Router;
use axum::extract::State;
use axum::routing::get;
use http::StatusCode;
use prometheus_client::encoding::text::encode;
use prometheus_client::registry::Registry;
use std::sync::Arc;

const OPENMETRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Both pages.
pub(super) fn router(edge: Arc<Edge>, registry: Arc<Registry>) -> Router {
    let metrics = Router::new()
        .route("/metrics", get(metrics))
        .with_state(registry);
    let status = Router::new().route("/status", get(status)).with_state(edge);
    metrics.merge(status)
}

async fn metrics(State(registry): State<Arc<Registry>>) -> Answer {
    let mut text = String::new();
    match encode(&mut text, &registry) {
        Ok(()) => Ok(of_bytes(StatusCode::OK, OPENMETRICS, text)),
        Err(error) => {
            let detail = format!("the metrics cannot be written: {error}");
            Err(Refusal::new(Code::Internal, detail).into())
        }
    }
}

async fn status(State(edge): State<Arc<Edge>>) -> Answer {
    json(&edge.status())
}
