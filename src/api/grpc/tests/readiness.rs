//! An edge without a network refuses what needs one, and says so to those who ask for its health.

use super::services::{REPORT_FAILURE, Routes, call, code, passed, report};
use crate::api::grpc::{Health, proto};
use crate::api::server::Drain;
use crate::clock::Clock;
use crate::edge::{Code, Edge, NewNetwork, Settings};
use crate::formats::{load_network, write_network};
use crate::network::{Generated, Joining, Topology};
use std::sync::Arc;
use tonic::Status;
use tonic_health::ServingStatus;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;

fn network() -> NewNetwork {
    let generated = Generated {
        nodes: 50,
        max_neighbours: 4,
        map_size_m: 1_000.0,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed: 1,
    };
    let text = write_network(&generated.network().expect("in range"));
    let loaded = load_network(&text).expect("a network");
    NewNetwork::new(Arc::new(loaded.topology), text.into())
}

#[tokio::test]
async fn an_edge_without_a_network_is_not_serving_until_it_gets_one() {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let (clock, _) = Clock::by_hand(start);
    let nothing = Arc::new(Topology::nothing());
    let edge = Edge::start(nothing, Default::default(), 1, Settings::default(), clock);
    let edge = edge.expect("threads");
    let (health, drain) = (Health::starting().await, Drain::new());
    let routes = Routes::of(&edge, &health);
    let following = tokio::spawn(health.follow(edge.clone(), drain.clone()));
    let mut client = HealthClient::new(routes.clone());
    let asked = || HealthCheckRequest::default();
    let told = client.check(asked()).await.expect("is known").into_inner();
    assert_eq!(told.status, ServingStatus::NotServing as i32);
    let mut changes = client.watch(asked()).await.expect("a watch").into_inner();
    let mut told = async || {
        let told = changes.message().await.expect("no break").expect("no end");
        told.status
    };
    assert_eq!(told().await, ServingStatus::NotServing as i32);

    let refused = call(&routes, REPORT_FAILURE, passed(report())).await;
    let refused: Result<proto::RecompositionAnswer, Status> = refused;
    let refused = refused.expect_err("there is no network");
    assert_eq!(
        (refused.code(), code(&refused)),
        (tonic::Code::Unavailable, Code::NotReady)
    );
    let network_of = async || -> Result<proto::GetNetworkResponse, Status> {
        let asked = passed(proto::GetNetworkRequest::default());
        call(&routes, "Network/GetNetwork", asked).await
    };
    let refused = network_of().await;
    assert_eq!(code(&refused.expect_err("there is none")), Code::NotReady);

    edge.replace_network(network())
        .await
        .expect("put into service");
    assert_eq!(told().await, ServingStatus::Serving as i32);
    let served = network_of().await;
    assert!(served.is_ok(), "{served:?}");
    drain.begin();
    assert_eq!(told().await, ServingStatus::NotServing as i32);
    following.await.expect("no panic");
}
