//! Orders called off: at once while no edge has a flight for them, and by the edge while their drone is on the ground.

use super::Dispatch;
use super::changes::Change;
use super::deliveries::may_call_off;
use super::edges::{CalledOff, EdgeError};
use super::orders::DECISIONS;
use super::records::{Asking, Kept, Order};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{Delivery, DeliveryStatus, FleetDroneState};
use skyway_registry::store::StoreError;
use skyway_service::access::Caller;
use skyway_service::refusal::{Code, Refusal};

/// For how long an edge is asked to call a flight off.
const ASKED_FOR: SignedDuration = SignedDuration::from_hours(24);
const CALLED_OFF: &str = "it was called off";
const DEPARTED: &str = "its drone departed before it could be called off";
const BEING_CALLED_OFF: &str = "it is being called off";
const OVER: &str = "its flight is over; what became of it, its edge tells";
const FORGOTTEN: &str = "its edge knows nothing of its flight any more; it may have been flown";

impl Dispatch {
    /// Calls a delivery off. Where an edge has its flight the answer may be that it is being called off, and the status
    /// follows once the edge has answered.
    ///
    /// # Errors
    /// When there is no such delivery of the caller's, its drone has departed, it is over, or the store does not answer.
    pub async fn cancel_delivery(&self, caller: &Caller, id: &str) -> Result<Delivery, Refusal> {
        for _ in 0..DECISIONS {
            let mut order = self.seen_order(caller, id).await?;
            if !may_call_off(caller, &order.value) {
                return Err(Refusal::not_found("delivery", id));
            }
            let status = order.value.delivery.status;
            if status == DeliveryStatus::Cancelled || order.value.dispatch.is_called_off {
                return self.told(caller, &order).await;
            }
            check_on_ground(status)?;
            let now = self.clock.now();
            let is_told = call_off(&mut order.value, now);
            let change = Change {
                order,
                drone: None,
                is_told,
            };
            if !self.commit_change(&change, now).await? {
                continue;
            }
            if change.order.value.dispatch.asking == Asking::CallingOff {
                self.ask_to_call_off(id).await?;
            }
            let order = self.order(id).await?;
            let goes_on = !order.value.dispatch.is_called_off;
            if goes_on && !order.value.delivery.status.is_final() {
                return Err(Refusal::new(Code::DeliveryStateConflict, DEPARTED));
            }
            return self.told(caller, &order).await;
        }
        Err(StoreError::Contended.into())
    }

    /// Asks the edge of an order to call its flight off, and commits what it answers.
    pub(super) async fn ask_to_call_off(&self, id: &str) -> Result<(), Refusal> {
        let asked = self.order(id).await?;
        if asked.value.dispatch.asking != Asking::CallingOff {
            return Ok(());
        }
        let answer = self.call_off_at_edge(&asked.value).await?;
        for _ in 0..DECISIONS {
            let mut order = self.order(id).await?;
            let is_same = order.value.dispatch.asking == Asking::CallingOff
                && order.value.delivery.allocation == asked.value.delivery.allocation;
            if !is_same {
                return Ok(());
            }
            let now = self.clock.now();
            let (is_told, drone) = settle(&mut order.value, &answer, now);
            let drone = match drone {
                Some(state) => self.freed_drone(&asked.value, state).await?,
                None => None,
            };
            let change = Change {
                order,
                drone,
                is_told,
            };
            if self.commit_change(&change, now).await? {
                return Ok(());
            }
        }
        Err(StoreError::Contended.into())
    }

    async fn call_off_at_edge(
        &self,
        order: &Order,
    ) -> Result<Result<CalledOff, EdgeError>, Refusal> {
        let delivery = &order.delivery;
        let Some(allocation) = &delivery.allocation else {
            return Ok(Ok(CalledOff::Cancelled));
        };
        match self.edge_by_id(&delivery.network, &allocation.edge).await {
            Ok(edge) => Ok(self.edges.call_off(&edge, &allocation.plan_id).await),
            Err(refusal) if refusal.code == Code::EdgeUnavailable => {
                let detail = refusal.detail;
                Ok(Err(EdgeError::NotAnswered { detail }))
            }
            Err(refusal) => Err(refusal),
        }
    }
}

/// Checks that a drone is on the ground for a delivery that stands so.
fn check_on_ground(status: DeliveryStatus) -> Result<(), Refusal> {
    let is_on_ground = matches!(
        status,
        DeliveryStatus::Created | DeliveryStatus::Scheduled | DeliveryStatus::Assigned
    );
    if is_on_ground {
        return Ok(());
    }
    let detail = format!(
        "the delivery is {}; it is called off before its drone departs",
        status.name()
    );
    Err(Refusal::new(Code::DeliveryStateConflict, detail))
}

