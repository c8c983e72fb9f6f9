//! What the news of flights make of deliveries.

use super::world::{EDGE, NETWORK, World};
use skyway::refusal::Code;
use skyway::wire::{
    DeliveryStatus, EdgeNews, EndedAs, FailureNews, FailureType, NewsEntry, PlanState,
};

const ALL: [&str; 5] = [
    "delivery.created",
    "delivery.assigned",
    "delivery.picking_up",
    "delivery.in_flight",
    "delivery.delivered",
];

#[tokio::test]
async fn an_order_is_assigned_picked_up_and_delivered() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    world.assign().await;
    let assigned = world.delivery(&id).await;
    assert_eq!(assigned.status, DeliveryStatus::Assigned);
    // 1,000 m to the shop, 1,500 m to the door, at 16 m/s.
    assert_eq!(
        assigned.promised_at.as_deref(),
        Some("2026-11-27T18:02:36.251Z")
    );
    assert_eq!(assigned.allocation.expect("a drone").cost_m, 5_000.0);
    assert_eq!(
        world.drone("swift:0").await,
        ("assigned".to_owned(), Some(id.clone()))
    );

    let flight = world.whole_flight(&id, "depot").await;
    let statuses = [
        (DeliveryStatus::Assigned, "assigned"),
        (DeliveryStatus::PickingUp, "in_flight"),
        (DeliveryStatus::InFlight, "in_flight"),
        (DeliveryStatus::Delivered, "in_flight"),
        (DeliveryStatus::Delivered, "available"),
    ];
    for ((number, news), (status, drone)) in (1..).zip(flight).zip(statuses) {
        assert_eq!(world.tell(number, &[news]).await, number);
        assert_eq!(world.status(&id).await, status);
        assert_eq!(world.drone("swift:0").await.0, drone);
    }
    let delivered = world.delivery(&id).await;
    let proof = delivered.proof.expect("a proof");
    assert_eq!((proof.lon, proof.lat), (Some(2_500.0), Some(0.0)));
    assert_eq!(world.told(&id).await, ALL);
    assert_eq!(world.drone("swift:0").await.1, None);
}

#[tokio::test]
async fn a_parcel_is_expected_at_its_drop_before_the_pickup_too() {
    for home in ["depot", "door"] {
        let world = World::with_drones(&[home]).await;
        let id = world.order("shop", "door").await;
        world.assign().await;
        let promised = world.delivery(&id).await.expected_at;
        let mut flight = world.whole_flight(&id, home).await;
        let told = "2026-11-27T18:09:00Z".to_owned();
        flight[1].expected_at = told.clone();
        world.tell(1, &flight[..2]).await;
        let picking_up = world.delivery(&id).await;
        assert_eq!(picking_up.status, DeliveryStatus::PickingUp);
        // Where the drop is its home, the one stop of a flight is the pickup.
        let expected = match home {
            "door" => promised,
            _ => Some(told),
        };
        assert_eq!(picking_up.expected_at, expected, "home at {home}");
    }
}

#[tokio::test]
async fn a_drone_that_departs_before_its_edge_has_answered_was_assigned_first() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.edge.lose_answers(1);
    world.assign().await;
    assert_eq!(world.status(&id).await, DeliveryStatus::Created);
    let plan = world.edge.plans().into_keys().next().expect("a plan");
    let departed = world.news_of(&id, plan, PlanState::Activated, 0);
    let expected_at = departed.expected_at.clone();
    world.tell(1, &[departed]).await;
    assert_eq!(world.told(&id).await, ALL[..3]);
    let delivery = world.delivery(&id).await;
    // No answer has promised anything.
    assert_eq!(delivery.promised_at, Some(expected_at));
    let statuses: Vec<DeliveryStatus> = delivery
        .history
        .iter()
        .map(|change| change.status)
        .collect();
    let expected = [
        DeliveryStatus::Created,
        DeliveryStatus::Assigned,
        DeliveryStatus::PickingUp,
    ];
    assert_eq!(statuses, expected);
}

#[tokio::test]
async fn a_drone_that_turns_back_delivers_nothing_and_proves_nothing() {
    // What was told of the flight before it is back home.
    for (told, status) in [(2, DeliveryStatus::Created), (3, DeliveryStatus::Returned)] {
        let world = World::with_drones(&["depot"]).await;
        let id = world.order("shop", "door").await;
        world.assign().await;
        let mut flight = world.whole_flight(&id, "depot").await;
        let mut ended = flight.pop().expect("an end");
        ended.stops_served = flight[told - 1].stops_served;
        flight.truncate(told);
        flight.push(ended);
        world.tell(1, &flight).await;
        let delivery = world.delivery(&id).await;
        assert_eq!((delivery.status, delivery.proof), (status, None));
        assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    }
}

#[tokio::test]
async fn news_are_taken_once_in_whatever_batches_they_come() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let flight = world.whole_flight(&id, "depot").await;
    assert_eq!(world.tell(1, &flight[..2]).await, 2);
    // Again, overlapping, and an early batch late.
    assert_eq!(world.tell(1, &flight[..4]).await, 4);
    assert_eq!(world.tell(1, &flight[..2]).await, 4);
    let before = world.delivery(&id).await;
    assert_eq!(world.tell(2, &flight[1..3]).await, 4);
    assert_eq!(world.delivery(&id).await, before);
    assert_eq!(world.tell(1, &flight).await, 5);
    assert_eq!(world.tell(1, &flight).await, 5);
    assert_eq!(world.told(&id).await, ALL);
    // Another life of the edge's store begins anew, and takes nothing back.
    let mut again = world.numbered(1, &flight);
    again.lineage = 2;
    let taken = world.dispatch.take_news(NETWORK, EDGE, again).await;
    assert_eq!(taken.expect("news").through, 5);
    assert_eq!(world.told(&id).await, ALL);
    assert_eq!(world.drone("swift:0").await.0, "available");
}

