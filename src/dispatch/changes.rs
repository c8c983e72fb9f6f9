//! A change of an order, with its drone and the messages that tell of it, in one commit.

use super::Dispatch;
use super::records::{Kept, Order};
use crate::refusal::Refusal;
use crate::registry::documents::{Commit, Committed, DocumentKind};
use crate::wire::{FleetDrone, FleetDroneState};
use jiff::Timestamp;

/// A change of an order that was decided on what the store says.
#[derive(Debug)]
pub(super) struct Change {
    pub(super) order: Kept<Order>,
    /// Its drone, where that changes, too.
    pub(super) drone: Option<Kept<FleetDrone>>,
    /// Whether it has another status.
    pub(super) is_told: bool,
}

impl Dispatch {
    /// Commits a change. Tells whether it was done: not where something it was decided on has moved.
    pub(super) async fn commit_change(
        &self,
        change: &Change,
        now: Timestamp,
    ) -> Result<bool, Refusal> {
        let mut commit = Commit {
            seen: vec![change.order.seen()],
            puts: vec![change.order.next(now)],
            ..Commit::default()
        };
        if let Some(drone) = &change.drone {
            commit.seen.push(drone.seen());
            commit.puts.push(drone.next(now));
        }
        if change.is_told {
            commit.messages = self.status_messages(&change.order.value, now).await?;
        }
        let is_done = self.documents.commit(&commit).await? == Committed::Done;
        if is_done && change.is_told {
            self.messages.notify_one();
        }
        if is_done && change.drone.is_some() {
            self.orders.notify_one();
        }
        Ok(is_done)
    }

    /// The drone of an order, in a state that it has from now on, without the order; none where it has none, or the drone has
    /// gone on to another.
    pub(super) async fn freed_drone(
        &self,
        order: &Order,
        state: FleetDroneState,
    ) -> Result<Option<Kept<FleetDrone>>, Refusal> {
        let mut drone = self.drone_of(order).await?;
        if let Some(drone) = &mut drone {
            drone.set(state, None);
        }
        Ok(drone)
    }

    /// The drone that an order has.
    pub(super) async fn drone_of(
        &self,
        order: &Order,
    ) -> Result<Option<Kept<FleetDrone>>, Refusal> {
        let Some(id) = order.drone_id() else {
            return Ok(None);
        };
        let document = self.documents.document(DocumentKind::Drone, id).await?;
        let drone: Option<Kept<FleetDrone>> = document.map(Kept::read).transpose()?;
        let delivery = order.delivery.id.as_str();
        Ok(drone.filter(|drone| drone.value.delivery_id.as_deref() == Some(delivery)))
    }
}
