//! Orders that are held for a drone that flies for another one.

use super::world::{World, errand};
use serde_json::json;
use skyway::wire::{EndedAs, PlanState};
use std::collections::BTreeMap;

/// A drone at the shop that flies from there to the door for 188 s, one that is free elsewhere, and an order from the shop on
/// which drones were looked for once.
async fn with_one_away(free_at: &str) -> (World, String) {
    let world = World::with_drones(&["shop", free_at]).await;
    let first = world.order("shop", "door").await;
    world.assign().await;
    assert_eq!(world.drone_of(&first).await, "swift:0");
    let flight = world.whole_flight(&first, "shop").await;
    world.tell(1, &flight[..2]).await;
    let second = world.order("shop", "door").await;
    world.assign().await;
    (world, second)
}

#[tokio::test]
async fn a_drone_that_is_sooner_back_than_another_is_there_is_waited_for() {
    let (world, waits) = with_one_away("tower").await;
    assert_eq!(world.drone_of(&waits).await, "");
    let reason = "it waits for a nearer drone that is soon back from another order";
    assert_eq!(world.reason(&waits).await, reason);
    let plan = world.edge.plans().into_iter().next().expect("a plan");
    world
        .edge
        .set(&plan.0, PlanState::Ended, Some(EndedAs::Delivered));
    let flight = world.whole_flight(&plan.1.delivery, "shop").await;
    world.tell(3, &flight[2..]).await;
    world.assign().await;
    assert_eq!(world.drone_of(&waits).await, "swift:0");

    let (world, does_not_wait) = with_one_away("hut").await;
    assert_eq!(world.drone_of(&does_not_wait).await, "swift:1");
}

#[tokio::test]
async fn an_order_is_held_though_another_one_gets_the_drone_that_would_be_sooner() {
    let world = World::with_drones(&["shop", "door", "tower"]).await;
    let first = world.order("shop", "door").await;
    world.assign().await;
    assert_eq!(world.drone_of(&first).await, "swift:0");
    let together = [
        world.order("shop", "door").await,
        world.order("shop", "door").await,
    ];
    world.assign().await;
    let mut reasons = BTreeMap::new();
    for id in together {
        reasons.insert(world.drone_of(&id).await, world.reason(&id).await);
    }
    let held = "it waits for a nearer drone that is soon back from another order";
    let drones: Vec<&str> = reasons.keys().map(|drone| &**drone).collect();
    assert_eq!(drones, ["", "swift:1"]);
    assert_eq!(reasons[""], held);
}

#[tokio::test]
async fn a_drone_that_is_late_is_waited_for_no_longer() {
    let (world, waits) = with_one_away("tower").await;
    world.pass(188 + 118);
    world.assign().await;
    assert_eq!(world.drone_of(&waits).await, "");
    world.pass(5);
    world.assign().await;
    assert_eq!(world.drone_of(&waits).await, "swift:1");
}

#[tokio::test]
async fn an_order_is_held_for_no_longer_than_a_fetch_takes() {
    let (world, waits) = with_one_away("roof").await;
    assert_eq!(world.drone_of(&waits).await, "");
    world.pass(188);
    world.assign().await;
    assert_eq!(world.drone_of(&waits).await, "");
    // Its flight costs 3,000 m and the wait until now 7,040 m; that of the other one 10,000 m.
    world.pass(32);
    world.assign().await;
    assert_eq!(world.drone_of(&waits).await, "swift:1");
}

#[tokio::test]
async fn an_order_for_later_is_held_at_no_cost_until_its_drone_has_to_leave() {
    let world = World::with_drones(&["shop", "hut"]).await;
    let first = world.order("shop", "door").await;
    world.assign().await;
    assert_eq!(world.drone_of(&first).await, "swift:0");
    let mut order = errand("shop", "door");
    order.start_time = Some("2026-11-27T18:14:00Z".to_owned());
    let waits = world.try_order(&order).await.expect("an order").id;
    world.assign().await;
    // The parcel is ready at 18:14: a wait until then costs nothing.
    for _ in 0..3 {
        assert_eq!(world.drone_of(&waits).await, "");
        world.pass(60);
        world.assign().await;
    }
}

#[tokio::test]
async fn an_order_is_not_held_past_what_a_free_drone_still_makes() {
    // Parcel ready, latest arrival, and when the far drone is sent though the near one is not back.
    let later = |start: &str, latest: Option<&str>| {
        let mut order = errand("shop", "door");
        order.start_time = Some(start.to_owned());
        order.arrive_by = latest.map(str::to_owned);
        order
    };
    let now = "2026-11-27T18:00:00Z";
    // Back in 188 s, and two minutes late it would leave the other one 594 s.
    for (latest, is_held) in [
        ("2026-11-27T18:15:10Z", true),
        ("2026-11-27T18:14:50Z", false),
    ] {
        let world = World::with_drones(&["shop", "tower"]).await;
        world.order("shop", "door").await;
        world.assign().await;
        let order = later(now, Some(latest));
        let id = world.try_order(&order).await.expect("an order").id;
        world.assign().await;
        assert_eq!(world.drone_of(&id).await.is_empty(), is_held, "{latest}");
    }
    // The far drone has to leave 500 s before the parcel is ready, and two minutes are for one that does not come back.
    let world = World::with_drones(&["shop", "tower"]).await;
    world.order("shop", "door").await;
    world.assign().await;
    let order = later("2026-11-27T18:12:00Z", None);
    let id = world.try_order(&order).await.expect("an order").id;
    world.pass(98);
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "");
    world.pass(4);
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "swift:1");
}

#[tokio::test]
async fn an_order_is_held_for_who_is_sooner_at_the_pickup_not_for_who_flies_less() {
    let world = World::with_drones(&["hut", "depot"]).await;
    let first = world.order("hut", "door").await;
    world.assign().await;
    assert_eq!(world.drone_of(&first).await, "swift:0");
    // From the hut it would be 16,000 m in all, from the depot 18,000 m, but first 3,000 m back.
    let id = world.order("shop", "tower").await;
    world.pass(150);
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "swift:1");
}

#[tokio::test]
async fn an_order_is_not_held_until_its_service_closes() {
    // Two minutes late, the near drone would leave the far one 500 s from 18:05:08 on.
    for (until, is_held) in [("18:14", true), ("18:13", false)] {
        let world = World::with_drones(&["shop", "tower"]).await;
        let hours = json!([{"days": ["FRI"], "from": "07:00", "until": until}]);
        let service = json!({"time_zone": "UTC", "hours": hours});
        world.put_service(&service).await;
        world.order("shop", "door").await;
        world.assign().await;
        let id = world.order("shop", "door").await;
        world.assign().await;
        assert_eq!(world.drone_of(&id).await.is_empty(), is_held, "{until}");
    }
}

#[tokio::test]
async fn a_drone_that_lands_elsewhere_is_not_waited_for() {
    let (world, waits) = with_one_away("tower").await;
    assert_eq!(world.drone_of(&waits).await, "");
    let plan = world.edge.plans().into_iter().next().expect("a plan");
    let delivery = plan.1.delivery;
    let mut diverts = world.news(&delivery, PlanState::Activated, 1).await;
    diverts.outcome = "diverted".to_owned();
    world.tell(3, &[diverts]).await;
    world.assign().await;
    assert_eq!(world.drone_of(&waits).await, "swift:1");
}
