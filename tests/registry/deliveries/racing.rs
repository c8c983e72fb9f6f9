//! Two processes over one store, at the same time.

use super::world::{EDGE, NETWORK, World, customer};
use skyway::network::Seeded;
use skyway::wire::{Customer, DeliveryStatus, EndedAs, FlightNews, PlanState};
use std::collections::{BTreeMap, BTreeSet};

/// Worlds per run; `SKYWAY_CASES` multiplies them.
#[expect(clippy::disallowed_methods, reason = "the one knob of long test runs")]
fn worlds() -> u64 {
    let factor = std::env::var("SKYWAY_CASES").ok();
    8 * factor
        .and_then(|factor| factor.parse::<u64>().ok())
        .unwrap_or(1)
}

/// A number below a small bound.
fn below(seeded: &mut Seeded, bound: usize) -> usize {
    usize::from(seeded.below(u16::try_from(bound).expect("a small bound")))
}

fn drawn<'a>(seeded: &mut Seeded, from: &[&'a str]) -> &'a str {
    from[below(seeded, from.len())]
}

/// Each drone has one order at most, each flight an order that knows of it.
async fn check(world: &World, orders: &[String], seed: u64) {
    let mut drones: BTreeMap<String, String> = BTreeMap::new();
    for id in orders {
        let delivery = world.delivery(id).await;
        if delivery.status != DeliveryStatus::Assigned {
            continue;
        }
        let drone = delivery.allocation.expect("a drone").drone_id;
        let before = drones.insert(drone.clone(), id.clone());
        assert_eq!(before, None, "seed {seed}: drone {drone} twice");
        let stands = world.drone(&drone).await;
        assert_eq!(
            stands,
            ("assigned".to_owned(), Some(id.clone())),
            "seed {seed}"
        );
    }
    let mut flown = BTreeSet::new();
    for (plan, there) in world.edge.plans() {
        if !there.is_active() {
            continue;
        }
        assert!(
            flown.insert(there.drone.clone()),
            "seed {seed}: {} twice",
            there.drone
        );
        let delivery = world.delivery(&there.delivery).await;
        let known = delivery.allocation.map(|allocation| allocation.plan_id);
        assert_eq!(
            known.as_ref(),
            Some(&plan),
            "seed {seed}: a flight that nobody knows of"
        );
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_drone_is_assigned_twice() {
    const NODES: [&str; 5] = ["depot", "shop", "door", "hut", "roof"];
    for seed in 0..worlds() {
        let mut seeded = Seeded::new(seed);
        let homes: Vec<&str> = (0..1 + below(&mut seeded, 5))
            .map(|_| drawn(&mut seeded, &NODES))
            .collect();
        let world = World::with_drones(&homes).await;
        let another = world.another().await;
        let mut orders = Vec::new();
        for _ in 0..1 + below(&mut seeded, 8) {
            let source = drawn(&mut seeded, &NODES);
            orders.push(world.order(source, "tower").await);
        }
        world
            .edge
            .lose_answers(u32::try_from(below(&mut seeded, 3)).expect("few"));
        let cancelled = orders[below(&mut seeded, orders.len())].clone();
        for round in 0..6 {
            let one = tokio::spawn({
                let dispatch = world.dispatch.clone();
                async move { dispatch.assign_now().await }
            });
            let other = tokio::spawn({
                let dispatch = another.dispatch.clone();
                async move { dispatch.assign_now().await }
            });
            if round == 1 {
                let shop = customer("shop");
                let called_off = another.dispatch.cancel_delivery(&shop, &cancelled).await;
                called_off.expect("its drone is on the ground");
            }
            one.await.expect("no panic").expect("the store answers");
            other.await.expect("no panic").expect("the store answers");
            world.pass(3);
        }
        check(&world, &orders, seed).await;
        let status = world.status(&cancelled).await;
        assert_eq!(status, DeliveryStatus::Cancelled, "seed {seed}");
        let mut assigned = 0;
        for id in &orders {
            assigned += usize::from(world.status(id).await == DeliveryStatus::Assigned);
        }
        let expected = (orders.len() - 1).min(homes.len());
        assert_eq!(
            assigned,
            expected,
            "seed {seed}: of {} orders",
            orders.len()
        );
    }
}

fn drawn_news(seeded: &mut Seeded, like: &FlightNews) -> FlightNews {
    let states = [
        PlanState::Accepted,
        PlanState::Activated,
        PlanState::Nonconforming,
        PlanState::Contingent,
        PlanState::Ended,
    ];
    let ends = [
        EndedAs::Delivered,
        EndedAs::Diverted,
        EndedAs::Cancelled,
        EndedAs::Lost,
    ];
    let state = states[below(seeded, states.len())];
    FlightNews {
        state,
        ended_as: (state == PlanState::Ended).then(|| ends[below(seeded, ends.len())]),
        stops_served: u32::try_from(below(seeded, 3)).expect("few"),
        holds: below(seeded, 3) == 0,
        landed_on: Some(drawn(seeded, &["depot", "shop", "roof"]).to_owned()),
        ..like.clone()
    }
}

/// A customer is changed and its data are deleted at the same time, both in the version that was seen: one is done.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn data_are_deleted_in_no_other_version_than_that_which_was_seen() {
    for seed in 0..worlds() {
        let world = World::with_drones(&[]).await;
        let another = world.another().await;
        let shop = customer("shop");
        for round in 0..5 {
            let draft = Customer {
                id: None,
                name: format!("Shop {round}"),
                contact: None,
            };
            let made = world.dispatch.put_entry(&shop, "shop", &draft, None).await;
            let tag = made.expect("a customer").etag;
            let (dispatch, caller, seen) = (another.dispatch.clone(), shop.clone(), tag.clone());
            let deleted = tokio::spawn(async move {
                let deleted = dispatch.delete_customer_data(&caller, "shop", Some(seen));
                deleted.await
            });
            let changed = world
                .dispatch
                .put_entry(&shop, "shop", &draft, Some(tag))
                .await;
            let deleted = deleted.await.expect("no panic");
            let done = (changed.is_ok(), deleted.is_ok());
            assert!(done.0 != done.1, "seed {seed}: {done:?}");
            let rest = world.dispatch.delete_customer_data(&shop, "shop", None);
            rest.await.expect("the store answers");
        }
    }
}

/// Two processes take the same news at the same time; each is taken once, and a final status stays.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn news_are_taken_once_by_two() {
    for seed in 0..worlds() {
        let mut seeded = Seeded::new(seed);
        let world = World::with_drones(&["depot"]).await;
        let another = world.another().await;
        let id = world.order("shop", "door").await;
        world.assign().await;
        let like = world.news(&id, PlanState::Accepted, 0).await;
        let news: Vec<FlightNews> = (0..30).map(|_| drawn_news(&mut seeded, &like)).collect();
        let mut last = None;
        for (first, part) in (1_u64..).step_by(5).zip(news.chunks(5)) {
            let batch = world.numbered(first, part);
            let take = |dispatch: &std::sync::Arc<skyway::dispatch::Dispatch>| {
                let (dispatch, batch) = (dispatch.clone(), batch.clone());
                tokio::spawn(async move { dispatch.take_news(NETWORK, EDGE, batch).await })
            };
            let (one, other) = (take(&world.dispatch), take(&another.dispatch));
            for taken in [one, other] {
                let taken = taken.await.expect("no panic").expect("news");
                assert_eq!(taken.through, first + 4, "seed {seed}");
            }
            let status = world.status(&id).await;
            if let Some(last) = last.filter(|last: &DeliveryStatus| last.is_final()) {
                assert_eq!(status, last, "seed {seed}");
            }
            last = Some(status);
        }
        let delivery = world.delivery(&id).await;
        let told = world.told(&id).await;
        let history = delivery.history.iter();
        let expected: Vec<String> = history
            .map(|change| format!("delivery.{}", change.status.name()))
            .collect();
        assert_eq!(told, expected, "seed {seed}");
    }
}
