//! What one drone or one fleet may take of what all share: memory, segments and pads.

use crate::stage::{Stage, ladder, loaded};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Caller, Code, EventStream, Role, Settings};
use skyway::wire::EventKind;
use std::sync::Arc;
use tokio_stream::StreamExt;

const KIB: usize = 1 << 10;

/// A token for all drones of a fleet, which may call them what it likes.
fn fleet() -> Caller {
    of_subject("*")
}

fn of_subject(subject: &str) -> Caller {
    Caller::local(Role::Drone, subject)
}

/// A report that brings a zone which is no zone, and 100 KiB in it.
fn heavy(id: Option<String>) -> Value {
    let mut report = json!({
        "service": {"from": "a1", "to": "a2"}, "destination": "a5", "dry_run": true,
        "zone": {"type": "Feature", "geometry": null, "properties": {"reason": "x".repeat(100 * KIB)}},
    });
    if let Some(id) = id {
        report["id"] = json!(id);
    }
    report
}

#[tokio::test]
async fn what_a_report_brings_counts_in_what_is_kept_of_it() {
    let stage = Stage::with(Settings {
        records_bytes_max: 1 << 20,
        ..Settings::default()
    });
    for _ in 0..50 {
        stage.answer(heavy(None)).await;
    }
    let status = stage.edge.status();
    assert!((1..=10).contains(&status.records), "{}", status.records);
    assert!(status.record_bytes <= 1 << 20, "{}", status.record_bytes);
    // Many small things weigh as much as a large one.
    let unknown: serde_json::Map<String, Value> = (0..2_000)
        .map(|number| (format!("member-{number}"), json!([number, [], {}])))
        .collect();
    for _ in 0..50 {
        let mut report = heavy(None);
        report["zone"]["properties"] = Value::Object(unknown.clone());
        stage.answer(report).await;
    }
    let status = stage.edge.status();
    assert!((1..=10).contains(&status.records), "{}", status.records);
}

#[tokio::test]
async fn a_warning_never_repeats_all_that_was_sent() {
    let stage = Stage::set();
    let long = "y".repeat(50 * KIB);
    let answer = stage
        .answer(json!({
            "service": {"plan_id": long, "from": "a1", "to": "a2"}, "destination": "a5",
            "drone": {"id": "d1", "airframe": long}, "objective": long, "deadline": long, "timestamp": long,
            "strategy": long, "remaining_path": [long, "a2", "a5"], long.clone(): long,
        }))
        .await;
    assert!(
        answer["warnings"]
            .as_array()
            .is_some_and(|list| list.len() > 3)
    );
    let told = answer["warnings"].to_string();
    assert!(told.len() < 8 * KIB, "{} bytes: {:.2000}", told.len(), told);
}

fn leg(kind: &str, drone: &str, place: usize) -> Value {
    json!({
        "type": kind, "drone": {"id": drone},
        "service": {"from": format!("a{place}"), "to": format!("a{}", place + 1)}, "destination": "b7",
    })
}

/// Reports of several drones, each on a leg of its own; gives the reasons of those that were not published.
async fn told_by_many(stage: &Stage, kind: &str, count: usize) -> Vec<String> {
    let mut reasons = Vec::new();
    for place in 0..count {
        let drone = format!("invented-{place}");
        stage.see(&drone, 50.0 + 100.0 * place as f64, 0.0).await;
        let answer = stage.answer(leg(kind, &drone, place)).await;
        if answer["publication"]["state"] != "published" {
            reasons.extend(answer["publication"]["reason"].as_str().map(str::to_owned));
        }
        stage.settle().await;
    }
    reasons
}

#[tokio::test]
async fn all_reports_together_close_a_small_share_of_the_pads() {
    let mut draft = ladder();
    for node in &mut draft.nodes {
        node.pads = 1;
    }
    let network = loaded(&draft);
    let settings = Settings {
        closed_fraction_max: 0.2,
        ..Settings::default()
    };
    // 16 nodes with pads: a fifth is three.
    let stage = Stage::on(network.topology, network.geojson, settings);
    let reasons = told_by_many(&stage, "infrastructure", 7).await;
    assert_eq!(reasons, ["network_quota"; 4]);
    stage.pass(SignedDuration::from_mins(31)).await;
    let reasons = told_by_many(&stage, "infrastructure", 3).await;
    assert!(reasons.is_empty(), "{reasons:?}");
}

