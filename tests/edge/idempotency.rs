//! The same thing sent twice.

use crate::stage::{Stage, circle};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Code, Idempotency, PageRequest, ZoneWrite};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

fn report() -> Value {
    json!({"id": "r1", "type": "navigational", "service": {"from": "a1", "to": "a2"}, "destination": "a4"})
}

#[tokio::test]
async fn a_repeated_report_gets_the_same_answer_while_its_path_is_open() {
    let stage = Stage::set();
    let first = stage.answer(report()).await;
    stage.pass(SignedDuration::from_secs(5)).await;
    let mut second = stage.answer(report()).await;
    assert_eq!(second["replayed"], true);
    second["replayed"] = json!(false);
    assert_eq!(first, second);

    stage
        .zone(circle("over-the-detour", 150.0, 100.0, 10.0))
        .await;
    let third = stage.answer(report()).await;
    assert_eq!(third["replayed"], false, "its path is closed: {third}");
    assert_ne!(third["path"], first["path"]);
    assert_eq!(third["publication"]["reason"], "sent_before");
}

#[tokio::test]
async fn an_answer_is_repeated_no_longer_than_it_is_valid() {
    let stage = Stage::set();
    let first = stage.answer(report()).await;
    stage.pass(SignedDuration::from_mins(1)).await;
    let second = stage.answer(report()).await;
    assert_eq!(second["replayed"], true, "{second}");
    stage.pass(SignedDuration::from_secs(1)).await;
    let third = stage.answer(report()).await;
    assert_eq!(third["replayed"], false, "{third}");
    assert_ne!(third["valid_until"], first["valid_until"]);
    assert_eq!(third["publication"]["reason"], "sent_before");
}

#[tokio::test]
async fn an_answer_without_a_path_is_repeated_at_the_same_revision_only() {
    let stage = Stage::set();
    // It closes nothing itself.
    let body = json!({"id": "r1", "type": "service_level", "service": {"from": "a1", "to": "a2"}, "destination": "a4"});
    for id in ["z1", "z2"] {
        // Both rows left of a1, and both right of it.
        let x = if id == "z1" { 50.0 } else { 150.0 };
        let feature = json!({
            "type": "Feature", "id": id, "properties": {"margin_m": 0},
            "geometry": {"type": "Polygon", "coordinates": [[[x - 5.0, -20.0], [x + 5.0, -20.0], [x + 5.0, 120.0], [x - 5.0, 120.0], [x - 5.0, -20.0]]]},
        });
        stage.zone(feature).await;
    }
    let first = stage.answer(body.clone()).await;
    assert_eq!(first["outcome"], "no_route", "{first}");
    assert_eq!(stage.answer(body.clone()).await["replayed"], true);
    stage.zone(circle("elsewhere", 650.0, 0.0, 5.0)).await;
    assert_eq!(stage.answer(body).await["replayed"], false);
}

#[tokio::test]
async fn another_report_under_the_same_id_is_answered_and_changes_nothing() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    let body = |leg: u32| json!({"id": "r1", "type": "navigational", "drone": {"id": "d1"}, "service": {"plan_id": "p1", "leg": leg}});
    let first = stage.answer(body(0)).await;
    assert_eq!(first["publication"]["state"], "published");
    let other = stage.answer(body(1)).await;
    assert_eq!(other["publication"]["reason"], "id_reused");
    assert!(
        other["warnings"].to_string().contains("id_reused"),
        "{other}"
    );
    assert!(stage.edge.closure(&stage.caller, "report:a1-a2").is_err());
    assert_eq!(stage.plan("p1").wanted.expect("the first one's").version, 2);
}

#[tokio::test]
async fn a_report_that_was_tried_before_counts_under_the_same_id() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    let mut body = json!({"id": "r1", "type": "navigational", "drone": {"id": "d1"}, "service": {"plan_id": "p1", "leg": 0},
        "dry_run": true});
    let tried = stage.answer(body.clone()).await;
    assert_eq!(tried["publication"]["reason"], "dry_run");
    body["dry_run"] = json!(false);
    let sent = stage.answer(body.clone()).await;
    assert_eq!(sent["publication"]["state"], "published");
    assert_eq!(stage.answer(body).await["replayed"], true);
}

