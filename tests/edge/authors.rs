//! Who did what: on every event, and on what others are told.

use crate::stage::{Stage, circle};
use serde_json::{Value, json};
use skyway::edge::{Caller, EventStream, Role, ZoneWrite};
use skyway::wire::EventKind;
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::StreamExt;

/// Longer than anything takes, so that a test that waits in vain fails.
const WAIT_AT_MOST: Duration = Duration::from_secs(20);

/// The next event of a kind; those before it are told where it never comes.
async fn next(events: &mut EventStream, kind: EventKind) -> Value {
    let mut passed = Vec::new();
    loop {
        let next = tokio::time::timeout(WAIT_AT_MOST, events.next()).await;
        let next = next.unwrap_or_else(|_| panic!("no {kind:?} after {passed:?}"));
        let event = next.expect("more").expect("no gap");
        if event.kind == kind {
            return serde_json::from_str(&event.json).expect("JSON");
        }
        passed.push(event.kind);
    }
}

/// The next events of two kinds, in either order: an answer is told beside the writer, which tells
/// what is published.
async fn both(events: &mut EventStream, kinds: [EventKind; 2]) -> [Value; 2] {
    let mut passed = Vec::new();
    let mut found = [None, None];
    while found.contains(&None) {
        let next = tokio::time::timeout(WAIT_AT_MOST, events.next()).await;
        let next = next.unwrap_or_else(|_| panic!("not {kinds:?}, but {passed:?}"));
        let event = next.expect("more").expect("no gap");
        passed.push(event.kind);
        if let Some(place) = kinds.iter().position(|kind| *kind == event.kind) {
            found[place] = serde_json::from_str(&event.json).ok();
        }
    }
    found.map(Option::unwrap_or_default)
}

#[tokio::test]
async fn an_event_says_who_made_it_happen() {
    let mut stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.caller = Caller::local(Role::Operator, "mira");
    let mut events = stage.edge.events(None).expect("a stream");
    let mira = json!({"tenant": "local", "subject": "mira", "role": "operator"});
    let edge = json!({"tenant": "local", "subject": "edge", "role": "edge"});
    stage.zone(circle("fair", 150.0, 0.0, 10.0)).await;
    assert_eq!(next(&mut events, EventKind::ZonePut).await["by"], mira);
    // What follows from it is the edge's doing.
    assert_eq!(next(&mut events, EventKind::PlanAffected).await["by"], edge);
    let (_, etag) = stage.edge.zone(&stage.caller, "fair").expect("there");
    let write = ZoneWrite {
        id: Some("fair".to_owned()),
        if_match: Some(etag),
        validate_only: false,
    };
    stage.caller.subject = Arc::from("noor");
    let why = Some("it is over".to_owned());
    let lifted = stage.edge.delete_zone(&stage.caller, write, why).await;
    lifted.expect("lifted");
    let told = next(&mut events, EventKind::ZoneDeleted).await;
    assert_eq!(told["by"]["subject"], "noor", "{told}");
    assert_eq!(told["reason"], "it is over", "{told}");
    // What follows from it has no reason of its own.
    let told = next(&mut events, EventKind::PlanRelieved).await;
    assert_eq!((&told["by"], told.get("reason")), (&edge, None));
    // A drone's report, and what it closes.
    stage.caller = Caller::local(Role::Drone, "d1");
    stage.see("d1", 50.0, 0.0).await;
    let report = json!({
        "type": "navigational", "drone": {"id": "d1"},
        "service": {"from": "a0", "to": "a1"}, "destination": "a4",
    });
    stage.answer(report).await;
    for told in both(&mut events, [EventKind::Recomposed, EventKind::ClosurePut]).await {
        assert_eq!(told["by"]["subject"], "d1", "{told}");
        assert_eq!(told["by"]["role"], "drone", "{told}");
    }
    stage.pass(jiff::SignedDuration::from_mins(16)).await;
    let ended = next(&mut events, EventKind::ClosureEnded).await;
    assert_eq!(ended["by"], edge, "it ended by itself: {ended}");
}