/// Calls an order off, as far as that is up to the registry. Tells whether it has another status.
fn call_off(order: &mut Order, now: Timestamp) -> bool {
    order.dispatch.is_called_off = true;
    if order.delivery.allocation.is_none() {
        let reason = Some(CALLED_OFF.to_owned());
        return order.set_status(DeliveryStatus::Cancelled, reason, now, None);
    }
    order.ask_to_call_off(now);
    order.delivery.reason = Some(BEING_CALLED_OFF.to_owned());
    false
}

/// What an edge's answer makes of an order that is being called off: whether it has another status, and how its drone stands
/// once it is free.
fn settle(
    order: &mut Order,
    answer: &Result<CalledOff, EdgeError>,
    now: Timestamp,
) -> (bool, Option<FleetDroneState>) {
    let asked_since = Timestamp::from_millisecond(order.dispatch.asked_since_ms).unwrap_or(now);
    let is_given_up = now.duration_since(asked_since) >= ASKED_FOR;
    match answer {
        Ok(CalledOff::Cancelled) => (end(order, true, now), Some(FleetDroneState::Available)),
        // Its edge has never said that it takes it on.
        Ok(CalledOff::Unknown) if order.delivery.status == DeliveryStatus::Created => {
            (end(order, true, now), Some(FleetDroneState::Available))
        }
        Ok(CalledOff::Departed) => {
            order.dispatch.asking = Asking::Nothing;
            order.dispatch.is_called_off = false;
            order.dispatch.is_given_up = false;
            order.delivery.reason = Some(DEPARTED.to_owned());
            (depart(order, now), None)
        }
        Ok(CalledOff::Over | CalledOff::Unknown) if order.delivery.status.is_final() => {
            order.dispatch.asking = Asking::Nothing;
            (false, None)
        }
        // It may have been flown to the door: no other drone is to fly it.
        Ok(CalledOff::Over | CalledOff::Unknown) if is_given_up => {
            order.dispatch.is_called_off = false;
            order.dispatch.is_given_up = true;
            (end(order, false, now), Some(FleetDroneState::OutOfService))
        }
        // What became of it, the edge tells, and nothing else is done for it before.
        Ok(over @ (CalledOff::Over | CalledOff::Unknown)) => {
            order.ask_again(now);
            let is_forgotten = *over == CalledOff::Unknown;
            let reason = if is_forgotten { FORGOTTEN } else { OVER };
            order.delivery.reason = Some(reason.to_owned());
            (false, None)
        }
        Err(_) if is_given_up => (end(order, false, now), Some(FleetDroneState::OutOfService)),
        Err(error) => {
            order.ask_again(now);
            if !order.delivery.status.is_final() {
                order.delivery.reason = Some(format!("{BEING_CALLED_OFF}: {error}"));
            }
            (false, None)
        }
    }
}

/// An order that was being assigned when its drone departed is assigned: the news of its flight follow, and promise its arrival.
fn depart(order: &mut Order, now: Timestamp) -> bool {
    if order.delivery.status != DeliveryStatus::Created {
        return false;
    }
    order.dispatch.flights += 1;
    let reason = order.delivery.reason.clone();
    order.set_status(DeliveryStatus::Assigned, reason, now, None)
}

/// Why an order was given up.
pub(super) fn not_answered(order: &Order) -> String {
    let allocation = order.delivery.allocation.as_ref();
    let edge = allocation.map_or("", |allocation| allocation.edge.as_str());
    format!("the edge '{edge}' did not answer in time")
}

/// An order whose flight is called off, or not known of after a day: cancelled where the customer wanted it; failed where it was
/// given up and its flight is not known of, or its time is over; else it waits for another drone.
fn end(order: &mut Order, is_known: bool, now: Timestamp) -> bool {
    order.dispatch.asking = Asking::Nothing;
    order.dispatch.failures = 0;
    if order.delivery.status.is_final() {
        return false;
    }
    if order.dispatch.is_called_off {
        let reason = Some(CALLED_OFF.to_owned());
        return order.set_status(DeliveryStatus::Cancelled, reason, now, None);
    }
    let was_given_up = std::mem::take(&mut order.dispatch.is_given_up);
    let reason = match was_given_up {
        true => Some(not_answered(order)),
        false => order.delivery.reason.clone(),
    };
    if was_given_up && (!is_known || now >= order.waits_until()) {
        return order.set_status(DeliveryStatus::Failed, reason, now, None);
    }
    let drone = order.drone_id().map(str::to_owned);
    if let Some(drone) = drone {
        order.dispatch.pass_over(&drone, now);
    }
    order.release();
    order.set_status(DeliveryStatus::Created, reason, now, None)
}

impl Kept<Order> {
    /// Whether an edge is to be asked about it now.
    pub(super) fn is_to_be_asked(&self, now: Timestamp) -> bool {
        let dispatch = &self.value.dispatch;
        dispatch.asking != Asking::Nothing && dispatch.next_look_ms <= now.as_millisecond()
    }
}
