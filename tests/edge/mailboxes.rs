//! What drones are told by themselves, on streams and sessions of the edge.

use crate::flying::{on, street};
use crate::memory_disk::{Breakage, MemoryDisk};
use crate::stage::{Stage, WAIT_AT_MOST, circle};
use crate::store_file::Medium;
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::{Caller, Code, Mail, MailStream, Role, Session, ZoneWrite};
use skyway::wire::{self, DroneMessage, MessageKind};
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use tokio_stream::{Stream, StreamExt};

fn hello(drone: &str) -> wire::HelloDrone {
    wire::HelloDrone {
        drone_id: drone.to_owned(),
        ends_session: None,
        received_through: None,
    }
}

/// What is there now.
fn there(mail: &mut MailStream) -> Vec<Mail> {
    let mut found = Vec::new();
    let mut context = Context::from_waker(Waker::noop());
    while let Poll::Ready(Some(next)) = std::pin::Pin::new(&mut *mail).poll_next(&mut context) {
        found.push(next);
    }
    found
}

pub(crate) fn messages(mail: &mut MailStream) -> Vec<DroneMessage<'static>> {
    let told = there(mail).into_iter().map(|told| match told {
        Mail::Message(message) => *message,
        Mail::Ended(ended) => panic!("{ended:?}"),
    });
    told.collect()
}

fn kinds(messages: &[DroneMessage<'_>]) -> Vec<MessageKind> {
    messages.iter().map(|message| message.kind).collect()
}

fn version(message: &DroneMessage<'_>) -> u32 {
    message.version.as_ref().expect("a version").version
}

async fn next(mail: &mut MailStream) -> DroneMessage<'static> {
    let next = tokio::time::timeout(WAIT_AT_MOST, mail.next()).await;
    match next.expect("in time") {
        Some(Mail::Message(message)) => *message,
        other => panic!("{other:?}"),
    }
}

fn session(stage: &Stage, drones: &[&str]) -> (Session, wire::Welcome<'static>) {
    let session = stage.edge.begin_session(&stage.caller);
    let drones = drones.iter().map(|drone| hello(drone)).collect();
    let welcome = session.hello(drones).expect("not too many");
    (session, welcome)
}

async fn acknowledge(stage: &Stage, id: &str, version: u32) {
    let ack = wire::Ack {
        version,
        ..wire::Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, id, ack).await;
    taken.expect("taken over");
    stage.settle().await;
}

async fn receive(stage: &Stage, drone: &str, message: &DroneMessage<'_>) -> u32 {
    let received = wire::Received {
        through: message.id.to_string(),
    };
    let edge = &stage.edge;
    let left = edge.receive_mail(&stage.caller, drone, &received).await;
    left.expect("received").left
}

#[tokio::test]
async fn a_zone_on_its_way_is_told_a_drone_until_it_has_answered() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    assert_eq!(messages(&mut mail), []);

    stage.zone(circle("crane", 250.0, 0.0, 10.0)).await;
    stage.settle().await;
    let told = messages(&mut mail);
    assert_eq!(kinds(&told), [MessageKind::Version]);
    assert_eq!(version(&told[0]), 2);
    assert_eq!(told[0].causes, ["crane"]);
    assert!(messages(&mut mail).is_empty(), "nothing is told twice");

    // It has received it, and does not fly it yet: it is told again.
    assert_eq!(receive(&stage, "d1", &told[0]).await, 1);
    let mut again = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    assert_eq!(kinds(&messages(&mut again)), [MessageKind::Version]);

    acknowledge(&stage, "p1", 2).await;
    let mut again = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    assert_eq!(messages(&mut again), []);
}

#[tokio::test]
async fn the_contingencies_of_a_flown_version_follow_it() {
    let stage = on(&street(&[2, 2, 2]));
    let asked = json!({"id": "p1", "drone_id": "d1", "source": "s0", "destination": "s2"});
    stage.deliver(asked).await.expect("a plan");
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = messages(&mut mail);
    assert_eq!(kinds(&told), [MessageKind::Contingencies]);
    let told = told[0].version.as_ref().expect("a version");
    assert!(told.legs.iter().all(|leg| leg.alternate.is_some()));
    assert_eq!(*told, stage.plan("p1").reported);
}

