//! One story for each resource: what clients see, word for word.

use crate::harness::{Api, Story, circle};
use insta::assert_snapshot;
use serde_json::{Value, json};
use skyway::edge::{NewNetwork, Settings};
use skyway::formats::load_network;
use skyway::network::Topology;
use skyway::network::bundled::SYDNEY_CBD;
use std::sync::Arc;

fn report() -> Value {
    json!({
        "type": "navigational",
        "service": {"from": "379", "to": "406"},
        "location": {"node": "379"},
        "remaining_path": ["379", "406", "420", "450"],
        "drone": {"id": "drone-7"},
    })
}

#[tokio::test]
async fn failures_are_answered_kept_and_listed() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    let first = story.post("/v1/failures", &report()).await.is(200).json();
    story.get("/v1/recompositions").await.is(200);
    let id = first["id"].as_str().expect("an id");
    let path = format!("/v1/recompositions/{id}?certificate=true");
    let record = api.get(&path).await.is(200).json();
    assert_eq!(record["answer"]["path"], first["path"]);
    assert_eq!(record["report"], report());
    assert!(record["certificate"].is_object(), "{record}");
    story.get("/v1/recompositions/7-999").await.is(404);
    assert_snapshot!(story.text);
}

#[tokio::test]
async fn a_batch_of_failures_has_an_answer_for_each() {
    let api = Api::start().await;
    let mut dry = report();
    dry["dry_run"] = json!(true);
    let batch = json!({"failures": [dry, {"type": "operational"}, "what?"]});
    let answers = api.post("/v1/failures:batch", &batch).await.is(200).json();
    let answers = answers["answers"].as_array().expect("answers").clone();
    assert_eq!(answers.len(), 3);
    assert_eq!(answers[0]["recomposition"]["outcome"], "rerouted");
    assert_eq!(answers[0]["recomposition"]["publication"]["state"], "none");
    assert_eq!(answers[1]["problem"]["code"], "report_not_located");
    assert_eq!(answers[2]["problem"]["code"], "body_invalid");
}

#[tokio::test]
async fn a_drone_always_gets_an_outcome() {
    let api = Api::start().await;
    let leg = r#""service": {"from": 379, "to": 406}"#;
    let bodies = [
        format!("{{{leg}}}"),
        format!("{{{leg}, \"location\": \"nowhere\"}}"),
        format!(
            "{{{leg}, \"timestamp\": 12, \"drone\": [], \"strategy\": \"magic\", \"colour\": 1}}"
        ),
        format!("{{{leg}, \"type\": \"act of god\", \"remaining_path\": [9999, 379, 406]}}"),
        format!("{{{leg}, {leg}}}"),
        format!("{{{leg}, \"id\": \"\"}}"),
        format!("{{{leg}, \"zone\": {{\"type\": \"Feature\"}}}}"),
        r#"{"location": [151.2097388, -33.862532]}"#.to_owned(),
        r#"{"location": {"node": 379}, "destination": 450}"#.to_owned(),
    ];
    for body in bodies {
        for query in ["", "?colour=red"] {
            let told = api
                .ask(&format!("POST /v1/failures{query}"), &[], &body)
                .await;
            assert_eq!(told.status, 200, "{body}: {}", told.body);
            assert!(told.json()["outcome"].is_string(), "{body}");
        }
    }
    let mislabelled = [("content-type", "text/plain")];
    api.ask("POST /v1/failures", &mislabelled, &format!("{{{leg}}}"))
        .await
        .is(200);
    let odd_key = api
        .ask(
            "POST /v1/failures",
            &[("idempotency-key", "k\u{e9}")],
            &format!("{{{leg}}}"),
        )
        .await
        .is(200);
    let warnings = odd_key.json()["warnings"].to_string();
    assert!(warnings.contains("idempotency_key_ignored"), "{warnings}");
}

