//! What edges tell of flights, and what that makes of deliveries.
//!
//! An edge numbers its news and sends them in order, again and again until it is told how far they were taken. They are taken
//! a few at a time, each part in one commit with the mark of how far that is: so each is taken once, by any process.

use super::Dispatch;
use super::records::{Asking, Kept, Order};
use jiff::Timestamp;
use skyway_contract::{
    DeliveryStatus, EdgeNews, EndedAs, FailureNews, FleetDrone, FlightNews, NewsEntry, NewsTaken,
    PlanState, ProofOfDelivery, RecomposedFlight,
};
use skyway_market::status::{Standing, Terms, fold};
use skyway_registry::documents::{
    Commit, Committed, Document, DocumentKind, FailureRow, Message, NewsMark,
};
use skyway_registry::store::StoreError;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The most news in a batch.
const NEWS_MAX: usize = 500;
/// The most that are taken in one commit; fewer where others get in between.
const TAKEN_AT_ONCE: usize = 64;
/// How often a part is decided anew because others got in between.
const DECISIONS: u32 = 32;
/// How often a delivery is flown for, where its flights end before the pickup.
const FLIGHTS_MAX: u32 = 3;
/// The most recompositions that are kept of a delivery.
const RECOMPOSITIONS_MAX: usize = 100;
/// The longest segment and outcome of a failure, in bytes.
const FAILURE_WORD_BYTES_MAX: usize = 512;

/// Whose news they are.
#[derive(Clone, Copy)]
struct Teller<'a> {
    network: &'a str,
    edge: &'a str,
    lineage: u64,
}

/// What a part of the news changes, on what was read.
#[derive(Default)]
struct Taking {
    orders: BTreeMap<String, Option<Kept<Order>>>,
    drones: BTreeMap<String, Option<Kept<FleetDrone>>>,
    changed_orders: BTreeMap<String, Document>,
    changed_drones: BTreeMap<String, Document>,
    messages: Vec<Message>,
    failures: Vec<FailureRow>,
}

impl Dispatch {
    /// Takes the news of an edge, those that were not taken before. Tells how far they are taken.
    ///
    /// # Errors
    /// When the batch is not valid, or the store does not answer; what was taken before that stays so.
    pub async fn take_news(
        self: &Arc<Self>,
        network: &str,
        edge: &str,
        news: EdgeNews,
    ) -> Result<NewsTaken, Refusal> {
        check(&news)?;
        self.registry.topology(network).await?;
        let teller = Teller {
            network,
            edge,
            lineage: news.lineage,
        };
        let mut at_once = TAKEN_AT_ONCE;
        let mut moved = 0;
        loop {
            let through = self
                .documents
                .news_through(network, edge, news.lineage)
                .await?;
            let first = news.news.partition_point(|entry| entry.number <= through);
            let last = (first + at_once).min(news.news.len());
            let part = &news.news[first..last];
            let Some(end) = part.last() else {
                return Ok(NewsTaken { through });
            };
            let mark = NewsMark {
                network: network.to_owned(),
                edge: edge.to_owned(),
                lineage: news.lineage,
                before: through,
                through: end.number,
            };
            if self.take_part(&teller, part, mark).await? {
                continue;
            }
            moved += 1;
            if moved >= DECISIONS {
                return Err(StoreError::Contended.into());
            }
            at_once = (at_once / 2).max(1);
        }
    }

