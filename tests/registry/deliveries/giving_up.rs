//! Edges that do not answer for long, and flights that were flown all the same.

use super::world::{World, customer};
use serde_json::Value;
use skyway::registry::documents::DocumentKind;
use skyway::wire::{DeliveryStatus, EndedAs, FlightNews, PlanState};

const FLOWN: [&str; 5] = [
    "delivery.created",
    "delivery.assigned",
    "delivery.picking_up",
    "delivery.in_flight",
    "delivery.delivered",
];

/// A world with an order whose edge has taken its flight on and was not heard, and the plan of that flight.
async fn unheard() -> (World, String, String) {
    let world = World::with_drones(&["depot", "roof"]).await;
    world.edge.lose_answers(1);
    let id = world.order("shop", "door").await;
    world.assign().await;
    let plan = world.edge.plans().into_keys().next();
    (world, id, plan.expect("a flight"))
}

/// All that is told of the flight, which was flown.
fn flown(world: &World, id: &str, plan: &str) -> Vec<FlightNews> {
    let news = |state, stops| world.news_of(id, plan.to_owned(), state, stops);
    let mut ended = news(PlanState::Ended, 2);
    ended.ended_as = Some(EndedAs::Delivered);
    ended.landed_on = Some("depot".to_owned());
    vec![
        news(PlanState::Accepted, 0),
        news(PlanState::Activated, 0),
        news(PlanState::Activated, 1),
        news(PlanState::Activated, 2),
        ended,
    ]
}

#[tokio::test]
async fn an_edge_that_stays_silent_is_given_up_and_the_flight_called_off() {
    let (world, id, _) = unheard().await;
    world.edge.lose_questions(2);
    world.pass(601);
    world.assign().await;
    // The edge may have its flight, so neither has it failed, nor is the drone free.
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    assert!(world.reason(&id).await.contains("did not answer in time"));
    assert_eq!(world.drone("swift:0").await.0, "assigned");
    for _ in 0..4 {
        world.pass(20);
        world.assign().await;
    }
    // Once the edge says that it does not fly it, another drone does.
    assert_eq!(world.status(&id).await, DeliveryStatus::Assigned);
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert_eq!(world.drone("swift:1").await.0, "assigned");
    let plans = world.edge.plans().into_values();
    assert_eq!(plans.filter(|plan| plan.is_active()).count(), 1);
    assert_eq!(
        world.told(&id).await,
        ["delivery.created", "delivery.assigned"]
    );
}

#[tokio::test]
async fn an_order_that_was_given_up_fails_once_its_time_is_over() {
    let (world, id, _) = unheard().await;
    world.edge.lose_questions(3);
    world.pass(3 * 3_600);
    for _ in 0..5 {
        world.assign().await;
        world.pass(20);
    }
    assert_eq!(world.status(&id).await, DeliveryStatus::Failed);
    assert!(world.reason(&id).await.contains("did not answer in time"));
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert!(world.edge.plans().values().all(|plan| !plan.is_active()));
    assert_eq!(
        world.told(&id).await,
        ["delivery.created", "delivery.failed"]
    );
}

#[tokio::test]
async fn no_more_drones_wait_for_an_edge_than_are_assigned_together() {
    let homes = ["depot"; 300];
    let world = World::with_drones(&homes).await;
    world.edge.lose_questions(u32::MAX);
    for _ in 0..homes.len() {
        world.order("shop", "door").await;
    }
    for _ in 0..3 {
        world.assign().await;
    }
    assert_eq!(assigned(&world, homes.len()).await, 256);
    // Nor while it is asked to call these flights off.
    world.pass(601);
    for _ in 0..3 {
        world.assign().await;
    }
    assert_eq!(assigned(&world, homes.len()).await, 256);
    // Those that are answered make room for others.
    world.edge.lose_questions(0);
    for _ in 0..3 {
        world.pass(20);
        world.assign().await;
    }
    assert_eq!(world.edge.plans().len(), homes.len());
}

/// How many of the first drones are assigned.
async fn assigned(world: &World, drones: usize) -> usize {
    let mut count = 0;
    for number in 0..drones {
        let (state, _) = world.drone(&format!("swift:{number}")).await;
        count += usize::from(state == "assigned");
    }
    count
}

#[tokio::test]
async fn what_was_flown_while_nobody_asked_is_delivered() {
    let (world, id, plan) = unheard().await;
    // The registry is away for longer than it asks, and the drone comes home meanwhile.
    world
        .edge
        .set(&plan, PlanState::Ended, Some(EndedAs::Delivered));
    world.pass(3_600);
    for _ in 0..5 {
        world.assign().await;
        world.pass(20);
    }
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    assert_eq!(world.edge.plans().len(), 1);
    let news = flown(&world, &id, &plan);
    world.tell(1, &news).await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Delivered);
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert_eq!(world.told(&id).await, FLOWN);
}

