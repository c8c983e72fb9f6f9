//! Drones on the ground that cannot go on: they hold on their pads, and are told when there is a way.

use crate::flying::{at, on, settings, street};
use crate::offers::block;
use crate::stage::{Stage, circle, names};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Idempotency, Settings};
use skyway::wire::{self, EndedAs, EventKind, PlanState};
use tokio_stream::StreamExt;

/// A drone with a plan along the street, which stands on its pad yet.
async fn waiting() -> Stage {
    let stage = on(&street(&[2, 2, 2]));
    let asked = json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s2"});
    stage.deliver(asked).await.expect("a plan");
    stage
}

/// The same, and its first leg is closed.
async fn shut_in() -> Stage {
    let stage = waiting().await;
    close(&stage, "s0-s1").await;
    stage
}

async fn close(stage: &Stage, segment: &str) {
    let draft = json!({"id": "works", "segments": [segment], "reason": "works"});
    let draft = serde_json::from_value(draft).expect("a draft");
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    closed.await.expect("a closure");
    stage.settle().await;
}

/// It tells where it stands for some seconds.
async fn stands(stage: &Stage) {
    for _ in 0..8 {
        stage.pass(SignedDuration::from_secs(1)).await;
        stands_at(stage, 0.0).await;
    }
    stage.settle().await;
}

async fn stands_at(stage: &Stage, x: f64) {
    let position = json!({"drone_id": "d", "location": {"x": x, "y": 0.0}, "airborne": false, "ground_speed_mps": 0.0});
    let batch = serde_json::from_value(json!({"positions": [position]})).expect("telemetry");
    let told = stage.edge.telemetry(&stage.caller, batch).await;
    told.expect("taken");
}

async fn takes_over(stage: &Stage) -> wire::Plan<'static> {
    let wanted = stage.plan("p").wanted.expect("a version");
    let ack = wire::Ack {
        version: wanted.version,
        ..wire::Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    taken.expect("taken over");
    stage.settle().await;
    stage.plan("p")
}

fn told(version: Option<&wire::PlanVersion<'_>>) -> (String, Vec<String>) {
    let version = version.expect("a version");
    (version.outcome.to_string(), names(&version.path.nodes))
}

#[tokio::test]
async fn a_drone_whose_way_closes_while_it_stands_holds_until_it_opens() {
    let stage = shut_in().await;
    let hold = ("hold".to_owned(), vec!["s0".to_owned()]);
    assert_eq!(told(stage.plan("p").wanted.as_ref()), hold);
    // Where it holds can be drawn.
    let stretch = stage
        .plan("p")
        .wanted
        .and_then(|wanted| wanted.first_stretch);
    let stretch = stretch.expect("a place");
    let places: Vec<_> = stretch.geometry.iter().map(|at| (at.x, at.y)).collect();
    assert_eq!(
        (stretch.kind, places),
        (wire::StretchKind::None, vec![(0.0, 0.0)])
    );
    let plan = takes_over(&stage).await;
    assert_eq!((told(Some(&plan.reported)), plan.wanted), (hold, None));
    stands(&stage).await;
    stage.pass(SignedDuration::from_secs(120)).await;
    stands(&stage).await;
    let plan = stage.plan("p");
    assert_eq!((plan.ended_as, plan.wanted), (None, None), "it waits");
    assert_eq!(plan.flags, [], "and is not overdue");
    let mut events = stage.edge.events(None).expect("a stream");
    let lifted = stage
        .edge
        .lift_closure(&stage.caller, "works", Some("*".to_owned()), None);
    lifted.await.expect("lifted");
    while events.next().await.expect("more").expect("no gap").kind != EventKind::PlanOffered {}
    let (outcome, nodes) = told(stage.plan("p").wanted.as_ref());
    assert_eq!(
        (&*outcome, nodes),
        ("rerouted", names_of(&["s0", "s1", "s2"]))
    );
    let plan = takes_over(&stage).await;
    assert_eq!(plan.reported.path.nodes.len(), 3);
    assert_ne!(plan.state, PlanState::Ended);
}

