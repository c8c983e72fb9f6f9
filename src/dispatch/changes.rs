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
        self.commit_all(std::slice::from_ref(change), now).await
    }

    /// Commits changes of different orders and drones in one, and each by itself where something they were decided on has
    /// moved. Tells of each whether it was done.
    pub(super) async fn commit_changes(
        &self,
        changes: &[Change],
        now: Timestamp,
    ) -> Result<Vec<bool>, Refusal> {
        if self.commit_all(changes, now).await? {
            return Ok(vec![true; changes.len()]);
        }
        let mut done = Vec::with_capacity(changes.len());
        for change in changes {
            done.push(self.commit_change(change, now).await?);
        }
        Ok(done)
    }

    /// Commits all changes or none.
    async fn commit_all(&self, changes: &[Change], now: Timestamp) -> Result<bool, Refusal> {
        let mut commit = Commit::default();
        for change in changes {
            commit.seen.push(change.order.seen());
            commit.puts.push(change.order.next(now));
            if let Some(drone) = &change.drone {
                commit.seen.push(drone.seen());
                commit.puts.push(drone.next(now));
            }
            if change.is_told {
                let told = self.status_messages(&change.order.value, now).await?;
                commit.messages.extend(told);
            }
        }
        let is_done = self.documents.commit(&commit).await? == Committed::Done;
        if is_done && changes.iter().any(|change| change.is_told) {
            self.messages.notify_one();
        }
        if is_done && changes.iter().any(|change| change.drone.is_some()) {
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
