//! Searches, quotes and orders, and who sees them.

use super::world::{NETWORK, OPEN_MAX, SERVICE, World, customer, errand, of};
use jiff::Timestamp;
use serde_json::json;
use skyway::access::Role;
use skyway::intake::PageRequest;
use skyway::refusal::Code;
use skyway::registry::WriteOptions;
use skyway::registry::documents::{Commit, Committed, DocumentKind};
use skyway::wire::{
    DeliveryOrder, DeliveryStatus, Id, OfferRank, ProofOfDelivery, Quote, QuoteRequest, Recipient,
    ServiceSearch,
};
use std::time::Duration;
use tokio::time::timeout;

fn search() -> ServiceSearch {
    ServiceSearch {
        network: NETWORK.to_owned(),
        source: Id::new("shop"),
        destination: Id::new("door"),
        payload_kg: 1.0,
        start_time: None,
        arrive_by: None,
        price_max: None,
        on_time_min_fraction: None,
        rank_by: OfferRank::Price,
    }
}

pub(super) fn quoted() -> QuoteRequest {
    QuoteRequest {
        service_id: SERVICE.to_owned(),
        source: Id::new("shop"),
        destination: Id::new("door"),
        payload_kg: 1.0,
        start_time: None,
        arrive_by: None,
        customer: None,
    }
}

#[tokio::test]
async fn a_search_tells_offers_and_why_others_do_not_fit() {
    let world = World::with_drones(&["depot", "roof"]).await;
    let found = world
        .dispatch
        .search_services(&search())
        .await
        .expect("offers");
    let offer = &found.offers[0];
    assert_eq!((offer.drones, offer.length_m), (2, 1_500.0));
    assert_eq!(offer.price.amount.to_string(), "8.00");
    // The near drone has 1,000 m to the shop.
    assert_eq!(offer.pickup_at, "2026-11-27T18:01:03Z");

    let square = json!([[
        [-10.0, -10.0],
        [2_000.0, -10.0],
        [2_000.0, 10.0],
        [-10.0, 10.0],
        [-10.0, -10.0]
    ]]);
    world
        .put_service(&json!({"area": {"type": "Polygon", "coordinates": square}}))
        .await;
    let found = world
        .dispatch
        .search_services(&search())
        .await
        .expect("offers");
    assert!(found.offers.is_empty());
    assert_eq!(found.passed_over[0].code, "area");
    assert_eq!(found.passed_over[0].text, "node 'door' is outside its area");

    let mut lost = search();
    lost.destination = Id::new("dor");
    let refused = world.dispatch.search_services(&lost).await.unwrap_err();
    assert_eq!(
        (refused.code, refused.faults[0].code.as_str()),
        (Code::PlanInvalid, "unknown_node")
    );
}

#[tokio::test]
async fn a_quote_is_accepted_once_and_in_time() {
    let world = World::with_drones(&["depot"]).await;
    let shop = customer("shop");
    let quote = world
        .dispatch
        .create_quote(&shop, quoted())
        .await
        .expect("a quote");
    assert_eq!(quote.price.amount.to_string(), "8.00");
    assert_eq!(quote.length_m, 1_500.0);
    assert!(world.edge.plans().is_empty());
    let accept = DeliveryOrder {
        quote_id: Some(quote.id.clone()),
        ..DeliveryOrder::default()
    };
    let delivery = world.try_order(&accept).await.expect("an order");
    assert_eq!(delivery.price.as_ref(), Some(&quote.price));
    assert_eq!(delivery.promised_at.as_ref(), Some(&quote.arrives_at));
    let twice = world.try_order(&accept).await.unwrap_err();
    assert_eq!(twice.code, Code::AlreadyExists);
    world.assign().await;
    let assigned = world.delivery(&delivery.id).await;
    assert_eq!(assigned.status, DeliveryStatus::Assigned);
    assert_eq!(assigned.promised_at.as_ref(), Some(&quote.arrives_at));

    world.put_drone("swift:9", "depot").await;
    let late = world
        .dispatch
        .create_quote(&shop, quoted())
        .await
        .expect("a quote");
    let stranger = world
        .dispatch
        .quote(&customer("other"), &late.id)
        .await
        .unwrap_err();
    assert_eq!(stranger.code, Code::NotFound);
    world.pass(300);
    let late = DeliveryOrder {
        quote_id: Some(late.id),
        ..DeliveryOrder::default()
    };
    assert_eq!(
        world.try_order(&late).await.unwrap_err().code,
        Code::QuoteExpired
    );
    let stated_twice = DeliveryOrder {
        payload_kg: Some(2.0),
        ..late
    };
    assert_eq!(
        world.try_order(&stated_twice).await.unwrap_err().code,
        Code::PlanInvalid
    );
}

