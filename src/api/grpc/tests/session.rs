//! A session, from the client's side.

use super::services::{Routes, call, code, context, delivery, passed, path, services_by};
use crate::access::{Caller, Role};
use crate::api::grpc::Health;
use crate::api::grpc::convert::timestamp;
use crate::api::grpc::proto::session_request::Body as Said;
use crate::api::grpc::proto::session_response::Body as Told;
use crate::api::grpc::proto::{self, SessionRequest, SessionResponse};
use crate::api::server::RequestContext;
use crate::clock::Clock;
use crate::edge::{Code, Edge, Idempotency, ZoneWrite};
use serde_json::json;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc::{Sender, channel};
use tokio::time::{sleep, timeout};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::ReceiverStream;
use tonic::client::Grpc;
use tonic::{Request, Status, Streaming};
use tonic_prost::ProstCodec;

/// Longer than anything takes, so that a test that hangs fails.
const WAIT_AT_MOST: Duration = Duration::from_secs(60);

/// A session and its client.
struct Line {
    said: Sender<SessionRequest>,
    told: Streaming<SessionResponse>,
}

impl Line {
    async fn begin(routes: &Routes, caller: Caller) -> Self {
        let (said, requests) = channel(64);
        let mut request = Request::new(ReceiverStream::new(requests));
        request.extensions_mut().insert(RequestContext {
            caller,
            ..context()
        });
        let mut client = Grpc::new(routes.clone());
        client.ready().await.expect("is always ready");
        let codec: ProstCodec<SessionRequest, SessionResponse> = ProstCodec::default();
        let begun = client.streaming(request, path("Drones/Session"), codec);
        let told = begun.await.expect("a session").into_inner();
        Self { said, told }
    }

    async fn say(&self, request_id: Option<u64>, body: Said) {
        let body = Some(body);
        let request = SessionRequest { request_id, body };
        self.said.send(request).await.expect("somebody reads");
    }

    async fn next(&mut self) -> Option<Result<SessionResponse, Status>> {
        let next = timeout(WAIT_AT_MOST, self.told.next()).await;
        next.expect("in time")
    }

    async fn told(&mut self) -> (Option<u64>, Told) {
        let told = self.next().await.expect("goes on").expect("an answer");
        (told.request_id, told.body.expect("says something"))
    }

    async fn hello(&mut self, drone: &str) -> proto::Welcome {
        self.say(None, hello(drone)).await;
        match self.told().await {
            (None, Told::Welcome(welcome)) => welcome,
            other => panic!("{other:?}"),
        }
    }
}

fn hello(drone: &str) -> Said {
    let drone = proto::HelloDrone {
        drone_id: drone.to_owned(),
        ..Default::default()
    };
    Said::Hello(proto::Hello {
        drones: vec![drone],
    })
}

/// The drone of a session that this one ends.
fn hello_after(session: &str) -> Said {
    let drone = proto::HelloDrone {
        drone_id: "d".to_owned(),
        ends_session: Some(session.to_owned()),
        received_through: None,
    };
    Said::Hello(proto::Hello {
        drones: vec![drone],
    })
}

fn seen(drone: &str, node: &str) -> Said {
    let place = proto::Place {
        place: Some(proto::place::Place::Node(node.to_owned())),
    };
    Said::Telemetry(proto::ReportTelemetryRequest {
        positions: vec![proto::TelemetryEntry {
            drone_id: drone.to_owned(),
            location: Some(place),
            ..Default::default()
        }],
    })
}

async fn close_ahead(edge: &Arc<Edge>) {
    let zone = json!({
        "type": "Feature", "id": "crane",
        "geometry": {"type": "Point", "coordinates": [100.0, 100.0]},
        "properties": {"radius_m": 1, "margin_m": 0},
    });
    let write = ZoneWrite::default();
    let operator = Caller::anyone();
    let posted = edge.create_zone(&operator, zone, write, Idempotency::default());
    posted.await.expect("a zone");
    edge.tick().await.expect("the writer works");
}

async fn begun(clock: Clock) -> (Arc<Edge>, Routes, Line) {
    let (edge, routes, _health): (_, _, Health) = services_by(clock).await;
    let line = Line::begin(&routes, Caller::anyone()).await;
    (edge, routes, line)
}

fn simulated() -> Clock {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    Clock::simulated(start, 1.0)
}

