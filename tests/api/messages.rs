//! What an answer says to its first reader: what was wrong with what was sent, and what to send.

use crate::harness::{self, Api};
use serde_json::{Value, json};

/// A circle of 60 m in Sydney, or where its coordinates are lost.
fn circle(id: &str, coordinates: [f64; 2]) -> Value {
    let mut zone = harness::circle(60.0);
    zone["id"] = json!(id);
    zone["geometry"]["coordinates"] = json!(coordinates);
    zone
}

const REPORT: &str = r#"{"service": {"from": 379, "to": 406}, "destination": 450}"#;

#[tokio::test]
async fn a_drone_is_answered_whatever_type_nobody_chose_and_refused_where_it_sends_something_else()
{
    let api = Api::start().await;
    for unchosen in [
        "application/json; charset=utf-8",
        "application/problem+json",
        "text/plain;charset=UTF-8",
        "application/octet-stream",
        "application/x-www-form-urlencoded",
        "",
    ] {
        let headers = [("content-type", unchosen)];
        api.ask("POST /v1/failures", &headers, REPORT).await.is(200);
    }
    for other in [
        "text/csv",
        "application/xml",
        "multipart/form-data; boundary=x",
        "application/protobuf",
    ] {
        let headers = [("content-type", other)];
        for line in [
            "POST /v1/failures",
            "POST /v1/failures:batch",
            "POST /v1/telemetry",
        ] {
            let told = api.ask(line, &headers, REPORT).await.is(415).json();
            let detail = told["detail"].as_str().expect("a detail");
            assert!(
                detail.contains("send JSON, and Content-Type: application/json"),
                "{line}: {told}"
            );
        }
    }
}

#[tokio::test]
async fn why_a_location_does_not_locate_is_told() {
    let api = Api::start().await;
    for (body, why) in [
        (
            json!({"location": [-33.8, 151.2]}),
            "'location' [-33.8, 151.2] is not on Earth and is ignored; longitude comes first: were they swapped?",
        ),
        (
            json!({"location": {"node": 9999}}),
            "'location' names the node '9999', which the network does not have",
        ),
        (
            json!({"location": {"x": 1, "y": 2}}),
            "'location' is in metres",
        ),
        (json!({"location": "here"}), "location"),
        (
            json!({"service": {"plan_id": "p9"}}),
            "the edge knows no active plan 'p9' of yours",
        ),
        (
            json!({"service": {"from": 9999, "to": 9998}, "location": [500.0, 2.0]}),
            "'location' [500, 2] is not on Earth",
        ),
    ] {
        let told = api.post("/v1/failures", &body).await.is(422).json();
        let text = told.to_string();
        assert!(text.contains("that locates the drone: "), "{body}: {text}");
        assert!(text.contains(why), "{body}: {text}");
    }
}

#[tokio::test]
async fn a_byte_order_mark_is_passed_over() {
    let api = Api::start().await;
    let marked = |text: &str| format!("\u{feff}{text}");
    api.ask("POST /v1/failures", &[], &marked(REPORT))
        .await
        .is(200);
    let zone = circle("marked", [151.210_855_1, -33.862_204]).to_string();
    api.ask("POST /v1/zones", &[], &marked(&zone)).await.is(201);
    let plan = json!({"source": 379, "destination": 450}).to_string();
    api.ask("POST /v1/plans", &[], &marked(&plan)).await.is(201);
}

#[tokio::test]
async fn a_zone_that_meets_nothing_has_a_hint() {
    let api = Api::start().await;
    let here = circle("here", [151.210_855_1, -33.862_204]);
    let told = api.post("/v1/zones", &here).await.is(201).json();
    assert!(told["effect"].get("hint").is_none(), "{told}");
    let lost = circle("lost", [151.210_855_1, 33.862_204]);
    for line in ["/v1/zones:preview", "/v1/zones"] {
        let told = api.post(line, &lost).await.json();
        let hint = told["effect"]["hint"].as_str().expect("a hint");
        assert!(
            hint.contains("did you mean [151.2108551, -33.862204]"),
            "{line}: {hint}"
        );
    }
}

#[tokio::test]
async fn what_is_no_number_in_a_query_is_told_in_words() {
    let api = Api::start().await;
    for (query, said) in [
        ("page_size=-1", "not a whole number"),
        ("page_size=many", "not a whole number"),
        ("page_size=", "empty"),
        ("page_size=99999999999", "too large"),
        ("page_size=0", "between 1 and 1000"),
    ] {
        let told = api.get(&format!("/v1/zones?{query}")).await;
        let text = told.json().to_string();
        assert!((400..500).contains(&told.status), "{text}");
        assert!(text.contains(said), "{query}: {text}");
        assert!(
            !text.contains("invalid digit") && !text.contains("target type"),
            "{text}"
        );
        assert!(text.contains("?page_size"), "{text}");
    }
}

#[tokio::test]
async fn no_length_is_minus_nothing() {
    let api = Api::start().await;
    let arrived = json!({
        "service": {"from": 379, "to": 406}, "destination": 406, "type": "service_level",
        "location": {"node": 406},
    });
    let told = api.post("/v1/failures", &arrived).await.is(200);
    assert!(!told.body.contains(":-0.0"), "{}", told.body);
}
