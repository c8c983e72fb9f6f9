//! Time passes: windows open and close, versions are missed, removals are held, events are told.

use crate::stage::{Stage, circle};
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::Code;
use skyway::wire::{EventKind, PlanFlag};
use tokio_stream::StreamExt;

#[tokio::test]
async fn a_zone_closes_shortly_before_its_window_says_from_when_and_is_in_force_in_it() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    let mut zone = circle("concert", 150.0, 0.0, 10.0);
    zone["properties"]["windows"] =
        json!([{"from": "2026-11-21T08:00:00Z", "until": "2026-11-21T09:00:00Z"}]);
    let ack = stage.zone(zone).await;
    let told = (ack.effect.in_force, ack.effect.closes_from.as_deref());
    assert_eq!(told, (false, Some("2026-11-21T07:50:00Z")));
    let question = json!({"service": {"from": "b1", "to": "b2"}, "location": {"node": "b1"}, "destination": "b3", "dry_run": true});
    let length = async || stage.answer(question.clone()).await["remaining_length_m"].as_f64();
    let closure = || {
        let closure = stage.edge.closure(&stage.caller, "concert").expect("there");
        (
            closure.in_force,
            closure.closes_from.map(|from| from.into_owned()),
        )
    };
    let soon = Some("2026-11-21T07:50:00Z".to_owned());
    assert_eq!(
        (length().await, closure()),
        (Some(400.0), (false, soon.clone()))
    );
    stage.pass(SignedDuration::from_mins(109)).await;
    assert_eq!(
        (length().await, closure()),
        (Some(400.0), (false, soon.clone()))
    );
    stage.pass(SignedDuration::from_mins(1)).await;
    assert_eq!(
        stage.answer(question.clone()).await["outcome"],
        "diverted",
        "within the horizon both rows are cut"
    );
    assert_eq!(closure(), (false, soon), "it has not begun");
    stage.pass(SignedDuration::from_mins(10)).await;
    assert_eq!(closure(), (true, None));
    stage.pass(SignedDuration::from_mins(60)).await;
    assert_eq!(
        stage.answer(question.clone()).await["outcome"],
        "diverted",
        "the end belongs to it"
    );
    stage.pass(SignedDuration::from_secs(1)).await;
    assert_eq!((length().await, closure()), (Some(400.0), (false, None)));
}

#[tokio::test]
async fn a_version_that_nobody_acknowledges_is_told() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a7").await;
    let mut events = stage.edge.events(None).expect("a stream");
    stage.zone(circle("fire", 550.0, 0.0, 10.0)).await;
    stage.pass(SignedDuration::from_secs(60)).await;
    let mut kinds = Vec::new();
    while kinds.last() != Some(&EventKind::PlanUnacknowledged) {
        let event = events.next().await.expect("more").expect("no gap");
        kinds.push(event.kind);
    }
    assert_eq!(
        kinds,
        [
            EventKind::ZonePut,
            EventKind::PlanAffected,
            EventKind::Replanned,
            EventKind::PlanUnacknowledged
        ]
    );
    assert_eq!(
        stage.plan("p1").flags,
        [PlanFlag::Affected, PlanFlag::Unacknowledged]
    );
}

#[tokio::test]
async fn a_listener_goes_on_where_it_left_and_is_told_when_that_is_gone() {
    let stage = Stage::set();
    for place in 0..3 {
        stage
            .zone(circle(
                &format!("z{place}"),
                50.0 + 100.0 * f64::from(place),
                50.0,
                5.0,
            ))
            .await;
    }
    let mut events = stage.edge.events(Some("7-1")).expect("a stream");
    let next = events.next().await.expect("more").expect("no gap");
    assert_eq!(next.id, "7-2");
    for (id, code) in [
        ("6-1", Code::EventsGone),
        ("7-99", Code::EventsGone),
        ("yesterday", Code::ParameterInvalid),
    ] {
        assert_eq!(
            stage.edge.events(Some(id)).expect_err(id).code,
            code,
            "{id}"
        );
    }
}