#[tokio::test]
async fn a_round_trip_that_holds_at_home_is_not_over() {
    let stage = on(&street(&[2, 2, 2]));
    let stops = json!([{"node": "s2", "service_s": 60}]);
    let asked =
        json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s0", "stops": stops});
    stage.deliver(asked).await.expect("a plan");
    close(&stage, "s0-s1").await;
    let plan = takes_over(&stage).await;
    let hold = ("hold".to_owned(), vec!["s0".to_owned()]);
    assert_eq!(told(Some(&plan.reported)), hold);
    stands(&stage).await;
    stage.pass(SignedDuration::from_secs(120)).await;
    stands(&stage).await;
    assert_eq!(stage.plan("p").ended_as, None, "nothing has been served");
}

#[tokio::test]
async fn a_drone_that_reports_from_its_pad_that_it_cannot_go_on_holds() {
    let stage = waiting().await;
    let answer = stage.answer(json!({
        "type": "navigational", "service": {"from": "s0", "to": "s1", "plan_id": "p"}, "destination": "s2",
        "location": {"node": "s0"}, "airborne": false, "drone": {"id": "d"},
    }));
    let answer = answer.await;
    assert_eq!(answer["outcome"], "hold", "{answer}");
    assert_eq!(answer["path"]["nodes"], json!(["s0"]));
    assert_ne!(stage.plan("p").ended_as, Some(EndedAs::Diverted));
}

/// A zone counts again tomorrow, or every week: who waits under it goes once it ends today.
#[tokio::test]
async fn who_holds_is_told_when_the_zone_ends_that_counts_now() {
    let windows = json!([{"from": at("05:00").to_string(), "until": at("07:00").to_string()},
        {"from": "2026-11-22T05:00:00Z", "until": "2026-11-22T07:00:00Z"}]);
    for settings in [Settings::default(), settings()] {
        let stage = Stage::with(Settings {
            closed_fraction_max: 0.2,
            ..settings
        });
        let mut school = circle("school", 0.0, 0.0, 10.0);
        school["properties"]["windows"] = windows.clone();
        stage.zone(school).await;
        let answer = stage.answer(json!({"type": "service_level", "service": {"from": "a0", "to": "a1"}, "destination": "a7",
            "location": {"node": "a0"}, "airborne": false}));
        let answer = answer.await;
        assert_eq!(answer["outcome"], "hold", "{answer}");
        let warnings = answer["warnings"].as_array().expect("warnings").iter();
        let told: Vec<&Value> = warnings.filter(|it| it["code"] == "holds_until").collect();
        let message = told[0]["message"].as_str().expect("a text");
        assert!(message.contains(&at("07:00").to_string()), "{message}");
    }
}

fn names_of(nodes: &[&str]) -> Vec<String> {
    nodes.iter().map(|node| (*node).to_owned()).collect()
}

#[tokio::test]
async fn what_a_waiting_drone_was_offered_closes_before_it_takes_it_over() {
    let stage = shut_in().await;
    takes_over(&stage).await;
    stands(&stage).await;
    let mut events = stage.edge.events(None).expect("a stream");
    let lifted = stage
        .edge
        .lift_closure(&stage.caller, "works", Some("*".to_owned()), None);
    lifted.await.expect("lifted");
    while events.next().await.expect("more").expect("no gap").kind != EventKind::PlanOffered {}
    // Of the offer itself nothing is left to be looked at.
    stage.settle().await;
    stage.settle().await;
    stage.zone(circle("later", 1_500.0, 0.0, 50.0)).await;
    stage.settle().await;
    let plan = stage.plan("p");
    assert_eq!(plan.affected_by, ["later"]);
    let leads_on = |wanted: &wire::PlanVersion<'_>| wanted.path.nodes.len() > 1;
    assert!(!plan.wanted.as_ref().is_some_and(leads_on), "{plan:?}");
}

