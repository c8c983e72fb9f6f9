//! A flight asked of an edge for a drone that is reserved: taken on, refused, or not answered yet.
//!
//! The reservation is committed first, with the plan's id. Whatever happens then, the edge is asked again under that id, by this
//! process or by another one, until it has answered; so no drone flies for an order that is unknown.

use super::Dispatch;
use super::calling_off::not_answered;
use super::changes::Change;
use super::edges::{CalledOff, ComposedFlight, EdgeError, FlightRequest};
use super::orders::DECISIONS;
use super::pace::pause_ms;
use super::quotes::departure;
use super::records::{Asking, Kept, Order};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{DeliveryStatus, FleetDroneState, PlanState};
use skyway_registry::store::StoreError;
use skyway_service::refusal::{Code, Refusal};

/// For how long an edge is asked to take a flight on.
const ASKED_FOR: SignedDuration = SignedDuration::from_mins(10);
/// Refusals in a row after which the next drone is not asked for at once.
const REFUSALS_AT_ONCE: u32 = 4;

/// What an edge's answer makes of an order.
struct Settled {
    is_told: bool,
    drone: DroneThen,
}

/// How the drone of an order stands after an edge's answer.
enum DroneThen {
    AsBefore,
    Free,
    FliesUntil(Timestamp),
}

