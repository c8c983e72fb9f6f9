//! Alarms: what an operator has to look at, raised once, acknowledged, ended, and bounded in number.

use crate::harness::{Api, Told};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::Settings;
use skyway::formats::load_network;
use skyway::network::bundled::SYDNEY_CBD;
use std::sync::Arc;

/// Closes every node, so that no drone has a way.
async fn close_everything(api: &Api) -> Told {
    let topology = api.edge.topology();
    let nodes: Vec<&str> = topology
        .nodes()
        .map(|node| topology.node_id(node))
        .collect();
    let draft = json!({"id": "everything", "nodes": nodes});
    api.post("/v1/closures", &draft).await.is(201)
}

/// A drone in the middle of a leg.
fn report(drone: &str) -> Value {
    json!({
        "type": "navigational",
        "service": {"from": 379, "to": 406},
        "location": [151.2097388, -33.862532],
        "destination": 450,
        "drone": {"id": drone},
    })
}

async fn alarms(api: &Api, query: &str) -> Vec<Value> {
    api.settled().await;
    let told = api.get(&format!("/v1/alarms{query}")).await.is(200).json();
    told["alarms"].as_array().expect("alarms").clone()
}

async fn kinds_of_events(api: &Api) -> Vec<(String, Value)> {
    api.settled().await;
    let mut stream = api.edge.events(Some("7-0")).expect("a stream");
    let latest = api.edge.latest_event_id();
    let mut told = Vec::new();
    loop {
        let event = tokio_stream::StreamExt::next(&mut stream).await;
        let event = event.expect("an event").expect("none is missed");
        let kind = serde_json::to_value(event.kind).expect("JSON");
        told.push((
            kind.as_str().expect("text").to_owned(),
            event.event.data.clone(),
        ));
        if event.id == latest {
            return told;
        }
    }
}

async fn counted(api: &Api, kind: &str) -> u64 {
    let status = api.ask_admin("GET /status").await.is(200).json();
    let raised = status["alarms_raised"].as_array().expect("counts").clone();
    let found = raised.iter().find(|entry| entry[0] == kind);
    found
        .and_then(|entry| entry[1].as_u64())
        .expect("every kind is there")
}

#[tokio::test]
async fn an_answer_without_a_way_raises_one_alarm_until_it_is_acknowledged() {
    let api = Api::start().await;
    assert!(alarms(&api, "").await.is_empty());
    assert_eq!(counted(&api, "grounded").await, 0);
    close_everything(&api).await;
    let mut dry = report("drone-7");
    dry["dry_run"] = json!(true);
    api.post("/v1/failures", &dry).await.is(200);
    assert!(
        alarms(&api, "").await.is_empty(),
        "a dry run raises no alarm"
    );

    for _ in 0..3 {
        let told = api
            .post("/v1/failures", &report("drone-7"))
            .await
            .is(200)
            .json();
        assert_eq!(told["outcome"], "no_route", "{told}");
    }
    let raised = alarms(&api, "?kind=no_route&acknowledged=false").await;
    assert_eq!(raised.len(), 1, "{raised:?}");
    let alarm = &raised[0];
    assert_eq!(
        (&alarm["drone_id"], &alarm["count"]),
        (&json!("drone-7"), &json!(3))
    );
    assert!(alarm["recomposition_id"].is_string() && alarm["message"].is_string());
    assert_eq!(counted(&api, "no_route").await, 1);

    let path = format!(
        "/v1/alarms/{}/acknowledge",
        alarm["id"].as_str().expect("an id")
    );
    let first = api.post(&path, &Value::Null).await.is(200).json();
    assert!(first["acknowledged_at"].is_string() && first["acknowledged_by"].is_string());
    let again = api.post(&path, &Value::Null).await.is(200).json();
    assert_eq!(first, again);
    assert!(alarms(&api, "?acknowledged=false").await.is_empty());
    assert_eq!(
        alarms(&api, "?acknowledged=true&ended=false").await.len(),
        1
    );
    assert!(alarms(&api, "?kind=lost").await.is_empty());
    // Nothing ends it, as it is about no plan: the next time is told anew.
    api.post("/v1/failures", &report("drone-7")).await.is(200);
    let raised = alarms(&api, "?kind=no_route&acknowledged=false").await;
    assert_eq!(raised.len(), 1, "{raised:?}");
    assert_eq!(raised[0]["count"], 1, "{raised:?}");
    let former = alarms(&api, "?acknowledged=true").await;
    assert!(former[0]["ended_at"].is_string(), "{former:?}");
    let told = kinds_of_events(&api).await;
    let told = told.iter().filter(|(kind, _)| kind.starts_with("alarm_"));
    let told: Vec<&str> = told.map(|(kind, _)| kind.as_str()).collect();
    assert_eq!(
        told,
        [
            "alarm_raised",
            "alarm_acknowledged",
            "alarm_ended",
            "alarm_raised"
        ]
    );

    assert_eq!(
        api.post("/v1/alarms/alarm-7-999/acknowledge", &Value::Null)
            .await
            .is(404)
            .code(),
        "not_found"
    );
    assert_eq!(
        api.get("/v1/alarms?kind=fire").await.is(400).code(),
        "parameter_invalid"
    );
}

