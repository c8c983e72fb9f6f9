//! A registry restored from a backup, another registry in its place, and revisions that would lead back.

use crate::memory_disk::MemoryDisk;
use crate::stage::{Central, NETWORK, Outpost, dawn, ladder, manner, up_to};
use serde_json::json;
use skyway::clock::Clock;
use skyway::edge::{Caller, Edge, Opening, Settings};
use skyway::formats::{load_network, write_network};
use skyway::wire::{EventKind, Weather};
use std::sync::Arc;

#[tokio::test]
async fn a_new_epoch_is_read_as_a_whole_and_its_differences_are_told() {
    let mut central = Central::open().await;
    central.put_zone("kept", 50.0, 0.0, 5.0).await;
    central.put_zone("lost", 150.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    let mut events = north.events();
    north.line.cut();
    central.restore().await;
    central.lift_zone("lost").await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(north.line.lists(), 2);
    assert_eq!(north.ids(), ["kept"]);
    let told = up_to(&mut events, EventKind::RegistryEpoch).await;
    let (_, data) = told.last().expect("an event");
    assert_eq!(data["gone"], serde_json::json!(["lost"]), "{data}");
    assert_eq!(data["put_count"], 0, "{data}");
    assert_eq!(data["to"], "2-4", "{data}");
    north.end().await;
}

fn windy() -> Weather {
    let weather = json!({"wind": [{
        "from": "2026-11-21T06:00:00Z", "until": "2026-11-21T09:00:00Z",
        "speed_mps": 7.0, "from_deg": 200.0,
    }]});
    serde_json::from_value(weather).expect("weather")
}

#[tokio::test]
async fn weather_that_a_backup_does_not_have_is_gone() {
    let mut central = Central::open().await;
    central.put_zone("kept", 50.0, 0.0, 5.0).await;
    let backup = central.back_up();
    let manner = manner(None);
    let put = central.registry.put_weather(NETWORK, windy(), &manner);
    put.await.expect("weather");
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    assert!(north.edge.weather(&north.caller).etag.is_some());
    north.line.cut();
    central.restore_backup(backup).await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    let weather = north.edge.weather(&north.caller);
    assert_eq!((weather.wind.len(), weather.etag), (0, None));
    north.end().await;
}

#[tokio::test]
async fn weather_that_was_put_at_an_edge_before_it_followed_stays() {
    let disk = MemoryDisk::default();
    let text = write_network(&ladder());
    let topology = load_network(&text).expect("a network").topology;
    let (clock, _hand) = Clock::by_hand(dawn());
    let opening = Opening::new(
        Arc::new(topology),
        text.into(),
        7,
        Settings::default(),
        clock,
    );
    let alone = Edge::open(opening, disk.open()).await.expect("an edge");
    let caller = Caller::anyone();
    let put = alone.put_weather(&caller, windy(), None);
    let etag = put.await.expect("weather").etag;
    assert!(etag.is_some());
    alone.tick().await.expect("the writer works");
    disk.crash();

    let mut central = Central::open().await;
    let mut north = Outpost::over(&central.registry, "north", &disk).await;
    for _ in 0..2 {
        north.settle(&central).await;
        assert_eq!(north.edge.weather(&north.caller).etag, etag);
        north.stored().await;
        north = north.crash("north", &disk).await;
        // A new epoch is read as a whole.
        central.restore().await;
        north.line.lead_to(Some(&central.registry));
    }
    north.settle(&central).await;
    assert_eq!(north.edge.weather(&north.caller).etag, etag);
    north.end().await;
}

#[tokio::test]
async fn a_list_that_has_lost_much_is_held() {
    let mut central = Central::open().await;
    for place in 0..12 {
        let x = 40.0 + 50.0 * f64::from(place);
        central
            .put_zone(&format!("z{place:02}"), x, 50.0, 5.0)
            .await;
    }
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    north.line.cut();
    central.restore().await;
    for place in 0..11 {
        central.lift_zone(&format!("z{place:02}")).await;
    }
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(north.ids().len(), 12);
    assert_eq!(north.holds()[0].closure_count, 11);
    north.end().await;
}

#[tokio::test]
async fn another_registry_is_not_followed_nor_told_anything() {
    let central = Central::open().await;
    central.put_zone("ours", 50.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    let stranger = Central::open().await;
    stranger.put_zone("theirs", 150.0, 0.0, 5.0).await;
    let mut events = north.events();
    north.line.lead_to(Some(&stranger.registry));
    let told = up_to_moving(&north, &mut events, EventKind::RegistryRefused).await;
    let (_, data) = told.last().expect("an event");
    assert_eq!(data["code"], "foreign_registry", "{data}");
    north.put_zone("mine", 250.0, 0.0, 5.0).await;
    let nacks = north.sync().nacks;
    north
        .until("it asks on", async || north.sync().nacks > nacks + 5)
        .await;
    assert_eq!(north.ids(), ["mine", "ours"]);
    assert_eq!(
        stranger.zones().await.len(),
        1,
        "a stranger is told nothing"
    );
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(central.zones().await.len(), 2);
    north.end().await;
}

async fn up_to_moving(
    north: &Outpost,
    events: &mut skyway::edge::EventStream,
    kind: EventKind,
) -> Vec<(EventKind, serde_json::Value)> {
    let nacks = north.sync().nacks;
    north
        .until("it is refused", async || north.sync().nacks > nacks)
        .await;
    up_to(events, kind).await
}

#[tokio::test]
async fn a_page_of_before_is_refused() {
    let central = Central::open().await;
    central.put_zone("a", 50.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    // What was told once comes again, as from a cache on the way.
    let follow = skyway::registry::Follow {
        after: 1,
        ..skyway::registry::Follow::default()
    };
    let old = central
        .registry
        .changes(crate::stage::NETWORK, &follow, std::future::ready(()))
        .await
        .expect("a page");
    central.lift_zone("a").await;
    north.settle(&central).await;
    let nacks = north.sync().nacks;
    north.line.bend(move |_| Ok(old.clone()));
    north
        .until("it is refused", async || north.sync().nacks > nacks)
        .await;
    let nack = north.sync().last_nack.expect("a reason");
    assert_eq!(nack.code, "revision_backwards");
    assert!(north.ids().is_empty(), "nothing comes back by an old page");
    north.line.straighten();
    central.put_zone("b", 50.0, 0.0, 5.0).await;
    north.settle(&central).await;
    assert_eq!(north.ids(), ["b"]);
    // A page of before that was on its way when the line was bent may be refused yet.
    north
        .until("nothing is refused", async || {
            north.sync().last_nack.is_none()
        })
        .await;
    north.end().await;
}

#[tokio::test]
async fn an_empty_list_has_to_say_that_it_is_meant() {
    let mut central = Central::open().await;
    central.put_zone("a", 50.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    north.line.cut();
    central.lift_zone("a").await;
    central.restore().await;
    north.line.bend_list(|mut page| {
        page.authoritative_empty = false;
        page.checksum = page.digest();
        Ok(page)
    });
    north.line.lead_to(Some(&central.registry));
    north
        .until("it is refused", async || north.sync().nacks > 0)
        .await;
    let nack = north.sync().last_nack.expect("a reason");
    assert_eq!(nack.code, "empty_not_authoritative");
    assert_eq!(north.ids(), ["a"]);
    north.line.straighten();
    north.settle(&central).await;
    assert!(north.ids().is_empty());
    north.end().await;
}
