//! Plans that are flown for deliveries, over a restart of their edge.

use crate::deliveries::{Pilot, flights, following};
use crate::flying::instant;
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, ladder};
use jiff::SignedDuration;
use serde_json::{Value, json};

/// From home at `a0` to the pickup at `a7`, to the drop at `b7`, and home.
fn around() -> Value {
    json!({
        "id": "p", "drone_id": "d", "delivery_id": "order-1", "source": "a0", "destination": "a0",
        "stops": [{"node": "a7", "service_s": 60.0}, {"node": "b7", "service_s": 30.0}],
    })
}

fn served(stage: &Stage) -> u32 {
    flights(stage).last().expect("news").stops_served
}

#[tokio::test]
async fn who_is_home_again_after_a_restart_is_not_sent_on_its_way_once_more() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), following()).await;
    let draft = ladder();
    let version = stage.deliver(around()).await.expect("a plan").reported;
    let soon = SignedDuration::from_secs(10);
    let is_near_home = instant(&version.arrives_at) - soon;
    let pilot = Pilot::of(&stage, &draft);
    pilot.fly_until(&version, is_near_home).await;
    assert_eq!((served(&stage), stage.plan("p").ended_as), (2, None));

    let stage = stage.again_with(disk.open(), following()).await;
    stage.pass(soon).await;
    Pilot::of(&stage, &draft).tell([0.0, 0.0], false).await;
    stage.zone(circle("on-the-way-out", 350.0, 0.0, 10.0)).await;
    let plan = stage.plan("p");
    assert_eq!((plan.wanted, plan.versions.len()), (None, 1));
}

#[tokio::test]
async fn who_turned_home_while_its_edge_was_away_has_served_no_stop_more() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), following()).await;
    let draft = ladder();
    let version = stage.deliver(around()).await.expect("a plan").reported;
    let flight = version.flight.as_ref().expect("a flight");
    let takes_off_at = instant(&flight.stops[0].takes_off_at);
    Pilot::of(&stage, &draft)
        .fly_until(&version, takes_off_at)
        .await;
    assert_eq!(served(&stage), 1);

    let stage = stage.again_with(disk.open(), following()).await;
    stage.pass(SignedDuration::from_secs(45)).await;
    Pilot::of(&stage, &draft).tell([0.0, 0.0], false).await;
    assert_eq!(served(&stage), 1, "there was no time for the drop");
}
