//! Which drone flies which order, and what an order waits for.

use super::ordering::{accepting, quoted};
use super::world::{SERVICE, World, customer, errand, of};
use jiff::Timestamp;
use serde_json::json;
use skyway::access::Role;
use skyway::wire::{DeliveryOrder, DeliveryStatus, EndedAs, Money, PlanState};

#[tokio::test]
async fn of_two_orders_and_one_drone_one_waits_and_says_why() {
    let world = World::with_drones(&["shop"]).await;
    let far = world.order("roof", "tower").await;
    let near = world.order("door", "hut").await;
    world.assign().await;
    assert_eq!(world.drone_of(&near).await, "swift:0");
    assert_eq!(world.status(&far).await, DeliveryStatus::Created);
    let reason = world.reason(&far).await;
    assert_eq!(
        reason,
        "the only drone that is free flies another order first"
    );
    world.assign().await;
    let reason = world.reason(&far).await;
    assert_eq!(
        reason,
        format!("no drone of the service '{SERVICE}' that fits is free")
    );
    // Looked at again and again nothing changes, so nothing is written.
    let before = world.delivery(&far).await;
    world.assign().await;
    assert_eq!(world.delivery(&far).await, before);

    let flight = world.whole_flight(&near, "shop").await;
    let plan = flight[0].plan_id.clone();
    world
        .edge
        .set(&plan, PlanState::Ended, Some(EndedAs::Delivered));
    world.tell(1, &flight).await;
    world.assign().await;
    assert_eq!(world.drone_of(&far).await, "swift:0");
}

#[tokio::test]
async fn orders_that_come_together_are_assigned_best_together() {
    // One by one, the first order would take the drone at the shop, and the second would be left with that at the tower.
    let world = World::with_drones(&["shop", "tower"]).await;
    let first = world.order("door", "hut").await;
    let second = world.order("depot", "shop").await;
    world.assign().await;
    // 13,000 m and 2,000 m; the other way round it would be 6,000 m and 18,000 m.
    assert_eq!(world.drone_of(&first).await, "swift:1");
    assert_eq!(world.drone_of(&second).await, "swift:0");
    let explanation = world
        .delivery(&first)
        .await
        .allocation
        .expect("a drone")
        .explanation;
    assert!(explanation.contains("2 orders together"), "{explanation}");
}

#[tokio::test]
async fn who_waits_behind_orders_that_an_edge_does_not_answer_has_its_turn() {
    let world = World::with_drones(&["depot"; 255]).await;
    world.edge.lose_questions(u32::MAX);
    for _ in 0..255 {
        world.order("shop", "door").await;
    }
    world.assign().await;
    // There is room for one more, and the first that waits has no drone.
    world
        .put_service(&json!({"id": "slow:parcels", "provider": "slow"}))
        .await;
    let mut without = errand("shop", "door");
    without.service_id = Some("slow:parcels".to_owned());
    world.try_order(&without).await.expect("an order");
    world.put_drone("swift:255", "depot").await;
    world.order("shop", "door").await;
    world.assign().await;
    assert_eq!(world.drone("swift:255").await.0, "assigned");
}

#[tokio::test]
async fn an_order_counts_all_drones_that_were_free_for_it() {
    let world = World::with_drones(&["shop", "tower", "depot"]).await;
    let id = world.order("door", "hut").await;
    world.assign().await;
    let delivery = world.delivery(&id).await;
    let explanation = delivery.allocation.expect("a drone").explanation;
    assert!(explanation.contains("of 3 that are free"), "{explanation}");
}

#[tokio::test]
async fn what_an_edge_refuses_the_next_drone_flies() {
    let world = World::with_drones(&["depot", "tower"]).await;
    world.edge.refuse("swift:0");
    let id = world.order("shop", "door").await;
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    assert_eq!(
        world.reason(&id).await,
        "drone 'swift:0' cannot fly it: no open way leads there (no_route)"
    );
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "swift:1");
}

#[tokio::test]
async fn a_refused_drone_is_asked_for_again_after_a_while() {
    let world = World::with_drones(&["depot"]).await;
    world.edge.refuse("swift:0");
    let id = world.order("shop", "door").await;
    world.assign().await;
    world.edge.accept("swift:0");
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    assert!(world.reason(&id).await.contains("cannot fly it"));
    world.pass(121);
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "swift:0");
}