#[tokio::test]
async fn a_zone_is_told_on_the_session_and_taken_over_on_it() {
    let (edge, routes, mut line) = begun(simulated()).await;
    let welcome = line.hello("d").await;
    assert_eq!(welcome.drones, ["d"]);
    let plan: proto::Plan = call(&routes, "Plans/CreatePlan", passed(delivery()))
        .await
        .expect("a plan");
    let way = plan.reported.expect("a version").path.expect("a path");
    assert_eq!(way.nodes, ["1", "2", "3"]);

    line.say(Some(1), seen("d", "1")).await;
    assert!(matches!(line.told().await, (Some(1), Told::Telemetry(_))));
    close_ahead(&edge).await;
    let (None, Told::Message(message)) = line.told().await else {
        panic!("no message");
    };
    assert_eq!(message.kind(), proto::MessageKind::Version, "{message:?}");
    let version = message.version.expect("a version");
    let way = version.path.expect("a path");
    assert_eq!(way.nodes[..2], ["1", "4"], "{:?}", message.causes);

    let acknowledge = proto::AcknowledgePlanRequest {
        id: "p".to_owned(),
        version: version.version,
        ..Default::default()
    };
    line.say(Some(7), Said::Acknowledge(acknowledge)).await;
    let (Some(7), Told::Plan(plan)) = line.told().await else {
        panic!("no plan");
    };
    assert!(plan.wanted.is_none());
    assert_eq!(plan.reported.map(|it| it.version), Some(version.version));

    // It comes back before it has said that it has received that: the welcome stands before all else.
    let mut again = Line::begin(&routes, Caller::anyone()).await;
    again.say(None, hello_after(&welcome.session_id)).await;
    assert!(matches!(again.told().await, (None, Told::Welcome(_))));
    assert!(matches!(line.told().await, (None, Told::Ended(_))));
    let received = proto::ReceivedRequest {
        drone_id: "d".to_owned(),
        through: message.id,
    };
    line.say(Some(8), Said::Received(received)).await;
    let (Some(8), Told::MailLeft(left)) = line.told().await else {
        panic!("no answer");
    };
    assert_eq!((left.drone_id.as_str(), left.left), ("d", 0));
}

#[tokio::test]
async fn without_a_request_id_only_what_is_refused_is_answered() {
    let (_, _, mut line) = begun(simulated()).await;
    line.hello("d").await;
    line.say(None, seen("d", "1")).await;
    line.say(None, seen("d", "nowhere")).await;
    let (None, Told::Telemetry(answer)) = line.told().await else {
        panic!("no answer");
    };
    assert_eq!(answer.positions.len(), 1);
    assert_eq!(answer.positions[0].warnings[0].code, "location_ignored");
    line.say(Some(3), seen("d", "1")).await;
    let (Some(3), Told::Telemetry(answer)) = line.told().await else {
        panic!("no answer");
    };
    assert!(answer.positions[0].accepted);

    let decline = proto::DeclinePlanRequest {
        id: "no plan".to_owned(),
        version: 1,
        ..Default::default()
    };
    line.say(Some(4), Said::Decline(decline)).await;
    let (Some(4), Told::Problem(problem)) = line.told().await else {
        panic!("no problem");
    };
    assert_eq!(problem.code, "not_found");
    assert_eq!(problem.request_id.as_deref(), Some("00000001-1"));
}

#[tokio::test]
async fn a_failure_is_answered_and_a_goodbye_leaves_the_line() {
    let (edge, _, mut line) = begun(simulated()).await;
    line.hello("d").await;
    line.say(None, Said::Failure(super::services::report()))
        .await;
    let (None, Told::Recomposition(answer)) = line.told().await else {
        panic!("no answer");
    };
    let told = answer.answer.expect("has an answer");
    assert_eq!(told.outcome(), proto::Outcome::Rerouted);

    let goodbye = proto::Goodbye {
        drone_ids: vec!["d".to_owned()],
    };
    line.say(Some(1), Said::Goodbye(goodbye)).await;
    assert!(matches!(line.told().await, (Some(1), Told::Goodbye(_))));
    assert_eq!(edge.status().drones_on_sessions, 0);
    drop(line.said);
    assert!(
        timeout(WAIT_AT_MOST, line.told.next())
            .await
            .expect("ends")
            .is_none()
    );
}

