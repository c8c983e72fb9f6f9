//! Versions of plans: what their drones say of them is true, and nothing that was sent is freed by a deadline.

use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, WAIT_AT_MOST, circle, names, node, segment};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Caller, Code, Role, Settings, WriterStep};
use skyway::formats::parse_report;
use skyway::wire::{self, PlanFlag, PlanState};
use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::task::{Context, Waker};

impl Stage {
    async fn acknowledges(&self, id: &str, body: Value) -> wire::Plan<'static> {
        let ack = serde_json::from_value(body).expect("an acknowledgement");
        let taken = self.edge.acknowledge_plan(&self.caller, id, ack).await;
        taken.expect("it is true")
    }

    async fn declines(&self, id: &str, body: Value) -> wire::Plan<'static> {
        let decline = serde_json::from_value(body).expect("a declined version");
        let answer = self.edge.decline_plan(&self.caller, id, decline).await;
        answer.expect("it is answered")
    }
}

fn numbers(plan: &wire::Plan<'_>) -> Vec<u32> {
    plan.versions.iter().map(|sent| sent.version).collect()
}

/// A plan along the lower row, with version 2 around a first zone and version 3 around a second one on that way.
async fn overtaken(stage: &Stage) {
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 50.0, 0.0).await;
    stage.zone(circle("first", 350.0, 0.0, 10.0)).await;
    let second = stage.plan("p").wanted.expect("a version");
    assert_eq!(second.version, 2);
    overtake(stage, &second).await;
}

/// A zone on the way of a second version.
async fn overtake(stage: &Stage, second: &wire::PlanVersion<'_>) {
    let crossing = if names(&second.path.nodes).contains(&"b3".to_owned()) {
        350.0
    } else {
        450.0
    };
    stage.zone(circle("second", crossing, 100.0, 10.0)).await;
}

#[tokio::test]
async fn an_acknowledgement_of_an_overtaken_version_is_true() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a3").await;
    stage.see("d1", 50.0, 0.0).await;
    stage.zone(circle("first", 150.0, 0.0, 10.0)).await;
    stage.zone(circle("second", 150.0, 100.0, 10.0)).await;
    let plan = stage.plan("p");
    assert_eq!(numbers(&plan), [1, 2, 3]);
    assert_eq!(plan.reported.version, 1);
    let taken = stage.acknowledges("p", json!({"version": 2})).await;
    assert_eq!(taken.reported.version, 2, "it is what the drone flies");
}

#[tokio::test]
async fn what_follows_an_overtaken_version_begins_where_the_drone_is() {
    let stage = Stage::set();
    overtaken(&stage).await;
    let plan = stage.plan("p");
    let wanted = plan.wanted.as_ref().map(|wanted| wanted.version);
    assert_eq!((numbers(&plan), wanted), (vec![1, 2, 3], Some(3)));
    let taken = stage
        .acknowledges(
            "p",
            json!({"version": 2, "location": {"x": 95.0, "y": 0.0}}),
        )
        .await;
    assert_eq!(taken.reported.version, 2);
    let wanted = taken.wanted.expect("version 2 meets the second zone");
    assert!(wanted.version > 3);
    assert_eq!(names(&wanted.path.nodes), ["a0"], "both rows are cut");
    assert_eq!(wanted.length_m, 95.0, "from where it said it is");
    let again = stage.acknowledges("p", json!({"version": 2})).await;
    assert_eq!(
        again.wanted.map(|it| it.version),
        Some(wanted.version),
        "said again"
    );
    let late = stage.acknowledges("p", json!({"version": 1})).await;
    assert_eq!(late.reported.version, 2, "a drone takes only a higher one");
    for number in [0, 99] {
        let never = wire::Ack {
            version: number,
            ..wire::Ack::default()
        };
        let never = stage.edge.acknowledge_plan(&stage.caller, "p", never).await;
        assert_eq!(never.expect_err("never sent").code, Code::PlanStateConflict);
    }
}

#[tokio::test]
async fn a_missed_acknowledgement_frees_nothing() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.zone(circle("fire", 350.0, 0.0, 10.0)).await;
    let wanted = stage.plan("p").wanted.expect("a version");
    // After the time for its acknowledgement, and on the way of the version that was not acknowledged.
    let around = wanted
        .legs
        .iter()
        .find(|leg| leg.from.text().starts_with('b') && leg.to.text().starts_with('b'));
    let around = around.expect("a leg of the upper row");
    let request = json!({"id": "other", "drone_id": "d2", "source": around.to, "destination": around.from,
        "start_time": around.departs_at, "airspeed_mps": 10.0});
    let request = serde_json::from_value(request).expect("a request");
    stage.pass(SignedDuration::from_secs(61)).await;
    let plan = stage.plan("p");
    assert_eq!(plan.flags, [PlanFlag::Affected, PlanFlag::Unacknowledged]);
    assert_eq!(numbers(&plan), [1, 2]);
    let other = stage
        .edge
        .compose_plan(&stage.caller, request, Default::default());
    let other = other.await.expect("a plan");
    assert!(
        other.conflicts.iter().any(|met| met.plan_id == "p"),
        "{other:?}"
    );
    let taken = stage.acknowledges("p", json!({"version": 2})).await;
    assert_eq!((taken.reported.version, taken.flags.len()), (2, 0));
}

