//! What a drone's report closes for everyone, and what it only proposes.

use crate::stage::Stage;
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Caller, Code, Decision, PageRequest, Role, Settings};
use skyway::wire::ClosureCause;

fn everything() -> PageRequest {
    PageRequest::default()
}

fn broken_leg(id: &str) -> Value {
    json!({"id": id, "type": "navigational", "drone": {"id": "d1"}, "service": {"plan_id": "p1", "leg": 0}})
}

#[tokio::test]
async fn a_drone_closes_the_leg_of_its_plan_for_everyone_and_it_opens_by_itself() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    let answer = stage.answer(broken_leg("r1")).await;
    assert_eq!(answer["publication"]["state"], "published", "{answer}");
    assert_eq!(answer["publication"]["closure_id"], "report:a0-a1");
    assert_eq!(
        answer["remaining_length_m"], 600.0,
        "back to a0 and around: {answer}"
    );
    let contingency = answer["legs"][0]["if_closed"]["outcome"].as_str();
    assert_eq!(
        contingency,
        Some("diverted"),
        "the failed leg stays closed for the drone: {answer}"
    );

    let closure = stage
        .edge
        .closure(&stage.caller, "report:a0-a1")
        .expect("it is closed");
    assert_eq!(closure.cause, ClosureCause::Report);
    assert_eq!(closure.reported_by.as_deref(), Some("d1"));
    let others = stage
        .answer(
            json!({"service": {"from": "b0", "to": "b1"}, "destination": "a1", "dry_run": true}),
        )
        .await;
    assert_eq!(
        others["outcome"], "diverted",
        "a0-a1 and b0-b1 closed: {others}"
    );

    stage.pass(SignedDuration::from_mins(15)).await;
    assert!(
        stage.edge.closure(&stage.caller, "report:a0-a1").is_ok(),
        "its end belongs to it"
    );
    stage.pass(SignedDuration::from_secs(1)).await;
    assert!(
        stage.edge.closure(&stage.caller, "report:a0-a1").is_err(),
        "its life is over"
    );
}

#[tokio::test]
async fn who_cannot_be_placed_there_publishes_nothing_but_is_answered() {
    let stage = Stage::set();
    let report = |more: Value| {
        let mut body = json!({"type": "environmental", "service": {"from": "a2", "to": "a3"}, "destination": "a5"});
        body.as_object_mut()
            .expect("an object")
            .extend(more.as_object().expect("an object").clone());
        body
    };
    let cases = [
        (json!({}), "proposed", "anonymous"),
        (
            json!({"drone": {"id": "d9"}}),
            "proposed",
            "not_placed_there",
        ),
        (
            json!({"drone": {"id": "d9"}, "type": "meteorite"}),
            "proposed",
            "doubtful",
        ),
        (
            json!({"drone": {"id": "d9"}, "type": "service_level"}),
            "none",
            "closes_nothing",
        ),
        (
            json!({"drone": {"id": "d9"}, "dry_run": true}),
            "none",
            "dry_run",
        ),
    ];
    for (more, state, reason) in cases {
        let answer = stage.answer(report(more.clone())).await;
        assert_eq!(answer["publication"]["state"], state, "{more}");
        assert_eq!(answer["publication"]["reason"], reason, "{more}");
        assert!(answer["outcome"].is_string(), "{more}");
    }
    let closures = stage
        .edge
        .closures(&stage.caller, &everything())
        .expect("a list");
    assert!(closures.closures.is_empty(), "{closures:?}");
    let proposals = stage
        .edge
        .proposals(&stage.caller, &everything())
        .expect("a list");
    assert_eq!(proposals.proposals.len(), 3);

    stage.see("d9", 250.0, 10.0).await;
    let answer = stage.answer(report(json!({"drone": {"id": "d9"}}))).await;
    assert_eq!(
        answer["publication"]["state"], "published",
        "its telemetry places it there: {answer}"
    );
}