#[tokio::test]
async fn what_happens_until_an_instant_is_told_before_the_clock_is_there() {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let (edge, routes, mut line) = begun(Clock::external(start)).await;
    line.hello("d").await;
    let delivery = proto::CreatePlanRequest {
        start_time: timestamp("2026-11-27T18:12:00Z"),
        ..delivery()
    };
    line.say(Some(1), seen("d", "1")).await;
    assert!(matches!(line.told().await, (Some(1), Told::Telemetry(_))));
    let asked = call(&routes, "Plans/CreatePlan", passed(delivery)).await;
    let _: proto::Plan = asked.expect("a plan");
    let zone = json!({
        "type": "Feature", "id": "later",
        "geometry": {"type": "Point", "coordinates": [100.0, 100.0]},
        "properties": {"radius_m": 1, "margin_m": 0,
            "windows": [{"from": "2026-11-27T18:20:00Z", "until": "2026-11-27T19:00:00Z"}]},
    });
    let write = ZoneWrite::default();
    let operator = Caller::anyone();
    let posted = edge.create_zone(&operator, zone, write, Idempotency::default());
    posted.await.expect("a zone");
    // By distance a zone closes ten minutes before it begins.
    let to = timestamp("2026-11-27T18:10:30Z");
    line.say(Some(9), Said::AdvanceTo(proto::AdvanceToRequest { to }))
        .await;
    let (None, Told::Message(message)) = line.told().await else {
        panic!("no message");
    };
    assert_eq!(message.causes, ["later"]);
    assert_eq!(message.kind(), proto::MessageKind::Version, "{message:?}");
    let (Some(9), Told::Clock(_)) = line.told().await else {
        panic!("no answer");
    };
}

#[tokio::test]
async fn a_drone_does_not_move_the_clock() {
    let start = "2026-11-27T18:00:00Z".parse().expect("an instant");
    let (_, routes, _) = begun(Clock::external(start)).await;
    let caller = Caller::local(Role::Drone, "d");
    let mut line = Line::begin(&routes, caller).await;
    line.hello("d").await;
    let to = timestamp("2026-11-27T18:15:00Z");
    line.say(Some(1), Said::AdvanceTo(proto::AdvanceToRequest { to }))
        .await;
    let (Some(1), Told::Problem(problem)) = line.told().await else {
        panic!("no problem");
    };
    assert_eq!(problem.code, "forbidden");
}

#[tokio::test(start_paused = true)]
async fn a_session_without_drones_is_ended() {
    let (_, _, mut line) = begun(simulated()).await;
    let ended = line.told.next().await.expect("an end");
    let status = ended.expect_err("no drone came");
    assert!(status.message().contains("hello"), "{status:?}");
    assert!(line.told.next().await.is_none());
}

#[tokio::test(start_paused = true)]
async fn a_session_may_be_without_drones_for_as_long_as_at_its_beginning() {
    let (_, _, mut line) = begun(simulated()).await;
    line.hello("a").await;
    // Its first ten seconds are over.
    sleep(Duration::from_secs(20)).await;
    let goodbye = proto::Goodbye {
        drone_ids: vec!["a".to_owned()],
    };
    line.say(Some(1), Said::Goodbye(goodbye)).await;
    assert!(matches!(line.told().await, (Some(1), Told::Goodbye(_))));
    sleep(Duration::from_secs(5)).await;
    line.hello("b").await;
}

#[tokio::test]
async fn a_word_that_leaves_its_version_out_is_refused() {
    let (_, _, mut line) = begun(simulated()).await;
    line.hello("d").await;
    let said = [
        Said::Acknowledge(proto::AcknowledgePlanRequest::default()),
        Said::Decline(proto::DeclinePlanRequest::default()),
    ];
    for word in said {
        line.say(Some(1), word).await;
        let (Some(1), Told::Problem(problem)) = line.told().await else {
            panic!("no problem");
        };
        let fault = &problem.errors[0];
        let told = (fault.code.as_str(), fault.pointer.as_str());
        assert_eq!(told, ("missing_field", "/version"));
    }
}

#[tokio::test]
async fn a_message_beyond_the_limit_ends_its_session_with_a_code() {
    let (_, _, mut line) = begun(simulated()).await;
    line.hello("d").await;
    line.say(Some(1), seen(&"d".repeat(2 << 20), "1")).await;
    let status = line.next().await.expect("an end").expect_err("too large");
    assert_eq!(status.code(), tonic::Code::ResourceExhausted);
    assert_eq!(code(&status), Code::BodyTooLarge);
    assert!(line.next().await.is_none());
}
