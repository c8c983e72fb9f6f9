//! A drone on the first stretch of a version is on a leg of its plan like any other.

use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, names};
use serde_json::{Value, json};
use skyway::wire::{self, PlanFlag, StretchKind};

/// Version 2 leads a drone that met an obstacle ahead of 350, 0 back to a3 and around by the upper row.
async fn turned_back(stage: &Stage) -> wire::Plan<'static> {
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 350.0, 0.0).await;
    let report = json!({"type": "navigational", "service": {"plan_id": "p", "leg": 3}, "location": {"x": 350.0, "y": 0.0},
        "drone": {"id": "d1"}});
    stage.answer(report).await;
    let ack = json!({"version": 2, "location": {"x": 350.0, "y": 0.0}});
    let ack = serde_json::from_value(ack).expect("an acknowledgement");
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    taken.expect("taken over")
}

fn stretch(version: &wire::PlanVersion<'_>) -> Value {
    let stretch = version.first_stretch.as_ref().expect("a first stretch");
    json!([stretch.from, stretch.to, stretch.enters, stretch.length_m])
}

#[tokio::test]
async fn a_version_tells_the_leg_that_it_begins_on() {
    let stage = Stage::set();
    let plan = turned_back(&stage).await;
    assert_eq!(names(&plan.reported.path.nodes)[..2], ["a3", "b3"]);
    assert_eq!(stretch(&plan.reported), json!(["a3", "a4", "a3", 50.0]));
    let kind = plan.reported.first_stretch.map(|stretch| stretch.kind);
    assert_eq!(kind, Some(StretchKind::Leg));
    assert!(
        stage
            .compose("other", "d2", "a0", "a1")
            .await
            .reported
            .first_stretch
            .is_none()
    );
}

/// However its place is written, a drone that was there three seconds ago has flown on since.
#[tokio::test]
async fn an_old_place_ages_whether_it_is_a_node_or_coordinates() {
    let stage = Stage::set();
    let asked = |location: Value| {
        stage.answer(json!({"type": "navigational", "service": {"from": "a3", "to": "a4"}, "destination": "a7",
            "location": location, "location_age_s": 3.0, "airborne": true, "drone": {"airspeed_mps": 10.0}, "dry_run": true}))
    };
    let by_node = asked(json!({"node": "a3"})).await;
    let by_coordinates = asked(json!({"x": 300.0, "y": 0.0})).await;
    for field in ["outcome", "first_stretch_m", "remaining_length_m"] {
        assert_eq!(by_node[field], by_coordinates[field], "{field}");
    }
    assert_eq!(by_node["first_stretch_m"], 30.0);
}

#[tokio::test]
async fn a_zone_on_the_first_stretch_alone_affects_the_plan() {
    let stage = Stage::set();
    turned_back(&stage).await;
    stage.see("d1", 345.0, 0.0).await;
    stage.zone(circle("behind", 360.0, 0.0, 5.0)).await;
    assert!(
        stage.plan("p").flags.is_empty(),
        "it has turned its back on that"
    );
    stage.zone(circle("between", 320.0, 0.0, 5.0)).await;
    let plan = stage.plan("p");
    assert_eq!(plan.flags, [PlanFlag::Affected]);
    assert_eq!(plan.affected_by, ["between"]);
    assert_eq!(plan.wanted, None, "the obstacle ahead, the zone behind");
}

#[tokio::test]
async fn the_next_answer_begins_on_the_leg_that_the_drone_is_on() {
    let stage = Stage::set();
    turned_back(&stage).await;
    stage.see("d1", 340.0, 0.0).await;
    stage.zone(circle("above", 300.0, 50.0, 5.0)).await;
    let wanted = stage.plan("p").wanted.expect("another way round");
    assert_eq!(stretch(&wanted), json!(["a3", "a4", "a3", 40.0]));
    assert_eq!(names(&wanted.path.nodes)[..2], ["a3", "a2"]);
}

#[tokio::test]
async fn progress_does_not_jump_back_to_legs_that_are_flown() {
    let stage = Stage::set();
    turned_back(&stage).await;
    for (x, y) in [
        (345.0, 0.0),
        (310.0, 0.0),
        (300.0, 40.0),
        (300.0, 95.0),
        (350.0, 100.0),
    ] {
        stage.see("d1", x, y).await;
    }
    stage.zone(circle("flown", 300.0, 50.0, 5.0)).await;
    stage.zone(circle("first", 330.0, 0.0, 5.0)).await;
    assert!(stage.plan("p").flags.is_empty(), "all of that is behind it");
}

#[tokio::test]
async fn a_drone_that_flies_a_segment_twice_is_on_the_second_flight_when_it_turns() {
    let stage = Stage::set();
    turned_back(&stage).await;
    // The upper row closes both ways but for the way back by the leg between the rows.
    for (x, y) in [(300.0, 30.0), (300.0, 90.0)] {
        stage.see("d1", x, y).await;
    }
    stage.zone(circle("above", 350.0, 100.0, 5.0)).await;
    let wanted = stage.plan("p").wanted.expect("a way on");
    assert_ne!(names(&wanted.path.nodes)[..2], ["b3", "b4"]);
}

#[tokio::test]
async fn a_first_stretch_is_in_the_way_of_others() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 310.0, 0.0).await;
    // The node ahead leads nowhere any more, but for the way that the drone comes.
    stage.zone(circle("along", 450.0, 0.0, 10.0)).await;
    stage.zone(circle("up", 400.0, 50.0, 10.0)).await;
    let wanted = stage.plan("p").wanted.expect("a way back");
    assert_eq!(stretch(&wanted), json!(["a3", "a4", "a3", 10.0]));
    let other = stage.compose("other", "d2", "a3", "a4").await;
    let meets = |met: &wire::Conflict<'_>| met.segment == "a3-a4" && met.direction == "opposite";
    assert!(other.conflicts.iter().any(meets), "{:?}", other.conflicts);
}

#[tokio::test]
async fn a_first_stretch_survives_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    let before = turned_back(&stage).await;
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    assert_eq!(stage.plan("p").reported, before.reported);
    stage.see("d1", 345.0, 0.0).await;
    stage.zone(circle("between", 320.0, 0.0, 5.0)).await;
    assert_eq!(stage.plan("p").flags, [PlanFlag::Affected]);
}

#[tokio::test]
async fn a_zone_on_a_first_stretch_beside_the_network_affects_the_plan() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    let place = json!({"x": 350.0, "y": -160.0});
    stage.see("d1", 350.0, -160.0).await;
    let report = json!({"type": "navigational", "service": {"plan_id": "p", "leg": 3}, "location": place,
        "drone": {"id": "d1"}});
    stage.answer(report).await;
    let ack = serde_json::from_value(json!({"version": 2, "location": place}));
    let ack = ack.expect("an acknowledgement");
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    let first = taken.expect("taken over").reported.first_stretch;
    let first = first.expect("a first stretch");
    assert_eq!(first.kind, StretchKind::Straight);
    let enters = first.enters.text().to_owned();
    let (row, number) = enters.split_at(1);
    let x = 100.0 * number.parse::<f64>().expect("a number");
    let y = if row == "a" { 0.0 } else { 100.0 };
    let between = circle("gap", (350.0 + x) / 2.0, (y - 160.0) / 2.0, 5.0);
    stage.zone(between).await;
    stage.settle().await;
    let plan = stage.plan("p");
    assert_eq!(
        (plan.flags, plan.affected_by),
        (vec![PlanFlag::Affected], vec!["gap".into()])
    );
}
