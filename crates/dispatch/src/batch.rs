//! The orders of one network that wait at the same time, and the drones that they are given.

use super::Dispatch;
use super::assigning::{Reserved, TOGETHER_MAX, ToAsk};
use super::changes::Change;
use super::choosing::{Row, best};
use super::edges::EdgeAddress;
use super::fleet::{Candidate, Demand, FLYING, candidates_of};
use super::holding::Holding;
use super::records::{Asking, Kept, Order};
use super::wanted::Stated;
use super::ways::{Errand, Ways};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{AllocatedDrone, FleetDroneState, PublishedService};
use skyway_market::hours::Hours;
use skyway_market::matching::way_s;
use skyway_registry::documents::Commit;
use skyway_service::refusal::{Code, Refusal};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The most reservations in one commit.
const RESERVED_AT_ONCE: usize = 64;
/// The most orders in a round for which a service is looked for.
const FILLED_MAX: usize = 16;
/// How long before a pickup its drone is assigned.
const AHEAD: SignedDuration = SignedDuration::from_mins(15);
/// How long an order waits until a service is looked for again.
const LOOK_FOR_SERVICE_AFTER: SignedDuration = SignedDuration::from_secs(5);
/// How long another process leaves a reservation to the one that made it.
const LEFT_FOR: SignedDuration = SignedDuration::from_secs(2);

/// An order that a drone is looked for.
pub(super) struct Waiting {
    pub(super) order: Kept<Order>,
    pub(super) service: PublishedService,
    pub(super) errand: Errand,
    /// Before when it has to be picked up, as its service closes then; none where it does not, or the times were promised.
    pub(super) closes_at: Option<Timestamp>,
}

/// What a round has come to over one network.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// The orders whose edge is to be asked.
    pub(super) to_ask: Vec<ToAsk>,
    /// The last order that was looked at, where there was no room for those after it.
    pub(super) through: Option<String>,
}

impl Dispatch {
    /// Reserves drones for orders over a network.
    pub(super) async fn assign_over(
        &self,
        network: &str,
        mut orders: Vec<Kept<Order>>,
        reserved: &Reserved,
        now: Timestamp,
    ) -> Result<Part, Refusal> {
        let edge = match self.edge_of(network).await {
            Ok(edge) => edge,
            Err(refusal) if refusal.code == Code::EdgeUnavailable => {
                for order in orders {
                    self.note(order, refusal.detail.clone(), now, now).await?;
                }
                return Ok(Part::default());
            }
            Err(refusal) => return Err(refusal),
        };
        let before = reserved.get(&(network.to_owned(), edge.id.clone()));
        let room = TOGETHER_MAX.saturating_sub(before.copied().unwrap_or_default());
        let through = match room < orders.len() {
            true => orders[..room].last().map(|last| last.document.id.clone()),
            false => None,
        };
        orders.truncate(room);
        let ways = self.ways(network).await?;
        let waiting = self.ready(&ways, orders, now).await?;
        let providers = waiting.iter().map(|order| order.provider().to_owned());
        let providers: BTreeSet<String> = providers.collect();
        let free = self
            .fleets(&providers, &[FleetDroneState::Available])
            .await?;
        let mut candidates = candidates_of(&free, &ways, now);
        let rows = waiting.iter();
        let mut rows: Vec<Row> = rows.map(|it| Row::of(it, &candidates, now)).collect();
        let flying = match rows.iter().any(|row| row.fitting > 0) {
            true => self.fleets(&providers, &FLYING).await?,
            false => Vec::new(),
        };
        let flying = candidates_of(&flying, &ways, now);
        let mut chosen = best(&rows, candidates.len()).await?;
        if !flying.is_empty() {
            for ((order, row), drone) in waiting.iter().zip(&mut rows).zip(chosen) {
                let otherwise = drone.map(|drone| &candidates[drone]);
                row.costs.extend(order.costs_held(otherwise, &flying, now));
            }
            candidates.extend(flying);
            chosen = best(&rows, candidates.len()).await?;
        }
        let together = waiting.len();
        let mut reservations = Vec::new();
        for ((order, row), drone) in waiting.into_iter().zip(&rows).zip(chosen) {
            let chosen = drone.and_then(|drone| Some((&candidates[drone], row.costs[drone]?)));
            let Some((candidate, cost_m)) = chosen else {
                self.note_waiting(order, row.fitting, now).await?;
                continue;
            };
            if candidate.free_s.is_some() {
                self.hold(order, now).await?;
                continue;
            }
            let explanation = explain(&order, candidate, cost_m, (row.fitting, together));
            let choice = (candidate, cost_m, explanation);
            reservations.push(reservation(order, choice, &edge, now));
        }
        let to_ask = self.reserve(&reservations, now).await?;
        Ok(Part { to_ask, through })
    }

