//! `/openapi.json`, its page at `/docs`, and the table of problems at `/docs/problems`.

use super::answer::{JSON, of_bytes};
use crate::api::problem;
use axum::Router;
use axum::routing::get;
use bytes::Bytes;
use http::StatusCode;
use serde_json::Value;
use utoipa_swagger_ui::{Config, SwaggerUi};

const HTML: &str = "text/html; charset=utf-8";

/// The pages of a description. They ask nothing of other hosts.
pub(in crate::api) fn router(description: &Value) -> Router {
    let json = Bytes::from(description.to_string());
    let problems = Bytes::from(problem::problems_html());
    // Without this the page asks a validator on the internet.
    let config = Config::from("/openapi.json").validator_url("none");
    Router::new()
        .route(
            "/openapi.json",
            get(|| async move { of_bytes(StatusCode::OK, JSON, json) }),
        )
        .route(
            "/docs/problems",
            get(|| async move { of_bytes(StatusCode::OK, HTML, problems) }),
        )
        .merge(SwaggerUi::new("/docs").config(config))
}
