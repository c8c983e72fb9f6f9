//! An edge that follows, dies, and starts again from its disk while the registry is away.

use crate::memory_disk::{Breakage, MemoryDisk};
use crate::stage::{Central, NETWORK, Outpost, circle, manner};
use serde_json::json;
use skyway::edge::{Decision, Settings, Table, ZoneWrite};
use skyway::wire::Freshness;
use std::cell::Cell;
use std::time::Duration;

/// An edge on a disk that has the zone `x` around a1-a2, of 20 m, from the registry.
async fn followed(disk: &MemoryDisk) -> (Central, Outpost) {
    let central = Central::open().await;
    central.put_zone("x", 150.0, 0.0, 20.0).await;
    let north = Outpost::over(&central.registry, "north", disk).await;
    north.settle(&central).await;
    (central, north)
}

#[tokio::test]
async fn what_was_not_told_yet_is_told_after_a_crash() {
    let disk = MemoryDisk::default();
    let (central, north) = followed(&disk).await;
    north.line.cut();
    north.put_zone("y", 350.0, 0.0, 20.0).await;
    north.put_zone("y", 350.0, 0.0, 30.0).await;
    north.close("works", "b4-b5").await;
    north.lift_zone("x").await;
    let (zones, blocked) = (north.zones(), north.blocked());
    let cursor = north.edge.stamp().registry_revision;
    let north = north.crash("north", &disk).await;
    assert_eq!((north.zones(), north.blocked()), (zones, blocked));
    assert_eq!(north.edge.stamp().registry_revision, cursor);
    assert_eq!(north.sync().outbox, 4, "in the order in which it was done");
    central.put_zone("z", 550.0, 100.0, 5.0).await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(
        central.zones().await,
        [("y".to_owned(), 30.0), ("z".to_owned(), 5.0)]
    );
    assert_eq!(north.zones(), central.zones().await);
    assert_eq!(central.closures().await.len(), 1);
    assert_eq!(north.line.lists(), 0, "it went on where it was");
    north.end().await;
}

#[tokio::test]
async fn a_change_that_waits_for_an_operator_waits_on_after_a_crash() {
    let disk = MemoryDisk::default();
    let (central, north) = followed(&disk).await;
    north.line.cut();
    central.put_zone("x", 150.0, 0.0, 90.0).await;
    north.put_zone("x", 150.0, 0.0, 5.0).await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    let before = north.holds();
    assert_eq!(before.len(), 1);
    north.stored().await;
    let north = north.crash("north", &disk).await;
    assert_eq!(north.holds(), before);
    assert_eq!(
        north.zones(),
        [("x".to_owned(), 90.0)],
        "the stricter of both"
    );
    north.decide(&before[0], Decision::Accept).await;
    let north = north.crash("north", &disk).await;
    assert!(north.holds().is_empty());
    assert_eq!(north.zones(), [("x".to_owned(), 5.0)]);
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 5.0)]);
    north.end().await;
}

#[tokio::test]
async fn weather_and_the_place_in_the_log_are_on_the_disk() {
    let disk = MemoryDisk::default();
    let (central, north) = followed(&disk).await;
    let weather = json!({"wind": [{
        "from": "2026-11-21T06:00:00Z", "until": "2026-11-21T09:00:00Z",
        "speed_mps": 7.0, "from_deg": 200.0,
    }]});
    let weather = serde_json::from_value(weather).expect("weather");
    let put = central
        .registry
        .put_weather(NETWORK, weather, &manner(None))
        .await;
    put.expect("weather");
    north.settle(&central).await;
    north.stored().await;
    let north = north.crash("north", &disk).await;
    let facts = disk.rows(Table::Facts);
    assert!(
        facts.iter().any(|(_, body)| body.contains("200.0")),
        "{facts:?}"
    );
    assert_ne!(north.edge.stamp().freshness, Freshness::Fresh);
    north.line.lead_to(Some(&central.registry));
    north
        .until("it has heard the registry", async || {
            north.edge.stamp().freshness == Freshness::Fresh
        })
        .await;
    assert_eq!(north.line.lists(), 0);
    north.end().await;
}

#[tokio::test]
async fn nothing_is_told_that_a_crash_would_forget() {
    let disk = MemoryDisk::default();
    let central = Central::open().await;
    let settings = Settings {
        commit_within: Duration::from_secs(3_600),
        ..Settings::default()
    };
    let north = Outpost::over_with(&central.registry, "north", &disk, settings).await;
    north.settle(&central).await;
    north.stored().await;
    disk.set(Breakage::Hanging);
    let hangs = async {
        north
            .until("it is in force", async || north.blocked() == 1)
            .await;
        // As much time passes as it would take to tell it.
        let turns = Cell::new(0);
        north
            .until("time has passed", async || {
                turns.set(turns.get() + 1);
                turns.get() > 100
            })
            .await;
        assert!(north.line.writes().is_empty());
        disk.set(Breakage::None);
    };
    tokio::join!(north.put_zone("y", 350.0, 0.0, 20.0), hangs);
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("y".to_owned(), 20.0)]);
    north.end().await;
}

#[tokio::test]
async fn a_disk_that_fails_keeps_nobody_from_learning() {
    let disk = MemoryDisk::default();
    let central = Central::open().await;
    let north = Outpost::over(&central.registry, "north", &disk).await;
    north.settle(&central).await;
    north.stored().await;
    disk.set(Breakage::Full);
    let write = ZoneWrite {
        id: Some("y".to_owned()),
        ..ZoneWrite::default()
    };
    let feature = circle("y", 350.0, 0.0, 20.0);
    let put = north.edge.put_zone(&north.caller, feature, write).await;
    let refusal = put.expect_err("it is not stored");
    assert!(refusal.enforced, "{refusal}");
    north
        .until("it is told", async || central.zones().await.len() == 1)
        .await;
    north.end().await;
}

#[tokio::test]
async fn an_edge_that_was_restarted_tells_its_registry_at_once() {
    let disk = MemoryDisk::default();
    let (central, north) = followed(&disk).await;
    let north = north.crash("north", &disk).await;
    // Nothing is new there: who asks for news first waits longer than this test.
    north.line.wait_for_ever();
    north.line.lead_to(Some(&central.registry));
    north.put_zone("y", 350.0, 0.0, 20.0).await;
    north
        .until("it is told", async || central.zones().await.len() == 2)
        .await;
    north
        .until("it is known to be current", async || {
            north.edge.stamp().freshness == Freshness::Fresh
        })
        .await;
    // So it is after the registry was away.
    north.line.cut();
    north
        .until("it is lost", async || {
            north.hand.advance(jiff::SignedDuration::from_secs(1));
            north.edge.stamp().freshness != Freshness::Fresh
        })
        .await;
    north.line.lead_to(Some(&central.registry));
    north
        .until("it is heard again", async || {
            north.edge.stamp().freshness == Freshness::Fresh
        })
        .await;
    north.end().await;
}
