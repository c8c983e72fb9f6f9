//! Plans in flight: closed ahead, recomposed, taken over, open again, over.

use crate::stage::{DAWN, Stage, circle, names};
use jiff::{SignedDuration, Timestamp};
use serde_json::json;
use skyway::edge::{Code, ZoneWrite};
use skyway::wire::{Ack, EndedAs, PlanFlag};

fn ack(version: u32) -> Ack {
    Ack {
        version,
        ..Ack::default()
    }
}

#[tokio::test]
async fn a_zone_marks_the_plans_it_meets_with_their_new_ways_and_its_deletion_frees_them() {
    let stage = Stage::set();
    stage.compose("met", "d1", "a0", "a4").await;
    stage.compose("free", "d2", "b5", "b7").await;
    let zone = circle("fire", 250.0, 0.0, 10.0);
    let preview = stage
        .edge
        .preview_zone(&stage.caller, zone.clone())
        .await
        .expect("a preview");
    assert_eq!(preview.effect.segments, ["a2-a3"]);
    assert_eq!(preview.effect.plans[0].plan_id, "met");
    assert!(!preview.enforced);
    assert!(
        stage.plan("met").flags.is_empty(),
        "a preview changes nothing"
    );

    let ack = stage.zone(zone).await;
    assert!(ack.enforced && !ack.durable);
    assert_eq!(ack.effect.plan_count, 1);
    assert_eq!(ack.effect.plans, {
        let mut told = preview.effect.plans.clone();
        told[0].version = Some(2);
        told
    });
    let plan = stage.plan("met");
    assert_eq!(plan.flags, [PlanFlag::Affected]);
    assert_eq!(plan.affected_by, ["fire"]);
    let proposed = plan.wanted.expect("a version is ready");
    assert!(
        !proposed.path.segments.contains(&"a2-a3".into()),
        "{proposed:?}"
    );
    assert_eq!(proposed.legs.len(), proposed.path.segments.len());
    let told = stage.see("d1", 10.0, 0.0).await.positions.remove(0);
    assert!(told.affected);
    assert_eq!(told.wanted.expect("told").version, 2);
    assert!(stage.plan("free").flags.is_empty());

    let write = ZoneWrite {
        id: Some("fire".to_owned()),
        if_match: ack.etag.map(String::from),
        ..ZoneWrite::default()
    };
    stage
        .edge
        .delete_zone(&stage.caller, write, None)
        .await
        .expect("deleted");
    let plan = stage.plan("met");
    assert_eq!((plan.flags.len(), plan.wanted), (0, None));
}

#[tokio::test]
async fn a_drone_takes_over_what_it_was_told_and_nothing_else() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    let answer = stage.answer(json!({"type": "navigational", "service": {"plan_id": "p1", "leg": 1}, "location": {"node": "a1"}})).await;
    assert_eq!(answer["plan"], json!({"id": "p1", "version": 2}));
    assert_eq!(
        answer["legs"].as_array().map(Vec::len),
        Some(
            answer["path"]["segments"]
                .as_array()
                .expect("segments")
                .len()
        )
    );

    let wrong = stage
        .edge
        .acknowledge_plan(&stage.caller, "p1", ack(3))
        .await;
    assert_eq!(
        wrong.expect_err("there is no version 3").code,
        Code::PlanStateConflict
    );
    let plan = stage
        .edge
        .acknowledge_plan(&stage.caller, "p1", ack(2))
        .await
        .expect("taken over");
    assert_eq!((plan.flags.len(), plan.reported.version), (0, 2));
    assert_eq!(plan.reported.length_m, 500.0);
    assert_eq!(names(&plan.reported.path.nodes)[..2], ["a1", "b1"]);
    let again = stage
        .edge
        .acknowledge_plan(&stage.caller, "p1", ack(2))
        .await
        .expect("the same again");
    assert_eq!(again.reported, plan.reported);
}