#[tokio::test]
async fn plans_are_composed_met_by_a_zone_taken_over_and_cancelled() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    let request = json!({"id": "p1", "source": 379, "destination": 450, "drone_id": "drone-7"});
    story.post("/v1/plans", &request).await.is(201);
    api.post("/v1/plans", &json!({"source": 1, "destination": 2}))
        .await
        .is(201);
    let page = api.get("/v1/plans?page_size=1").await.is(200).json();
    assert_eq!(page["plans"].as_array().map(Vec::len), Some(1));
    let next = page["next_page_token"].as_str().expect("a second page");
    let rest = api
        .get(&format!("/v1/plans?page_size=1&page_token={next}"))
        .await
        .is(200)
        .json();
    assert_eq!(rest["plans"].as_array().map(Vec::len), Some(1));
    assert_ne!(rest["plans"], page["plans"]);
    assert!(rest.get("next_page_token").is_none());

    let mut zone = circle(40.0);
    zone["id"] = json!("z1");
    story.post("/v1/zones", &zone).await.is(201);
    let met = api.get("/v1/plans?affected_by=z1").await.is(200).json();
    assert_eq!(met["plans"][0]["id"], "p1");
    assert_eq!(
        api.get("/v1/plans?drone_id=drone-8").await.is(200).json()["plans"],
        json!([])
    );
    let plan = api.get("/v1/plans/p1").await.is(200).json();
    assert_eq!(plan["flags"], json!(["affected"]));
    let version = &plan["wanted"]["version"];
    let stale = api
        .post("/v1/plans/p1/ack", &json!({"version": 99}))
        .await
        .is(409);
    assert_eq!(stale.code(), "plan_state_conflict");
    let taken = api
        .post("/v1/plans/p1/ack", &json!({"version": version}))
        .await
        .is(200)
        .json();
    assert_eq!(taken["flags"], json!([]));
    assert_eq!(&taken["reported"]["version"], version);
    let cancelled = api.ask("DELETE /v1/plans/p1", &[], "").await.is(200).json();
    assert_eq!(cancelled["ended_as"], "cancelled");
    assert_eq!(
        api.get("/v1/plans/nobody").await.is(404).code(),
        "not_found"
    );
    assert_snapshot!(story.text);
}

#[tokio::test]
async fn closures_are_made_changed_and_lifted() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    let draft = json!({"id": "c1", "reason": "crane", "segments": ["379-406"], "pads": [406]});
    story.post("/v1/closures", &draft).await.is(201);
    story.post("/v1/closures", &draft).await.is(409);
    story.get("/v1/closures/c1").await.is(200);
    let change = json!({"until": "2026-11-27T20:00:00Z"});
    story
        .ask("PATCH /v1/closures/c1", &[], &change)
        .await
        .is(200);
    story.get("/v1/closures").await.is(200);
    story
        .ask("DELETE /v1/closures/c1", &[], &Value::Null)
        .await
        .is(200);
    story.get("/v1/closures/c1").await.is(404);
    assert_snapshot!(story.text);
}

#[tokio::test]
async fn what_waits_for_an_operator_is_listed_and_decided() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    let mut regulatory = report();
    regulatory["type"] = json!("regulatory");
    regulatory["zone"] = circle(40.0);
    for decision in ["accept", "reject"] {
        let answer = api.post("/v1/failures", &regulatory).await.is(200).json();
        let id = answer["publication"]["proposal_ids"][0].as_str();
        let id = id.unwrap_or_else(|| panic!("no proposal: {}", answer["publication"]));
        api.settled().await;
        story.get("/v1/proposals").await.is(200);
        let path = format!("/v1/proposals/{id}/{decision}");
        story.post(&path, &Value::Null).await.is(200);
        story.post(&path, &Value::Null).await.is(404);
    }
    story.get("/v1/holds").await.is(200);
    story
        .post("/v1/holds/hold-7-1/release", &Value::Null)
        .await
        .is(404);
    story
        .post("/v1/holds/hold-7-1/reject", &Value::Null)
        .await
        .is(404);
    assert_snapshot!(story.text);
}