    /// Takes a part of the news. Tells whether it was done: not where something it was decided on has moved.
    async fn take_part(
        &self,
        teller: &Teller<'_>,
        part: &[NewsEntry],
        mark: NewsMark,
    ) -> Result<bool, Refusal> {
        let mut taking = Taking::default();
        for entry in part {
            // It was checked before.
            let at: Timestamp = entry.at.parse().unwrap_or_default();
            if let Some(failure) = &entry.failure {
                let row = failure_row(teller, entry.number, at, failure);
                taking.failures.push(row);
            }
            if let Some(flight) = &entry.flight {
                self.take_flight(teller, flight, at, &mut taking).await?;
            }
        }
        let (orders, drones) = (taking.orders.into_values(), taking.drones.into_values());
        let seen_orders = orders.flatten().map(|order| order.seen());
        let seen_drones = drones.flatten().map(|drone| drone.seen());
        let is_told = !taking.messages.is_empty();
        let frees = !taking.changed_drones.is_empty();
        let puts = taking.changed_orders.into_values();
        let commit = Commit {
            seen: seen_orders.chain(seen_drones).collect(),
            puts: puts.chain(taking.changed_drones.into_values()).collect(),
            messages: taking.messages,
            failures: taking.failures,
            news: Some(mark),
            ..Commit::default()
        };
        if self.documents.commit(&commit).await? != Committed::Done {
            return Ok(false);
        }
        if is_told {
            self.messages.notify_one();
        }
        if frees || is_told {
            self.orders.notify_one();
        }
        Ok(true)
    }

    /// What the news of a flight change: its delivery, if it is flown for that by this edge, and its drone.
    async fn take_flight(
        &self,
        teller: &Teller<'_>,
        flight: &FlightNews,
        at: Timestamp,
        taking: &mut Taking,
    ) -> Result<(), Refusal> {
        let id = &flight.delivery_id;
        if !taking.orders.contains_key(id) {
            let kind = DocumentKind::Delivery;
            let document = self.documents.document(kind, id).await?;
            let order = document.map(Kept::read).transpose()?;
            taking.orders.insert(id.clone(), order);
        }
        let Some(Some(order)) = taking.orders.get_mut(id) else {
            tracing::debug!(edge = teller.edge, delivery = id, "news of no delivery");
            return Ok(());
        };
        if !is_its_flight(&order.value, teller, flight) {
            tracing::debug!(edge = teller.edge, delivery = id, "news of another flight");
            return Ok(());
        }
        let now = self.clock.now();
        // An edge whose clock is ahead must not date what comes after its news.
        let at = at.min(now);
        let drone = order.value.drone_id().map(str::to_owned);
        let before = order.value.clone();
        if assign_first(&mut order.value, flight, at) {
            let told = self.status_messages(&order.value).await?;
            taking.messages.extend(told);
        }
        let (standing, is_told) = apply(&mut order.value, flight, at, now);
        if is_told {
            let told = self.status_messages(&order.value).await?;
            taking.messages.extend(told);
        }
        if order.value != before {
            taking.changed_orders.insert(id.clone(), order.next(now));
        }
        let Some(drone) = drone else {
            return Ok(());
        };
        self.take_drone(&drone, flight, &standing, taking).await
    }

    async fn take_drone(
        &self,
        id: &str,
        flight: &FlightNews,
        standing: &Standing,
        taking: &mut Taking,
    ) -> Result<(), Refusal> {
        let Some(state) = standing.drone else {
            return Ok(());
        };
        if !taking.drones.contains_key(id) {
            let kind = DocumentKind::Drone;
            let document = self.documents.document(kind, id).await?;
            let drone = document.map(Kept::read).transpose()?;
            taking.drones.insert(id.to_owned(), drone);
        }
        let Some(Some(drone)) = taking.drones.get_mut(id) else {
            return Ok(());
        };
        let delivery = flight.delivery_id.as_str();
        if drone.value.delivery_id.as_deref() != Some(delivery) {
            return Ok(());
        }
        let is_back_as_told = flight.state != PlanState::Contingent && flight.outcome != "diverted";
        let delivery = (!standing.is_over).then_some(delivery);
        let free_at = drone.value.free_at.clone().filter(|_| is_back_as_told);
        let is_as_before = drone.value.state == state
            && drone.value.delivery_id.as_deref() == delivery
            && drone.value.free_at == free_at;
        if is_as_before {
            return Ok(());
        }
        drone.value.free_at = free_at;
        drone.set(state, delivery);
        let document = drone.next(self.clock.now());
        taking.changed_drones.insert(id.to_owned(), document);
        Ok(())
    }
}

