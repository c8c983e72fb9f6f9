//! Plans that have no way: what they are told, and that they get one once there is one.

use crate::enforcing::{of_kind, told};
use crate::stage::{Stage, circle};
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::{AlarmFilter, Idempotency, PageRequest};
use skyway::wire::EventKind;

/// Closes all nodes; gives the etag of what does.
async fn close_all(stage: &Stage) -> String {
    let topology = stage.edge.topology();
    let nodes: Vec<&str> = topology
        .nodes()
        .map(|node| topology.node_id(node))
        .collect();
    let draft = serde_json::from_value(json!({"id": "all", "nodes": nodes})).expect("a draft");
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    closed.await.expect("a closure").etag.into_owned()
}

#[tokio::test]
async fn a_plan_without_a_way_is_told_why_and_what_to_do() {
    let stage = Stage::set();
    stage.compose("p", "d", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(3)).await;
    stage.see("d", 30.0, 0.0).await;
    close_all(&stage).await;
    let told = told(&stage.edge).await;
    let affected = of_kind(&told, EventKind::PlanAffected);
    assert_eq!(affected.len(), 1, "{affected:?}");
    let data = affected[0];
    assert_eq!(
        (&data["outcome"], &data["causes"]),
        (&json!("no_route"), &json!(["all"]))
    );
    assert!(
        data["what_to_do"].is_string() && data.get("unsafe_way").is_some(),
        "{data}"
    );
    let raised = of_kind(&told, EventKind::AlarmRaised);
    assert_eq!(
        (&raised[0]["alarm"]["kind"], &raised[0]["alarm"]["plan_id"]),
        (&json!("no_route"), &json!("p"))
    );
    assert_eq!(
        of_kind(&told, EventKind::Replanned)[0]["outcomes"],
        json!({"no_route": 1})
    );
}

#[tokio::test]
async fn a_plan_without_a_way_gets_one_as_soon_as_there_is_one() {
    let stage = Stage::set();
    stage.compose("p", "d", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(3)).await;
    stage.see("d", 30.0, 0.0).await;
    stage.zone(circle("z", 300.0, 0.0, 10.0)).await;
    let etag = close_all(&stage).await;
    assert!(stage.plan("p").wanted.is_none());
    let lifted = stage
        .edge
        .lift_closure(&stage.caller, "all", Some(etag), None);
    lifted.await.expect("lifted");
    stage.settle().await;
    let wanted = stage.plan("p").wanted.expect("a way around the zone");
    assert_eq!(wanted.outcome, "rerouted");
}

#[tokio::test]
async fn alarms_of_invented_drones_do_not_drive_out_that_of_a_plan() {
    let stage = Stage::set();
    stage.compose("p", "d", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(3)).await;
    stage.see("d", 30.0, 0.0).await;
    close_all(&stage).await;
    stage.settle().await;
    let is_there = || {
        let (edge, page) = (
            &stage.edge,
            PageRequest {
                size: Some(1_000),
                ..PageRequest::default()
            },
        );
        let alarms = edge.alarms(&stage.caller, &page, AlarmFilter::default());
        let mut alarms = alarms.expect("alarms").alarms.into_iter();
        alarms.any(|alarm| alarm.plan_id.as_deref() == Some("p") && alarm.ended_at.is_none())
    };
    assert!(is_there());
    for number in 0..1_001 {
        let answer = stage
            .answer(json!({"type": "navigational", "service": {"from": "a1", "to": "a2"},
                "location": {"x": 150.0, "y": 0.0}, "destination": "a7", "drone": {"id": format!("x{number}")}}))
            .await;
        assert_eq!(answer["outcome"], "no_route");
    }
    stage.settle().await;
    assert!(is_there());
}