#[tokio::test]
async fn who_holds_keeps_its_pad_for_as_long_as_it_holds() {
    let stage = on(&street(&[1, 1, 1]));
    let asked = json!({"id": "p", "drone_id": "d", "source": "s1", "destination": "s2"});
    stage.deliver(asked).await.expect("a plan");
    close(&stage, "s1-s2").await;
    let held = takes_over(&stage).await;
    assert_eq!(held.reported.outcome, "hold");
    let probe = || json!({"drone_id": "probe", "source": "s0", "destination": "s0", "stops": [{"node": "s1", "service_s": 60.0}]});
    stage.deliver(probe()).await.expect_err("its pad is taken");
    for _ in 0..62 {
        stands_at(&stage, 1_000.0).await;
        stage.pass(SignedDuration::from_secs(30)).await;
    }
    stage.deliver(probe()).await.expect_err("it still is");
}

/// By its plan it has left, by what it says it stands on its pad yet: it is not sent up into a zone.
#[tokio::test]
async fn a_late_drone_that_stands_on_its_pad_is_told_to_hold_there() {
    let stage = waiting().await;
    stage.pass(SignedDuration::from_secs(20)).await;
    let stands = json!({"drone_id": "d", "location": {"x": 0.0, "y": 0.0}, "airborne": false});
    let batch = wire::Telemetry {
        positions: vec![stands],
    };
    let taken = stage.edge.telemetry(&stage.caller, batch).await;
    taken.expect("telemetry");
    stage.zone(circle("over", 0.0, 0.0, 50.0)).await;
    stage.settle().await;
    let hold = ("hold".to_owned(), names_of(&["s0"]));
    assert_eq!(told(stage.plan("p").wanted.as_ref()), hold);
    let report = json!({"type": "service_level", "service": {"plan_id": "p", "leg": 0}, "drone": {"id": "d"}, "dry_run": true});
    let answer = stage.answer(report).await;
    assert_eq!(answer["outcome"], "hold", "{answer}");
    assert_eq!(
        answer["flags"].as_array().map_or(0, Vec::len),
        0,
        "{answer}"
    );
}

/// What a drone that waits at `s0` for its start at eight o'clock is answered, or one that flies from there now.
async fn answered(starts: &str, report: Value) -> (Stage, Value) {
    let stage = on(&block());
    let asked = json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s2", "start_time": at(starts).to_string()});
    stage.deliver(asked).await.expect("a plan");
    if starts == "06:00" {
        stage.pass(SignedDuration::from_secs(40)).await;
    }
    let mut body = json!({"service": {"plan_id": "p", "leg": 0}, "drone": {"id": "d"}});
    let members = body.as_object_mut().expect("an object");
    members.extend(report.as_object().expect("an object").clone());
    let answer = stage.answer(body).await;
    (stage, answer)
}

#[tokio::test]
async fn one_that_waits_and_reports_its_leg_starts_no_sooner() {
    let (stage, answer) = answered("08:00", json!({"type": "navigational"})).await;
    assert_eq!(answer["outcome"], "rerouted", "{answer}");
    let plan = stage.plan("p");
    let wanted = plan.wanted.as_ref().expect("another way");
    assert_eq!(names(&wanted.path.nodes), ["s0", "north", "s2"]);
    assert_eq!(wanted.departs_at, plan.reported.departs_at);
    stage
        .check_version(&plan, wanted, &[])
        .expect("it can be flown");
}

#[tokio::test]
async fn one_that_waits_is_led_around_the_zone_that_it_brings() {
    let zone = circle("own", 500.0, 0.0, 20.0);
    let (_, answer) = answered(
        "08:00",
        json!({"type": "service_level", "zone": zone, "dry_run": true}),
    )
    .await;
    assert_eq!(
        answer["path"]["nodes"],
        json!(["s0", "north", "s2"]),
        "{answer}"
    );
}

#[tokio::test]
async fn one_that_has_to_leave_a_zone_does_not_simply_fly_on() {
    // The shorter way out leads on along its plan.
    let zone = circle("own", 520.0, 0.0, 60.0);
    let report = json!({"type": "service_level", "zone": zone, "airborne": true, "location": {"x": 570.0, "y": 0.0},
        "dry_run": true});
    let (_, answer) = answered("06:00", report).await;
    assert!(
        answer["flags"].to_string().contains("leaving_zone"),
        "{answer}"
    );
    assert_eq!(answer["outcome"], "rerouted", "{answer}");
}
