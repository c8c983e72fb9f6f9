//! The wall clock steps against time that only goes forward: nothing opens by it until an operator confirms.

use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle};
use crate::store_file::Medium;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::clock::Clock;
use skyway::wire::{EventKind, Freshness, PlanFlag};
use std::time::Duration;
use tokio_stream::StreamExt;

const HOUR: SignedDuration = SignedDuration::from_hours(1);

fn zone_until(id: &str, from: &str, until: &str) -> Value {
    let mut zone = circle(id, 150.0, 0.0, 10.0);
    zone["properties"]["windows"] = json!([{"from": from, "until": until}]);
    zone
}

fn in_force(stage: &Stage, id: &str) -> bool {
    stage
        .edge
        .closure(&stage.caller, id)
        .expect("it stands")
        .in_force
}

#[tokio::test]
async fn a_step_forward_opens_nothing_and_closes_what_it_says() {
    let (stage, hands) = Stage::on_machine_clock();
    stage
        .zone(zone_until(
            "now",
            "2026-11-21T05:00:00Z",
            "2026-11-21T06:30:00Z",
        ))
        .await;
    stage
        .zone(zone_until(
            "later",
            "2026-11-21T12:00:00Z",
            "2026-11-21T13:00:00Z",
        ))
        .await;
    assert!(in_force(&stage, "now") && !in_force(&stage, "later"));
    let mut events = stage.edge.events(None).expect("a stream");
    // To half past twelve.
    hands.step(SignedDuration::from_mins(390));
    stage.settle().await;
    assert!(in_force(&stage, "now"), "its end has not come");
    assert!(in_force(&stage, "later"), "it may well be noon");
    assert_eq!(stage.edge.stamp().freshness, Freshness::Degraded);
    let status = stage.edge.status();
    assert_eq!(
        (status.clock_steps, status.clock_apart_s),
        (1, Some(23_400.0))
    );
    let stepped = events.next().await.expect("more").expect("no gap");
    assert_eq!(stepped.kind, EventKind::ClockStepped);
    assert_eq!(stepped.event.data["apart_s"], 23_400.0);

    let confirmed = stage
        .edge
        .confirm_clock(&stage.caller)
        .await
        .expect("confirmed");
    assert_eq!(
        (&*confirmed.now, confirmed.confirmed_step_s),
        ("2026-11-21T12:30:00Z", Some(23_400.0))
    );
    assert!(!in_force(&stage, "now") && in_force(&stage, "later"));
    assert_eq!(stage.edge.stamp().freshness, Freshness::Fresh);
    assert_eq!(stage.edge.status().clock_apart_s, None);
    let again = stage
        .edge
        .confirm_clock(&stage.caller)
        .await
        .expect("nothing to do");
    assert_eq!(again.confirmed_step_s, None);
}

#[tokio::test]
async fn a_step_back_opens_nothing_that_is_closed() {
    let (stage, hands) = Stage::on_machine_clock();
    stage
        .zone(zone_until(
            "now",
            "2026-11-21T06:00:00Z",
            "2026-11-21T09:00:00Z",
        ))
        .await;
    assert!(in_force(&stage, "now"), "it is six o'clock");
    hands.step(-HOUR * 10);
    stage.settle().await;
    assert!(in_force(&stage, "now"), "by the time as it went on");
    // Time goes on: it ends by that, yet by the wall clock it is about to begin.
    hands.advance(Duration::from_secs(9 * 3_600));
    stage.settle().await;
    assert!(
        !in_force(&stage, "now"),
        "over by one, not begun by the other"
    );
    hands.advance(Duration::from_secs(3_600));
    stage.settle().await;
    assert!(in_force(&stage, "now"), "begun by the other");
    stage
        .edge
        .confirm_clock(&stage.caller)
        .await
        .expect("confirmed");
    assert!(in_force(&stage, "now"), "it is six o'clock again");
}

#[tokio::test]
async fn lives_and_plans_end_when_both_clocks_say_so() {
    for by in [HOUR, -HOUR] {
        let (stage, hands) = Stage::on_machine_clock();
        let draft = json!({"id": "works", "segments": ["a1-a2"], "until": "2026-11-21T06:10:00Z"});
        let draft = serde_json::from_value(draft).expect("a draft");
        stage
            .edge
            .close(&stage.caller, draft, Default::default())
            .await
            .expect("closed");
        stage.compose("p", "d1", "b0", "b3").await;
        hands.step(by);
        stage.settle().await;
        assert!(in_force(&stage, "works"), "{by}");
        assert!(stage.plan("p").flags.is_empty(), "{by}");
        hands.advance(Duration::from_secs(11 * 60));
        stage.settle().await;
        let is_over = by > SignedDuration::ZERO;
        assert_eq!(
            stage.edge.closure(&stage.caller, "works").is_err(),
            is_over,
            "{by}"
        );
        assert_eq!(
            stage.plan("p").flags == [PlanFlag::Overdue],
            is_over,
            "{by}"
        );
        hands.advance(Duration::from_secs(3_600));
        stage.settle().await;
        assert!(stage.edge.closure(&stage.caller, "works").is_err(), "{by}");
    }
}

