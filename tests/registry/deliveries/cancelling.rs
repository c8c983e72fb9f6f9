//! Orders called off, in every state and in every order of events.

use super::world::{World, customer};
use skyway::refusal::Code;
use skyway::wire::{DeliveryStatus, EndedAs, PlanState};

#[tokio::test]
async fn an_order_that_waits_is_called_off_at_once() {
    let world = World::with_drones(&[]).await;
    let id = world.order("shop", "door").await;
    let shop = customer("shop");
    let cancelled = world.dispatch.cancel_delivery(&shop, &id).await;
    assert_eq!(
        cancelled.expect("cancelled").status,
        DeliveryStatus::Cancelled
    );
    let again = world.dispatch.cancel_delivery(&shop, &id).await;
    assert_eq!(again.expect("the same").status, DeliveryStatus::Cancelled);
    assert_eq!(
        world.told(&id).await,
        ["delivery.created", "delivery.cancelled"]
    );
}

#[tokio::test]
async fn a_flight_on_the_ground_is_called_off_by_its_edge() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let mut over = world.news(&id, PlanState::Ended, 0).await;
    let cancelled = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    let cancelled = cancelled.expect("cancelled");
    assert_eq!(cancelled.status, DeliveryStatus::Cancelled);
    assert_eq!(cancelled.expected_at, None);
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    assert!(world.edge.plans().values().all(|plan| !plan.is_active()));
    // The next order has the drone; then the edge tells what it has done.
    let next = world.order("shop", "door").await;
    world.assign().await;
    over.ended_as = Some(EndedAs::Cancelled);
    world.tell(1, &[over]).await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Cancelled);
    assert_eq!(
        world.drone("swift:0").await,
        ("assigned".to_owned(), Some(next))
    );
}

#[tokio::test]
async fn a_drone_that_has_departed_flies_on() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let flight = world.whole_flight(&id, "depot").await;
    // The registry does not know yet.
    world
        .edge
        .set(&flight[0].plan_id, PlanState::Activated, None);
    let refused = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    assert_eq!(refused.unwrap_err().code, Code::DeliveryStateConflict);
    assert!(world.reason(&id).await.contains("departed"));
    world.tell(1, &flight[..2]).await;
    let refused = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    assert_eq!(refused.unwrap_err().code, Code::DeliveryStateConflict);
    world.tell(3, &flight[2..]).await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Delivered);
}

#[tokio::test]
async fn a_drone_that_departs_while_its_order_is_called_off_flies_on() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let flight = world.whole_flight(&id, "depot").await;
    world.edge.lose_questions(1);
    let waiting = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    assert_eq!(
        waiting.expect("being called off").status,
        DeliveryStatus::Assigned
    );
    world.tell(1, &flight[..2]).await;
    let refused = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    assert_eq!(refused.unwrap_err().code, Code::DeliveryStateConflict);
    world.tell(3, &flight[2..]).await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Delivered);
}

#[tokio::test]
async fn while_the_edge_is_silent_it_is_being_called_off() {
    let world = World::with_drones(&["depot"]).await;
    world.edge.lose_answers(1);
    let id = world.order("shop", "door").await;
    world.assign().await;
    world.edge.lose_questions(2);
    let waiting = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    let waiting = waiting.expect("being called off");
    assert_eq!(waiting.status, DeliveryStatus::Created);
    assert!(
        waiting
            .reason
            .unwrap_or_default()
            .contains("being called off")
    );
    for _ in 0..3 {
        world.pass(5);
        world.assign().await;
    }
    assert_eq!(world.status(&id).await, DeliveryStatus::Cancelled);
    assert!(world.edge.plans().values().all(|plan| !plan.is_active()));
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
}

/// Its drone may be under way with the parcel.
#[tokio::test]
async fn a_flight_that_its_edge_has_forgotten_is_not_taken_for_called_off() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    world.edge.forget();
    let waiting = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    let waiting = waiting.expect("being called off");
    assert_eq!(waiting.status, DeliveryStatus::Assigned);
    let reason = waiting.reason.unwrap_or_default();
    assert!(reason.contains("may have been flown"), "{reason}");
    assert_eq!(world.drone("swift:0").await.0, "assigned");
    world.pass(24 * 3_600);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Failed);
    let drone = world.drone("swift:0").await;
    assert_eq!(drone, ("out_of_service".to_owned(), None));
}

#[tokio::test]
async fn an_edge_that_ends_it_first_and_an_order_called_off_agree() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let mut over = world.news(&id, PlanState::Ended, 0).await;
    over.ended_as = Some(EndedAs::Cancelled);
    world.edge.lose_questions(1);
    let waiting = world.dispatch.cancel_delivery(&customer("shop"), &id).await;
    assert_eq!(
        waiting.expect("being called off").status,
        DeliveryStatus::Assigned
    );
    world.tell(1, &[over]).await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Cancelled);
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    world.pass(10);
    world.assign().await;
    let events = [
        "delivery.created",
        "delivery.assigned",
        "delivery.cancelled",
    ];
    assert_eq!(world.told(&id).await, events);
}

#[tokio::test]
async fn nobody_calls_off_what_another_has_ordered() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    for stranger in ["other", "swift"] {
        let refused = world
            .dispatch
            .cancel_delivery(&customer(stranger), &id)
            .await;
        assert_eq!(refused.unwrap_err().code, Code::NotFound);
    }
}