#[tokio::test]
async fn an_operators_write_with_a_key_is_done_once() {
    let stage = Stage::set();
    let mut unnamed = circle("", 250.0, 0.0, 10.0);
    unnamed.as_object_mut().expect("an object").remove("id");
    let put = |key| {
        stage
            .edge
            .create_zone(&stage.caller, unnamed.clone(), ZoneWrite::default(), key)
    };
    let first = put(keyed(1)).await.expect("a zone");
    let second = put(keyed(1)).await.expect("the same answer");
    assert_eq!(first, second);
    let zones = stage
        .edge
        .zones(&stage.caller, &Default::default())
        .expect("a list");
    assert_eq!(zones.features.len(), 1);
    let other = put(keyed(2)).await;
    assert_eq!(
        other.expect_err("another body").code,
        Code::IdempotencyMismatch
    );
}

#[tokio::test]
async fn many_sendings_at_once_have_one_effect() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    let body = json!({"id": "r1", "type": "navigational", "drone": {"id": "d1"}, "service": {"plan_id": "p1", "leg": 0}});
    let mut sendings = tokio::task::JoinSet::new();
    for _ in 0..32 {
        let (edge, caller, body) = (stage.edge.clone(), stage.caller.clone(), body.to_string());
        sendings.spawn(async move {
            let parsed = skyway::formats::parse_report(body.as_bytes()).expect("a report");
            let answered = edge
                .report_failure(&caller, parsed)
                .await
                .expect("an outcome");
            let mut answer = serde_json::to_value(answered.to_wire()).expect("JSON");
            answer["replayed"].take()
        });
    }
    let replayed: Vec<Value> = sendings.join_all().await;
    let fresh = replayed
        .iter()
        .filter(|replayed| **replayed == json!(false))
        .count();
    assert_eq!(fresh, 1, "{replayed:?}");
    stage.settle().await;
    assert_eq!(stage.plan("p1").wanted.expect("a version").version, 2);
}

#[tokio::test]
async fn an_answer_is_not_repeated_once_the_leg_that_its_drone_is_on_has_closed() {
    let stage = Stage::set();
    let body = json!({"id": "r1", "type": "service_level", "service": {"from": "a1", "to": "a2"}, "destination": "a4",
        "location": {"x": 150.0, "y": 0.0}, "drone": {"id": "d1"}});
    let first = stage.answer(body.clone()).await;
    assert_eq!(first["path"]["nodes"][0], "a2", "it flies on: {first}");
    assert_eq!(stage.answer(body.clone()).await["replayed"], true);
    let draft = json!({"id": "works", "segments": ["a1-a2"], "reason": "works"});
    let draft = serde_json::from_value(draft).expect("a draft");
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    closed.await.expect("a closure");
    let second = stage.answer(body).await;
    assert_eq!(second["replayed"], false, "{second}");
    assert_eq!(second["path"]["nodes"][0], "a1", "it turns back: {second}");
}

/// Closes a segment under a key, and asks once whether that is done.
fn polled_once(stage: &Stage) -> Poll<()> {
    let mut closing = pin!(stage.edge.close(&stage.caller, works(), keyed(1)));
    let mut context = Context::from_waker(Waker::noop());
    closing.as_mut().poll(&mut context).map(drop)
}

fn works() -> skyway::wire::ClosureDraft {
    let draft = json!({"segments": ["a1-a2"], "reason": "works"});
    serde_json::from_value(draft).expect("a draft")
}

fn keyed(fingerprint: u8) -> Idempotency {
    Idempotency {
        key: Some("k1".to_owned()),
        fingerprint: [fingerprint; 32],
    }
}

#[tokio::test]
async fn a_write_whose_client_went_away_is_done_once_all_the_same() {
    let stage = Stage::set();
    assert_eq!(polled_once(&stage), Poll::Pending, "its client goes away");
    let closed = loop {
        match stage.edge.close(&stage.caller, works(), keyed(1)).await {
            Err(refusal) if refusal.code == Code::IdempotencyInProgress => {
                tokio::task::yield_now().await;
            }
            closed => break closed.expect("a closure"),
        }
    };
    let page = PageRequest::default();
    let closures = stage.edge.closures(&stage.caller, &page).expect("a list");
    let ids: Vec<_> = closures.closures.iter().map(|it| &it.id).collect();
    assert_eq!(ids, [&closed.id]);
}
