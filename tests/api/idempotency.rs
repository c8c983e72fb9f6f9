//! Requests that are sent twice: with a key they are done once.

use crate::harness::{Api, circle};
use serde_json::json;

#[tokio::test]
async fn a_write_with_a_key_is_done_once() {
    let api = Api::start().await;
    let key = [("idempotency-key", "k1")];
    let writes = [
        ("/v1/zones", circle(30.0), circle(31.0)),
        (
            "/v1/closures",
            json!({"nodes": [406]}),
            json!({"nodes": [405]}),
        ),
        (
            "/v1/plans",
            json!({"source": 1, "destination": 9}),
            json!({"source": 1, "destination": 8}),
        ),
    ];
    for (path, body, other) in writes {
        let line = format!("POST {path}");
        let first = api.ask(&line, &key, &body.to_string()).await.is(201);
        let again = api.ask(&line, &key, &body.to_string()).await.is(201);
        assert_eq!(first.body, again.body, "{path}");
        assert_eq!(first.header("location"), again.header("location"), "{path}");
        let mismatch = api.ask(&line, &key, &other.to_string()).await.is(422);
        assert_eq!(mismatch.code(), "idempotency_mismatch", "{path}");
        api.ask(&line, &[("idempotency-key", "k2")], &other.to_string())
            .await
            .is(201);
    }
    let empty = api
        .ask(
            "POST /v1/zones",
            &[("idempotency-key", "")],
            &circle(5.0).to_string(),
        )
        .await;
    assert_eq!(empty.is(400).code(), "parameter_invalid");
}

#[tokio::test]
async fn a_report_under_an_id_or_a_key_is_answered_once() {
    let api = Api::start().await;
    let report =
        json!({"service": {"from": 379, "to": 406}, "remaining_path": [379, 406, 420, 450]});
    let key = [("idempotency-key", "r1")];
    let first = api
        .ask("POST /v1/failures", &key, &report.to_string())
        .await
        .is(200)
        .json();
    let again = api
        .ask("POST /v1/failures", &key, &report.to_string())
        .await
        .is(200)
        .json();
    assert_eq!(first["replayed"], false);
    assert_eq!(again["replayed"], true);
    assert_eq!(first["id"], again["id"]);
    let mut named = report.clone();
    named["id"] = json!("r1");
    let named = api
        .ask(
            "POST /v1/failures",
            &[("idempotency-key", "r2")],
            &named.to_string(),
        )
        .await;
    // The report's own id counts, not the key beside it.
    assert_eq!(named.is(200).json()["id"], first["id"]);
}
