//! Plans that are offered a better version, since something has opened.

use crate::flights_change::{acknowledge, lift};
use crate::flying::{instant, on, street, windowed};
use crate::mailboxes::messages;
use crate::stage::{DAWN, Stage, WAIT_AT_MOST, circle, names, node, segment};
use jiff::SignedDuration;
use serde_json::json;
use skyway::network::NetworkDraft;
use skyway::wire::{EventKind, MessageKind};
use tokio::time::timeout;
use tokio_stream::StreamExt;

/// A square with a short way and a long one.
pub(crate) fn block() -> NetworkDraft {
    let mut draft = street(&[1, 1, 1]);
    draft.nodes.push(node("north", 1_000.0, 1_500.0));
    draft
        .segments
        .extend([segment("s0", "north"), segment("north", "s2")]);
    draft
}

#[tokio::test]
async fn what_opens_early_is_offered_and_forced_on_nobody() {
    let stage = on(&block());
    let ack = stage.zone(circle("fire", 1_500.0, 0.0, 50.0)).await;
    let request = |id: &str| json!({"id": id, "source": "s0", "destination": "s2", "start_time": "2026-11-21T08:00:00Z"});
    let around = stage.deliver(request("p")).await.expect("a plan");
    assert_eq!(names(&around.reported.path.nodes), ["s0", "north", "s2"]);
    let mut events = stage.edge.events(None).expect("a stream");
    lift(&stage, &ack, "fire").await;
    let offered = async || loop {
        let event = events.next().await.expect("more").expect("no gap");
        if event.kind == EventKind::PlanOffered {
            return;
        }
    };
    let mut offered = offered;
    offered().await;
    let plan = stage.plan("p");
    assert!(plan.flags.is_empty());
    assert_eq!(plan.reported, around.reported, "it is flown as it was");
    let offer = plan.wanted.clone().expect("an offer");
    assert_eq!(names(&offer.path.nodes), ["s0", "s1", "s2"]);
    assert_eq!(offer.outcome, "rerouted");
    stage.check_version(&plan, &offer, &[]).expect("flyable");
    stage.pass(SignedDuration::from_secs(61)).await;
    let plan = stage.plan("p");
    assert_eq!((plan.flags.len(), plan.wanted), (0, None));
    assert_eq!(stage.edge.status().plans_unacknowledged, 0);
}

/// Of one plan more than are looked at after a change, the last one only would be better.
#[tokio::test]
async fn every_plan_has_its_turn_to_be_offered_a_better_one() {
    let stage = on(&block());
    let zone = circle("fire", 1_500.0, 0.0, 50.0);
    let fire = stage.zone(windowed(zone, "06:00", "06:30")).await;
    for number in 0..=200 {
        let starts = instant(DAWN) + SignedDuration::from_mins(15 * (201 - number));
        let (id, starts) = (format!("p{number:03}"), starts.to_string());
        let mut request =
            json!({"id": id, "source": "s0", "destination": "s2", "objective": "time"});
        request["start_time"] = json!(starts);
        stage.deliver(request).await.expect("a plan");
    }
    let before = stage.plan("p200").reported;
    assert_eq!(names(&before.path.nodes), ["s0", "north", "s2"]);
    lift(&stage, &fire, "fire").await;
    let changes = async {
        while stage.plan("p200").wanted.is_none() {
            let other = stage.zone(circle("other", 0.0, 9_000.0, 50.0)).await;
            lift(&stage, &other, "other").await;
        }
    };
    timeout(WAIT_AT_MOST, changes).await.expect("an offer");
    assert!(stage.plan("p000").wanted.is_none());
}

/// A plan around a zone that was lifted then, and the version that is offered for it.
async fn offered() -> (Stage, u32) {
    let stage = on(&block());
    let ack = stage.zone(circle("fire", 1_500.0, 0.0, 50.0)).await;
    let request = json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s2", "start_time": "2026-11-21T08:00:00Z"});
    stage.deliver(request).await.expect("a plan");
    let mut events = stage.edge.events(None).expect("a stream");
    lift(&stage, &ack, "fire").await;
    while events.next().await.expect("more").expect("no gap").kind != EventKind::PlanOffered {}
    let version = stage.plan("p").wanted.expect("an offer").version;
    (stage, version)
}

#[tokio::test]
async fn an_offer_may_be_taken() {
    let (stage, version) = offered().await;
    let plan = acknowledge(&stage, "p", version).await;
    assert_eq!(names(&plan.reported.path.nodes), ["s0", "s1", "s2"]);
    assert!(plan.flags.is_empty());
}

#[tokio::test]
async fn who_declines_an_offer_flies_on_as_before() {
    let (stage, version) = offered().await;
    let drone = stage.plan("p").drone_id.expect("a drone").into_owned();
    let decline = serde_json::from_value(json!({"version": version})).expect("a decline");
    let declined = stage.edge.decline_plan(&stage.caller, "p", decline).await;
    declined.expect("declined");
    stage.settle().await;
    let plan = stage.plan("p");
    assert_eq!((plan.wanted, plan.flags), (None, Vec::new()));
    let mut mail = stage.edge.mail(&stage.caller, &drone, None).expect("mail");
    let told = messages(&mut mail);
    assert!(
        told.iter().all(|it| it.kind != MessageKind::NoWay),
        "{told:?}"
    );
}