impl Dispatch {
    /// Asks the edge of an order what it is to be asked, and commits what it answers.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(super) async fn ask_edge(&self, id: &str) -> Result<(), Refusal> {
        match self.order(id).await?.value.dispatch.asking {
            Asking::Nothing => Ok(()),
            Asking::Reserving => self.ask_to_take_on(id).await,
            Asking::CallingOff => self.ask_to_call_off(id).await,
        }
    }

    async fn ask_to_take_on(&self, id: &str) -> Result<(), Refusal> {
        let asked = self.order(id).await?.value;
        if asked.dispatch.asking != Asking::Reserving {
            return Ok(());
        }
        let answer = if is_given_up(&asked, self.clock.now()) {
            None
        } else {
            let answer = self.compose_at_edge(&asked).await?;
            Some(self.confirmed(&asked, answer).await?)
        };
        for _ in 0..DECISIONS {
            let mut order = self.order(id).await?;
            let is_same = order.value.dispatch.asking == Asking::Reserving
                && order.value.delivery.allocation == asked.delivery.allocation;
            if !is_same {
                return self
                    .answered_late(&asked, &order, answer.and_then(Result::ok))
                    .await;
            }
            let now = self.clock.now();
            let settled = match &answer {
                Some(answer) => settle(&mut order.value, answer, now),
                None => give_up(&mut order.value, now),
            };
            let drone = match settled.drone {
                DroneThen::AsBefore => None,
                DroneThen::Free => {
                    let state = FleetDroneState::Available;
                    self.freed_drone(&asked, state).await?
                }
                DroneThen::FliesUntil(ends_at) => {
                    let mut drone = self.drone_of(&asked).await?;
                    if let Some(drone) = &mut drone {
                        drone.value.free_at = Some(ends_at.to_string());
                    }
                    drone
                }
            };
            let change = Change {
                order,
                drone,
                is_told: settled.is_told,
            };
            if self.commit_change(&change, now).await? {
                return Ok(());
            }
        }
        Err(StoreError::Contended.into())
    }

    /// An edge has taken a flight on that its order does not wait for any more: it is called off, unless it is flown already.
    async fn answered_late(
        &self,
        asked: &Order,
        order: &Kept<Order>,
        flight: Option<ComposedFlight>,
    ) -> Result<(), Refusal> {
        let (Some(flight), Some(allocation)) = (flight, &asked.delivery.allocation) else {
            return Ok(());
        };
        let is_its_flight = order.value.delivery.allocation.as_ref() == Some(allocation);
        let status = order.value.delivery.status;
        if is_its_flight && !status.is_final() {
            return self.promise(order, &flight).await;
        }
        let network = &asked.delivery.network;
        let edge = self.edge_by_id(network, &allocation.edge).await?;
        let called_off = self.edges.call_off(&edge, &allocation.plan_id).await;
        if let Err(error) = called_off {
            let (edge, plan) = (&edge.id, &allocation.plan_id);
            tracing::warn!(edge, plan, %error, "a flight that no order has is not called off");
        }
        Ok(())
    }

    /// The news of a flight have come before the edge's answer: it still has to be promised.
    async fn promise(&self, order: &Kept<Order>, flight: &ComposedFlight) -> Result<(), Refusal> {
        if order.value.delivery.promised_at.is_some() {
            return Ok(());
        }
        let mut order = order.clone();
        let arrives_at = flight.drop_at.to_string();
        order
            .value
            .delivery
            .expected_at
            .get_or_insert(arrives_at.clone());
        order.value.delivery.promised_at = Some(arrives_at);
        let change = Change {
            order,
            drone: None,
            is_told: false,
        };
        // Where it has moved again there is nothing to promise any more.
        self.commit_change(&change, self.clock.now()).await?;
        Ok(())
    }

    /// What an edge refuses it may have taken on before, when its answer was lost: so the flight is called off before another
    /// drone is looked for. Where that is not certain, or its drone has departed, the edge has not answered.
    async fn confirmed(
        &self,
        order: &Order,
        answer: Result<ComposedFlight, EdgeError>,
    ) -> Result<Result<ComposedFlight, EdgeError>, Refusal> {
        let (Err(EdgeError::Refused { .. }), Some(allocation)) =
            (&answer, &order.delivery.allocation)
        else {
            return Ok(answer);
        };
        let edge = self
            .edge_by_id(&order.delivery.network, &allocation.edge)
            .await?;
        Ok(
            match self.edges.call_off(&edge, &allocation.plan_id).await {
                Ok(CalledOff::Cancelled | CalledOff::Unknown) => answer,
                Ok(CalledOff::Departed | CalledOff::Over) => Err(EdgeError::NotAnswered {
                    detail: "its drone has departed".to_owned(),
                }),
                Err(error) => Err(EdgeError::NotAnswered {
                    detail: error.to_string(),
                }),
            },
        )
    }

    async fn compose_at_edge(
        &self,
        order: &Order,
    ) -> Result<Result<ComposedFlight, EdgeError>, Refusal> {
        let delivery = &order.delivery;
        let Some(allocation) = &delivery.allocation else {
            return Err(Refusal::new(
                Code::Internal,
                "an order is reserved without a drone",
            ));
        };
        let edge = match self.edge_by_id(&delivery.network, &allocation.edge).await {
            Ok(edge) => edge,
            Err(refusal) if refusal.code == Code::EdgeUnavailable => {
                let detail = refusal.detail;
                return Ok(Err(EdgeError::NotAnswered { detail }));
            }
            Err(refusal) => return Err(refusal),
        };
        let dispatch = &order.dispatch;
        let request = FlightRequest {
            plan_id: Some(allocation.plan_id.clone()),
            drone_id: Some(allocation.drone_id.clone()),
            delivery_id: Some(delivery.id.clone()),
            home: dispatch.home.clone(),
            pickup: delivery.source.text().to_owned(),
            drop: delivery.destination.text().to_owned(),
            payload_kg: delivery.payload_kg,
            start_time: departure(order.start_time(), dispatch.fetch_m, self.clock.now()),
            airframe: dispatch.airframe.clone(),
        };
        Ok(self.edges.compose(&edge, &request).await)
    }
}

/// Whether an edge was asked for long enough.
fn is_given_up(order: &Order, now: Timestamp) -> bool {
    let asked_since = Timestamp::from_millisecond(order.dispatch.asked_since_ms).unwrap_or(now);
    now.duration_since(asked_since) >= ASKED_FOR || now >= order.waits_until()
}

