//! The services over a small network, called by the clients that the proto files compile to.

use crate::access::Caller;
use crate::api::grpc::proto::airspace_client::AirspaceClient;
use crate::api::grpc::proto::drones_client::DronesClient;
use crate::api::grpc::proto::network_client::NetworkClient;
use crate::api::grpc::proto::plans_client::PlansClient;
use crate::api::grpc::proto::recomposition_client::RecompositionClient;
use crate::api::grpc::proto::{self, batch_entry::Entry, zone::Geometry};
use crate::api::grpc::{Health, Limits, handlers};
use crate::api::operations::{Daemon, Operation};
use crate::api::problem::of_grpc_status;
use crate::api::server::{Answering, GrpcHandler, RequestContext, RequestId};
use crate::clock::Clock;
use crate::edge::{Code, Edge, Settings};
use crate::network::sketch;
use std::convert::Infallible;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio_stream::StreamExt;
use tonic::body::Body;
use tonic::{Request, Status};
use tonic_health::ServingStatus;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;
use tower::Service;

/// ```text
/// 1---2---3
/// |   |   |
/// 4---5---6
/// ```
pub(super) async fn services() -> (Routes, Health) {
    let drawing = "1 2 3\n4 5 6";
    let segments = [
        ("1", "2"),
        ("2", "3"),
        ("4", "5"),
        ("5", "6"),
        ("1", "4"),
        ("2", "5"),
        ("3", "6"),
    ];
    let topology = Arc::new(sketch(drawing, &segments));
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let clock = Clock::simulated(start, 1.0);
    let edge = Edge::start(topology, "{}".into(), 1, Settings::default(), clock).expect("threads");
    let health = Health::starting().await;
    (Routes::of(&edge, &health), health)
}

/// Hands each request to the handler of its path, as the gate does.
#[derive(Clone)]
pub(super) struct Routes(Arc<Vec<(Operation, GrpcHandler)>>);

impl Routes {
    pub(super) fn of(edge: &Arc<Edge>, health: &Health) -> Self {
        let found = handlers(edge, Limits::default(), health);
        Self(Arc::new(found.expect("the descriptors are read")))
    }
}

impl Service<http::Request<Body>> for Routes {
    type Response = http::Response<Body>;
    type Error = Infallible;
    type Future = Answering;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, request: http::Request<Body>) -> Answering {
        let asked = Operation::of_grpc(Daemon::Edge, request.uri().path());
        let found = self
            .0
            .iter()
            .find(|(operation, _)| Some(*operation) == asked);
        let (_, handler) = found.expect("a path of the table with its handler");
        handler(request)
    }
}

/// What the gate leaves in every request.
pub(super) fn passed<M>(message: M) -> Request<M> {
    let mut request = Request::new(message);
    request.extensions_mut().insert(context());
    request
}

fn context() -> RequestContext {
    RequestContext {
        caller: Caller::anyone(),
        operation: Operation::ReportFailure,
        request_id: RequestId::counted(1, 1),
        deadline: tokio::time::Instant::now() + Duration::from_secs(10),
    }
}

pub(super) fn code(status: &Status) -> Code {
    of_grpc_status(status).expect("a status of the table").code
}

/// Stuck before 2 on the way from 1 to 3.
pub(super) fn report() -> proto::FailureReport {
    proto::FailureReport {
        r#type: proto::FailureType::Navigational as i32,
        remaining_path: ["1", "2", "3"].map(str::to_owned).to_vec(),
        dry_run: Some(true),
        ..Default::default()
    }
}

