//! Drones that fall silent, where the writer comes late to what telemetry shows.

use crate::stage::{Stage, WAIT_AT_MOST};
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::{Settings, WriterStep};
use skyway::wire::PlanState;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};

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