#[tokio::test]
async fn of_the_versions_of_a_plan_only_the_newest_is_told() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a7").await;
    stage.zone(circle("first", 250.0, 0.0, 10.0)).await;
    stage.zone(circle("second", 450.0, 100.0, 10.0)).await;
    stage.settle().await;
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = messages(&mut mail);
    let wanted = stage.plan("p1").wanted.expect("a version").version;
    let orders = told.iter().filter(|it| it.kind == MessageKind::Version);
    assert_eq!(orders.map(version).collect::<Vec<_>>(), [wanted]);

    // What was in its way is lifted: nothing is to be flown any more.
    for id in ["first", "second"] {
        let write = ZoneWrite {
            id: Some(id.to_owned()),
            if_match: Some("*".to_owned()),
            ..ZoneWrite::default()
        };
        let lifted = stage.edge.delete_zone(&stage.caller, write, None);
        lifted.await.expect("lifted");
    }
    stage.settle().await;
    let told = messages(&mut mail);
    assert_eq!(
        kinds(&told).last(),
        Some(&MessageKind::Relieved),
        "{told:?}"
    );
    let mut again = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = kinds(&messages(&mut again));
    assert!(!told.contains(&MessageKind::Version), "{told:?}");
}

/// A drone on the second leg of its plan, with a zone all around it.
async fn enclosed() -> Stage {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.pass(SignedDuration::from_secs(15)).await;
    stage.see("d1", 150.0, 0.0).await;
    stage.zone(ring()).await;
    stage.settle().await;
    stage
}

fn ring() -> serde_json::Value {
    let outer = [
        [-50.0, -50.0],
        [750.0, -50.0],
        [750.0, 150.0],
        [-50.0, 150.0],
        [-50.0, -50.0],
    ];
    let hole = [
        [120.0, -20.0],
        [120.0, 20.0],
        [180.0, 20.0],
        [180.0, -20.0],
        [120.0, -20.0],
    ];
    json!({
        "type": "Feature", "id": "all",
        "geometry": {"type": "Polygon", "coordinates": [outer, hole]},
        "properties": {"margin_m": 0},
    })
}

#[tokio::test]
async fn that_there_is_no_way_is_kept_until_the_drone_has_received_it() {
    let stage = enclosed().await;
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = messages(&mut mail);
    let no_way = told.iter().find(|it| it.kind == MessageKind::NoWay);
    let no_way = no_way.unwrap_or_else(|| panic!("{told:?}"));
    assert_eq!(no_way.causes, ["all"]);
    assert!(no_way.unsafe_way.is_some() && no_way.text.is_some());
    let alarm = told.iter().find(|it| it.kind == MessageKind::Alarm);
    let alarm = alarm.expect("its operator was alarmed");
    assert_eq!(alarm.alarm, Some(wire::AlarmKind::NoRoute));

    let last = told.last().expect("told");
    let mut again = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    assert_eq!(messages(&mut again).len(), told.len());
    assert_eq!(receive(&stage, "d1", last).await, 0);
    let mut again = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    assert_eq!(messages(&mut again), []);
}

#[tokio::test]
async fn a_drone_beside_its_way_that_finds_none_is_told_that_its_plan_is_affected() {
    let stage = enclosed().await;
    let mut answered = 0;
    for number in 0..6 {
        stage.pass(SignedDuration::from_secs(1)).await;
        let told = stage.see("d1", 155.0 + f64::from(number), 60.0).await;
        answered += usize::from(told.positions[0].recomposition_id.is_some());
        assert!(told.positions[0].affected, "{told:?}");
    }
    assert!(answered > 0, "it is never answered");
}

#[tokio::test]
async fn a_drone_that_has_declined_all_versions_is_told_so() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.zone(circle("crane", 250.0, 0.0, 10.0)).await;
    while let Some(wanted) = stage.plan("p1").wanted {
        let decline = wire::Decline {
            version: wanted.version,
            ..wire::Decline::default()
        };
        let declined = stage.edge.decline_plan(&stage.caller, "p1", decline).await;
        declined.expect("answered");
        stage.settle().await;
    }
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = messages(&mut mail);
    let no_way = told.iter().find(|it| it.kind == MessageKind::NoWay);
    let text = no_way.and_then(|it| it.text.as_deref()).expect("a text");
    assert!(text.contains("declined"), "{text}");
}

#[tokio::test]
async fn a_cancelled_plan_is_told_its_drone_and_its_other_messages_are_gone() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.zone(circle("crane", 250.0, 0.0, 10.0)).await;
    let cancelled = stage
        .edge
        .cancel_plan(&stage.caller, "p1", Default::default());
    cancelled.await.expect("cancelled");
    stage.settle().await;
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = messages(&mut mail);
    assert_eq!(kinds(&told), [MessageKind::Ended]);
    assert_eq!(told[0].ended_as, Some(wire::EndedAs::Cancelled));

    // Its next plan begins with an empty mailbox.
    stage.compose("p2", "d1", "b0", "b4").await;
    stage.settle().await;
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    let told = messages(&mut mail);
    assert!(told.iter().all(|it| it.plan_id == "p2"), "{told:?}");
}

