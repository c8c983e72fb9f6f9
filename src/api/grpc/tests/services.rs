//! The services over a small network, called by the client of the library.

use crate::access::Caller;
use crate::api::grpc::convert::timestamp;
use crate::api::grpc::proto::{self, batch_entry::Entry};
use crate::api::grpc::{Health, Limits, handlers};
use crate::api::operations::{Daemon, Operation};
use crate::api::problem::of_grpc_status;
use crate::api::server::{Answering, GrpcHandler, RequestContext, RequestId};
use crate::clock::Clock;
use crate::edge::{Code, Edge, Settings};
use crate::network::sketch;
use http::uri::PathAndQuery;
use prost::Message;
use std::convert::Infallible;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tonic::body::Body;
use tonic::client::Grpc;
use tonic::{Request, Status, Streaming};
use tonic_health::ServingStatus;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;
use tonic_prost::ProstCodec;
use tower::Service;

pub(super) const REPORT_FAILURE: &str = "Recomposition/ReportFailure";

/// ```text
/// 1---2---3
/// |   |   |
/// 4---5---6
/// ```
pub(super) async fn services() -> (Routes, Health) {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let (_, routes, health) = services_by(Clock::simulated(start, 1.0)).await;
    (routes, health)
}

pub(super) async fn services_by(clock: Clock) -> (Arc<Edge>, Routes, Health) {
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
    let edge = Edge::start(topology, "{}".into(), 1, Settings::default(), clock).expect("threads");
    let health = Health::starting().await;
    let routes = Routes::of(&edge, &health);
    (edge, routes, health)
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

/// Calls a method, as `Plans/GetPlan`.
pub(super) async fn call<M, A>(
    routes: &Routes,
    method: &str,
    request: Request<M>,
) -> Result<A, Status>
where
    M: Message + 'static,
    A: Message + Default + 'static,
{
    let mut client = Grpc::new(routes.clone());
    client.ready().await.expect("is always ready");
    let codec = ProstCodec::default();
    let answer = client.unary(request, path(method), codec).await;
    answer.map(tonic::Response::into_inner)
}

pub(super) fn path(method: &str) -> PathAndQuery {
    let path = format!("/skyway.v1.{method}");
    path.parse().expect("a path")
}

/// What the gate leaves in every request.
pub(super) fn passed<M>(message: M) -> Request<M> {
    let mut request = Request::new(message);
    request.extensions_mut().insert(context());
    request
}

pub(super) fn context() -> RequestContext {
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
async fn a_failure_report_is_answered() {
    let (routes, _) = services().await;
    let answer = call(&routes, REPORT_FAILURE, passed(report())).await;
    let answer: proto::RecompositionAnswer = answer.expect("an answer");
    let told = answer.answer.expect("has an answer");
    assert_eq!(told.outcome(), proto::Outcome::Rerouted);
    let path = told.path.expect("has a path");
    assert_eq!(path.nodes, ["1", "4", "5", "2", "3"]);
    assert!(!answer.stamp.expect("has a stamp").revision.is_empty());
}

#[tokio::test]
async fn each_report_of_a_batch_has_its_own_outcome_or_problem() {
    let (routes, _) = services().await;
    let failures = vec![proto::FailureReport::default(), report()];
    let message = proto::ReportFailuresRequest { failures };
    let answers = call(&routes, "Recomposition/ReportFailures", passed(message)).await;
    let answers: proto::ReportFailuresResponse = answers.expect("answers");
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
    let refused = call(&routes, REPORT_FAILURE, Request::new(report())).await;
    let refused: Result<proto::RecompositionAnswer, Status> = refused;
    assert_eq!(
        code(&refused.expect_err("the caller is unknown")),
        Code::Internal
    );
}

pub(super) fn delivery() -> proto::CreatePlanRequest {
    proto::CreatePlanRequest {
        id: Some("p".to_owned()),
        source: "1".to_owned(),
        destination: Some("3".to_owned()),
        drone_id: Some("d".to_owned()),
        ..Default::default()
    }
}

#[tokio::test]
async fn a_refusal_has_its_code_and_the_places_of_its_faults() {
    let (routes, _) = services().await;
    let nowhere = proto::CreatePlanRequest {
        source: "nowhere".to_owned(),
        ..delivery()
    };
    let refused = call(&routes, "Plans/CreatePlan", passed(nowhere)).await;
    let refused: Result<proto::Plan, Status> = refused;
    let status = refused.expect_err("starts nowhere");
    assert_eq!(status.code(), tonic::Code::InvalidArgument);
    let refusal = of_grpc_status(&status).expect("a status of the table");
    assert_eq!(refusal.code, Code::PlanInvalid);
    assert_eq!(refusal.faults[0].pointer, "/source");
}

#[tokio::test]
async fn a_plan_is_composed_once_its_drone_told_of_it_and_all_of_it_can_be_watched() {
    let (routes, _) = services().await;
    let mut client = Grpc::new(routes.clone());
    client.ready().await.expect("is always ready");
    let watch = passed(proto::WatchEventsRequest::default());
    let codec = ProstCodec::default();
    let watched = client.server_streaming(watch, path("Airspace/WatchEvents"), codec);
    let mut events: Streaming<proto::Event> = watched.await.expect("a stream").into_inner();
    let plan = call(&routes, "Plans/CreatePlan", passed(delivery())).await;
    let plan: proto::Plan = plan.expect("is composed");
    let way = plan
        .reported
        .expect("has a version")
        .path
        .expect("has a path");
    assert_eq!(way.nodes, ["1", "2", "3"]);
    let again = call(&routes, "Plans/CreatePlan", passed(delivery())).await;
    let again: Result<proto::Plan, Status> = again;
    let again = again.expect_err("is there already");
    assert_eq!(code(&again), Code::AlreadyExists);
    let event = events.message().await.expect("no break").expect("no end");
    assert_eq!(event.kind(), proto::EventKind::PlanComposed);

    let location = Some(proto::place::Place::Node("1".to_owned()));
    let entry = proto::TelemetryEntry {
        drone_id: "d".to_owned(),
        location: Some(proto::Place { place: location }),
        ..Default::default()
    };
    let positions = vec![entry, proto::TelemetryEntry::default()];
    let message = proto::ReportTelemetryRequest { positions };
    let answer = call(&routes, "Drones/ReportTelemetry", passed(message)).await;
    let answer: proto::ReportTelemetryResponse = answer.expect("an answer");
    let accepted: Vec<bool> = answer
        .positions
        .iter()
        .map(|entry| entry.accepted)
        .collect();
    assert_eq!(accepted, [true, false]);
    assert_eq!(answer.positions[0].plan_id.as_deref(), Some("p"));
}

#[tokio::test]
async fn a_simulator_moves_the_clock_and_is_told_why_not() {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let (_, routes, _) = services_by(Clock::external(start)).await;
    let to = timestamp("2026-11-27T19:00:00Z");
    let message = proto::AdvanceToRequest { to };
    let moved = call(&routes, "Clock/AdvanceTo", passed(message)).await;
    let moved: proto::AdvanceToResponse = moved.expect("it moves");
    let stamp = moved.stamp.as_ref().expect("a stamp");
    assert_eq!((&moved.time, moved.fired), (&to, 0));
    assert_eq!(stamp.clock(), proto::ClockKind::External);
    let asked = proto::GetClockRequest {};
    let told = call(&routes, "Clock/GetClock", passed(asked)).await;
    let told: proto::GetClockResponse = told.expect("the time");
    assert_eq!((told.kind(), told.time), (proto::ClockKind::External, to));
    let refusals = [
        (timestamp("2026-11-27T18:59:59Z"), Code::ClockBackwards),
        (timestamp("2026-11-28T19:00:01Z"), Code::ClockTooFar),
        (None, Code::BodyInvalid),
    ];
    for (to, expected) in refusals {
        let message = proto::AdvanceToRequest { to };
        let refused = call(&routes, "Clock/AdvanceTo", passed(message)).await;
        let refused: Result<proto::AdvanceToResponse, Status> = refused;
        assert_eq!(code(&refused.expect_err("not there")), expected);
    }
}

#[tokio::test]
async fn the_network_is_sent_only_to_who_has_another_version() {
    let (routes, _) = services().await;
    let mut asked = proto::GetNetworkRequest::default();
    let first = call(&routes, "Network/GetNetwork", passed(asked.clone())).await;
    let first: proto::GetNetworkResponse = first.expect("the network");
    assert!(!first.document.is_empty());
    asked.etag = Some(first.etag.clone());
    let again = call(&routes, "Network/GetNetwork", passed(asked)).await;
    let again: proto::GetNetworkResponse = again.expect("nothing new");
    assert!(again.document.is_empty());
    assert_eq!(again.etag, first.etag);

    let near = proto::NearestRequest {
        location: Some(proto::Coordinates { x: 190.0, y: 10.0 }),
        k: None,
    };
    let nearest = call(&routes, "Network/Nearest", passed(near)).await;
    let nearest: proto::NearestResponse = nearest.expect("nodes");
    assert_eq!(nearest.nodes[0].id, "5");
}

#[tokio::test]
async fn a_message_beyond_the_limit_is_refused_unread() {
    let (routes, _) = services().await;
    let large = proto::FailureReport {
        objective: Some("x".repeat(2 << 20)),
        ..report()
    };
    let refused = call(&routes, REPORT_FAILURE, passed(large)).await;
    let refused: Result<proto::RecompositionAnswer, Status> = refused;
    // In the words of tonic, which the gate tells in ours.
    let status = refused.expect_err("is too large");
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
    assert_eq!(paths.len(), 15, "{paths:?}");
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