#[tokio::test]
async fn an_edge_tells_of_its_own_flights_only() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let before = world.delivery(&id).await;
    let flight = world.whole_flight(&id, "depot").await;
    let news = world.numbered(1, &flight);
    let nowhere = world.dispatch.take_news("nowhere", EDGE, news.clone());
    let refused = nowhere.await.expect_err("no such network");
    assert_eq!(refused.code, Code::NotFound);
    let taken = world.dispatch.take_news(NETWORK, "edge-2", news).await;
    assert_eq!(taken.expect("news").through, 5);
    let mut other = world.news(&id, PlanState::Activated, 1).await;
    other.plan_id.push('x');
    world.tell(1, &[other]).await;
    assert_eq!(world.delivery(&id).await, before);
}

#[tokio::test]
async fn a_flight_that_ends_before_the_pickup_is_flown_anew_three_times_at_most() {
    let world = World::with_drones(&["depot", "roof", "tower", "tower"]).await;
    let id = world.order("shop", "door").await;
    let mut flown = Vec::new();
    for number in 1..=3 {
        world.assign().await;
        assert_eq!(world.status(&id).await, DeliveryStatus::Assigned);
        flown.push(world.drone_of(&id).await);
        let mut over = world.news(&id, PlanState::Ended, 0).await;
        over.ended_as = Some(EndedAs::Cancelled);
        let plan = over.plan_id.clone();
        world
            .edge
            .set(&plan, PlanState::Ended, Some(EndedAs::Cancelled));
        world.tell(number, &[over]).await;
    }
    assert_eq!(flown, ["swift:0", "swift:1", "swift:2"]);
    assert_eq!(world.status(&id).await, DeliveryStatus::Failed);
    assert_eq!(world.drone("swift:0").await, ("available".to_owned(), None));
    let told = world.told(&id).await;
    assert_eq!(
        told.iter()
            .filter(|event| *event == "delivery.assigned")
            .count(),
        3
    );
    assert_eq!(told.last().map(String::as_str), Some("delivery.failed"));
}

#[tokio::test]
async fn recompositions_are_noted_once() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let mut rerouted = world.news(&id, PlanState::Activated, 1).await;
    rerouted.version = 2;
    rerouted.outcome = "rerouted".to_owned();
    rerouted.causes = vec!["zone-7".to_owned()];
    let mut holding = rerouted.clone();
    holding.version = 3;
    holding.outcome = "hold".to_owned();
    holding.holds = true;
    world.tell(1, &[rerouted.clone(), rerouted, holding]).await;
    let delivery = world.delivery(&id).await;
    assert_eq!(delivery.status, DeliveryStatus::Holding);
    let noted = delivery.recompositions.iter();
    let noted: Vec<(u32, &str)> = noted
        .map(|noted| (noted.plan_version, noted.outcome.as_str()))
        .collect();
    assert_eq!(noted, [(2, "rerouted"), (3, "hold")]);
}

#[tokio::test]
async fn recompositions_of_the_next_flight_are_noted_too() {
    let world = World::with_drones(&["depot", "roof"]).await;
    let id = world.order("shop", "door").await;
    for first in [1, 3] {
        world.assign().await;
        let mut rerouted = world.news(&id, PlanState::Activated, 0).await;
        rerouted.version = 2;
        rerouted.outcome = "rerouted".to_owned();
        let mut over = rerouted.clone();
        over.state = PlanState::Ended;
        over.ended_as = Some(EndedAs::Lost);
        world
            .edge
            .set(&over.plan_id, PlanState::Ended, Some(EndedAs::Lost));
        world.tell(first, &[rerouted, over]).await;
    }
    let delivery = world.delivery(&id).await;
    let noted = delivery.recompositions.iter();
    let noted: Vec<u32> = noted.map(|noted| noted.plan_version).collect();
    assert_eq!(noted, [2, 2]);
}

#[tokio::test]
async fn failures_are_rows_and_batches_are_judged() {
    let world = World::with_drones(&[]).await;
    let failure = |number: u64| NewsEntry {
        number,
        at: world.now().to_string(),
        flight: None,
        failure: Some(FailureNews {
            recomposition_id: format!("r{number}"),
            drone_id: None,
            failure_type: FailureType::Navigational,
            segment: Some("shop-door".to_owned()),
            outcome: "rerouted".to_owned(),
            elapsed_us: 12.0,
        }),
    };
    let told = |news: Vec<NewsEntry>| EdgeNews { lineage: 1, news };
    let take = |news| world.dispatch.take_news(NETWORK, EDGE, news);
    assert_eq!(
        take(told((1..=200).map(failure).collect()))
            .await
            .expect("news")
            .through,
        200
    );
    assert_eq!(
        take(told((150..=210).map(failure).collect()))
            .await
            .expect("news")
            .through,
        210
    );
    let counted = world
        .documents
        .count_failures(NETWORK, 0, i64::MAX, 10)
        .await;
    let counted = counted.expect("answers");
    assert_eq!((counted.len(), counted[0].count), (1, 210));
    assert_eq!(counted[0].segment, "shop-door");

    let falling = take(told(vec![failure(300), failure(300)]))
        .await
        .unwrap_err();
    assert_eq!(falling.code, Code::BodyInvalid);
    let too_many = take(told((300..900).map(failure).collect()))
        .await
        .unwrap_err();
    assert_eq!(too_many.code, Code::BodyInvalid);
    assert_eq!(take(told(Vec::new())).await.expect("news").through, 210);
}