#[tokio::test]
async fn a_fleet_has_a_quota_of_its_own_whatever_it_calls_its_drones() {
    let settings = Settings {
        closed_fraction_max: 1.0,
        alive_per_subject: 4,
        ..Settings::default()
    };
    let mut stage = Stage::with(settings);
    stage.caller = fleet();
    let reasons = told_by_many(&stage, "navigational", 7).await;
    assert_eq!(reasons, ["subject_quota"; 3]);
    // What is closed already is renewed.
    stage.see("another", 50.0, 0.0).await;
    let again = stage.answer(leg("navigational", "another", 0)).await;
    assert_eq!(again["publication"]["state"], "published", "{again}");
    // Another fleet has its own.
    stage.caller.subject = Arc::from("d7");
    stage.see("d7", 650.0, 0.0).await;
    let answer = stage.answer(leg("navigational", "d7", 6)).await;
    assert_eq!(answer["publication"]["state"], "published", "{answer}");
    stage.pass(SignedDuration::from_mins(16)).await;
    stage.caller = fleet();
    let reasons = told_by_many(&stage, "navigational", 5).await;
    assert_eq!(reasons, ["subject_quota"; 1]);
}

/// The next event of a kind.
async fn next(events: &mut EventStream, kind: EventKind) -> Value {
    loop {
        let event = events.next().await.expect("more").expect("no gap");
        if event.kind == kind {
            return event.event.data.clone();
        }
    }
}

#[tokio::test]
async fn a_report_in_anothers_name_is_answered_and_is_not_shown_as_that_drones() {
    let mut stage = Stage::set();
    stage.see("d1", 150.0, 0.0).await;
    let mut events = stage.edge.events(None).expect("a stream");
    stage.caller = Caller::local(Role::Drone, "d2");
    let answer = stage.answer(leg("navigational", "d1", 1)).await;
    assert_eq!(answer["outcome"], "rerouted", "{answer}");
    let codes: Vec<&str> = answer["warnings"]
        .as_array()
        .expect("warnings")
        .iter()
        .filter_map(|warning| warning["code"].as_str())
        .collect();
    assert!(codes.contains(&"drone_not_yours"), "{answer}");
    assert_eq!(answer["publication"]["reason"], "anonymous", "{answer}");
    let told = next(&mut events, EventKind::Recomposed).await;
    assert_eq!(told["drone_id"], Value::Null, "{told}");
    assert_eq!(told["id"], answer["id"]);
}

#[tokio::test]
async fn a_member_that_is_there_twice_is_told() {
    let stage = Stage::set();
    stage.see("d1", 150.0, 0.0).await;
    let cases = [
        (r#""type": "service_level", "#, "", "/type"),
        ("", r#", "id": "d2""#, "/drone/id"),
        (
            r#""zone": {"type": "Feature", "properties": {"a": 1, "a": 2}}, "#,
            "",
            "/zone/properties/a",
        ),
        (r#""a/b~": 1, "a/b~": 2, "#, "", "/a~1b~0"),
    ];
    for (more, of_drone, pointer) in cases {
        let body = format!(
            r#"{{{more}"type": "navigational", "drone": {{"id": "d1"{of_drone}}}, "service": {{"from": "a1", "to": "a2"}}, "destination": "a5"}}"#
        );
        let parsed = skyway::formats::parse_report(body.as_bytes()).expect("a report");
        let answered = stage.edge.report_failure(&stage.caller, parsed).await;
        let answer = serde_json::to_value(answered.expect("an outcome").to_wire()).expect("JSON");
        let warnings = answer["warnings"].as_array().expect("warnings");
        let twice = warnings
            .iter()
            .find(|warning| warning["code"] == "member_twice")
            .unwrap_or_else(|| panic!("{pointer}: {answer}"));
        let message = twice["message"].as_str().expect("text");
        assert!(message.contains(pointer), "{message}");
        assert_eq!(
            answer["publication"]["state"], "proposed",
            "it is unclear which was meant: {answer}"
        );
    }
}

#[tokio::test]
async fn a_token_limits_the_priority_that_a_plan_may_have() {
    let settings = Settings {
        urgent: vec!["medical".to_owned()],
        ..crate::flying::settings()
    };
    let network = loaded(&crate::flying::street(&[3, 3]));
    let mut stage = Stage::on(network.topology, network.geojson, settings);
    let asked = |id: &str, priority: Option<u32>| {
        let drone = format!("{}:{id}", if id == "urgent" { "medical" } else { "fleet" });
        json!({"id": id, "drone_id": drone, "source": "s0", "destination": "s1", "priority": priority})
    };
    stage.caller = of_subject("fleet");
    let usual = stage.deliver(asked("usual", None)).await.expect("a plan");
    assert_eq!(usual.priority, 50);
    let refused = stage.deliver(asked("high", Some(51))).await;
    let refused = refused.expect_err("too high");
    assert_eq!(refused.code, Code::Forbidden, "{refused:?}");
    let refused = stage.deliver(asked("higher", Some(101))).await;
    assert_eq!(
        refused.expect_err("no priority").faults[0].pointer,
        "/priority"
    );
    stage.caller = of_subject("medical");
    let urgent = stage.deliver(asked("urgent", Some(100))).await;
    assert_eq!(urgent.expect("a plan").priority, 100);
}