#[tokio::test]
async fn an_edge_that_was_silent_is_asked_again_for_the_same_plan() {
    for loses_answer in [false, true] {
        let world = World::with_drones(&["depot", "tower"]).await;
        if loses_answer {
            world.edge.lose_answers(2);
        } else {
            world.edge.lose_questions(2);
        }
        let id = world.order("shop", "door").await;
        world.assign().await;
        assert_eq!(world.status(&id).await, DeliveryStatus::Created);
        assert_eq!(world.reason(&id).await, "the edge does not answer");
        assert_eq!(world.drone("swift:0").await.0, "assigned");
        for _ in 0..3 {
            world.pass(3);
            world.assign().await;
        }
        assert_eq!(world.drone_of(&id).await, "swift:0");
        assert_eq!(world.edge.plans().len(), 1);
        assert_eq!(
            world.told(&id).await,
            ["delivery.created", "delivery.assigned"]
        );
    }
}

#[tokio::test]
async fn another_process_goes_on_where_one_has_died() {
    let world = World::with_drones(&["depot"]).await;
    // It has reserved and asked; the answer never came, and then it died.
    world.edge.lose_answers(1);
    let id = world.order("shop", "door").await;
    world.assign().await;
    let plans = world.edge.plans();
    assert_eq!(plans.len(), 1);
    let another = world.another().await;
    drop(world);
    another.pass(3);
    another.assign().await;
    assert_eq!(another.status(&id).await, DeliveryStatus::Assigned);
    let allocation = another.delivery(&id).await.allocation.expect("a drone");
    assert!(plans.contains_key(&allocation.plan_id));
    assert_eq!(another.edge.plans().len(), 1);
}

#[tokio::test]
async fn an_order_without_a_drone_is_answered_at_its_deadline() {
    let world = World::with_drones(&[]).await;
    let mut order = errand("shop", "door");
    order.arrive_by = Some("2026-11-27T18:30:00Z".to_owned());
    let id = world.try_order(&order).await.expect("an order").id;
    let patient = world.order("shop", "door").await;
    world.assign().await;
    assert!(world.reason(&id).await.contains("is free"));
    world.pass(30 * 60);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Failed);
    assert_eq!(world.status(&patient).await, DeliveryStatus::Created);
    world.pass(120 * 60);
    world.assign().await;
    assert_eq!(world.status(&patient).await, DeliveryStatus::Failed);
    assert_eq!(
        world.told(&id).await,
        ["delivery.created", "delivery.failed"]
    );
}

#[tokio::test]
async fn a_flight_that_would_come_too_late_is_called_off_for_another_drone() {
    let world = World::with_drones(&["tower", "depot"]).await;
    world.edge.refuse("swift:1");
    let mut order = errand("shop", "door");
    order.arrive_by = Some("2026-11-27T18:05:00Z".to_owned());
    let id = world.try_order(&order).await.expect("an order").id;
    // The near drone is refused; the far one would take 9 minutes.
    for _ in 0..3 {
        world.assign().await;
        world.pass(1);
    }
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    assert!(
        world.reason(&id).await.contains("would arrive at"),
        "{}",
        world.reason(&id).await
    );
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert!(world.edge.plans().values().all(|plan| !plan.is_active()));
}

#[tokio::test]
async fn no_customer_is_told_of_another_flight_of_a_drone() {
    let world = World::with_drones(&["depot"]).await;
    let flown = world.order("shop", "door").await;
    world.assign().await;
    // The registry takes it for free, and its edge knows better.
    world.put_drone("swift:0", "depot").await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let reason = world.reason(&id).await;
    assert!(reason.contains("plan_state_conflict"), "{reason}");
    assert!(!reason.contains(&flown), "{reason}");
}

#[tokio::test]
async fn an_order_for_later_gets_its_drone_shortly_before() {
    let world = World::with_drones(&["depot"]).await;
    let mut order = errand("shop", "door");
    order.start_time = Some("2026-11-27T20:00:00Z".to_owned());
    let id = world.try_order(&order).await.expect("an order").id;
    world.assign().await;
    assert_eq!(
        world.reason(&id).await,
        "its drone is assigned from 2026-11-27T19:45:00Z on"
    );
    world.pass(105 * 60);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Assigned);
}

