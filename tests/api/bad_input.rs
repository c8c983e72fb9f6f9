//! What operators and clients get wrong: each has its status, its code and its place.

use crate::harness::{Api, circle};
use insta::assert_snapshot;
use skyway::api::operations::{Daemon, Listener, TABLE};
use std::fmt::Write;

const ZONE_TWICE: &str = r#"{"type": "Feature", "type": "Feature"}"#;

/// The line of a request, a header or none, and the body.
type Case = (
    &'static str,
    Option<(&'static str, &'static str)>,
    &'static str,
);

/// Requests that are refused.
const REFUSED: &[Case] = &[
    ("POST /v1/failures", None, ""),
    ("POST /v1/failures", None, "{\"type\": "),
    ("POST /v1/failures", None, "[]"),
    ("POST /v1/failures", None, "{}"),
    ("POST /v1/failures", None, "{\"location\": [1e999, 0]}"),
    ("POST /v1/zones", Some(("content-type", "text/plain")), "{}"),
    (
        "POST /v1/plans",
        Some(("content-type", "application/x-www-form-urlencoded")),
        "{}",
    ),
    (
        "POST /v1/failures",
        Some(("content-encoding", "gzip")),
        "{}",
    ),
    ("POST /v1/failures:batch", None, "[]"),
    ("POST /v1/failures:batch", None, "{\"failures\": {}}"),
    ("POST /v1/failures:batch", None, "{\"failure\": []}"),
    ("POST /v1/telemetry", None, "{\"positions\": 1}"),
    ("POST /v1/telemetry", None, "not json"),
    ("POST /v1/plans", None, ""),
    ("POST /v1/plans", None, "[379, 450]"),
    ("POST /v1/plans", None, "{\"source\": 379}"),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 450, \"destination\": 451}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destinaton\": 450}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 9999}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 450, \"payload_kg\": 1e999}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 450, \"airspeed_mps\": \"16\"}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 450, \"airspeed_mps\": 0}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 450, \"start_time\": \"noon\"}",
    ),
    (
        "POST /v1/plans",
        None,
        "{\"source\": 379, \"destination\": 450} {}",
    ),
    (
        "POST /v1/plans?dry_run=true",
        None,
        "{\"source\": 379, \"destination\": 450}",
    ),
    ("POST /v1/plans/nobody/ack", None, "{\"version\": -1}"),
    ("POST /v1/plans/nobody/ack", None, "{\"version\": 1}"),
    ("POST /v1/zones", None, ""),
    ("POST /v1/zones", None, "[]"),
    ("POST /v1/zones", None, ZONE_TWICE),
    (
        "POST /v1/zones",
        None,
        "{\"type\": \"Feature\", \"properties\": {\"lower_m\": 1e999}}",
    ),
    (
        "POST /v1/zones",
        None,
        "{\"type\": \"Feature\", \"geometry\": null, \"colour\": 1}",
    ),
    ("POST /v1/zones?validate=true", None, "{}"),
    ("POST /v1/zones?validate_only=yes", None, "{}"),
    ("PUT /v1/zones/%FF", None, "{}"),
    ("DELETE /v1/zones/nobody", None, ""),
    ("POST /v1/closures", None, "{}"),
    (
        "POST /v1/closures",
        None,
        "{\"segments\": [\"379-406\", 7]}",
    ),
    (
        "POST /v1/closures",
        None,
        "{\"segments\": [\"406-379\"], \"until\": \"2020-01-01T00:00:00Z\"}",
    ),
    ("POST /v1/closures", None, "{\"segmets\": [\"379-406\"]}"),
    ("PATCH /v1/closures/nobody", None, "{}"),
    ("PATCH /v1/closures/nobody", None, "{\"confirmed\": true}"),
    (
        "PATCH /v1/closures/nobody",
        None,
        "{\"confirmed\": \"yes\"}",
    ),
    ("GET /v1/zones?page_size=0", None, ""),
    ("GET /v1/zones?page_size=many", None, ""),
    ("GET /v1/zones?page_sise=3", None, ""),
    ("GET /v1/zones?page_size=3&page_size=4", None, ""),
    ("GET /v1/zones?page_token=zz", None, ""),
    ("GET /v1/nodes/379?verbose=1", None, ""),
    ("GET /v1/nearest?lon=151", None, ""),
    ("GET /v1/nearest?lon=151&lat=north", None, ""),
    ("GET /v1/nearest?lon=NaN&lat=0", None, ""),
    ("GET /v1/nearest?lon=151&lat=-33&k=101", None, ""),
    ("GET /v1/network?format=xml", None, ""),
    ("GET /v1/recompositions/7-1?certificate=maybe", None, ""),
    ("GET /v1/events?after=yesterday", None, ""),
    ("GET /v1/nothing", None, ""),
    ("PATCH /v1/zones/z1", None, "{}"),
];

#[tokio::test]
async fn every_mistake_has_its_status_code_and_place() {
    let api = Api::start().await;
    let mut table = String::new();
    for (line, header, body) in REFUSED {
        let headers: Vec<_> = header.iter().copied().collect();
        let told = api.ask(line, &headers, body).await;
        let media_type = told.header("content-type");
        assert_eq!(
            media_type,
            Some("application/problem+json"),
            "{line} {body}"
        );
        let problem = told.json();
        assert_eq!(problem["request_id"], "test", "{line} {body}");
        assert_eq!(problem["status"], told.status, "{line} {body}");
        // Writing to text cannot fail.
        let _ = writeln!(
            table,
            "{line} {body}\n    {} {}: {}",
            told.status,
            told.code(),
            problem["detail"]
        );
        for fault in problem["errors"].as_array().into_iter().flatten() {
            let _ = writeln!(
                table,
                "        {} {} {}",
                fault["code"], fault["pointer"], fault["hint"]
            );
        }
    }
    assert_snapshot!(table);
}

#[tokio::test]
async fn a_body_beyond_the_limit_and_a_number_beyond_a_double_are_told_as_such() {
    let api = Api::start().await;
    let long = "x".repeat(1024 * 1024 + 1);
    assert_eq!(
        api.ask("POST /v1/zones", &[], &long).await.is(413).code(),
        "body_too_large"
    );
    let zone = circle(30.0).to_string().replace("30.0", "1e400");
    let told = api.ask("POST /v1/zones", &[], &zone).await.is(400).json();
    let message = told["errors"][0]["message"].as_str().unwrap_or_default();
    assert!(
        message.contains("line 1, column") && message.contains("1.8e308"),
        "{message}"
    );
}

#[tokio::test]
async fn every_path_says_which_methods_it_has() {
    let api = Api::start().await;
    for row in TABLE
        .iter()
        .filter(|row| row.operation.is_of(Daemon::Edge))
        .filter(|row| row.listener != Some(Listener::Admin))
    {
        for (_, path) in row.rest {
            let path = path.replace("{id}", "7").replace("{*file}", "x");
            let told = api.ask(&format!("OPTIONS {path}"), &[], "").await.is(405);
            assert_eq!(told.code(), "method_not_allowed", "{path}");
            let allowed = told.header("allow").unwrap_or_default();
            assert!(
                row.rest
                    .iter()
                    .any(|(method, _)| allowed.contains(method.as_str())),
                "{path}: {allowed}"
            );
        }
    }
}