#[tokio::test]
async fn a_failure_report_is_answered_and_can_be_read_again() {
    let (routes, _) = services().await;
    let mut client = RecompositionClient::new(routes);
    let answer = client
        .report_failure(passed(report()))
        .await
        .expect("an answer")
        .into_inner();
    let told = answer.answer.expect("has an answer");
    assert_eq!(told.outcome(), proto::Outcome::Rerouted);
    let path = told.path.expect("has a path");
    assert_eq!(path.nodes, ["1", "4", "5", "2", "3"]);
    assert!(!answer.stamp.expect("has a stamp").revision.is_empty());

    let asked = proto::GetRecompositionRequest {
        id: answer.id.clone(),
        certificate: true,
    };
    let record = client
        .get_recomposition(passed(asked))
        .await
        .expect("a record")
        .into_inner();
    assert_eq!(
        record.report.expect("has the report").remaining_path,
        ["1", "2", "3"]
    );
    assert!(record.certificate.expect("was asked for").starts_with('{'));

    let asked = proto::ListRecompositionsRequest::default();
    let listed = client
        .list_recompositions(passed(asked))
        .await
        .expect("a page")
        .into_inner();
    assert_eq!(listed.recompositions[0].id, answer.id);
}

#[tokio::test]
async fn each_report_of_a_batch_has_its_own_outcome_or_problem() {
    let (routes, _) = services().await;
    let failures = vec![proto::FailureReport::default(), report()];
    let message = proto::ReportFailuresRequest { failures };
    let mut client = RecompositionClient::new(routes);
    let answers = client
        .report_failures(passed(message))
        .await
        .expect("answers")
        .into_inner();
    match answers.answers.as_slice() {
        [first, second] => {
            let Some(Entry::Problem(problem)) = &first.entry else {
                panic!("{first:?}");
            };
            assert_eq!(problem.code, "report_not_located");
            assert!(
                matches!(second.entry, Some(Entry::Recomposition(_))),
                "{second:?}"
            );
        }
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_request_that_has_not_passed_the_gate_is_refused() {
    let (routes, _) = services().await;
    let refused = RecompositionClient::new(routes)
        .report_failure(Request::new(report()))
        .await;
    assert_eq!(
        code(&refused.expect_err("nobody knows who calls")),
        Code::Internal
    );
}

/// Around the middle of the segment from 2 to 3.
fn zone() -> proto::Zone {
    proto::Zone {
        id: "crane".to_owned(),
        geometry: Some(Geometry::Circle(proto::Circle {
            centre: Some(proto::Coordinates { x: 300.0, y: 100.0 }),
            radius_m: 20.0,
        })),
        margin_m: Some(0.0),
        ..Default::default()
    }
}

fn create() -> proto::CreateZoneRequest {
    proto::CreateZoneRequest {
        zone: Some(zone()),
        ..Default::default()
    }
}

#[tokio::test]
async fn a_zone_is_previewed_and_written_once() {
    let (routes, _) = services().await;
    let mut client = AirspaceClient::new(routes);
    let preview = proto::PreviewZoneRequest { zone: Some(zone()) };
    let ack = client.preview_zone(passed(preview)).await;
    let ack = ack.expect("a preview").into_inner();
    assert_eq!(ack.effect.expect("has an effect").segments, ["2-3"]);

    let ack = client.create_zone(passed(create())).await;
    let ack = ack.expect("is written").into_inner();
    assert_eq!(ack.zone.as_ref().map(|zone| &*zone.id), Some("crane"));
    let again = client.create_zone(passed(create())).await;
    let again = again.expect_err("is there already");
    assert_eq!(code(&again), Code::AlreadyExists);
}

#[tokio::test]
async fn a_zone_is_changed_and_lifted_by_its_version_and_all_of_it_can_be_watched() {
    let (routes, _) = services().await;
    let mut client = AirspaceClient::new(routes);
    let watch = proto::WatchEventsRequest::default();
    let watched = client.watch_events(passed(watch)).await;
    let mut events = watched.expect("a stream").into_inner();
    let ack = client.create_zone(passed(create())).await;
    let ack = ack.expect("is written").into_inner();

    let changed = proto::Zone {
        reason: Some("works".to_owned()),
        ..zone()
    };
    let mut put = proto::PutZoneRequest {
        id: "crane".to_owned(),
        zone: Some(changed),
        ..Default::default()
    };
    let refused = client.put_zone(passed(put.clone())).await;
    let refused = refused.expect_err("without its version");
    assert_eq!(code(&refused), Code::PreconditionRequired);
    put.etag = ack.etag;
    let written = client.put_zone(passed(put)).await.expect("is written");
    assert!(!written.into_inner().created);
    let id = "crane".to_owned();
    let found = client.get_zone(passed(proto::GetZoneRequest { id })).await;
    let found = found.expect("is there").into_inner();
    let reason = found.zone.and_then(|zone| zone.reason);
    assert_eq!(reason.as_deref(), Some("works"));

    let delete = proto::DeleteZoneRequest {
        id: "crane".to_owned(),
        etag: Some(found.etag),
        ..Default::default()
    };
    client.delete_zone(passed(delete)).await.expect("is lifted");
    let mut kinds = Vec::new();
    while !kinds.contains(&proto::EventKind::ZoneDeleted) {
        let event = events.next().await.expect("goes on").expect("an event");
        kinds.push(event.kind());
    }
    let puts = kinds
        .iter()
        .filter(|kind| **kind == proto::EventKind::ZonePut);
    assert_eq!(puts.count(), 2, "{kinds:?}");
}

#[tokio::test]
async fn a_zone_that_is_not_valid_is_refused_with_the_places_of_its_faults() {
    let (routes, _) = services().await;
    let create = proto::CreateZoneRequest {
        zone: Some(proto::Zone {
            geometry: None,
            ..zone()
        }),
        ..Default::default()
    };
    let status = AirspaceClient::new(routes)
        .create_zone(passed(create))
        .await;
    let status = status.expect_err("has no geometry");
    assert_eq!(status.code(), tonic::Code::InvalidArgument);
    let refusal = of_grpc_status(&status).expect("a status of the table");
    assert_eq!(refusal.code, Code::ZoneInvalid);
    assert_eq!(refusal.faults[0].pointer, "/geometry");
}

#[tokio::test]
async fn a_closure_and_what_nobody_has_are_told_with_the_world() {
    let (routes, _) = services().await;
    let mut client = AirspaceClient::new(routes);
    let create = proto::CreateClosureRequest {
        id: Some("works".to_owned()),
        nodes: vec!["5".to_owned()],
        ..Default::default()
    };
    let made = client
        .create_closure(passed(create))
        .await
        .expect("is closed")
        .into_inner();
    assert_eq!(made.closure.expect("has a closure").nodes, ["5"]);
    assert!(made.stamp.is_some());
    let decide = proto::DecideProposalRequest {
        id: "7".to_owned(),
        decision: 0,
    };
    let refused = client
        .decide_proposal(passed(decide))
        .await
        .expect_err("no decision");
    assert_eq!(code(&refused), Code::BodyInvalid);
    let decide = proto::DecideHoldRequest {
        id: "7".to_owned(),
        decision: 1,
    };
    let refused = client
        .decide_hold(passed(decide))
        .await
        .expect_err("no hold");
    assert_eq!(code(&refused), Code::NotFound);
}

#[tokio::test]
async fn a_plan_is_composed_and_its_drone_told_of_it() {
    let (routes, _) = services().await;
    let mut plans = PlansClient::new(routes.clone());
    let create = proto::CreatePlanRequest {
        id: Some("p".to_owned()),
        source: "1".to_owned(),
        destination: "3".to_owned(),
        drone_id: Some("d".to_owned()),
        ..Default::default()
    };
    let plan = plans
        .create_plan(passed(create))
        .await
        .expect("is composed")
        .into_inner();
    let way = plan
        .reported
        .expect("has a version")
        .path
        .expect("has a path");
    assert_eq!(way.nodes, ["1", "2", "3"]);

    let location = Some(proto::place::Place::Node("1".to_owned()));
    let entry = proto::TelemetryEntry {
        drone_id: "d".to_owned(),
        location: Some(proto::Place { place: location }),
        ..Default::default()
    };
    let positions = vec![entry, proto::TelemetryEntry::default()];
    let message = proto::ReportTelemetryRequest { positions };
    let mut drones = DronesClient::new(routes);
    let answer = drones
        .report_telemetry(passed(message))
        .await
        .expect("an answer")
        .into_inner();
    let accepted: Vec<bool> = answer
        .positions
        .iter()
        .map(|entry| entry.accepted)
        .collect();
    assert_eq!(accepted, [true, false]);
    assert_eq!(answer.positions[0].plan_id.as_deref(), Some("p"));
}

#[tokio::test]
async fn the_network_is_sent_only_to_who_has_another_version() {
    let (routes, _) = services().await;
    let mut client = NetworkClient::new(routes);
    let mut asked = proto::GetNetworkRequest::default();
    let first = client
        .get_network(passed(asked.clone()))
        .await
        .expect("the network")
        .into_inner();
    assert!(!first.document.is_empty());
    asked.etag = Some(first.etag.clone());
    let again = client
        .get_network(passed(asked))
        .await
        .expect("nothing new")
        .into_inner();
    assert!(again.document.is_empty());
    assert_eq!(again.etag, first.etag);

    let near = proto::NearestRequest {
        location: Some(proto::Coordinates { x: 190.0, y: 10.0 }),
        k: None,
    };
    let nearest = client
        .nearest(passed(near))
        .await
        .expect("nodes")
        .into_inner();
    assert_eq!(nearest.nodes[0].id, "5");
}

#[tokio::test]
async fn a_message_beyond_the_limit_is_refused_unread() {
    let (routes, _) = services().await;
    let large = proto::FailureReport {
        objective: Some("x".repeat(2 << 20)),
        ..report()
    };
    let status = RecompositionClient::new(routes)
        .report_failure(passed(large))
        .await;
    let status = status.expect_err("is too large");
    // In the words of tonic, which the gate tells in ours.
    assert_eq!(status.code(), tonic::Code::OutOfRange);
}

#[tokio::test]
async fn health_follows_readiness_for_every_service() {
    let (routes, health) = services().await;
    for (is_ready, expected) in [
        (false, ServingStatus::NotServing),
        (true, ServingStatus::Serving),
    ] {
        health.set_ready(is_ready).await;
        for service in ["", "skyway.v1.Recomposition", "skyway.v1.Airspace"] {
            let asked = HealthCheckRequest {
                service: service.to_owned(),
            };
            let told = HealthClient::new(routes.clone())
                .check(asked)
                .await
                .expect("is known");
            assert_eq!(told.into_inner().status, expected as i32, "{service}");
        }
    }
}

#[test]
fn the_table_of_operations_and_the_descriptors_have_the_same_methods() {
    use prost::Message;
    let described = Descriptors::decode(crate::api::grpc::DESCRIPTORS).expect("were compiled in");
    let mut paths = Vec::new();
    for file in &described.files {
        for service in &file.services {
            let methods = service.methods.iter();
            paths.extend(
                methods.map(|method| format!("/{}.{}/{}", file.package, service.name, method.name)),
            );
        }
    }
    assert_eq!(paths.len(), 37, "{paths:?}");
    for path in paths {
        let found = Operation::of(Daemon::Edge, &http::Method::POST, &path);
        assert!(found.is_some(), "{path} is not in the table of operations");
    }
}

/// As much of `google.protobuf.FileDescriptorSet` as names methods.
#[derive(Clone, PartialEq, prost::Message)]
struct Descriptors {
    #[prost(message, repeated, tag = "1")]
    files: Vec<File>,
}

#[derive(Clone, PartialEq, prost::Message)]
struct File {
    #[prost(string, tag = "2")]
    package: String,
    #[prost(message, repeated, tag = "6")]
    services: Vec<Named>,
}

#[derive(Clone, PartialEq, prost::Message)]
struct Named {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, repeated, tag = "2")]
    methods: Vec<MethodName>,
}

#[derive(Clone, PartialEq, prost::Message)]
struct MethodName {
    #[prost(string, tag = "1")]
    name: String,
}