fn check(news: &EdgeNews) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    if news.news.len() > NEWS_MAX {
        let message = format!("{} are more than {NEWS_MAX} news", news.news.len());
        faults.add("too_many", "/news", message, None);
    }
    for (place, entry) in news.news.iter().enumerate().take(NEWS_MAX) {
        faults.instant(&format!("/news/{place}/at"), Some(&entry.at));
        let before = place.checked_sub(1).map(|before| news.news[before].number);
        if entry.number == 0 || before.is_some_and(|before| before >= entry.number) {
            let message = format!("{} does not rise", entry.number);
            faults.add(
                "not_rising",
                &format!("/news/{place}/number"),
                message,
                None,
            );
        }
        if let Some(failure) = &entry.failure {
            let below = |name: &str| format!("/news/{place}/failure/{name}");
            let segment = failure.segment.as_deref();
            faults.text(&below("segment"), segment, FAILURE_WORD_BYTES_MAX);
            let outcome = Some(&*failure.outcome);
            faults.text(&below("outcome"), outcome, FAILURE_WORD_BYTES_MAX);
        }
        if let Some(flight) = &entry.flight {
            let pointer = format!("/news/{place}/flight/expected_at");
            faults.instant(&pointer, Some(&flight.expected_at));
        }
    }
    faults.check(Code::BodyInvalid, "news")
}

/// Whether a flight is the one that a delivery has, and this edge the one that has its plan.
fn is_its_flight(order: &Order, teller: &Teller<'_>, flight: &FlightNews) -> bool {
    let allocation = order.delivery.allocation.as_ref();
    order.delivery.network == teller.network
        && allocation.is_some_and(|allocation| {
            allocation.edge == teller.edge && allocation.plan_id == flight.plan_id
        })
}

/// A drone may depart before the edge's answer has come that it takes the flight on, or calls it off: then it was assigned
/// first. Tells whether that is another status.
fn assign_first(order: &mut Order, flight: &FlightNews, at: Timestamp) -> bool {
    let waits_for_answer = match order.dispatch.asking {
        Asking::Nothing => false,
        Asking::Reserving => true,
        Asking::CallingOff => flight.ended_as != Some(EndedAs::Cancelled),
    };
    let is_created = order.delivery.status == DeliveryStatus::Created;
    if !is_created || !waits_for_answer || flight.state == PlanState::Accepted {
        return false;
    }
    order.dispatch.flights += 1;
    order.set_status(DeliveryStatus::Assigned, None, at, Some(flight.version))
}

/// Applies the news of its flight to an order. Tells how it stands, and whether that is another status.
fn apply(
    order: &mut Order,
    flight: &FlightNews,
    at: Timestamp,
    now: Timestamp,
) -> (Standing, bool) {
    // That it is taken on, the edge's answer says, with the times that are promised.
    let is_only_accepted = flight.state == PlanState::Accepted;
    let before = order.delivery.status;
    // Who has departed is not called off any more, whatever an edge answers to that.
    if !before.is_final() && is_under_way(flight) {
        order.dispatch.is_called_off = false;
    }
    let standing = fold(
        &Terms {
            status: before,
            pickup: order.delivery.source.text(),
            drop: order.delivery.destination.text(),
            home: &order.dispatch.home,
            is_called_off: order.dispatch.is_called_off,
            may_retry: !order.dispatch.is_called_off
                && !order.dispatch.is_given_up
                && order.dispatch.flights < FLIGHTS_MAX
                && now < order.waits_until(),
        },
        flight,
    );
    if is_only_accepted {
        note_orphan(order, now);
        return (standing, false);
    }
    order.dispatch.asking = Asking::Nothing;
    order.dispatch.is_given_up = false;
    if before.is_final() {
        return (standing, false);
    }
    // Where no answer of the edge has promised an arrival, these are its times, as long as the drop is still to come.
    let is_before_drop = is_under_way(flight) && flight.stops_served < flight.stops;
    if is_before_drop && leads_to_drop(order, flight) {
        let promised_at = &mut order.delivery.promised_at;
        promised_at.get_or_insert_with(|| flight.expected_at.clone());
    }
    // The drop comes next once the parcel is on board.
    let is_on_board = matches!(
        standing.status,
        DeliveryStatus::InFlight | DeliveryStatus::Holding
    );
    if !standing.is_over && (is_on_board || leads_to_drop(order, flight)) {
        order.delivery.expected_at = Some(flight.expected_at.clone());
    }
    note_recomposition(order, flight, at);
    if standing.status == DeliveryStatus::Delivered {
        order.delivery.proof = Some(proof(flight, at));
    }
    if standing.status == DeliveryStatus::Created {
        let drone = order.drone_id().unwrap_or_default().to_owned();
        order.dispatch.pass_over(&drone, now);
        order.release();
    }
    let version = Some(flight.version);
    let reason = standing.reason.clone();
    let is_told = order.set_status(standing.status, reason, at, version);
    (standing, is_told)
}

