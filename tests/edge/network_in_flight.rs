//! A new network under drones in flight.

use crate::mailboxes::messages;
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, names, without};
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::{AlarmFilter, PageRequest};
use skyway::wire::{AlarmKind, EndedAs, Release};

#[tokio::test]
async fn the_drones_of_plans_that_a_new_network_ends_are_told_and_who_flies_is_alarmed() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    stage.compose("flies", "d1", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(25)).await;
    stage.see("d1", 250.0, 0.0).await;
    let later = stage.edge.clock().now() + SignedDuration::from_secs(600);
    let waits = json!({"id": "waits", "drone_id": "d2", "source": "a6", "destination": "a7", "start_time": later.to_string()});
    stage.deliver(waits).await.expect("a plan");
    stage.rebuild(|draft| without(draft, "a7")).await;
    let told = |stage: &Stage, drone: &str| {
        let mut mail = stage.edge.mail(&stage.caller, drone, None).expect("mail");
        let ended = messages(&mut mail).into_iter();
        let ended = ended.map(|message| (message.plan_id.into_owned(), message.ended_as));
        ended.collect::<Vec<_>>()
    };
    let filter = AlarmFilter::default();
    let alarms = stage
        .edge
        .alarms(&stage.caller, &PageRequest::default(), filter);
    let alarms = alarms.expect("alarms").alarms;
    let alarmed = alarms
        .iter()
        .map(|alarm| (alarm.kind, alarm.plan_id.as_deref()));
    assert_eq!(
        alarmed.collect::<Vec<_>>(),
        [(AlarmKind::NoRoute, Some("flies"))]
    );
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    for (drone, plan) in [("d1", "flies"), ("d2", "waits")] {
        assert_eq!(
            told(&stage, drone),
            [(plan.to_owned(), Some(EndedAs::Cancelled))]
        );
    }
}

#[tokio::test]
async fn who_has_another_plan_is_no_alarm_any_more() {
    let stage = Stage::set();
    stage.compose("flies", "d1", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(25)).await;
    stage.see("d1", 250.0, 0.0).await;
    stage.rebuild(|draft| without(draft, "a7")).await;
    assert_eq!(open_alarms(&stage), 1);
    stage.compose("next", "d1", "a2", "a0").await;
    assert_eq!(open_alarms(&stage), 0);
}

fn open_alarms(stage: &Stage) -> usize {
    let filter = AlarmFilter::default();
    let alarms = stage
        .edge
        .alarms(&stage.caller, &PageRequest::default(), filter);
    let alarms = alarms.expect("alarms").alarms;
    let open = alarms.iter().filter(|alarm| alarm.ended_at.is_none());
    open.count()
}

#[tokio::test]
async fn who_flies_on_over_what_is_left_of_its_way_is_found_on_it() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a7").await;
    stage.see("d1", 550.0, 0.0).await;
    // A leg that it has flown is gone, and one ahead of it.
    stage
        .rebuild(|draft| {
            let is_gone = |from: &str, to: &str| [("a1", "a2"), ("a6", "a7")].contains(&(from, to));
            draft.segments.retain(|it| !is_gone(&it.from, &it.to));
        })
        .await;
    let wanted = stage.plan("p").wanted.expect("a way around");
    assert!(
        names(&wanted.path.nodes).contains(&"b7".to_owned()),
        "{wanted:?}"
    );
}

#[tokio::test]
async fn what_became_of_a_lost_plan_can_be_said_where_its_way_is_gone() {
    for node in ["a7", "a6"] {
        let stage = Stage::set();
        stage.compose("p", "d1", "a0", "a7").await;
        stage.pass(SignedDuration::from_hours(24)).await;
        assert_eq!(stage.plan("p").ended_as, Some(EndedAs::Lost));
        assert_eq!(open_alarms(&stage), 1);
        stage.rebuild(|draft| without(draft, node)).await;
        let release = Release {
            ended_as: EndedAs::Delivered,
        };
        let released = stage.edge.release_plan(&stage.caller, "p", release);
        released.await.expect("released");
        assert_eq!(open_alarms(&stage), 0);
    }
}