#[tokio::test]
async fn what_was_withdrawn_may_still_be_flown() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    let ack = stage.zone(circle("fire", 350.0, 0.0, 10.0)).await;
    let wanted = stage.plan("p").wanted.expect("a version");
    let way = wanted.path.clone();
    let write = skyway::edge::ZoneWrite {
        id: Some("fire".to_owned()),
        if_match: ack.etag.map(String::from),
        ..Default::default()
    };
    stage
        .edge
        .delete_zone(&stage.caller, write, None)
        .await
        .expect("lifted");
    let plan = stage.plan("p");
    assert_eq!((plan.wanted, plan.flags.len()), (None, 0));
    assert_eq!(
        plan.versions.len(),
        2,
        "its drone may have taken it over meanwhile"
    );
    // Someone who comes the other way on the withdrawn way meets it.
    let nodes = names(&way.nodes);
    let up = nodes
        .iter()
        .position(|node| node.starts_with('b'))
        .expect("around");
    let request = json!({"id": "other", "drone_id": "d2", "source": nodes[up + 1], "destination": nodes[up],
        "start_time": wanted.legs[up].departs_at, "airspeed_mps": 10.0});
    let request = serde_json::from_value(request).expect("a request");
    let other = stage
        .edge
        .compose_plan(&stage.caller, request, Default::default());
    let other = other.await.expect("a plan");
    assert!(
        other.conflicts.iter().any(|met| met.plan_id == "p"),
        "{other:?}"
    );
    let taken = stage.acknowledges("p", json!({"version": 2})).await;
    assert_eq!((taken.reported.path, taken.versions.len()), (way, 1));
}

#[tokio::test]
async fn a_declined_version_is_answered_twice_and_then_by_an_operator() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 250.0, 0.0).await;
    stage.zone(circle("fire", 450.0, 0.0, 10.0)).await;
    let mut wanted = stage.plan("p").wanted.expect("a version");
    for _ in 0..2 {
        let body = json!({"version": wanted.version, "reason": "obstacle"});
        let plan = stage.declines("p", body.clone()).await;
        assert_eq!(plan.reported.version, 1, "it flies on as it did");
        let next = plan.wanted.expect("another one");
        assert!(next.version > wanted.version);
        assert_ne!(next.path.segments.first(), wanted.path.segments.first());
        let again = stage.declines("p", body).await;
        assert_eq!(
            again.wanted.map(|it| it.version),
            Some(next.version),
            "said again"
        );
        wanted = next;
    }
    let plan = stage
        .declines("p", json!({"version": wanted.version}))
        .await;
    assert_eq!((plan.wanted, plan.flags), (None, vec![PlanFlag::Affected]));
    assert_ne!(plan.state, PlanState::Ended);
}

/// A drone declines a version, and reports a failure before it is answered: what the answer tells it, it may fly.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_version_of_an_answer_may_be_flown_where_a_newer_one_comes_before_it() {
    let is_held = Arc::new(AtomicBool::new(false));
    let (arrivals, arrived) = mpsc::channel();
    let (gate, closed) = mpsc::channel::<()>();
    let closed = Mutex::new(closed);
    let held = is_held.clone();
    let settings = Settings {
        closed_fraction_max: 0.2,
        ..Settings::default()
    };
    let stage = Stage::watched(settings, false, move |_, step| {
        if step == WriterStep::Enforced && held.swap(false, Ordering::Relaxed) {
            arrivals.send(()).expect("the test waits");
            let _opened = closed.lock().expect("a channel").recv();
        }
    });
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 250.0, 0.0).await;
    stage.zone(circle("fire", 450.0, 0.0, 10.0)).await;
    stage.settle().await;
    is_held.store(true, Ordering::Relaxed);
    let edge = stage.edge.clone();
    let holding = tokio::spawn(async move { edge.tick().await });
    let held = arrived.recv_timeout(WAIT_AT_MOST);
    held.expect("the writer is held");
    let mut declining = pin!(stage.declines("p", json!({"version": 2, "reason": "obstacle"})));
    let handed_in = declining
        .as_mut()
        .poll(&mut Context::from_waker(Waker::noop()));
    assert!(handed_in.is_pending(), "the writer is held");
    let report = json!({"type": "operational", "detail": "battery", "service": {"plan_id": "p", "leg": 2},
        "location": {"x": 250.0, "y": 0.0}, "drone": {"id": "d1"}});
    let report = parse_report(report.to_string().as_bytes()).expect("a report");
    let answer = stage.edge.report_failure(&stage.caller, report).await;
    let answer = serde_json::to_value(answer.expect("an answer").to_wire()).expect("JSON");
    assert_eq!(answer["plan"]["version"], 3);
    drop(gate);
    holding.await.expect("no panic").expect("carried out");
    let declined = declining.await;
    assert_eq!(declined.wanted.expect("another one").version, 4);
    stage.settle().await;
    assert_eq!(numbers(&stage.plan("p")), [1, 2, 3, 4]);
    let taken = stage.acknowledges("p", json!({"version": 3})).await;
    assert_eq!(taken.reported.version, 3);
}