#[tokio::test]
async fn the_network_is_told_in_two_formats_and_node_by_node() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    story.get("/v1/nodes/406").await.is(200);
    story.get("/v1/nodes/nowhere").await.is(404);
    story
        .get("/v1/nearest?lon=151.21&lat=-33.86&k=2")
        .await
        .is(200);
    story.get("/v1/nearest?lon=-33.86&lat=151.21").await.is(400);
    assert_snapshot!(story.text);

    let network = api.get("/v1/network").await.is(200);
    assert_eq!(network.header("content-type"), Some("application/geo+json"));
    assert_eq!(network.json()["type"], "FeatureCollection");
    let compact = api.get("/v1/network?format=compact").await.is(200);
    assert_eq!(compact.header("content-type"), Some("application/json"));
    assert_ne!(compact.header("etag"), network.header("etag"));
    assert!(compact.header("skyway-revision").is_some());
    let etag = network.header("etag").expect("an entity tag");
    let known = api
        .ask("GET /v1/network", &[("if-none-match", etag)], "")
        .await
        .is(304);
    assert_eq!(
        (known.body.as_str(), known.header("etag")),
        ("", Some(etag))
    );
}

#[tokio::test]
async fn telemetry_is_taken_entry_by_entry() {
    let api = Api::start().await;
    let mut story = Story::of(&api);
    let batch = json!({"positions": [
        {"drone_id": "drone-7", "location": [151.2097388, -33.862532], "battery_fraction": 0.62},
        {"drone_id": "drone-8", "location": [-33.862532, 151.2097388]},
        {"location": {"node": 379}},
        7,
    ]});
    story.post("/v1/telemetry", &batch).await.is(200);
    story.get("/v1/drones").await.is(200);
    assert_snapshot!(story.text);
}

#[tokio::test]
async fn an_edge_without_a_network_asks_to_come_again() {
    let nothing = Arc::new(Topology::nothing());
    let api = Api::on(nothing, "", Settings::default()).await;
    assert_eq!(api.get("/livez").await.is(200).body, "live\n");
    let position = json!({"positions": [{"drone_id": "drone-7", "location": {"node": 379}}]});
    for told in [
        api.get("/readyz").await,
        api.post("/v1/failures", &report()).await,
        api.post("/v1/zones", &circle(40.0)).await,
        api.post("/v1/plans", &json!({"source": 406, "destination": 379}))
            .await,
        api.post("/v1/telemetry", &position).await,
        api.get("/v1/network").await,
        api.get("/v1/nearest?lon=151.21&lat=-33.86").await,
    ] {
        let told = told.is(503);
        assert_eq!(told.code(), "not_ready");
        assert_eq!(told.header("retry-after"), Some("1"));
    }
    assert_eq!(
        api.get("/v1/zones").await.is(200).json()["features"],
        json!([])
    );
    assert_eq!(
        api.ask_admin("GET /status").await.is(200).json()["nodes"],
        0
    );

    let loaded = load_network(SYDNEY_CBD).expect("a network");
    let network = NewNetwork::new(Arc::new(loaded.topology), SYDNEY_CBD.into());
    api.edge
        .replace_network(network)
        .await
        .expect("put into service");
    assert_eq!(api.get("/readyz").await.is(200).body, "ready\n");
    let answer = api.post("/v1/failures", &report()).await.is(200).json();
    assert_eq!(answer["topology_revision"], 2);
}

#[tokio::test]
async fn a_clock_that_has_not_stepped_needs_no_confirmation() {
    let api = Api::start().await;
    let told = api
        .post("/v1/clock:confirm", &Value::Null)
        .await
        .is(200)
        .json();
    assert_eq!(
        (&told["confirmed_step_s"], &told["freshness"]),
        (&Value::Null, &json!("fresh"))
    );
}

#[tokio::test]
async fn probes_and_the_admin_listener_tell_how_the_edge_stands() {
    let api = Api::start().await;
    assert_eq!(api.get("/livez").await.is(200).body, "live\n");
    assert_eq!(api.get("/readyz").await.is(200).body, "ready\n");
    assert_eq!(
        api.ask_admin("GET /status").await.is(200).json()["network"]["name"],
        "Sydney CBD"
    );
    let metrics = api.ask_admin("GET /metrics").await.is(200);
    assert!(metrics.body.ends_with("# EOF\n"), "{}", metrics.body);
    assert_eq!(api.get("/status").await.is(404).code(), "not_found");
    assert_eq!(
        api.ask_admin("GET /v1/zones").await.is(404).code(),
        "not_found"
    );
}
