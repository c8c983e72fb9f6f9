//! The demo's fleet as a client of an edge: what its drones are told comes by itself.

use crate::harness::{Api, WAIT_AT_MOST};
use axum::extract::Request;
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use http::StatusCode;
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::api::rest;
use skyway::demo::{Fleet, fly};
use skyway::edge::{FlightSettings, Settings};
use skyway::flight::Airframe;
use skyway::formats::load_network;
use skyway::network::bundled::SYDNEY_CBD;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// What a list has under a name, once `is_there` says so.
async fn until(api: &Api, path: &str, is_there: impl Fn(&Value) -> bool) -> Value {
    let asking = async {
        loop {
            let told = api.get(path).await.is(200).json();
            if is_there(&told) {
                return told;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let told = tokio::time::timeout(WAIT_AT_MOST, asking).await;
    told.unwrap_or_else(|_| panic!("{path} does not come to be as it should"))
}

/// Lets no telemetry through while it is deaf.
async fn listen_to(is_deaf: Arc<AtomicBool>, request: Request, next: Next) -> Response {
    let is_telemetry = request.uri().path() == "/v1/telemetry";
    match is_telemetry && is_deaf.load(Ordering::SeqCst) {
        true => StatusCode::SERVICE_UNAVAILABLE.into_response(),
        false => next.run(request).await,
    }
}

#[tokio::test]
async fn a_drone_of_the_demo_takes_over_a_version_that_no_telemetry_has_asked_for() {
    let topology = Arc::new(load_network(SYDNEY_CBD).expect("a network").topology);
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let settings = Settings {
        flight: Some(FlightSettings::of(Airframe::phantom3())),
        ..Settings::default()
    };
    let (api, hand) = Api::at(topology, SYDNEY_CBD.into(), settings, start).await;
    let is_deaf = Arc::new(AtomicBool::new(false));
    let (router, _) = rest::router(api.edge.clone(), api.drain.clone());
    let heard = is_deaf.clone();
    let router = router.layer(from_fn(move |request, next| {
        listen_to(heard.clone(), request, next)
    }));
    let url = api.another(router).await;
    // No registry is there: the wind stays as it is.
    let fleet = Fleet {
        drones: 1,
        seed: 1,
        registry: (url.clone(), "none".to_owned()),
    };
    let (clock, stop) = (api.edge.clock().clone(), CancellationToken::new());
    let flying = tokio::spawn({
        let stop = stop.clone();
        async move { fly(&fleet, &url, clock, stop).await }
    });
    until(&api, "/v1/drones", |told| !told["drones"][0].is_null()).await;
    // Its first wait is over, and time stands still from then on.
    hand.set(start + SignedDuration::from_secs(60));
    let told = until(&api, "/v1/plans", |told| !told["plans"][0].is_null()).await;
    let plan = &told["plans"][0];
    let nodes = plan["reported"]["path"]["nodes"].as_array().expect("nodes");
    is_deaf.store(true, Ordering::SeqCst);
    let closure = json!({"id": "crane", "reason": "crane", "nodes": [nodes[nodes.len() / 2]]});
    api.post("/v1/closures", &closure).await.is(201);
    let path = format!("/v1/plans/{}", plan["id"].as_str().expect("an id"));
    let taken = until(&api, &path, |plan| plan["reported"]["version"] == 2).await;
    assert_eq!(taken["wanted"], Value::Null, "{taken}");
    stop.cancel();
    flying
        .await
        .expect("no panic")
        .expect("a network to fly in");
}