#[tokio::test]
async fn an_edge_that_hangs_holds_a_few_quotes_and_no_more() {
    let world = World::with_drones(&["depot"]).await;
    world.edge.hang();
    let mut waiting = Vec::new();
    for asked in 1..=8 {
        let dispatch = world.dispatch.clone();
        let mut quote =
            Box::pin(async move { dispatch.create_quote(&customer("shop"), quoted()).await });
        while world.edge.left_hanging() < asked {
            let answered = timeout(Duration::from_millis(20), &mut quote).await;
            assert!(answered.is_err(), "it waits for its edge");
        }
        waiting.push(quote);
    }
    let shop = customer("shop");
    let refused = world.dispatch.create_quote(&shop, quoted());
    assert_eq!(refused.await.unwrap_err().code, Code::EdgeUnavailable);
    // Who goes away leaves a place.
    waiting.pop();
    let mut again = Box::pin(world.dispatch.create_quote(&shop, quoted()));
    while world.edge.left_hanging() < 9 {
        assert!(
            timeout(Duration::from_millis(20), &mut again)
                .await
                .is_err()
        );
    }
}

/// A quote for the shop, from a start time on where one is given.
async fn quote_from(world: &World, start_time: Option<&str>) -> Quote {
    let mut request = quoted();
    request.start_time = start_time.map(str::to_owned);
    let shop = customer("shop");
    let quote = world.dispatch.create_quote(&shop, request);
    quote.await.expect("a quote")
}

pub(super) fn accepting(quote: &Quote) -> DeliveryOrder {
    DeliveryOrder {
        quote_id: Some(quote.id.clone()),
        ..DeliveryOrder::default()
    }
}

#[tokio::test]
async fn a_quote_for_a_time_that_is_past_is_flown_from_now_on() {
    let world = World::with_drones(&["depot"]).await;
    let quote = quote_from(&world, Some("2026-11-27T15:00:00Z")).await;
    let order = world.try_order(&accepting(&quote)).await.expect("an order");
    assert_eq!(order.start_time, "2026-11-27T18:00:00Z");
    world.assign().await;
    assert_eq!(world.status(&order.id).await, DeliveryStatus::Assigned);
}

#[tokio::test]
async fn a_quote_that_is_accepted_late_promises_as_much_later() {
    // When the parcel is ready, and by how many seconds the promise is later where the quote is accepted after 240 s.
    for (start_time, later_s) in [
        (None, 240),
        (Some("2026-11-27T15:00:00Z"), 240),
        (Some("2026-11-27T18:03:00Z"), 60),
        (Some("2026-11-27T19:00:00Z"), 0),
    ] {
        let world = World::with_drones(&["depot"]).await;
        let quote = quote_from(&world, start_time).await;
        world.pass(240);
        let order = world.try_order(&accepting(&quote)).await.expect("an order");
        let instant = |text: &str| text.parse::<Timestamp>().expect("an instant");
        let promised_at = instant(&order.promised_at.expect("a promise"));
        let later = promised_at.duration_since(instant(&quote.arrives_at));
        assert_eq!(later.as_secs(), later_s, "{start_time:?}");
    }
}

#[tokio::test]
async fn a_quote_of_a_service_that_was_deleted_is_not_accepted() {
    let world = World::with_drones(&["depot"]).await;
    let quote = quote_from(&world, None).await;
    let commit = Commit {
        deletes: vec![(DocumentKind::Service, SERVICE.to_owned())],
        ..Commit::default()
    };
    let committed = world.documents.commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
    let refused = world.try_order(&accepting(&quote)).await.unwrap_err();
    assert_eq!(
        (refused.code, refused.faults[0].code.as_str()),
        (Code::NoOffer, "validity")
    );
    // Once it is offered again the quote still holds.
    world.put_service(&json!({})).await;
    world.try_order(&accepting(&quote)).await.expect("an order");
}

