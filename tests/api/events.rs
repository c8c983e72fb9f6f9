//! The event stream: what happens is told in order, from where a listener left off, or not at all.

use crate::harness::{Api, WAIT_AT_MOST, circle};
use reqwest::Response;
use serde_json::json;
use skyway::edge::Settings;

/// Reads the stream until a number of frames has come.
pub(crate) async fn frames(response: &mut Response, count: usize) -> Vec<String> {
    let mut text = String::new();
    while text.matches("\n\n").count() < count {
        let chunk = tokio::time::timeout(WAIT_AT_MOST, response.chunk()).await;
        let chunk = chunk.expect("in time").expect("no error").expect("no end");
        text.push_str(std::str::from_utf8(&chunk).expect("text"));
    }
    text.split_terminator("\n\n").map(str::to_owned).collect()
}

pub(crate) fn field<'a>(frame: &'a str, name: &str) -> Option<&'a str> {
    let mut lines = frame.lines();
    lines.find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
}

async fn put_zone(api: &Api, id: &str) {
    let line = format!("PUT /v1/zones/{id}");
    api.ask(&line, &[], &circle(30.0).to_string()).await.is(201);
}

#[tokio::test]
async fn events_are_told_and_a_listener_goes_on_where_it_left_off() {
    let api = Api::start().await;
    let mut stream = api.open("GET /v1/events", &[], "").await;
    assert_eq!(stream.headers()["content-type"], "text/event-stream");
    let first = frames(&mut stream, 1).await;
    assert!(first[0].starts_with(": skyway\nretry: 2000"), "{first:?}");
    assert_eq!(field(&first[0], "id"), Some("7-0"));
    put_zone(&api, "z1").await;
    put_zone(&api, "z2").await;
    let told = frames(&mut stream, 2).await;
    assert_eq!(field(&told[0], "event"), Some("zone_put"));
    assert_eq!(field(&told[0], "id"), Some("7-1"));
    let data: serde_json::Value =
        serde_json::from_str(field(&told[0], "data").expect("data")).expect("JSON");
    assert_eq!(
        (&data["id"], &data["kind"]),
        (&"7-1".into(), &"zone_put".into())
    );

    for (path, last_event_id) in [
        ("/v1/events", Some("7-1")),
        ("/v1/events?after=7-1", None),
        ("/v1/events?after=7-0", Some("7-1")),
    ] {
        let headers: Vec<_> = last_event_id
            .map(|id| ("last-event-id", id))
            .into_iter()
            .collect();
        let mut resumed = api.open(&format!("GET {path}"), &headers, "").await;
        let again = frames(&mut resumed, 2).await;
        assert_eq!(again[1], told[1], "{path}");
    }
}

#[tokio::test]
async fn who_comes_back_too_late_is_told_before_the_stream_begins() {
    let settings = Settings {
        events_max: 2,
        ..Settings::default()
    };
    let api = Api::with(settings).await;
    for id in ["z1", "z2", "z3", "z4"] {
        put_zone(&api, id).await;
    }
    for gone in ["7-1", "6-1", "7-99"] {
        let told = api
            .ask("GET /v1/events", &[("last-event-id", gone)], "")
            .await;
        assert_eq!(told.is(410).code(), "events_gone", "{gone}");
    }
    let mut stream = api.open("GET /v1/events?after=7-2", &[], "").await;
    assert_eq!(field(&frames(&mut stream, 3).await[2], "id"), Some("7-4"));
}

#[tokio::test]
async fn more_streams_than_may_be_are_refused() {
    let settings = Settings {
        event_streams_max: 1,
        ..Settings::default()
    };
    let api = Api::with(settings).await;
    let _open = api.open("GET /v1/events", &[], "").await;
    let told = api.ask("GET /v1/events", &[], "").await.is(429);
    assert_eq!(told.code(), "limit_reached");
    assert!(told.header("retry-after").is_some());
}

#[tokio::test]
async fn a_drain_ends_readiness_and_streams() {
    let api = Api::start().await;
    let mut stream = api.open("GET /v1/events", &[], "").await;
    frames(&mut stream, 1).await;
    api.drain.begin();
    let end = tokio::time::timeout(WAIT_AT_MOST, stream.chunk())
        .await
        .expect("in time");
    assert!(matches!(end, Ok(None)), "{end:?}");
}

#[tokio::test]
async fn why_something_was_lifted_is_told() {
    let api = Api::start().await;
    put_zone(&api, "z1").await;
    let shut = json!({"id": "c1", "segments": ["379-406"]});
    api.post("/v1/closures", &shut).await.is(201);
    let long = format!("DELETE /v1/closures/c1?reason={}", "a".repeat(257));
    let refused = api.ask(&long, &[], "").await.is(400);
    assert_eq!(refused.code(), "parameter_invalid");
    for line in [
        "DELETE /v1/zones/z1?reason=the%20concert%20is%20over",
        "DELETE /v1/closures/c1?reason=the%20concert%20is%20over",
    ] {
        api.ask(line, &[("if-match", "*")], "").await.is(200);
    }
    let mut stream = api.open("GET /v1/events?after=7-2", &[], "").await;
    let told = frames(&mut stream, 3).await;
    let kinds: Vec<_> = told[1..]
        .iter()
        .map(|frame| field(frame, "event"))
        .collect();
    assert_eq!(kinds, [Some("zone_deleted"), Some("closure_ended")]);
    for frame in &told[1..] {
        let data = field(frame, "data").expect("data");
        let event: serde_json::Value = serde_json::from_str(data).expect("JSON");
        assert_eq!(event["reason"], "the concert is over");
    }
}