    /// Commits reservations. Gives those that were done.
    async fn reserve(
        &self,
        reservations: &[Change],
        now: Timestamp,
    ) -> Result<Vec<ToAsk>, Refusal> {
        let mut reserved = Vec::new();
        for part in reservations.chunks(RESERVED_AT_ONCE) {
            let done = self.commit_changes(part, now).await?;
            let done = part.iter().zip(done).filter(|(_, is_done)| *is_done);
            reserved.extend(done.map(|(change, _)| ToAsk::of(&change.order)));
        }
        Ok(reserved)
    }

    /// The orders whose drone is looked for now; the others are noted.
    async fn ready(
        &self,
        ways: &Arc<Ways>,
        orders: Vec<Kept<Order>>,
        now: Timestamp,
    ) -> Result<Vec<Waiting>, Refusal> {
        let mut services: BTreeMap<String, Option<PublishedService>> = BTreeMap::new();
        let (mut waiting, mut without_service) = (Vec::new(), Vec::new());
        for order in orders {
            let Some(id) = order.value.delivery.service_id.clone() else {
                without_service.push(order);
                continue;
            };
            if !services.contains_key(&id) {
                let found = match self.service_by_id(&id).await {
                    Ok(service) => Some(service),
                    Err(refusal) if refusal.code == Code::NotFound => None,
                    Err(refusal) => return Err(refusal),
                };
                services.insert(id.clone(), found);
            }
            let service = services.get(&id).and_then(Option::as_ref);
            let (opens_at, closes_at) = hours_of(&order.value, service, now);
            if let Some(opens_at) = opens_at {
                let reason = format!("the service '{id}' is closed until {opens_at}");
                self.note(order, reason, now, now).await?;
                continue;
            }
            let assigned_from = order
                .value
                .start_time()
                .saturating_sub(AHEAD)
                .unwrap_or(now);
            if assigned_from > now {
                let reason = format!("its drone is assigned from {assigned_from} on");
                self.note(order, reason, assigned_from, now).await?;
                continue;
            }
            let delivery = &order.value.delivery;
            let nodes = ways
                .node(delivery.source.text())
                .zip(ways.node(delivery.destination.text()));
            match (services.get(&id).cloned().flatten(), nodes) {
                (Some(service), Some((pickup, drop))) => waiting.push(Waiting {
                    errand: Errand::between(ways, pickup, drop).await?,
                    order,
                    service,
                    closes_at,
                }),
                (None, _) => {
                    let reason = format!("the service '{id}' is offered no more");
                    self.note(order, reason, now, now).await?;
                }
                (_, None) => {
                    let reason = "its pickup or its drop is on the network no more".to_owned();
                    self.note(order, reason, now, now).await?;
                }
            }
        }
        // Each look puts an order off, so that all have their turn.
        without_service.sort_by_key(|order| order.value.dispatch.next_look_ms);
        for order in without_service.into_iter().take(FILLED_MAX) {
            self.fill(order, now).await?;
        }
        Ok(waiting)
    }