#[tokio::test]
async fn a_quote_of_a_provider_that_is_suspended_is_not_accepted() {
    let world = World::with_drones(&["depot"]).await;
    let quote = quote_from(&world, None).await;
    let stands = |state: &'static str| {
        let (world, body) = (&world, json!({"name": "Swift", "state": state}));
        async move {
            world
                .put(DocumentKind::Provider, "swift", state, &body)
                .await
        }
    };
    stands("suspended").await;
    let refused = world.try_order(&accepting(&quote)).await.unwrap_err();
    assert_eq!(
        (refused.code, refused.faults[0].code.as_str()),
        (Code::NoOffer, "suspended")
    );
    stands("active").await;
    world.try_order(&accepting(&quote)).await.expect("an order");
}

#[tokio::test]
async fn without_a_free_drone_there_is_no_quote() {
    let world = World::with_drones(&[]).await;
    let refused = world
        .dispatch
        .create_quote(&customer("shop"), quoted())
        .await
        .unwrap_err();
    assert_eq!(
        (refused.code, refused.faults[0].code.as_str()),
        (Code::NoOffer, "no_drone")
    );
}

#[tokio::test]
async fn the_same_key_orders_once() {
    let world = World::with_drones(&["depot"]).await;
    let shop = customer("shop");
    let options = |fingerprint: &str| WriteOptions {
        subject: shop.subject.to_string(),
        key: Some("order-4711".to_owned()),
        fingerprint: fingerprint.to_owned(),
        ..WriteOptions::default()
    };
    let order = errand("shop", "door");
    let place = |manner| {
        let (dispatch, order, shop) = (world.dispatch.clone(), order.clone(), shop.clone());
        async move { dispatch.create_delivery(&shop, &order, &manner).await }
    };
    let (first, second) = tokio::join!(place(options("one")), place(options("one")));
    let (first, second) = (first.expect("an order"), second.expect("the same"));
    assert_eq!(first, second);
    world.pass(5);
    assert_eq!(place(options("one")).await.expect("the same"), first);
    let other = place(options("two")).await.unwrap_err();
    assert_eq!(other.code, Code::IdempotencyMismatch);
    let page = PageRequest::default();
    let all = world
        .dispatch
        .deliveries(&shop, &page)
        .await
        .expect("a page");
    assert_eq!(all.deliveries.len(), 1);
}

#[tokio::test]
async fn a_customer_has_so_many_orders_at_once_and_no_more() {
    let world = World::with_drones(&[]).await;
    let order = errand("shop", "door");
    let first = world.try_order(&order).await.expect("an order").id;
    for _ in 1..OPEN_MAX {
        world.try_order(&order).await.expect("an order");
    }
    let one_more = world.try_order(&order).await.unwrap_err();
    assert_eq!(one_more.code, Code::LimitReached);
    assert_eq!(one_more.detail, "'shop' has 320 orders that are not over");
    let (other, options) = (customer("other"), WriteOptions::default());
    let of_another = world.dispatch.create_delivery(&other, &order, &options);
    of_another.await.expect("room for others");
    let shop = customer("shop");
    let called_off = world.dispatch.cancel_delivery(&shop, &first);
    called_off.await.expect("it waits");
    world.try_order(&order).await.expect("room again");
}