/// Whether the drone of a flight has departed and is not back.
fn is_under_way(flight: &FlightNews) -> bool {
    match flight.state {
        PlanState::Activated | PlanState::Nonconforming | PlanState::Contingent => true,
        PlanState::Accepted | PlanState::Ended => false,
    }
}

/// Whether an edge tells of a flight when it arrives at the drop, also before the pickup: not where that is where the flight
/// ends, nor where the drone lands elsewhere.
fn leads_to_drop(order: &Order, flight: &FlightNews) -> bool {
    order.delivery.destination.text() != order.dispatch.home && flight.outcome != "diverted"
}

/// A flight that was taken on after its order was over is called off.
fn note_orphan(order: &mut Order, now: Timestamp) {
    if order.delivery.status.is_final() && order.dispatch.asking == Asking::Nothing {
        order.ask_to_call_off(now);
    }
}

/// Notes a version that another one was recomposed into, once.
fn note_recomposition(order: &mut Order, flight: &FlightNews, at: Timestamp) {
    let noted = match order.dispatch.noted_version {
        // Of an order that was stored before this was counted.
        0 if order.dispatch.flights <= 1 => {
            let last = order.delivery.recompositions.last();
            last.map_or(0, |last| last.plan_version)
        }
        noted => noted,
    };
    if noted >= flight.version || flight.outcome == "composed" {
        return;
    }
    order.dispatch.noted_version = flight.version;
    if order.delivery.recompositions.len() >= RECOMPOSITIONS_MAX {
        order.delivery.recompositions.remove(0);
    }
    let expected_at = order.delivery.expected_at.clone();
    order.delivery.recompositions.push(RecomposedFlight {
        at: at.to_string(),
        plan_version: flight.version,
        outcome: flight.outcome.clone(),
        causes: flight.causes.clone(),
        expected_at: expected_at.unwrap_or_else(|| flight.expected_at.clone()),
    });
}

fn proof(flight: &FlightNews, at: Timestamp) -> ProofOfDelivery {
    let [lon, lat] = flight.place.map_or([None; 2], |place| place.map(Some));
    ProofOfDelivery {
        at: at.to_string(),
        lon,
        lat,
        photo: None,
        code: None,
    }
}

fn failure_row(
    teller: &Teller<'_>,
    number: u64,
    at: Timestamp,
    failure: &FailureNews,
) -> FailureRow {
    let failure_type = serde_json::to_value(failure.failure_type).unwrap_or_default();
    FailureRow {
        network: teller.network.to_owned(),
        edge: teller.edge.to_owned(),
        lineage: teller.lineage,
        number,
        at_ms: at.as_millisecond(),
        failure_type: failure_type.as_str().unwrap_or_default().to_owned(),
        segment: failure.segment.clone().unwrap_or_default(),
        outcome: failure.outcome.clone(),
    }
}