#[tokio::test]
async fn what_lies_behind_a_drone_affects_it_no_more() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a7").await;
    stage.see("d1", 450.0, 0.0).await;
    stage.zone(circle("behind", 150.0, 0.0, 10.0)).await;
    assert!(stage.plan("p1").flags.is_empty());
    stage.zone(circle("ahead", 650.0, 0.0, 10.0)).await;
    let plan = stage.plan("p1");
    assert_eq!(plan.affected_by, ["ahead"]);
    let proposed = plan.wanted.expect("a way");
    assert_eq!(
        names(&proposed.path.nodes)[0],
        "a5",
        "the open leg ahead is flown: {proposed:?}"
    );
}

#[tokio::test]
async fn opposite_plans_on_one_segment_conflict_until_one_is_cancelled() {
    let stage = Stage::set();
    stage.compose("east", "d1", "a0", "a3").await;
    let west = stage.compose("west", "d2", "a3", "a0").await;
    let conflict = &west.conflicts[0];
    assert_eq!(
        (&*conflict.plan_id, &*conflict.segment, &*conflict.direction),
        ("east", "a1-a2", "opposite")
    );
    stage
        .edge
        .cancel_plan(&stage.caller, "east", Default::default())
        .await
        .expect("cancelled");
    assert!(stage.plan("west").conflicts.is_empty());
    assert_eq!(stage.plan("east").ended_as, Some(EndedAs::Cancelled));
}

#[tokio::test]
async fn a_drone_flies_one_plan_at_a_time() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    let request =
        serde_json::from_value(json!({"drone_id": "d1", "source": "a0", "destination": "a1"}))
            .expect("a request");
    let second = stage
        .edge
        .compose_plan(&stage.caller, request, Default::default())
        .await;
    assert_eq!(
        second.expect_err("one at a time").code,
        Code::PlanStateConflict
    );
}

/// It reports about the plan that it flies, though it still names the one before.
#[tokio::test]
async fn a_report_that_names_a_plan_of_before_is_about_the_one_that_its_drone_flies() {
    let stage = Stage::set();
    stage.compose("old", "d1", "a0", "a7").await;
    let cancelled = stage
        .edge
        .cancel_plan(&stage.caller, "old", Default::default());
    cancelled.await.expect("cancelled");
    stage.compose("new", "d1", "a0", "b7").await;
    let report = json!({"type": "navigational", "drone": {"id": "d1"}, "service": {"plan_id": "old", "leg": 5}});
    let answer = stage.answer(report).await;
    let warnings = answer["warnings"].to_string();
    assert!(warnings.contains("unknown_plan"), "{answer}");
    assert_eq!(answer["plan"]["id"], "new", "{answer}");
    // The sixth leg is one of the old plan.
    let stretch = &answer["first_stretch"];
    assert_eq!(
        (&stretch["from"], &stretch["to"]),
        (&json!("a0"), &json!("a1")),
        "{answer}"
    );
}

#[tokio::test]
async fn the_remaining_time_of_a_drone_that_stands_counts_its_wait() {
    let stage = Stage::set();
    let now: Timestamp = DAWN.parse().expect("an instant");
    let start = now + SignedDuration::from_mins(5);
    let request = json!({"id": "p", "drone_id": "d", "source": "a0", "destination": "a4", "start_time": start.to_string(),
        "airspeed_mps": 10.0});
    let request = serde_json::from_value(request).expect("a request");
    let composed = stage
        .edge
        .compose_plan(&stage.caller, request, Default::default());
    composed.await.expect("a plan");
    let report = json!({"type": "navigational", "drone": {"id": "d"}, "service": {"plan_id": "p", "leg": 0}});
    let answer = stage.answer(report).await;
    let legs = answer["legs"].as_array().expect("legs");
    let last = legs.last().expect("a way")["arrives_at"].as_str();
    let arrives: Timestamp = last.expect("an instant").parse().expect("an instant");
    let ahead_s = arrives.duration_since(now).as_secs_f64();
    let told_s = answer["remaining_time_s"].as_f64().expect("seconds");
    assert!(
        ahead_s > 300.0 && (told_s - ahead_s).abs() < 0.01,
        "{answer}"
    );
}