#[tokio::test]
async fn each_sees_what_is_theirs() {
    let world = World::with_drones(&["depot"]).await;
    let order = DeliveryOrder {
        reference: Some("4711".to_owned()),
        recipient: Some(Recipient {
            name: Some("Ada".to_owned()),
            ..Recipient::default()
        }),
        ..errand("shop", "door")
    };
    let placed = world.try_order(&order).await.expect("an order");
    assert_eq!(placed.recipient, None);
    let id = placed.id;
    world.assign().await;
    let see = |caller| {
        let (dispatch, id) = (world.dispatch.clone(), id.clone());
        async move { dispatch.delivery(&caller, &id).await }
    };
    let own = see(customer("shop")).await.expect("its own");
    assert_eq!(
        own.recipient
            .and_then(|recipient| recipient.name)
            .as_deref(),
        Some("Ada")
    );
    assert!(own.price.is_some());
    let flown = see(of(Role::Provider, "swift")).await.expect("flown by it");
    assert!(flown.recipient.is_none() && flown.price.is_some());
    let watched = see(of(Role::Operator, "local")).await.expect("a flight");
    assert!(watched.recipient.is_none() && watched.price.is_none());
    for (role, tenant) in [
        (Role::Customer, "other"),
        (Role::Provider, "rival"),
        (Role::Edge, "local"),
    ] {
        let refused = see(of(role, tenant)).await.unwrap_err();
        assert_eq!(refused.code, Code::NotFound);
        let page = PageRequest::default();
        let listed = world.dispatch.deliveries(&of(role, tenant), &page).await;
        let is_tenant = role != Role::Edge;
        assert!(!is_tenant || listed.expect("a page").deliveries.is_empty());
    }
}

#[tokio::test]
async fn a_proof_is_completed_by_the_provider_after_the_arrival() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let proof = ProofOfDelivery {
        at: "2026-11-27T18:00:00Z".to_owned(),
        lon: None,
        lat: None,
        photo: Some("https://proofs.example/1.jpg".to_owned()),
        code: Some("2718".to_owned()),
    };
    let (swift, shop) = (of(Role::Provider, "swift"), customer("shop"));
    let early = world
        .dispatch
        .prove_delivery(&swift, &id, &proof)
        .await
        .unwrap_err();
    assert_eq!(early.code, Code::DeliveryStateConflict);
    let flight = world.whole_flight(&id, "depot").await;
    world.tell(1, &flight).await;
    let proved = world
        .dispatch
        .prove_delivery(&swift, &id, &proof)
        .await
        .expect("a proof");
    let kept = proved.proof.expect("a proof");
    assert_eq!(
        (kept.code.as_deref(), kept.lon),
        (Some("2718"), Some(2_500.0))
    );
    let not_its_own = world
        .dispatch
        .prove_delivery(&shop, &id, &proof)
        .await
        .unwrap_err();
    assert_eq!(not_its_own.code, Code::NotFound);
}

#[tokio::test]
async fn a_track_has_a_place_only_while_it_is_flown() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let shop = customer("shop");
    let sighting = skyway::registry::documents::PositionRow {
        drone: "swift:0".to_owned(),
        at_ms: world.now().as_millisecond(),
        lon: 1_200.0,
        lat: 0.0,
        altitude_m: None,
        battery_fraction: Some(0.8),
        speed_mps: None,
    };
    world
        .documents
        .keep_positions(&[sighting])
        .await
        .expect("kept");
    let before = world.dispatch.track(&shop, &id).await.expect("a track");
    assert_eq!(before.place, None);
    let flight = world.whole_flight(&id, "depot").await;
    world.tell(1, &flight[..3]).await;
    let under_way = world.dispatch.track(&shop, &id).await.expect("a track");
    assert_eq!(under_way.status, DeliveryStatus::InFlight);
    assert_eq!(under_way.place.map(|place| place.lon), Some(1_200.0));
    world.tell(4, &flight[3..]).await;
    let after = world.dispatch.track(&shop, &id).await.expect("a track");
    assert_eq!(
        (after.status, after.place),
        (DeliveryStatus::Delivered, None)
    );
    let stranger = world
        .dispatch
        .track(&customer("other"), &id)
        .await
        .unwrap_err();
    assert_eq!(stranger.code, Code::NotFound);
}

#[tokio::test]
async fn an_order_waits_for_a_week_at_most() {
    let world = World::with_drones(&["depot"]).await;
    let mut order = errand("shop", "door");
    order.start_time = Some("2026-11-28T18:00:00Z".to_owned());
    order.arrive_by = Some("2026-12-05T18:00:01Z".to_owned());
    let refused = world.try_order(&order).await.unwrap_err();
    assert_eq!(refused.code, Code::PlanInvalid);
    let fault = &refused.faults[0];
    assert_eq!(
        (fault.code.as_str(), fault.pointer.as_str()),
        ("out_of_range", "/arrive_by")
    );
    assert!(fault.hint.is_some());
    order.arrive_by = Some("2026-12-05T18:00:00Z".to_owned());
    world.try_order(&order).await.expect("an order");
}