#[tokio::test]
async fn what_an_edge_refuses_it_may_have_taken_on_before() {
    for has_departed in [false, true] {
        let (world, id, plan) = unheard().await;
        if has_departed {
            world.edge.set(&plan, PlanState::Activated, None);
        }
        world.edge.deny();
        world.pass(20);
        world.assign().await;
        let flies = world.edge.plans()[&plan].is_active();
        assert_eq!(flies, has_departed);
        let drone = world.drone("swift:0").await.0;
        assert_eq!(drone == "assigned", has_departed, "{drone}");
        assert_eq!(world.status(&id).await, DeliveryStatus::Created);
        if has_departed {
            let news = flown(&world, &id, &plan);
            world.tell(1, &news).await;
            assert_eq!(world.told(&id).await, FLOWN);
        }
    }
}

#[tokio::test]
async fn what_departed_while_nobody_asked_flies_on() {
    let (world, id, plan) = unheard().await;
    world.edge.set(&plan, PlanState::Activated, None);
    world.pass(601);
    world.assign().await;
    world.assign().await;
    let assigned = world.delivery(&id).await;
    assert_eq!(assigned.status, DeliveryStatus::Assigned);
    assert_eq!(assigned.promised_at, None);
    assert_eq!(flights(&world, &id).await, 1);
    let news = flown(&world, &id, &plan);
    world.tell(1, &news[..2]).await;
    let promised_at = world.delivery(&id).await.promised_at;
    assert_eq!(promised_at.as_ref(), Some(&news[1].expected_at));
    world.tell(3, &news[2..]).await;
    assert_eq!(world.told(&id).await, FLOWN);
    assert_eq!(flights(&world, &id).await, 1);
}

/// How many flights of an order were taken on.
async fn flights(world: &World, id: &str) -> u64 {
    let document = world.documents.document(DocumentKind::Delivery, id).await;
    let body = document.expect("answers").expect("an order").body;
    let body: Value = serde_json::from_str(&body).expect("JSON");
    body["dispatch"]["flights"].as_u64().expect("a number")
}

#[tokio::test]
async fn an_order_called_off_after_its_flight_gets_no_other() {
    let (world, id, plan) = unheard().await;
    world
        .edge
        .set(&plan, PlanState::Ended, Some(EndedAs::Delivered));
    let shop = customer("shop");
    let told = world.dispatch.cancel_delivery(&shop, &id).await;
    assert_eq!(
        told.expect("being called off").status,
        DeliveryStatus::Created
    );
    for _ in 0..5 {
        world.pass(20);
        world.assign().await;
    }
    assert_eq!(world.edge.plans().len(), 1);
    assert_eq!(world.drone("swift:1").await, ("available".to_owned(), None));
    let news = flown(&world, &id, &plan);
    world.tell(1, &news).await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Delivered);
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert_eq!(world.told(&id).await, FLOWN);
}

#[tokio::test]
async fn after_a_day_an_order_ends_though_its_edge_tells_nothing() {
    for is_over in [false, true] {
        let (world, id, plan) = unheard().await;
        if is_over {
            world
                .edge
                .set(&plan, PlanState::Ended, Some(EndedAs::Delivered));
        } else {
            world.edge.lose_questions(u32::MAX);
        }
        world.pass(601);
        world.assign().await;
        world.pass(23 * 3_600);
        world.assign().await;
        assert_eq!(world.status(&id).await, DeliveryStatus::Created);
        world.pass(3_600);
        world.assign().await;
        assert_eq!(world.status(&id).await, DeliveryStatus::Failed);
        assert!(world.reason(&id).await.contains("did not answer in time"));
        // Where its drone is, nobody knows.
        let drone = world.drone("swift:0").await;
        assert_eq!(drone, ("out_of_service".to_owned(), None));
    }
}

#[tokio::test]
async fn after_a_day_without_news_a_flight_is_over() {
    for (told, status) in [
        (1, DeliveryStatus::Failed),
        (3, DeliveryStatus::Failed),
        (4, DeliveryStatus::Delivered),
    ] {
        let world = World::with_drones(&["depot"]).await;
        let id = world.order("shop", "door").await;
        world.assign().await;
        let flight = world.whole_flight(&id, "depot").await;
        world.tell(1, &flight[..told]).await;
        let before = world.status(&id).await;
        world.pass(23 * 3_600);
        world.assign().await;
        assert_eq!(world.status(&id).await, before, "told {told}");
        assert_eq!(world.drone("swift:0").await.1, Some(id.clone()));
        world.pass(2 * 3_600);
        world.assign().await;
        assert_eq!(world.status(&id).await, status, "told {told}");
        let drone = world.drone("swift:0").await;
        assert_eq!(drone, ("out_of_service".to_owned(), None), "told {told}");
        // What is told of it afterwards changes nothing.
        world.tell(told as u64 + 1, &flight[told..]).await;
        assert_eq!(world.status(&id).await, status, "told {told}");
        assert_eq!(world.drone("swift:0").await, drone, "told {told}");
    }
}

#[tokio::test]
async fn a_flight_that_something_is_told_of_each_day_goes_on() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let flight = world.whole_flight(&id, "depot").await;
    world.tell(1, &flight[..2]).await;
    world.pass(20 * 3_600);
    world.tell(3, &flight[2..3]).await;
    world.pass(20 * 3_600);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::InFlight);
    assert_eq!(world.drone("swift:0").await.0, "in_flight");
}