#[tokio::test]
async fn a_drone_has_three_closures_alive_and_a_second_report_renews_one() {
    let settings = Settings {
        closed_fraction_max: 1.0,
        ..Settings::default()
    };
    let stage = Stage::with(settings);
    for place in 0..5 {
        stage.see("d1", 50.0 + 100.0 * f64::from(place), 0.0).await;
        let body = json!({
            "type": "navigational", "drone": {"id": "d1"},
            "service": {"from": format!("a{place}"), "to": format!("a{}", place + 1)}, "destination": "b7",
        });
        let answer = stage.answer(body).await;
        let expected = if place < 3 { "published" } else { "proposed" };
        assert_eq!(answer["publication"]["state"], expected, "leg {place}");
    }
    stage.pass(SignedDuration::from_mins(10)).await;
    stage.see("d1", 50.0, 0.0).await;
    let again = json!({"type": "navigational", "drone": {"id": "d1"}, "service": {"from": "a0", "to": "a1"}, "destination": "b7"});
    let answer = stage.answer(again).await;
    assert_eq!(
        answer["publication"]["state"], "published",
        "a renewal closes nothing more"
    );
    stage.pass(SignedDuration::from_mins(10)).await;
    let alive = stage
        .edge
        .closures(&stage.caller, &everything())
        .expect("a list")
        .closures;
    let ids: Vec<&str> = alive.iter().map(|closure| &*closure.id).collect();
    assert_eq!(ids, ["report:a0-a1"]);
}

#[tokio::test]
async fn all_reports_together_close_a_small_share_of_the_network() {
    let settings = Settings {
        closed_fraction_max: 0.1,
        ..Settings::default()
    };
    // 22 segments: a tenth is two.
    let stage = Stage::with(settings);
    for place in 0..4 {
        let drone = format!("d{place}");
        stage
            .see(&drone, 50.0 + 100.0 * f64::from(place), 0.0)
            .await;
        let body = json!({
            "type": "navigational", "drone": {"id": drone},
            "service": {"from": format!("a{place}"), "to": format!("a{}", place + 1)}, "destination": "b7",
        });
        let answer = stage.answer(body).await;
        let expected = if place < 2 { "published" } else { "proposed" };
        assert_eq!(answer["publication"]["state"], expected, "drone {place}");
    }
}

#[tokio::test]
async fn a_zone_that_a_report_brings_binds_it_alone_until_an_operator_accepts_it() {
    let stage = Stage::set();
    let body = json!({
        "type": "regulatory", "service": {"from": "a1", "to": "a2"}, "location": {"node": "a1"}, "destination": "a4",
        "zone": crate::stage::circle("stadium", 200.0, 50.0, 60.0),
    });
    let answer = stage.answer(body.clone()).await;
    assert_eq!(
        answer["outcome"], "diverted",
        "both rows are cut for this request: {answer}"
    );
    assert!(stage.edge.zone(&stage.caller, "stadium").is_err());
    let proposals = stage
        .edge
        .proposals(&stage.caller, &everything())
        .expect("a list")
        .proposals;
    let zone = proposals
        .iter()
        .find(|proposal| proposal.zone.is_some())
        .expect("the zone is proposed");

    let decided = stage
        .edge
        .decide_proposal(&stage.caller, &zone.id, Decision::Accept)
        .await;
    decided.expect("accepted");
    assert!(stage.edge.zone(&stage.caller, "stadium").is_ok());
    let again = stage
        .edge
        .decide_proposal(&stage.caller, &zone.id, Decision::Reject)
        .await;
    assert_eq!(again.expect_err("decided already").code, Code::NotFound);
}

#[tokio::test]
async fn what_an_operator_accepts_shortens_no_closure_that_stands() {
    let stage = Stage::set();
    let report = |from: &str, to: &str, drone: Value| json!({"type": "navigational", "service": {"from": from, "to": to}, "destination": "b7", "drone": drone});
    stage.answer(report("a0", "a1", json!({}))).await;
    stage.pass(SignedDuration::from_mins(10)).await;
    stage.see("d1", 50.0, 0.0).await;
    let renewed = report("a0", "a1", json!({"id": "d1"}));
    let answer = stage.answer(renewed).await;
    assert_eq!(answer["publication"]["state"], "published", "{answer}");
    let closed = || {
        let closure = stage.edge.closure(&stage.caller, "report:a0-a1");
        let closure = closure.expect("there");
        (
            closure.until.map(|until| until.into_owned()),
            closure.confirmed,
        )
    };
    let (until, is_confirmed) = closed();
    assert!(until.is_some() && !is_confirmed);
    let proposals = stage.edge.proposals(&stage.caller, &everything());
    let proposals = proposals.expect("a list").proposals;
    assert_eq!(proposals.len(), 1, "{proposals:?}");
    let accepted = stage
        .edge
        .decide_proposal(&stage.caller, &proposals[0].id, Decision::Accept);
    accepted.await.expect("accepted");
    assert_eq!(closed(), (until, true));
}

