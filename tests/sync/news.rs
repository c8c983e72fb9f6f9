//! What the registry is told of deliveries, failures and drones: in order, once, and also after a time without it.

use crate::memory_disk::MemoryDisk;
use crate::stage::{Central, Outpost, ladder, manner};
use serde_json::json;
use skyway::edge::{Idempotency, Settings};
use skyway::formats::{load_network, write_network};
use skyway::network::{Coordinates, NetworkDraft};
use skyway::wire::{self, EndedAs, PlanState};

/// A delivery from one end of the ladder to the other.
async fn order(outpost: &Outpost, number: usize) {
    let request = json!({
        "id": format!("p{number}"), "drone_id": format!("d{number}"), "delivery_id": format!("order-{number}"),
        "source": "a0", "destination": "a7",
    });
    let request = serde_json::from_value(request).expect("a delivery request");
    let edge = &outpost.edge;
    let plan = edge.compose_plan(&outpost.caller, request, Idempotency::default());
    plan.await.expect("a plan");
}

async fn cancel(outpost: &Outpost, number: usize) {
    let id = format!("p{number}");
    let cancelled = wire::Cancellation::default();
    let over = outpost.edge.cancel_plan(&outpost.caller, &id, cancelled);
    over.await.expect("cancelled");
}

/// The plans of the news that the far end has, with their states.
fn taken(outpost: &Outpost) -> Vec<(String, PlanState)> {
    let news = outpost.line.news_taken().into_iter();
    news.filter_map(|entry| entry.flight)
        .map(|flight| (flight.plan_id, flight.state))
        .collect()
}

async fn until_told(outpost: &Outpost) {
    let all = async || outpost.sync().news == 0;
    outpost.until("all is told", all).await;
}

fn numbers(news: &[wire::NewsEntry]) -> Vec<u64> {
    news.iter().map(|entry| entry.number).collect()
}

#[tokio::test]
async fn news_wait_for_a_registry_that_is_away_and_are_told_in_their_order() {
    let (central, north) = Outpost::alone().await;
    north.line.cut();
    for number in 0..3 {
        order(&north, number).await;
    }
    cancel(&north, 1).await;
    assert_eq!(north.sync().news, 4);
    // A zone does not wait behind them, nor they behind a zone that is not taken.
    north.line.take_no_writes(true);
    north.put_zone("y", 350.0, 100.0, 5.0).await;
    north.line.lead_to(Some(&central.registry));
    until_told(&north).await;
    let of = |number: usize, state| (format!("p{number}"), state);
    let mut told = taken(&north);
    // They depart while the clock goes on.
    told.retain(|(_, state)| *state != PlanState::Activated);
    let steps = [
        of(0, PlanState::Accepted),
        of(1, PlanState::Accepted),
        of(2, PlanState::Accepted),
        of(1, PlanState::Ended),
    ];
    assert_eq!(told, steps);
    assert_eq!(north.sync().outbox, 1);
    let taken = numbers(&north.line.news_taken());
    let sent = north.line.news_sent().into_iter();
    let sent: Vec<u64> = sent.flat_map(|batch| numbers(&batch.news)).collect();
    assert_eq!(sent, taken, "each was sent once");
    north.end().await;
}

#[tokio::test]
async fn what_was_lost_on_its_way_back_is_sent_again_and_taken_once() {
    let (_central, north) = Outpost::alone().await;
    north.line.lose_answers(true);
    order(&north, 0).await;
    let sent_thrice = async || north.line.news_sent().len() > 2;
    north.until("it is sent again", sent_thrice).await;
    north.line.lose_answers(false);
    until_told(&north).await;
    let accepted = taken(&north).into_iter();
    let accepted = accepted.filter(|(_, state)| *state == PlanState::Accepted);
    assert_eq!(accepted.count(), 1);
    north.end().await;
}

#[tokio::test]
async fn news_survive_a_crash_of_the_edge() {
    let central = Central::open().await;
    let disk = MemoryDisk::default();
    let north = Outpost::over(&central.registry, "north", &disk).await;
    north.settle(&central).await;
    north.line.cut();
    order(&north, 0).await;
    cancel(&north, 0).await;
    north.stored().await;
    let north = north.crash("north", &disk).await;
    assert_eq!(north.sync().news, 2);
    north.line.lead_to(Some(&central.registry));
    until_told(&north).await;
    let last = north.line.news_taken().pop().expect("news");
    let flight = last.flight.expect("a flight");
    assert_eq!(flight.ended_as, Some(EndedAs::Cancelled));
    let lineages = north.line.news_sent();
    assert_eq!(lineages[0].lineage, 7, "that of the first start");
    north.end().await;
}