#[tokio::test]
async fn a_parcel_is_picked_up_when_its_service_is_open() {
    let world = World::with_drones(&["depot"]).await;
    let hours = json!([{"days": ["FRI", "SAT"], "from": "07:00", "until": "18:30"}]);
    world
        .put_service(&json!({"time_zone": "UTC", "hours": hours}))
        .await;
    let opens_at = "2026-11-28T07:00:00Z";
    let waits = "its drone is assigned from 2026-11-28T06:45:00Z on";
    // It is Friday, 18:00, and there is one drone for two orders.
    let first = world.order("shop", "door").await;
    world.assign().await;
    assert_eq!(world.status(&first).await, DeliveryStatus::Assigned);
    let second = world.order("shop", "door").await;
    world.pass(40 * 60);
    world.assign().await;
    let closed = format!("the service '{SERVICE}' is closed until {opens_at}");
    assert_eq!(world.reason(&second).await, closed);

    world.put_drone("swift:2", "depot").await;
    let quote = world
        .dispatch
        .create_quote(&customer("shop"), quoted())
        .await
        .expect("a quote");
    assert_eq!(quote.request.start_time.as_deref(), Some(opens_at));
    let pickup_at: Timestamp = quote.pickup_at.parse().expect("a time");
    let opens: Timestamp = opens_at.parse().expect("a time");
    assert!(
        pickup_at.duration_since(opens).abs().as_secs() < 60,
        "{pickup_at}"
    );
    let accept = DeliveryOrder {
        quote_id: Some(quote.id),
        ..DeliveryOrder::default()
    };
    let accepted = world.try_order(&accept).await.expect("an order");
    assert_eq!(accepted.start_time, opens_at);
    let plain = world.order("shop", "door").await;
    assert_eq!(world.delivery(&plain).await.start_time, opens_at);
    world.assign().await;
    for id in [&accepted.id, &plain] {
        assert_eq!(world.status(id).await, DeliveryStatus::Created);
        assert_eq!(world.reason(id).await, waits);
    }
}

/// With a quote and without, the hours are those of the pickup.
#[tokio::test]
async fn no_drone_is_sent_that_comes_after_its_service_closes() {
    let world = World::with_drones(&["shop"]).await;
    let hours = json!([{"days": ["FRI"], "from": "07:00", "until": "18:10"}]);
    let service = json!({"time_zone": "UTC", "hours": hours});
    world.put_service(&service).await;
    world.order("shop", "door").await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    // The drone of the first order is late, and the next one has 500 s to the shop.
    world.pass(310);
    world.put_drone("swift:far", "tower").await;
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "");
    let shop = customer("shop");
    let quote = world.dispatch.create_quote(&shop, quoted());
    let next_week = quote.await.expect("a quote").request.start_time;
    assert_eq!(next_week.as_deref(), Some("2026-12-04T07:00:00Z"));
    world.put_drone("swift:near", "depot").await;
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "swift:near");
}

#[tokio::test]
async fn a_flight_that_would_pick_up_after_closing_is_called_off() {
    let world = World::with_drones(&["depot"]).await;
    let hours = json!([{"days": ["FRI"], "from": "07:00", "until": "18:05"}]);
    let service = json!({"time_zone": "UTC", "hours": hours});
    world.put_service(&service).await;
    // It would be at the shop within two minutes, and its edge takes it on after four and a half.
    world.edge.lose_questions(1);
    let id = world.order("shop", "door").await;
    world.assign().await;
    world.pass(270);
    for _ in 0..2 {
        world.assign().await;
    }
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    let reason = world.reason(&id).await;
    assert!(reason.contains("after its service closes"), "{reason}");
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert!(world.edge.plans().values().all(|plan| !plan.is_active()));
}

#[tokio::test]
async fn what_was_promised_is_not_flown_after_closing_once_that_is_past() {
    let world = World::with_drones(&["shop"]).await;
    let hours = json!([{"days": ["FRI"], "from": "07:00", "until": "18:10"}]);
    let service = json!({"time_zone": "UTC", "hours": hours});
    world.put_service(&service).await;
    let shop = customer("shop");
    let quote = world.dispatch.create_quote(&shop, quoted());
    let quote = quote.await.expect("a quote");
    world.order("shop", "door").await;
    world.assign().await;
    let accepted = world.try_order(&accepting(&quote)).await.expect("an order");
    // It is half past seven when another drone is free.
    world.pass(90 * 60);
    world.put_drone("swift:near", "depot").await;
    world.assign().await;
    assert_eq!(world.drone_of(&accepted.id).await, "");
    let reason = world.reason(&accepted.id).await;
    assert!(reason.contains("closed until"), "{reason}");
}

