//! Drones in the air that other plans leave no way, or no pad.

use crate::enforcing::{of_kind, told};
use crate::flying::{on, street};
use crate::stage::{Stage, circle, names, node, segment};
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::AlarmFilter;
use skyway::network::{Coordinates, NetworkDraft};
use skyway::wire::{self, AlarmKind, EventKind, Flag};

/// A square of 1 km, a little shorter by b, and a rooftop west of it: e, and then a, b, c, d around it. Only e and c
/// have pads.
fn square() -> NetworkDraft {
    let mut nodes = vec![
        node("e", -1_000.0, 0.0),
        node("a", 0.0, 0.0),
        node("b", 950.0, 0.0),
        node("c", 1_000.0, 1_000.0),
        node("d", 0.0, 1_000.0),
    ];
    for node in &mut nodes {
        node.pads = if ["e", "c"].contains(&&*node.id) {
            3
        } else {
            0
        };
    }
    let joined = [("e", "a"), ("a", "b"), ("b", "c"), ("c", "d"), ("d", "a")];
    NetworkDraft {
        nodes,
        segments: joined.map(|(from, to)| segment(from, to)).into(),
        coordinates: Coordinates::Planar,
        name: "square".to_owned(),
        ..NetworkDraft::default()
    }
}

fn alarms(stage: &Stage) -> Vec<(AlarmKind, Option<String>)> {
    let filter = AlarmFilter::default();
    let listed = stage
        .edge
        .alarms(&stage.caller, &Default::default(), filter);
    let all = listed.expect("alarms").alarms.into_iter();
    let open = all.filter(|alarm| alarm.ended_at.is_none());
    open.map(|alarm| (alarm.kind, alarm.plan_id.map(|plan| plan.into_owned())))
        .collect()
}

/// A flies from e to c by b and is between a and b; B flies from c to e by d and is between d and a.
async fn two_in_the_air() -> Stage {
    let stage = on(&square());
    let start = |after_s: i64| {
        let at = stage.edge.clock().now() + SignedDuration::from_secs(after_s);
        at.to_string()
    };
    let one = json!({"id": "A", "drone_id": "dA", "source": "e", "destination": "c"});
    let one = stage.deliver(one).await.expect("a plan");
    assert_eq!(names(&one.reported.path.nodes), ["e", "a", "b", "c"]);
    let other = json!({"id": "B", "drone_id": "dB", "source": "c", "destination": "e", "start_time": start(20),
        "objective": "time"});
    let other = stage.deliver(other).await.expect("a plan");
    assert_eq!(names(&other.reported.path.nodes), ["c", "d", "a", "e"]);
    stage.pass(SignedDuration::from_secs(100)).await;
    stage.see("dA", 530.0, 0.0).await;
    stage
}

async fn acknowledge(stage: &Stage, id: &str, version: u32) {
    let ack = wire::Ack {
        version,
        ..wire::Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, id, ack).await;
    taken.expect("taken over");
    stage.settle().await;
}

#[tokio::test]
async fn a_drone_that_only_others_leave_no_way_is_told_one_and_an_operator_is_alarmed() {
    let stage = two_in_the_air().await;
    stage.zone(circle("ahead", 900.0, 0.0, 20.0)).await;
    let wanted = stage.plan("A").wanted.expect("a way");
    assert_eq!(wanted.flags, [Flag::Unseparated], "{wanted:?}");
    let alarm = (AlarmKind::Unseparated, Some("A".to_owned()));
    assert_eq!(alarms(&stage), std::slice::from_ref(&alarm));

    // That a better one is sent does not end the alarm: its drone flies the one that it has taken over.
    acknowledge(&stage, "A", wanted.version).await;
    let release = wire::Release {
        ended_as: wire::EndedAs::Cancelled,
    };
    let cancelled = stage.edge.release_plan(&stage.caller, "B", release).await;
    cancelled.expect("cancelled");
    stage.pass(SignedDuration::from_secs(10)).await;
    stage.zone(circle("on it", 0.0, 700.0, 20.0)).await;
    let next = stage.plan("A").wanted.expect("another way");
    assert!(next.flags.is_empty(), "{next:?}");
    assert_eq!(alarms(&stage), [alarm]);
    acknowledge(&stage, "A", next.version).await;
    assert_eq!(alarms(&stage), []);
}

#[tokio::test]
async fn a_drone_without_a_way_is_told_one_once_a_pad_is_free() {
    let stage = on(&street(&[1, 1, 1]));
    let first = json!({"id": "first", "drone_id": "d1", "source": "s2", "destination": "s1"});
    stage.deliver(first).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(2)).await;
    let landed = stage
        .edge
        .complete_plan(&stage.caller, "first", wire::Completion::default());
    landed.await.expect("ended");
    let next = json!({"id": "next", "drone_id": "d2", "source": "s0", "destination": "s2"});
    stage.deliver(next).await.expect("a plan");
    stage.pass(SignedDuration::from_secs(30)).await;
    stage.see("d2", 400.0, 0.0).await;
    for (id, x) in [("behind", 0.0), ("ahead", 2_000.0)] {
        stage.zone(circle(id, x, 0.0, 50.0)).await;
    }
    let without = stage.plan("next");
    assert!(without.wanted.is_none(), "{without:?}");
    // The drone on s1 is moved away; nothing has opened.
    let gone = json!({"drone_id": "d1", "location": {"x": 1_000.0, "y": 500.0}, "airborne": true});
    let told = stage.edge.telemetry(
        &stage.caller,
        wire::Telemetry {
            positions: vec![gone],
        },
    );
    assert!(told.await.expect("telemetry").positions[0].accepted);
    stage.pass(SignedDuration::from_secs(16)).await;
    let wanted = stage.plan("next").wanted.expect("a way");
    assert_eq!(names(&wanted.path.nodes), ["s1"]);
}

#[tokio::test]
async fn a_zone_to_come_on_the_way_that_a_drone_was_told_is_told_by_name() {
    let stage = on(&square());
    let in_minutes = |minutes: i64| {
        let at = stage.edge.clock().now() + SignedDuration::from_mins(minutes);
        at.to_string()
    };
    let plan = json!({"id": "p", "drone_id": "d", "source": "e", "destination": "c", "start_time": in_minutes(60)});
    stage.deliver(plan).await.expect("a plan");
    stage.zone(circle("now", 500.0, 0.0, 20.0)).await;
    let wanted = stage.plan("p").wanted.expect("a way");
    assert_eq!(names(&wanted.path.nodes), ["e", "a", "d", "c"]);
    let mut later = circle("later", 500.0, 1_000.0, 20.0);
    later["properties"]["windows"] = json!([{"from": in_minutes(50), "until": in_minutes(80)}]);
    let ack = stage.zone(later).await;
    assert!(!ack.effect.in_force);
    let plan = stage.plan("p");
    let named: Vec<&str> = plan.affected_by.iter().map(|id| &**id).collect();
    assert_eq!(named, ["now", "later"]);
    let told = told(&stage.edge).await;
    let replanned = of_kind(&told, EventKind::Replanned);
    let of_later = replanned
        .iter()
        .find(|event| event["closure_id"] == "later");
    let outcomes = &of_later.expect("told")["outcomes"];
    assert!(outcomes.get("unaffected").is_none(), "{outcomes}");
}