#[tokio::test]
async fn mail_survives_a_restart_and_its_numbers_rise() {
    for medium in Medium::both() {
        let stage = Stage::over(medium.open().await).await;
        stage.compose("p1", "d1", "a0", "a4").await;
        stage.zone(circle("crane", 250.0, 0.0, 10.0)).await;
        stage.settle().await;
        let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
        let mut before = vec![next(&mut mail).await];
        while before.last().map(|it| it.kind) != Some(MessageKind::Version) {
            before.push(next(&mut mail).await);
        }
        let version_before = before.pop().expect("a version");
        drop(mail);
        stage.edge.end().await;
        let stage = stage.again(medium.open().await).await;
        let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
        let told = messages(&mut mail);
        let order = told.iter().find(|it| it.kind == MessageKind::Version);
        let order = order.unwrap_or_else(|| panic!("{told:?}"));
        assert_eq!(order.id, version_before.id);
        assert_eq!(order.version, version_before.version);

        stage.zone(circle("next", 250.0, 100.0, 10.0)).await;
        stage.settle().await;
        let newer = next(&mut mail).await;
        let number = |id: &str| id.rsplit('-').next().and_then(|it| it.parse::<u64>().ok());
        assert!(number(&newer.id) > number(&order.id), "{newer:?}");
        stage.edge.end().await;
    }
}

#[tokio::test]
async fn a_drone_is_told_while_the_disk_hangs() {
    let disk = MemoryDisk::default();
    let stage = Stage::impatient(disk.open()).await;
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.settle().await;
    let mut mail = stage.edge.mail(&stage.caller, "d1", None).expect("mail");
    disk.set(Breakage::Hanging);
    let zone = stage.edge.create_zone(
        &stage.caller,
        circle("crane", 250.0, 0.0, 10.0),
        Default::default(),
        Default::default(),
    );
    let refused = zone.await.expect_err("not stored");
    assert_eq!(refused.code, Code::NotDurable);
    loop {
        if next(&mut mail).await.kind == MessageKind::Version {
            break;
        }
    }
    disk.set(Breakage::None);
}

#[tokio::test]
async fn a_session_that_was_heard_before_the_clock_was_set_back_may_be_taken_over() {
    let (stage, hands) = Stage::on_machine_clock();
    let (first, _) = session(&stage, &["d1"]);
    first.heard();
    hands.step(-SignedDuration::from_hours(1));
    let confirmed = stage.edge.confirm_clock(&stage.caller).await;
    confirmed.expect("confirmed");
    hands.advance(Duration::from_secs(16));
    let (_second, welcome) = session(&stage, &["d1"]);
    assert_eq!(welcome.drones, ["d1"], "{:?}", welcome.refused);
}

#[tokio::test]
async fn a_plan_that_is_over_gets_no_contingencies() {
    let stage = on(&street(&[2; 12]));
    for number in 0..8 {
        let (id, drone) = (format!("p{number}"), format!("d{number}"));
        let asked = json!({"id": id, "drone_id": drone, "source": "s0", "destination": "s9",
            "start_time": format!("2026-11-21T08:{number:02}:00Z")});
        let asked = serde_json::from_value(asked).expect("a delivery request");
        let composed = stage
            .edge
            .compose_plan(&stage.caller, asked, Default::default());
        composed.await.expect("a plan");
        // They are being worked out.
        let cancelled = stage
            .edge
            .cancel_plan(&stage.caller, &id, Default::default());
        cancelled.await.expect("cancelled");
        stage.settle().await;
        let mut mail = stage.edge.mail(&stage.caller, &drone, None).expect("mail");
        assert_eq!(kinds(&messages(&mut mail)), [MessageKind::Ended]);
    }
}