#[tokio::test]
async fn an_order_that_no_service_fits_waits_for_one() {
    let world = World::with_drones(&["depot"]).await;
    world.put_service(&json!({"payload_max_kg": 0.5})).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    assert!(
        world
            .reason(&id)
            .await
            .contains("it carries 0.5 kg at most")
    );
    world.put_service(&json!({})).await;
    world.pass(6);
    world.assign().await;
    world.assign().await;
    let delivery = world.delivery(&id).await;
    assert_eq!(delivery.status, DeliveryStatus::Assigned);
    assert_eq!(delivery.price.expect("a price").amount.to_string(), "8.00");
    assert_eq!(delivery.provider.as_deref(), Some("swift"));
}

#[tokio::test]
async fn an_order_that_is_filled_while_its_service_is_closed_waits_for_its_opening() {
    let world = World::with_drones(&["depot"]).await;
    world.put_service(&json!({"payload_max_kg": 0.5})).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    // It is Friday, 18:00.
    let hours = json!([{"days": ["SAT"], "from": "07:00", "until": "17:00"}]);
    let closed = json!({"time_zone": "UTC", "hours": hours});
    world.put_service(&closed).await;
    world.pass(6);
    world.assign().await;
    let filled = world.delivery(&id).await;
    assert_eq!(filled.service_id.as_deref(), Some(SERVICE));
    assert_eq!(filled.start_time, "2026-11-28T07:00:00Z");
    world.pass(151 * 60);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    world.pass(11 * 3_600);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Assigned);
}

#[tokio::test]
async fn the_cheapest_service_has_a_drone_that_can_fly() {
    let world = World::with_drones(&["depot"]).await;
    // Cheaper, and its provider has no drone.
    let cheaper = json!({
        "id": "slow:parcels", "provider": "slow",
        "tariff": {"currency": "AUD", "base": "1", "per_km": "1", "minimum": "0"},
    });
    world.put_service(&cheaper).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let delivery = world.delivery(&id).await;
    assert_eq!(delivery.status, DeliveryStatus::Assigned);
    assert_eq!(delivery.service_id.as_deref(), Some(SERVICE));
    // A drone that is busy is one that can fly: its service is the cheapest all the same.
    let later = world.delivery(&world.order("shop", "door").await).await;
    assert_eq!(later.service_id.as_deref(), Some(SERVICE));
}

#[tokio::test]
async fn orders_that_wait_in_vain_hold_up_no_other() {
    let world = World::with_drones(&["depot"]).await;
    // Its provider has no drone at all.
    let other = json!({"id": "slow:parcels", "provider": "slow"});
    world.put_service(&other).await;
    let mut order = errand("shop", "door");
    order.service_id = Some("slow:parcels".to_owned());
    // More than are assigned together.
    for _ in 0..300 {
        world.try_order(&order).await.expect("an order");
    }
    world.pass(1);
    order.service_id = Some(SERVICE.to_owned());
    let id = world.try_order(&order).await.expect("an order").id;
    world.assign().await;
    assert_eq!(world.drone_of(&id).await, "swift:0");
}

#[tokio::test]
async fn for_all_orders_a_service_is_looked_for_in_turn() {
    let world = World::with_drones(&[]).await;
    let mut order = errand("shop", "door");
    order.price_max = Some(Money {
        amount: "1.50".parse().expect("an amount"),
        currency: "AUD".to_owned(),
    });
    let mut orders = Vec::new();
    // More than one is looked for at once.
    for _ in 0..20 {
        orders.push(world.try_order(&order).await.expect("an order").id);
    }
    for _ in 0..2 {
        world.assign().await;
        world.pass(6);
    }
    let operator = of(Role::Operator, "airspace");
    for id in orders {
        let seen = world.dispatch.delivery(&operator, &id).await;
        // Who is told no prices learns none from this either.
        assert_eq!(
            seen.expect("a delivery").reason.expect("a reason"),
            format!("no service fits it yet; '{SERVICE}': its price does not fit")
        );
    }
}