    /// Looks for a service for an order that has none.
    async fn fill(&self, mut order: Kept<Order>, now: Timestamp) -> Result<(), Refusal> {
        let delivery = &order.value.delivery;
        let stated = Stated {
            network: &delivery.network,
            source: &delivery.source,
            destination: &delivery.destination,
            payload_kg: delivery.payload_kg,
            start_time: Some(&delivery.start_time),
            arrive_by: delivery.arrive_by.as_deref(),
            price_max: delivery.price_max.as_ref(),
            on_time_min_fraction: None,
        };
        let later = now.saturating_add(LOOK_FOR_SERVICE_AFTER).unwrap_or(now);
        let wanted = match self.wanted(stated, "order").await {
            Ok(wanted) => wanted,
            Err(refusal) if refusal.code == Code::PlanInvalid => {
                return self.note(order, refusal.detail, later, now).await;
            }
            Err(refusal) => return Err(refusal),
        };
        match self.cheapest(&wanted).await? {
            Ok((service, fit)) => {
                let id = service.id.as_deref().unwrap_or_default();
                let Some(service_seen) = self.service_seen(id).await? else {
                    // It was deleted meanwhile: the next round looks again.
                    return Ok(());
                };
                let delivery = &mut order.value.delivery;
                delivery.service_id.clone_from(&service.id);
                delivery.provider.clone_from(&service.provider);
                delivery.price = Some(fit.price);
                delivery.reason = None;
                // As for an order that is filled at once: it waits for the opening, and its time counts from there.
                if let Some(opens_at) = fit.opens_at {
                    delivery.start_time = opens_at.to_string();
                }
                order.value.dispatch.next_look_ms = now.as_millisecond();
                let commit = Commit {
                    seen: vec![order.seen(), service_seen],
                    puts: vec![order.next(now)],
                    ..Commit::default()
                };
                self.documents.commit(&commit).await?;
                self.orders.notify_one();
                Ok(())
            }
            Err(passed_over) => {
                let reason = match passed_over.first() {
                    // Others read it who are told no prices.
                    Some(first) if first.code == "price" => format!(
                        "no service fits it yet; '{}': its price does not fit",
                        first.service_id
                    ),
                    Some(first) => format!(
                        "no service fits it yet; '{}': {}",
                        first.service_id, first.text
                    ),
                    None => "no service is offered over its network yet".to_owned(),
                };
                self.note(order, reason, later, now).await
            }
        }
    }

    /// Lets an order wait for a drone that flies for another one, though some are free.
    async fn hold(&self, mut waiting: Waiting, now: Timestamp) -> Result<(), Refusal> {
        let dispatch = &mut waiting.order.value.dispatch;
        dispatch.holds_since_ms.get_or_insert(now.as_millisecond());
        let reason = "it waits for a nearer drone that is soon back from another order";
        self.note(waiting.order, reason.to_owned(), now, now).await
    }

    async fn note_waiting(
        &self,
        waiting: Waiting,
        fitting: usize,
        now: Timestamp,
    ) -> Result<(), Refusal> {
        // What an edge has said of the last drone tells more than that none is left.
        let was_refused = waiting.order.value.dispatch.failures > 0;
        if fitting == 0 && was_refused {
            return Ok(());
        }
        let service = waiting.service.id.as_deref().unwrap_or_default();
        let reason = match fitting {
            0 => format!("no drone of the service '{service}' that fits is free"),
            1 => "the only drone that is free flies another order first".to_owned(),
            _ => format!("the {fitting} drones that are free fly other orders first"),
        };
        self.note(waiting.order, reason, now, now).await
    }
}

/// When the service of an order opens, where it is closed, and else when it closes. What was quoted is flown at the times that
/// were promised, as long as they are ahead.
fn hours_of(
    order: &Order,
    service: Option<&PublishedService>,
    now: Timestamp,
) -> (Option<Timestamp>, Option<Timestamp>) {
    let promised_at = order.delivery.promised_at.as_deref();
    let promised_at: Option<Timestamp> = promised_at.and_then(|at| at.parse().ok());
    let is_promised = order.delivery.quote_id.is_some() && promised_at.is_none_or(|at| now <= at);
    let service = service.filter(|_| !is_promised);
    // Hours that cannot be read were refused when the service was published.
    let hours = service.and_then(|it| Hours::read(&it.time_zone, &it.hours).ok());
    let Some(hours) = hours else {
        return (None, None);
    };
    let starts_at = order.start_time().max(now);
    match hours.next_opening(starts_at) {
        Some(opens_at) if opens_at > starts_at => (Some(opens_at), None),
        _ => (None, hours.closing(starts_at)),
    }
}

impl Waiting {
    fn provider(&self) -> &str {
        let provider = self.order.value.delivery.provider.as_deref();
        provider.unwrap_or_default()
    }

