//! Plans that a new network ends, as their source or destination is gone.

use crate::mailboxes::messages;
use crate::stage::{Stage, without};
use jiff::SignedDuration;
use serde_json::json;
use skyway::edge::{AlarmFilter, MemoryDisk, PageRequest};
use skyway::wire::{AlarmKind, EndedAs};

#[tokio::test]
async fn the_drones_of_plans_that_a_new_network_ends_are_told_and_who_flies_is_alarmed() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    stage.compose("flies", "d1", "a0", "a7").await;
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