#[tokio::test]
async fn one_that_the_registry_will_never_take_holds_no_other_up() {
    let (central, north) = Outpost::alone().await;
    north.line.cut();
    for number in 0..5 {
        order(&north, number).await;
    }
    let waiting: Vec<u64> = numbers(&north.edge.snapshot().news().cloned().collect::<Vec<_>>());
    north.line.refuse_news(waiting[2]);
    north.line.lead_to(Some(&central.registry));
    until_told(&north).await;
    let taken = numbers(&north.line.news_taken());
    let others: Vec<u64> = waiting
        .iter()
        .copied()
        .filter(|it| *it != waiting[2])
        .collect();
    assert_eq!(taken[..4], others);
    assert_eq!(north.sync().news_lost, 1);
    north.end().await;
}

#[tokio::test]
async fn no_more_than_five_hundred_go_at_once() {
    let (central, north) = Outpost::alone().await;
    north.line.cut();
    for number in 0..300 {
        order(&north, number).await;
        cancel(&north, number).await;
    }
    north.line.lead_to(Some(&central.registry));
    until_told(&north).await;
    let batches = north.line.news_sent().into_iter();
    let batches: Vec<usize> = batches.map(|batch| batch.news.len()).collect();
    assert_eq!(batches, [500, 100]);
    north.end().await;
}

/// The ladder, on earth.
fn on_earth() -> NetworkDraft {
    let mut draft = ladder();
    for node in &mut draft.nodes {
        node.position = [
            151.2 + node.position[0] / 92_000.0,
            -33.8 + node.position[1] / 111_000.0,
        ];
    }
    draft.coordinates = Coordinates::Geographic;
    draft
}

async fn see(outpost: &Outpost, drone: &str, second: i64) {
    let at = outpost.edge.clock().now() + jiff::SignedDuration::from_millis(second);
    let positions = vec![json!({
        "drone_id": drone, "location": [151.2, -33.8], "timestamp": at.to_string(), "battery_fraction": 0.5,
    })];
    let batch = wire::Telemetry { positions };
    let told = outpost.edge.telemetry(&outpost.caller, batch).await;
    assert!(told.expect("telemetry").positions[0].accepted);
}

/// An edge over a network at the registry whose places are on earth.
async fn on_earth_behind(central: &Central) -> Outpost {
    let text = write_network(&on_earth());
    let loaded = load_network(&text).expect("a network");
    let put = central
        .registry
        .put_network("earth", &text, &manner(None))
        .await;
    put.expect("a network");
    let north = Outpost::on(&central.registry, "earth", (loaded.topology, text));
    let is_read = async || north.edge.stamp().registry_revision.is_some();
    north.until("the registry is read", is_read).await;
    north
}

#[tokio::test]
async fn positions_that_are_too_many_at_once_are_told_in_parts() {
    let central = Central::open().await;
    let north = on_earth_behind(&central).await;
    north.line.refuse_positions_from(4);
    north.line.take_no_positions(true);
    for number in 0..9 {
        see(&north, "d", number).await;
    }
    north.line.take_no_positions(false);
    let all = async || north.sync().positions == 0;
    north.until("all are told", all).await;
    let batches = north.line.positions_taken();
    let taken: usize = batches.iter().map(|batch| batch.positions.len()).sum();
    let left_out: u64 = batches.iter().map(|batch| batch.left_out).sum();
    assert_eq!((taken, left_out), (9, 0));
    north.end().await;
}

#[tokio::test]
async fn positions_are_told_within_a_second_and_again_until_they_are_taken() {
    let central = Central::open().await;
    let north = on_earth_behind(&central).await;
    north.line.take_no_positions(true);
    for number in 0..3 {
        see(&north, "d", number).await;
    }
    let has_failed = async || {
        north
            .sync()
            .failures
            .get("transport")
            .is_some_and(|it| *it > 1)
    };
    north.until("they are not taken", has_failed).await;
    assert_eq!(north.sync().positions, 3, "they wait");
    north.line.take_no_positions(false);
    let before = north.edge.clock().now();
    let all = async || north.sync().positions == 0 && !north.line.positions_taken().is_empty();
    north.until("they are taken", all).await;
    let took = north.edge.clock().now().duration_since(before);
    assert!(took.as_millis() <= 1_000, "{took}");
    let batches = north.line.positions_taken();
    let entries: Vec<_> = batches.iter().flat_map(|batch| &batch.positions).collect();
    assert_eq!(entries.len(), 3);
    let first = entries[0];
    assert_eq!(
        (&*first.drone_id, first.lon, first.lat),
        ("d", 151.2, -33.8)
    );
    assert_eq!(first.battery_fraction, Some(0.5));
    assert!(entries.is_sorted_by_key(|entry| entry.at_ms));
    north.end().await;
}

#[tokio::test]
async fn places_that_are_not_on_earth_are_not_told() {
    let central = Central::open().await;
    let north = Outpost::with(&central.registry, "north", Settings::default());
    north.settle(&central).await;
    let positions = vec![json!({"drone_id": "d", "location": {"x": 10.0, "y": 0.0}})];
    let batch = wire::Telemetry { positions };
    let told = north.edge.telemetry(&north.caller, batch).await;
    assert!(told.expect("telemetry").positions[0].accepted);
    assert_eq!(north.sync().positions, 0);
    north.end().await;
}