/// The edge has not answered: whether it has the flight is not known, so it is called off there. What becomes of the order the
/// edge then says.
fn give_up(order: &mut Order, now: Timestamp) -> Settled {
    order.ask_to_call_off(now);
    order.dispatch.is_given_up = true;
    order.delivery.reason = Some(not_answered(order));
    Settled {
        is_told: false,
        drone: DroneThen::AsBefore,
    }
}

fn settle(
    order: &mut Order,
    answer: &Result<ComposedFlight, EdgeError>,
    now: Timestamp,
) -> Settled {
    match answer {
        // What became of it, the edge tells; it is asked again in case it does not.
        Ok(flight) if flight.state == PlanState::Ended => wait(order, "its flight is over", now),
        Ok(flight) => taken_on(order, flight, now),
        Err(EdgeError::Refused { code, detail }) => refused(order, code, detail, now),
        Err(EdgeError::NotAnswered { detail }) => wait(order, detail, now),
    }
}

fn taken_on(order: &mut Order, flight: &ComposedFlight, now: Timestamp) -> Settled {
    if let Some(late) = lateness(order, flight) {
        order.ask_to_call_off(now);
        let drone = order.drone_id().unwrap_or_default();
        order.delivery.reason = Some(format!("drone '{drone}' would {late}"));
        return Settled {
            is_told: false,
            drone: DroneThen::AsBefore,
        };
    }
    order.dispatch.asking = Asking::Nothing;
    order.dispatch.failures = 0;
    order.dispatch.flights += 1;
    let arrives_at = flight.drop_at.to_string();
    order.delivery.promised_at.get_or_insert(arrives_at.clone());
    order.delivery.expected_at = Some(arrives_at);
    let version = Some(flight.version);
    Settled {
        is_told: order.set_status(DeliveryStatus::Assigned, None, now, version),
        drone: DroneThen::FliesUntil(flight.ends_at),
    }
}

/// In what a flight is too late, by the times that its edge says; none where it is in time.
fn lateness(order: &Order, flight: &ComposedFlight) -> Option<String> {
    let closes_ms = order.dispatch.closes_ms;
    if closes_ms.is_some_and(|closes_ms| flight.pickup_at.as_millisecond() >= closes_ms) {
        let pickup_at = flight.pickup_at;
        return Some(format!(
            "pick up at {pickup_at} only, after its service closes"
        ));
    }
    let latest = order.delivery.arrive_by.as_deref();
    let latest: Timestamp = latest?.parse().ok()?;
    (flight.drop_at > latest).then(|| format!("arrive at {} only", flight.drop_at))
}

fn refused(order: &mut Order, code: &str, detail: &str, now: Timestamp) -> Settled {
    let drone = order.drone_id().unwrap_or_default().to_owned();
    let delivery = &order.delivery.id;
    tracing::info!(delivery, code, detail, "an edge refuses a flight");
    order.dispatch.pass_over(&drone, now);
    order.release();
    order.dispatch.failures += 1;
    let in_a_row = order.dispatch.failures;
    if in_a_row >= REFUSALS_AT_ONCE {
        let pause = pause_ms(in_a_row);
        order.dispatch.next_look_ms = now.as_millisecond().saturating_add(pause);
    }
    // The edge names the other flight, which is no business of this customer's.
    let told = match code {
        "plan_state_conflict" => "its edge has another flight for it",
        _ => detail,
    };
    order.delivery.reason = Some(format!("drone '{drone}' cannot fly it: {told} ({code})"));
    Settled {
        is_told: false,
        drone: DroneThen::Free,
    }
}

fn wait(order: &mut Order, why: &str, now: Timestamp) -> Settled {
    order.ask_again(now);
    order.delivery.reason = Some(why.to_owned());
    Settled {
        is_told: false,
        drone: DroneThen::AsBefore,
    }
}
