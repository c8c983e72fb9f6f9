//! Drones that fall silent: where the writer comes late to what telemetry shows, after answers, over a lifted zone and a
//! restart.

use crate::stage::{Stage, WAIT_AT_MOST, circle};
use crate::store_file::Medium;
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::{AlarmFilter, PageRequest, Settings, WriterStep, ZoneWrite};
use skyway::wire::{Ack, AlarmKind, PlanFlag, PlanState};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

async fn is_seen_in_flight(stage: &Stage) {
    let position = json!({"drone_id": "d", "location": {"x": 50.0, "y": 0.0}, "airborne": true});
    let batch = serde_json::from_value(json!({"positions": [position]})).expect("telemetry");
    let told = stage.edge.telemetry(&stage.caller, batch).await;
    assert!(told.expect("telemetry").positions[0].accepted);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn silence_counts_from_the_last_sign_and_not_from_when_the_writer_learns_of_it() {
    let is_held = Arc::new(AtomicBool::new(false));
    let (arrivals, arrived) = mpsc::channel();
    let (gate, closed) = mpsc::channel::<()>();
    let closed = Mutex::new(closed);
    let held = is_held.clone();
    let stage = Stage::watched(Settings::default(), false, move |_, step| {
        if step == WriterStep::Enforced && held.load(Ordering::Relaxed) {
            // The test may have seen enough; then the gate is open.
            let _seen = arrivals.send(());
            let _opened = closed.lock().expect("a channel").recv();
        }
    });
    stage.compose("p", "d", "a0", "a7").await;

    is_held.store(true, Ordering::Relaxed);
    let edge = stage.edge.clone();
    let holding = tokio::spawn(async move { edge.tick().await });
    let arrived = arrived.recv_timeout(WAIT_AT_MOST);
    arrived.expect("the writer is held");
    // It departs and is seen; the writer learns of neither until three seconds later.
    stage.hand.advance(SignedDuration::from_secs(5));
    is_seen_in_flight(&stage).await;
    stage.hand.advance(SignedDuration::from_secs(3));
    is_held.store(false, Ordering::Relaxed);
    drop(gate);
    holding.await.expect("no panic").expect("carried out");
    stage.settle().await;
    assert_eq!(stage.plan("p").state, PlanState::Activated);

    stage.pass(SignedDuration::from_secs(11)).await;
    assert_eq!(stage.plan("p").state, PlanState::Activated);
    stage.pass(SignedDuration::from_secs(1)).await;
    assert_eq!(stage.plan("p").state, PlanState::Contingent);
}

/// A drone on its way along the ladder, which telemetry sees once a second for so long.
async fn seen_for(stage: &Stage, seconds: i64) {
    stage.compose("p", "d", "a0", "a7").await;
    for _ in 0..seconds {
        stage.pass(SignedDuration::from_secs(1)).await;
        is_seen_in_flight(stage).await;
    }
    stage.settle().await;
    assert_eq!(stage.plan("p").state, PlanState::Activated);
}

async fn acknowledge(stage: &Stage, ack: serde_json::Value) {
    let ack: Ack = serde_json::from_value(ack).expect("an ack");
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    taken.expect("taken over");
    stage.settle().await;
}

/// Whether an operator is to call the drone.
fn is_alarmed(stage: &Stage) -> bool {
    let (edge, page) = (&stage.edge, PageRequest::default());
    let alarms = edge.alarms(&stage.caller, &page, AlarmFilter::default());
    let mut alarms = alarms.expect("alarms").alarms.into_iter();
    alarms.any(|alarm| alarm.kind == AlarmKind::Contingent && alarm.ended_at.is_none())
}

/// Nothing comes for as long as makes it silent.
async fn falls_silent(stage: &Stage) {
    stage.pass(SignedDuration::from_secs(16)).await;
    let plan = stage.plan("p");
    assert_eq!(
        (plan.state, plan.flags.contains(&PlanFlag::Silent)),
        (PlanState::Contingent, true)
    );
    assert!(is_alarmed(stage));
}

#[tokio::test]
async fn one_that_last_told_where_it_is_with_an_answer_falls_silent() {
    let stage = Stage::set();
    seen_for(&stage, 3).await;
    acknowledge(
        &stage,
        json!({"version": 1, "location": {"x": 60.0, "y": 0.0}}),
    )
    .await;
    falls_silent(&stage).await;
}

#[tokio::test]
async fn one_that_answers_is_no_longer_silent_until_it_is_silent_once_more() {
    for is_asked in [false, true] {
        let stage = Stage::set();
        seen_for(&stage, 3).await;
        let mut version = 1;
        if is_asked {
            stage.zone(circle("z", 450.0, 0.0, 10.0)).await;
            stage.settle().await;
            version = stage.plan("p").wanted.expect("another way").version;
        }
        falls_silent(&stage).await;
        acknowledge(&stage, json!({"version": version})).await;
        let plan = stage.plan("p");
        assert_eq!((plan.state, plan.flags), (PlanState::Activated, Vec::new()));
        assert!(!is_alarmed(&stage));
        falls_silent(&stage).await;
    }
}

#[tokio::test]
async fn one_that_declines_is_no_longer_silent() {
    let stage = Stage::set();
    seen_for(&stage, 3).await;
    stage.zone(circle("z", 450.0, 0.0, 10.0)).await;
    falls_silent(&stage).await;
    let decline = json!({"version": 2, "reason": "operator"});
    let decline = serde_json::from_value(decline).expect("a decline");
    let declined = stage.edge.decline_plan(&stage.caller, "p", decline).await;
    declined.expect("declined");
    stage.settle().await;
    assert!(!stage.plan("p").flags.contains(&PlanFlag::Silent));
    assert!(!is_alarmed(&stage));
}

#[tokio::test]
async fn a_lifted_zone_does_not_make_a_silent_drone_heard() {
    let stage = Stage::set();
    seen_for(&stage, 3).await;
    stage.zone(circle("z", 450.0, 0.0, 10.0)).await;
    falls_silent(&stage).await;
    let lifted = ZoneWrite {
        id: Some("z".to_owned()),
        if_match: Some("*".to_owned()),
        ..ZoneWrite::default()
    };
    let lifted = stage.edge.delete_zone(&stage.caller, lifted, None).await;
    lifted.expect("lifted");
    stage.settle().await;
    let plan = stage.plan("p");
    assert_eq!(
        (plan.state, plan.flags),
        (PlanState::Contingent, vec![PlanFlag::Silent])
    );
    assert!(is_alarmed(&stage));
}

#[tokio::test]
async fn one_that_falls_silent_over_a_restart_is_silent() {
    for medium in Medium::both() {
        let stage = Stage::over(medium.open().await).await;
        seen_for(&stage, 17).await;
        let stage = stage.again(medium.open().await).await;
        assert_eq!(stage.plan("p").state, PlanState::Activated);
        falls_silent(&stage).await;
    }
}

#[tokio::test]
async fn one_that_falls_silent_while_the_wall_clock_is_behind_is_silent() {
    let (stage, hands) = Stage::on_machine_clock();
    stage.compose("p", "d", "a0", "a7").await;
    hands.advance(Duration::from_secs(1));
    is_seen_in_flight(&stage).await;
    hands.step(-SignedDuration::from_hours(1));
    hands.advance(Duration::from_secs(17));
    stage.settle().await;
    assert_eq!(stage.plan("p").state, PlanState::Contingent);
    assert!(is_alarmed(&stage));
}

#[tokio::test]
async fn one_that_falls_silent_after_the_clock_was_set_back_is_silent() {
    let (stage, hands) = Stage::on_machine_clock();
    stage.compose("p", "d", "a0", "a7").await;
    for _ in 0..20 {
        hands.advance(Duration::from_secs(1));
        is_seen_in_flight(&stage).await;
        stage.settle().await;
    }
    hands.step(-SignedDuration::from_hours(1));
    let confirmed = stage.edge.confirm_clock(&stage.caller).await;
    confirmed.expect("confirmed");
    is_seen_in_flight(&stage).await;
    hands.advance(Duration::from_secs(17));
    stage.settle().await;
    assert_eq!(stage.plan("p").state, PlanState::Contingent);
    assert!(is_alarmed(&stage));
}

#[tokio::test]
async fn one_that_answers_late_is_no_longer_silent() {
    let stage = Stage::set();
    seen_for(&stage, 3).await;
    stage.zone(circle("z", 450.0, 0.0, 10.0)).await;
    stage.settle().await;
    acknowledge(&stage, json!({"version": 2})).await;
    falls_silent(&stage).await;
    // It took this long to say what it flew before.
    acknowledge(&stage, json!({"version": 1})).await;
    assert!(!stage.plan("p").flags.contains(&PlanFlag::Silent));
    assert!(!is_alarmed(&stage));

    falls_silent(&stage).await;
    let decline = serde_json::from_value(json!({"version": 1})).expect("a decline");
    let declined = stage.edge.decline_plan(&stage.caller, "p", decline).await;
    declined.expect("declined");
    stage.settle().await;
    assert!(!stage.plan("p").flags.contains(&PlanFlag::Silent));
}

#[tokio::test]
async fn drones_that_are_made_up_silence_none_that_flies_a_plan() {
    let settings = Settings {
        drones_max: 10,
        ..Settings::default()
    };
    let stage = Stage::with(settings);
    seen_for(&stage, 3).await;
    for number in 0..100 {
        let position =
            json!({"drone_id": format!("made-up-{number}"), "location": {"x": 0.0, "y": 0.0}});
        let batch = serde_json::from_value(json!({"positions": [position]})).expect("telemetry");
        let told = stage.edge.telemetry(&stage.caller, batch).await;
        assert!(told.expect("telemetry").positions[0].accepted);
    }
    let known = stage.edge.drones(&stage.caller, &PageRequest::default());
    let known = known.expect("drones").drones;
    let has = |id: &str| known.iter().any(|drone| drone.id == id);
    assert!(has("d") && has("made-up-99") && known.len() == 10);
    stage.pass(SignedDuration::from_secs(14)).await;
    assert_eq!(stage.plan("p").state, PlanState::Activated, "it was heard");
}