#[tokio::test]
async fn a_clock_that_comes_back_needs_nobody() {
    let (stage, hands) = Stage::on_machine_clock();
    let mut events = stage.edge.events(None).expect("a stream");
    hands.step(HOUR);
    stage.settle().await;
    hands.step(-HOUR + SignedDuration::from_secs(1));
    stage.settle().await;
    let kinds = [EventKind::ClockStepped, EventKind::ClockSettled];
    for kind in kinds {
        assert_eq!(
            events.next().await.expect("more").expect("no gap").kind,
            kind
        );
    }
    assert_eq!(stage.edge.stamp().freshness, Freshness::Fresh);
}

#[tokio::test]
async fn reports_are_answered_and_published_while_the_clock_is_doubted() {
    let (stage, hands) = Stage::on_machine_clock();
    hands.step(-HOUR * 3);
    stage.see("d1", 150.0, 0.0).await;
    let report = json!({"type": "navigational", "service": {"from": "a1", "to": "a2"}, "location": {"x": 150.0, "y": 0.0},
        "destination": "a4", "drone": {"id": "d1"}});
    let answer = stage.answer(report).await;
    assert_eq!(
        (&answer["outcome"], &answer["freshness"]),
        (&json!("rerouted"), &json!("degraded"))
    );
    assert_eq!(answer["publication"]["state"], "published");
    assert!(in_force(&stage, "report:a1-a2"));
    // Its life passes by the time that goes on, and only then by the other.
    hands.advance(Duration::from_secs(16 * 60));
    stage.settle().await;
    assert!(stage.edge.closure(&stage.caller, "report:a1-a2").is_ok());
}

#[tokio::test]
async fn small_steps_are_followed() {
    let (stage, hands) = Stage::on_machine_clock();
    hands.step(SignedDuration::from_secs(4));
    stage.settle().await;
    assert_eq!(stage.edge.clock().now().to_string(), "2026-11-21T06:00:04Z");
    assert_eq!(stage.edge.stamp().freshness, Freshness::Fresh);
}

#[tokio::test]
async fn positions_by_a_clock_that_was_ahead_are_forgotten_once_it_is_set_right() {
    let (stage, hands) = Stage::on_machine_clock();
    hands.step(HOUR);
    stage.settle().await;
    stage
        .edge
        .confirm_clock(&stage.caller)
        .await
        .expect("confirmed");
    stage.see("d1", 100.0, 0.0).await;
    hands.step(-HOUR);
    stage.settle().await;
    stage
        .edge
        .confirm_clock(&stage.caller)
        .await
        .expect("confirmed");
    let told = stage.see("d1", 110.0, 0.0).await;
    assert!(told.positions[0].accepted, "{told:?}");
}

#[tokio::test]
async fn a_restart_by_a_clock_that_is_wrong_opens_nothing() {
    // Without a clock of its own that runs on, the machine begins three hours before it ended.
    let back = (SignedDuration::ZERO, -HOUR * 3);
    // It had stepped ahead, behind the end of the zone, and no operator has confirmed that.
    let ahead = (HOUR * 3, HOUR * 3);
    for (before, after) in [back, ahead] {
        let medium = Medium::Memory(MemoryDisk::default());
        let start: Timestamp = "2026-11-21T06:00:00Z".parse().expect("an instant");
        let (clock, hands) = Clock::by_two_hands(start);
        let stage = Stage::by_clock(medium.open().await, clock).await;
        let until = "2026-11-21T08:00:00Z";
        stage
            .zone(zone_until("now", "2026-11-21T05:00:00Z", until))
            .await;
        hands.step(before);
        hands.advance(Duration::from_secs(60));
        stage.settle().await;
        assert!(in_force(&stage, "now"));
        stage.edge.end().await;

        let (clock, _hands) = Clock::by_two_hands(start + SignedDuration::from_mins(2) + after);
        let stage = Stage::by_clock(medium.open().await, clock).await;
        assert!(in_force(&stage, "now"), "{before} {after}");
        stage.zone(circle("other", 350.0, 0.0, 10.0)).await;
        stage.settle().await;
        assert!(in_force(&stage, "now"), "{before} {after}");
        assert_eq!(stage.edge.stamp().freshness, Freshness::Degraded);
        stage
            .edge
            .confirm_clock(&stage.caller)
            .await
            .expect("confirmed");
        assert!(!in_force(&stage, "now"), "{before} {after}");
    }
}
