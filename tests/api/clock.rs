//! The time that an edge goes by, as its clients read it.

use crate::harness::Api;
use jiff::{SignedDuration, Timestamp};
use serde_json::json;
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