#[tokio::test]
async fn a_drone_that_has_not_the_battery_is_told_where_to_land() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a6").await;
    stage.see("d1", 250.0, 0.0).await;
    stage.zone(circle("fire", 450.0, 0.0, 10.0)).await;
    let plan = stage
        .declines("p", json!({"version": 2, "reason": "battery"}))
        .await;
    let wanted = plan.wanted.expect("somewhere to land");
    assert_eq!(wanted.outcome, "diverted");
    assert_eq!(
        names(&wanted.path.nodes).last().map(String::as_str),
        Some("a0")
    );
}

#[tokio::test]
async fn versions_that_were_sent_survive_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    overtaken(&stage).await;
    let before = stage.plan("p");
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    let after = stage.plan("p");
    assert_eq!(after.versions, before.versions);
    assert_eq!(
        (after.reported, after.wanted),
        (before.reported, before.wanted)
    );
    let taken = stage.acknowledges("p", json!({"version": 2})).await;
    assert_eq!(taken.reported.version, 2);
    assert!(taken.wanted.expect("another one").version > 3);
}

#[tokio::test]
async fn versions_that_were_sent_are_the_same_ways_on_another_network() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 50.0, 0.0).await;
    stage.zone(circle("first", 350.0, 0.0, 10.0)).await;
    let second = stage.plan("p").wanted.expect("a version");
    overtake(&stage, &second).await;
    assert_eq!(numbers(&stage.plan("p")), [1, 2, 3]);
    // All nodes and segments have other numbers now.
    stage
        .rebuild(|draft| {
            draft.nodes.insert(0, node("west", -100.0, 0.0));
            draft.segments.insert(0, segment("west", "a0"));
        })
        .await;
    assert_eq!(numbers(&stage.plan("p")), [1, 2, 3]);
    let taken = stage.acknowledges("p", json!({"version": 2})).await;
    assert_eq!(names(&taken.reported.path.nodes), names(&second.path.nodes));
}

#[tokio::test]
async fn a_drone_whose_position_is_refused_has_orders_all_the_same() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 50.0, 0.0).await;
    stage.zone(circle("fire", 350.0, 0.0, 10.0)).await;
    let refused = [
        json!({"drone_id": "d1", "location": {"x": 40.0, "y": 0.0}, "timestamp": "2026-11-21T05:59:00Z"}),
        json!({"drone_id": "d1", "location": {"node": "nowhere"}}),
    ];
    let positions = refused.to_vec();
    let told = stage
        .edge
        .telemetry(&stage.caller, wire::Telemetry { positions });
    for told in told.await.expect("telemetry").positions {
        assert!(!told.accepted && told.affected, "{told:?}");
        assert_eq!(told.wanted.map(|wanted| wanted.version), Some(2));
    }
}

#[tokio::test]
async fn a_fleet_names_its_drones_with_a_colon() {
    let stage = Stage::set();
    let fleet = Caller::local(Role::Drone, "acme");
    assert!(fleet.speaks_for("acme:1") && fleet.speaks_for("acme/1"));
    assert!(!fleet.speaks_for("acme1") && !fleet.speaks_for("other:1"));
    let request = |drone: &str| {
        let request = json!({"source": "a0", "destination": "a3", "drone_id": drone});
        serde_json::from_value(request).expect("a request")
    };
    let plan = stage
        .edge
        .compose_plan(&fleet, request("acme:1"), Default::default());
    assert_eq!(
        plan.await.expect("a plan").drone_id.as_deref(),
        Some("acme:1")
    );
    let slashed = stage
        .edge
        .compose_plan(&fleet, request("acme/2"), Default::default());
    let refused = slashed.await.expect_err("a slash");
    assert!(format!("{refused:?}").contains("acme:2"), "{refused:?}");
}

#[tokio::test]
async fn a_zone_on_what_was_withdrawn_is_told_the_drone_that_may_fly_it() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 50.0, 0.0).await;
    let ack = stage.zone(circle("fire", 350.0, 0.0, 10.0)).await;
    let second = stage.plan("p").wanted.expect("a version");
    let write = skyway::edge::ZoneWrite {
        id: Some("fire".to_owned()),
        if_match: ack.etag.map(String::from),
        ..Default::default()
    };
    let lifted = stage.edge.delete_zone(&stage.caller, write, None).await;
    lifted.expect("lifted");
    assert_eq!(stage.plan("p").wanted, None);
    overtake(&stage, &second).await;
    let plan = stage.plan("p");
    assert_eq!(plan.flags, [PlanFlag::Affected]);
    let third = plan.wanted.expect("what it is to fly, in so many words");
    // From where it is, the way that it has reported.
    let on = &names(&plan.reported.path.nodes)[1..];
    assert_eq!(names(&third.path.nodes), on);
    let taken = stage
        .acknowledges("p", json!({"version": third.version}))
        .await;
    assert!(taken.flags.is_empty());
}