    /// By drone what fetching, flying and returning cost, in metres; none where it cannot fly it.
    pub(super) fn costs(&self, candidates: &[Candidate<'_>], now: Timestamp) -> Vec<Option<f64>> {
        let demand = Demand {
            network: &self.order.value.delivery.network,
            payload_kg: self.order.value.delivery.payload_kg,
            now,
        };
        let dispatch = &self.order.value.dispatch;
        let costs = candidates.iter().map(|candidate| {
            let Kept { document, value } = candidate.drone;
            let is_fit = document.tenant == self.provider()
                && demand.fits(value, &self.service)
                && !dispatch.passes_over(&document.id, now)
                && self.is_open_for(candidate, now);
            is_fit
                .then(|| self.errand.round_m(candidate.home))
                .flatten()
        });
        costs.collect()
    }

    /// Whether a drone is at the pickup before the service closes.
    fn is_open_for(&self, candidate: &Candidate<'_>, now: Timestamp) -> bool {
        let Some(closes_at) = self.closes_at else {
            return true;
        };
        let leaves_s = candidate.free_s.unwrap_or_default().max(0.0);
        let fetch_m = self.errand.fetch_m(candidate.home);
        let there_s = fetch_m.map(|fetch_m| leaves_s + way_s(fetch_m));
        there_s.is_some_and(|there_s| there_s < closes_at.duration_since(now).as_secs_f64())
    }

    /// The same of drones that fly, with what waiting for them counts, beside the free one that it would have otherwise.
    fn costs_held(
        &self,
        otherwise: Option<&Candidate<'_>>,
        flying: &[Candidate<'_>],
        now: Timestamp,
    ) -> Vec<Option<f64>> {
        let holding = otherwise.and_then(|drone| Holding::of(self, drone, now));
        let Some(holding) = holding else {
            return vec![None; flying.len()];
        };
        let rounds = self.costs(flying, now).into_iter().zip(flying);
        let costs = rounds.map(|(round_m, drone)| Some(round_m? + holding.wait_m(drone)?));
        costs.collect()
    }
}

/// A drone that is reserved for an order, to be committed: it is not where another order has got it.
fn reservation(
    waiting: Waiting,
    (candidate, cost_m, explanation): (&Candidate<'_>, f64, String),
    edge: &EdgeAddress,
    now: Timestamp,
) -> Change {
    let Waiting {
        mut order,
        service,
        errand,
        closes_at,
    } = waiting;
    let mut drone = candidate.drone.clone();
    let id = order.document.id.clone();
    drone.set(FleetDroneState::Assigned, Some(&id));
    let dispatch = &mut order.value.dispatch;
    dispatch.asking = Asking::Reserving;
    dispatch.home = drone.value.home.text().to_owned();
    dispatch.airframe = drone.value.airframe.clone().or(service.airframe);
    dispatch.fetch_m = errand.fetch_m(candidate.home).unwrap_or(0.0);
    dispatch.closes_ms = closes_at.map(Timestamp::as_millisecond);
    dispatch.reserved += 1;
    dispatch.asked_since_ms = now.as_millisecond();
    let left_until = now.saturating_add(LEFT_FOR).unwrap_or(now);
    dispatch.next_look_ms = left_until.as_millisecond();
    let plan_id = format!("delivery-{id}-{}", dispatch.reserved);
    order.value.delivery.allocation = Some(AllocatedDrone {
        drone_id: drone.document.id.clone(),
        edge: edge.id.clone(),
        plan_id,
        cost_m,
        explanation,
    });
    Change {
        order,
        drone: Some(drone),
        is_told: false,
    }
}

fn explain(
    waiting: &Waiting,
    candidate: &Candidate<'_>,
    cost_m: f64,
    (fitting, together): (usize, usize),
) -> String {
    let fetch_m = waiting.errand.fetch_m(candidate.home).unwrap_or(0.0);
    let why = if together == 1 {
        format!("the shortest flight of {fitting} that are free and fit")
    } else {
        format!("the shortest flights for {together} orders together")
    };
    format!("{why}: {fetch_m:.0} m to the pickup, {cost_m:.0} m in all")
}
