//! The time that an edge goes by, as its clients read it.

use crate::events::{field, frames};
use crate::harness::{Api, Told, circle};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::clock::Clock;
use skyway::edge::Settings;
use skyway::formats::load_network;
use skyway::network::bundled::SYDNEY_CBD;
use skyway::wire::ClockKind;
use std::sync::Arc;

#[tokio::test]
async fn a_client_reads_the_time_that_the_edge_goes_by() {
    let start: Timestamp = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let loaded = load_network(SYDNEY_CBD).expect("a network");
    let topology = Arc::new(loaded.topology);
    let (api, hand) = Api::at(topology, SYDNEY_CBD.into(), Settings::default(), start).await;
    let told = api.get("/v1/clock").await.is(200).json();
    let expected = json!({"kind": "simulated", "time": "2026-11-27T18:00:00Z", "rate": 0.0});
    assert_eq!(told, expected);
    hand.advance(SignedDuration::from_secs(90));
    let told = api.get("/v1/clock").await.is(200).json();
    assert_eq!(told["time"], "2026-11-27T18:01:30Z");
}

#[tokio::test]
async fn every_clock_says_what_moves_it_and_how_fast() {
    let start: Timestamp = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let clocks = [
        (Clock::real(), ClockKind::Real, 1.0),
        (Clock::simulated(start, 20.0), ClockKind::Simulated, 20.0),
        (Clock::of_runtime(start), ClockKind::Simulated, 1.0),
        (Clock::external(start), ClockKind::External, 0.0),
    ];
    for (clock, kind, rate) in clocks {
        assert_eq!((clock.kind(), clock.rate()), (kind, rate), "{clock:?}");
    }
}

/// An edge over Sydney whose clock clients move.
async fn stepped() -> Api {
    let loaded = load_network(SYDNEY_CBD).expect("a network");
    let clock = Clock::external("2026-11-27T18:00:00Z".parse().expect("an instant"));
    let (topology, text) = (Arc::new(loaded.topology), SYDNEY_CBD.into());
    Api::by(clock, topology, text, Settings::default()).await
}

async fn advance(api: &Api, to: &str) -> Told {
    api.post("/v1/clock:advance", &json!({ "to": to })).await
}

#[tokio::test]
async fn a_client_moves_the_clock_and_everything_happens_at_its_own_instant() {
    let api = stepped().await;
    let told = api.get("/v1/clock").await.is(200).json();
    let expected = json!({"kind": "external", "time": "2026-11-27T18:00:00Z", "rate": 0.0});
    assert_eq!(told, expected);
    // A window closes ten minutes before it begins.
    for (id, from, until) in [("z1", "18:30", "18:50"), ("z2", "18:15", "18:20")] {
        let mut zone = circle(30.0);
        let instant = |time: &str| format!("2026-11-27T{time}:00Z");
        zone["properties"]["windows"] = json!([{"from": instant(from), "until": instant(until)}]);
        let line = format!("PUT /v1/zones/{id}");
        let put = api.ask(&line, &[], &zone.to_string()).await.is(201).json();
        assert_eq!(put["clock"], "external");
    }
    let shut = json!({"id": "c1", "segments": ["379-406"], "until": "2026-11-27T18:15:00Z"});
    api.post("/v1/closures", &shut).await.is(201);
    let told = advance(&api, "2026-11-27T18:30:00Z").await.is(200).json();
    assert_eq!(told["time"], "2026-11-27T18:30:00Z");
    assert_eq!(told["clock"], "external");
    assert_eq!(told["fired"], 4);
    let mut stream = api.open("GET /v1/events?after=7-3", &[], "").await;
    let frames = frames(&mut stream, 5).await;
    let events = frames[1..].iter().map(|frame| {
        let data = field(frame, "data").expect("data");
        let event: Value = serde_json::from_str(data).expect("JSON");
        assert_eq!(event["clock"], "external");
        (
            event["at"].clone(),
            event["kind"].clone(),
            event["data"].clone(),
        )
    });
    let events: Vec<_> = events.collect();
    let at = |time: &str| json!(format!("2026-11-27T{time}Z"));
    let turned = |time, began: &[&str], ended: &[&str]| {
        let data = json!({"began": began, "ended": ended});
        (at(time), json!("windows_turned"), data)
    };
    // What ends, ends after its last instant.
    assert_eq!(events[0], turned("18:05:00", &["z2"], &[]));
    let ended = (&at("18:15:00.000000001"), &json!("closure_ended"));
    assert_eq!((&events[1].0, &events[1].1), ended);
    assert_eq!(events[2], turned("18:20:00", &["z1"], &[]));
    assert_eq!(events[3], turned("18:20:00.000000001", &[], &["z2"]));
    assert_eq!(events.len(), 4);
}

#[tokio::test]
async fn the_clock_goes_forward_only_and_by_a_day_at_most() {
    let api = stepped().await;
    for _ in 0..2 {
        let told = advance(&api, "2026-11-28T18:00:00Z").await.is(200).json();
        assert_eq!(
            (&told["time"], &told["fired"]),
            (&json!("2026-11-28T18:00:00Z"), &json!(0))
        );
    }
    let back = advance(&api, "2026-11-28T17:59:59.999Z").await.is(422);
    assert_eq!(back.code(), "clock_backwards");
    let far = advance(&api, "2026-11-29T18:00:00.001Z").await.is(422);
    assert_eq!(far.code(), "clock_too_far");
    let unreadable = advance(&api, "in an hour").await.is(400);
    assert_eq!(unreadable.json()["errors"][0]["pointer"], "/to");
    let unknown = json!({"to": "2026-11-28T18:00:00Z", "by": 1});
    api.post("/v1/clock:advance", &unknown).await.is(400);
    let told = api.get("/v1/clock").await.is(200).json();
    assert_eq!(told["time"], "2026-11-28T18:00:00Z");
    let other = Api::start().await;
    let refused = advance(&other, "2026-11-27T18:00:00Z").await.is(409);
    assert_eq!(refused.code(), "clock_not_external");
}

#[tokio::test]
async fn telemetry_is_judged_by_the_clock_that_is_moved() {
    let api = stepped().await;
    let see = async |timestamp: &str| {
        let entry = json!({"drone_id": "d1", "location": {"node": "379"}, "timestamp": timestamp});
        let told = api
            .post("/v1/telemetry", &json!({"positions": [entry]}))
            .await;
        told.is(200).json()["positions"][0]["warnings"][0]["code"].clone()
    };
    assert_eq!(see("2026-11-27T18:10:00Z").await, "timestamp_ahead");
    advance(&api, "2026-11-27T18:10:00Z").await.is(200);
    assert_eq!(see("2026-11-27T18:10:00Z").await, Value::Null);
}
