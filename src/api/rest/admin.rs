//! `GET /metrics` and `GET /status`, for the keepers of a daemon.

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