#[tokio::test]
async fn a_drone_is_on_one_session_which_another_one_may_end_by_its_name() {
    let stage = Stage::set();
    let (first, welcome) = session(&stage, &["d1", "d2"]);
    assert_eq!(welcome.drones, ["d1", "d2"]);
    let mut on_first = first.mail();

    let (second, refused) = session(&stage, &["d1"]);
    assert_eq!(refused.drones.len(), 0);
    assert_eq!(refused.refused[0].reason.code, "drone_on_another_session");

    let named = wire::HelloDrone {
        ends_session: Some(welcome.session_id.to_string()),
        ..hello("d1")
    };
    let taken = second.hello(vec![named]).expect("not too many");
    assert_eq!(taken.drones, ["d1"]);
    let told = there(&mut on_first);
    let [Mail::Ended(ended)] = &told[..] else {
        panic!("{told:?}");
    };
    assert_eq!(taken.ended, std::slice::from_ref(ended));
    assert_eq!(ended.drone_id, "d1");
    assert_eq!(ended.session_id, welcome.session_id);
    assert_eq!(ended.taken_over_by, taken.session_id);

    // Two that take it from each other are held off; the other drone stays where it is.
    let back = wire::HelloDrone {
        ends_session: Some(taken.session_id.to_string()),
        ..hello("d1")
    };
    let held_off = first.hello(vec![back.clone()]).expect("not too many");
    assert_eq!(held_off.refused[0].reason.code, "taken_over_too_often");
    stage.hand.advance(SignedDuration::from_secs(5));
    let back = first.hello(vec![back]).expect("not too many");
    assert_eq!(back.drones, ["d1"]);

    stage.compose("p1", "d1", "a0", "a4").await;
    stage.compose("p2", "d2", "b0", "b4").await;
    stage.zone(circle("crane", 250.0, 50.0, 60.0)).await;
    stage.settle().await;
    let told: Vec<_> = messages(&mut on_first)
        .iter()
        .map(|it| it.drone_id.to_string())
        .collect();
    assert_eq!(told, ["d1", "d2"]);
    assert_eq!(
        there(&mut second.mail()).len(),
        1,
        "that it has lost d1 again"
    );
}

#[tokio::test]
async fn a_session_on_which_nothing_was_heard_for_long_is_ended_by_any_other() {
    let stage = Stage::set();
    let (_silent, _) = session(&stage, &["d1"]);
    stage.hand.advance(SignedDuration::from_secs(14));
    let (next, refused) = session(&stage, &["d1"]);
    assert_eq!(refused.drones.len(), 0);
    stage.hand.advance(SignedDuration::from_secs(1));
    let welcome = next.hello(vec![hello("d1")]).expect("not too many");
    assert_eq!((welcome.drones.len(), welcome.ended.len()), (1, 1));
}

#[tokio::test]
async fn a_session_that_ends_leaves_its_drones_and_their_mail() {
    let stage = Stage::set();
    let (first, _) = session(&stage, &["d1"]);
    stage.compose("p1", "d1", "a0", "a4").await;
    stage.zone(circle("crane", 250.0, 0.0, 10.0)).await;
    stage.settle().await;
    assert_eq!(messages(&mut first.mail()).len(), 1);
    drop(first);
    assert_eq!(stage.edge.status().drones_on_sessions, 0);
    let (second, welcome) = session(&stage, &["d1"]);
    assert_eq!(welcome.drones, ["d1"]);
    assert_eq!(messages(&mut second.mail()).len(), 1);
    second.goodbye(&["d1".to_owned()]);
    assert_eq!(stage.edge.status().drones_on_sessions, 0);
}

#[tokio::test]
async fn a_token_of_a_drone_sees_its_own_mailbox_alone() {
    let stage = Stage::set();
    let drone = Caller::local(Role::Drone, "acme");
    assert!(stage.edge.mail(&drone, "acme:1", None).is_ok());
    let refused = stage.edge.mail(&drone, "other:1", None);
    assert_eq!(refused.expect_err("another's").code, Code::Forbidden);
    let session = stage.edge.begin_session(&drone);
    let welcome = session.hello(vec![hello("acme:1"), hello("other:1")]);
    let welcome = welcome.expect("not too many");
    assert_eq!(welcome.drones, ["acme:1"]);
    assert_eq!(welcome.refused[0].reason.code, "drone_not_yours");
}

#[tokio::test]
async fn what_is_no_message_of_this_edge_is_refused() {
    let stage = Stage::set();
    for id in ["1", "x", "", "7-x"] {
        let refused = stage.edge.mail(&stage.caller, "d1", Some(id));
        assert_eq!(refused.expect_err("no id").code, Code::ParameterInvalid);
    }
    // A hello after the store is lost names messages of another one: it is told all that there is.
    let lost = wire::HelloDrone {
        received_through: Some("1795334027520-17".to_owned()),
        ..hello("d1")
    };
    let session = stage.edge.begin_session(&stage.caller);
    assert_eq!(session.hello(vec![lost]).expect("few").drones, ["d1"]);
}
