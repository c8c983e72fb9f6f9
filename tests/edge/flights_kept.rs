//! Answers in flight over restarts: found again, computed again, and not given again once their times are over.

use crate::flying::settings;
use crate::stage::{Stage, circle};
use crate::store_file::Medium;
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::formats::{IntoTerm, read_flight_question, recorded_question};
use skyway::wire;

fn report(id: &str) -> Value {
    json!({
        "id": id, "type": "environmental", "service": {"from": "a1", "to": "a2"},
        "destination": "a3", "location": {"x": 150, "y": 0},
        "drone": {"id": "drone-1", "battery_fraction": 0.6, "payload_kg": 0.2},
    })
}

/// What is kept of an answer, and whether its plan can be certified.
async fn kept(stage: &Stage, id: &str) -> (wire::Record<'static>, bool) {
    stage.settle().await;
    let found = stage.edge.recomposition(&stage.caller, id, true).await;
    let found = found.expect("it is kept");
    let mut record = json!(found.to_wire());
    let certificate = record["certificate"].take();
    let record = serde_json::from_value(record).expect("a record");
    (record, certificate["plan"]["legs"].is_array())
}

#[tokio::test]
async fn an_answer_is_computed_again_from_the_file() {
    for medium in Medium::both() {
        let stage = Stage::over_with(medium.open().await, settings()).await;
        stage.zone(circle("here", 250.0, 100.0, 10.0)).await;
        let answer = stage.answer(report("r1")).await;
        assert_eq!(answer["energy"], "assumed", "{answer}");
        let id = answer["id"].as_str().expect("an id").to_owned();
        let (before, is_certified) = kept(&stage, &id).await;
        assert!(is_certified);
        stage.edge.end().await;
        let stage = stage.again_with(medium.open().await, settings()).await;
        let (after, is_certified) = kept(&stage, &id).await;
        assert!(is_certified);
        assert_eq!(after.world, before.world);
        let topology = stage.edge.topology();
        let (airspace, read) = recorded_question(&after, &topology).expect("a question");
        let question = after.world.flight.as_ref().expect("what it was flown in");
        let question = read_flight_question(question, &airspace).expect("it can be read");
        let again = question.answer(&read.request);
        let outcome: wire::Outcome = again.outcome.into_term();
        assert_eq!(outcome, after.answer.answer.outcome);
        let length_m = again.composition.map(|plan| plan.plan.distance_m);
        assert_eq!(length_m, after.answer.answer.remaining_length_m);
    }
}

#[tokio::test]
async fn an_answer_is_given_again_only_while_its_times_can_be_kept() {
    for medium in Medium::both() {
        let stage = Stage::over_with(medium.open().await, settings()).await;
        assert_eq!(stage.answer(report("r1")).await["replayed"], false);
        assert_eq!(stage.answer(report("r1")).await["replayed"], true);
        stage.pass(SignedDuration::from_secs(61)).await;
        let late = stage.answer(report("r1")).await;
        assert_eq!(late["replayed"], false, "its pads would be taken too late");
        assert_eq!(stage.answer(report("r1")).await["replayed"], true);
        stage.edge.end().await;
        // It is no longer known which plans it was given among.
        let stage = stage.again_with(medium.open().await, settings()).await;
        assert_eq!(stage.answer(report("r1")).await["replayed"], false);
    }
}