#[tokio::test]
async fn pads_that_fail_can_be_flown_over() {
    let stage = Stage::set();
    stage.see("d1", 650.0, 0.0).await;
    let body = json!({"type": "infrastructure", "drone": {"id": "d1"}, "service": {"from": "a6", "to": "a7"}, "destination": "a7"});
    let answer = stage.answer(body).await;
    assert_eq!(answer["publication"]["closure_id"], "pads:a7", "{answer}");
    let node = stage.edge.node("a7").expect("a node");
    assert!(node.pads_closed && !node.closed);
    let over = stage
        .answer(
            json!({"service": {"from": "b6", "to": "b7"}, "destination": "b7", "dry_run": true}),
        )
        .await;
    assert_eq!(
        over["outcome"], "rerouted",
        "the way over a7 is open: {over}"
    );
}

/// What its drone has not come to it cannot have seen: an operator decides.
#[tokio::test]
async fn pads_that_a_drone_does_not_come_to_are_only_proposed() {
    let stage = Stage::set();
    let report = |leg: [&str; 2], node: &str, more: Value| {
        let mut body = json!({"type": "infrastructure", "drone": {"id": "d1"}, "node": node,
            "service": {"from": leg[0], "to": leg[1]}, "destination": "a7"});
        let fields = body.as_object_mut().expect("an object");
        fields.extend(more.as_object().expect("an object").clone());
        body
    };
    stage.see("d1", 650.0, 0.0).await;
    let elsewhere = report(["a6", "a7"], "b0", json!({}));
    let answer = stage.answer(elsewhere).await;
    assert_eq!(answer["publication"]["state"], "proposed", "{answer}");
    assert_eq!(answer["publication"]["reason"], "not_placed_there");
    assert!(!stage.edge.node("b0").expect("a node").pads_closed);

    // What is ahead on its plan it may be told of otherwise.
    stage.compose("p2", "d2", "a0", "a7").await;
    let planned = json!({"drone": {"id": "d2"}, "service": {"plan_id": "p2", "leg": 2}});
    let answer = stage.answer(report(["a2", "a3"], "a7", planned)).await;
    assert_eq!(answer["publication"]["closure_id"], "pads:a7", "{answer}");
}

#[tokio::test]
async fn a_drone_learns_nothing_of_where_another_one_is() {
    let mut stage = Stage::set();
    stage.see("d1", 250.0, 10.0).await;
    let body = json!({"type": "navigational", "drone": {"id": "d1"}, "destination": "a5"});
    let own = stage.report(body.clone()).await;
    assert!(own.is_ok(), "its telemetry locates it: {own:?}");
    stage.caller = Caller::local(Role::Drone, "d2");
    let others = stage.report(body).await;
    assert_eq!(
        others.expect_err("nothing locates it").code,
        Code::ReportNotLocated
    );
}

/// A zone of a number of corners around a0.
fn ragged(corners: usize) -> Value {
    let corner = |number: usize| {
        let angle = std::f64::consts::TAU * (number % corners) as f64 / corners as f64;
        json!([10.0 * angle.cos(), 10.0 * angle.sin()])
    };
    let ring: Vec<Value> = (0..=corners).map(corner).collect();
    json!({"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]}, "properties": {}})
}

#[tokio::test]
async fn proposals_of_one_subject_crowd_out_no_others() {
    let mut stage = Stage::set();
    let drone = |name: &str| Caller::local(Role::Drone, name);
    let report = |drone: &str, number: usize, corners: usize| {
        json!({
            "id": format!("{drone}-{number}"), "type": "regulatory", "drone": {"id": drone},
            "service": {"from": "a0", "to": "a1"}, "destination": "a4", "zone": ragged(corners),
        })
    };
    stage.caller = drone("quiet");
    stage.answer(report("quiet", 0, 8)).await;
    let quiet = stage.edge.proposals(&Caller::anyone(), &everything());
    let quiet = quiet.expect("proposals").proposals.len();
    stage.caller = drone("loud");
    for number in 0..80 {
        stage.answer(report("loud", number, 2_000)).await;
    }
    let page = PageRequest {
        size: Some(1_000),
        token: None,
    };
    let kept = stage.edge.proposals(&Caller::anyone(), &page);
    let kept = kept.expect("proposals").proposals;
    let of = |name: &str| {
        let own = |drone: &Option<_>| drone.as_deref() == Some(name);
        kept.iter()
            .filter(|proposal| own(&proposal.drone_id))
            .count()
    };
    assert_eq!(of("quiet"), quiet, "what others propose stays");
    assert!(of("loud") > 0 && of("loud") < 80, "{} are kept", of("loud"));
    let text = serde_json::to_string(&kept).expect("JSON");
    assert!(text.len() < 8 * 1024 * 1024, "{} bytes", text.len());
}