#[tokio::test]
async fn the_alarm_of_a_plan_ends_with_its_cause() {
    let api = Api::start().await;
    let request = json!({"id": "p1", "source": 379, "destination": 450, "drone_id": "drone-7"});
    api.post("/v1/plans", &request).await.is(201);
    let position =
        json!({"positions": [{"drone_id": "drone-7", "location": [151.2097388, -33.862532]}]});
    api.post("/v1/telemetry", &position).await.is(200);
    close_everything(&api).await;
    let raised = alarms(&api, "?kind=no_route&ended=false").await;
    assert_eq!(raised.len(), 1, "{raised:?}");
    assert_eq!(raised[0]["plan_id"], "p1");
    assert_eq!(raised[0]["causes"], json!(["everything"]));
    let etag = api.get("/v1/closures/everything").await.is(200).json()["etag"].clone();
    let etag = etag.as_str().expect("an entity tag").to_owned();
    api.ask("DELETE /v1/closures/everything", &[("if-match", &etag)], "")
        .await
        .is(200);
    assert!(alarms(&api, "?ended=false").await.is_empty());
    let ended = alarms(&api, "?ended=true").await;
    assert!(ended[0]["ended_at"].is_string(), "{ended:?}");
    let told = kinds_of_events(&api).await;
    let raised = told.iter().find(|(kind, _)| kind == "alarm_raised");
    let (_, data) = raised.expect("it is told");
    assert_eq!(data["alarm"]["plan_id"], "p1");
    assert!(told.iter().any(|(kind, _)| kind == "alarm_ended"));
}

#[tokio::test]
async fn a_version_that_nobody_acknowledges_raises_an_alarm() {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let loaded = load_network(SYDNEY_CBD).expect("a network");
    let topology = Arc::new(loaded.topology);
    let (api, hand) = Api::at(topology, SYDNEY_CBD.into(), Settings::default(), start).await;
    let request = json!({"id": "p1", "source": 379, "destination": 450, "drone_id": "drone-7"});
    api.post("/v1/plans", &request).await.is(201);
    let draft = json!({"id": "c1", "segments": ["379-406"]});
    api.post("/v1/closures", &draft).await.is(201);
    hand.advance(SignedDuration::from_secs(61));
    let raised = alarms(&api, "?kind=unacknowledged").await;
    assert_eq!(raised.len(), 1, "{raised:?}");
    assert_eq!(
        (&raised[0]["plan_id"], &raised[0]["causes"]),
        (&json!("p1"), &json!(["c1"]))
    );
    let plan = api.get("/v1/plans/p1").await.is(200).json();
    let version = plan["wanted"]["version"].clone();
    api.post("/v1/plans/p1/ack", &json!({"version": version}))
        .await
        .is(200);
    assert!(alarms(&api, "?ended=false").await.is_empty());
}

#[tokio::test]
async fn alarms_are_bounded_and_those_that_nobody_has_seen_stay_longest() {
    let api = Api::start().await;
    close_everything(&api).await;
    let batch = |from: usize| {
        let reports = (from..from + 500).map(|number| report(&format!("drone-{number}")));
        json!({"failures": reports.collect::<Vec<_>>()})
    };
    api.post("/v1/failures:batch", &batch(0)).await.is(200);
    let first = alarms(&api, "?page_size=10").await;
    for alarm in &first[1..] {
        let path = format!(
            "/v1/alarms/{}/acknowledge",
            alarm["id"].as_str().expect("an id")
        );
        api.post(&path, &Value::Null).await.is(200);
    }
    api.post("/v1/failures:batch", &batch(500)).await.is(200);
    let kept = alarms(&api, "?page_size=1000").await;
    assert_eq!(kept.len(), 1_000);
    api.post("/v1/failures", &report("one-more")).await.is(200);
    let kept = alarms(&api, "?page_size=1000").await;
    assert!(kept.len() < 1_000);
    assert!(
        kept.iter()
            .all(|alarm| alarm.get("acknowledged_at").is_none())
    );
    assert_eq!(
        kept.last().map(|alarm| &alarm["drone_id"]),
        Some(&json!("one-more"))
    );
    let page = api.get("/v1/alarms?page_size=600").await.is(200).json();
    let next = page["next_page_token"].as_str().expect("a second page");
    let rest = api
        .get(&format!("/v1/alarms?page_size=600&page_token={next}"))
        .await
        .is(200)
        .json();
    let count = |page: &Value| page["alarms"].as_array().map_or(0, Vec::len);
    assert_eq!(count(&page) + count(&rest), kept.len());
}
