//! `GET /metrics` and `GET /status`, for the keepers of a daemon.

use super::answer::{Answer, json, of_bytes};
use crate::edge::{Code, Edge, Refusal};
use axum::Router;
use axum::extract::State;
use axum::routing::get;
use http::{HeaderMap, StatusCode, header};
use prometheus_client::encoding::text::encode;
use prometheus_client::registry::Registry;
use std::sync::Arc;

const OPENMETRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// The older format, which knows no exemplars.
const PLAIN: &str = "text/plain; version=0.0.4; charset=utf-8";

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
        false => of_bytes(StatusCode::OK, PLAIN, without_exemplars(&text)),
    })
}

/// Whether who asks reads `OpenMetrics`: everyone but those who ask for the older format alone.
fn reads_openmetrics(headers: &HeaderMap) -> bool {
    let accepted = headers.get_all(header::ACCEPT).iter();
    let accepted = accepted.filter_map(|value| value.to_str().ok());
    let types: Vec<&str> = accepted
        .flat_map(|value| value.split(','))
        .filter_map(|range| range.split(';').next())
        .map(str::trim)
        .collect();
    let asks_for = |name: &str| types.iter().any(|range| range.eq_ignore_ascii_case(name));
    asks_for("application/openmetrics-text") || !asks_for("text/plain")
}

/// The same without what the older format does not know. No label of ours has a ` # ` in its value.
fn without_exemplars(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for line in text.lines() {
        plain.push_str(line.split_once(" # {").map_or(line, |(sample, _)| sample));
        plain.push('\n');
    }
    plain
}

async fn status(State(edge): State<Arc<Edge>>) -> Answer {
    json(&edge.status())
}
