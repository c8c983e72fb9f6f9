//! A change of an order, with its drone and the messages that tell of it, in one commit.

use super::Dispatch;
use super::records::{Kept, Order};
use jiff::Timestamp;
use skyway_contract::{FleetDrone, FleetDroneState};
use skyway_registry::documents::{Commit, Committed, DocumentKind};
use skyway_service::refusal::Refusal;

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
        let mut commit = together(changes, now);
        for change in changes.iter().filter(|change| change.is_told) {
            let told = self.status_messages(&change.order.value).await?;
            commit.messages.extend(told);
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

/// The commit of all of them, which is decided on each of their orders and drones.
fn together(changes: &[Change], now: Timestamp) -> Commit {
    let mut commit = Commit::default();
    for change in changes {
        commit.seen.push(change.order.seen());
        commit.puts.push(change.order.next(now));
        if let Some(drone) = &change.drone {
            commit.seen.push(drone.seen());
            commit.puts.push(drone.next(now));
        }
    }
    commit
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::de::DeserializeOwned;
    use serde_json::{Value, json};
    use skyway_registry::documents::Document;

    fn kept<T: DeserializeOwned>(kind: DocumentKind, number: u64, body: &Value) -> Kept<T> {
        let document = Document {
            kind,
            id: format!("{}-{number}", kind.name()),
            tenant: "swift".to_owned(),
            party: String::new(),
            state: String::new(),
            version: number,
            changed_ms: 0,
            body: body.to_string(),
        };
        Kept::read(document).expect("a whole body")
    }

    fn reserved(number: u64) -> Change {
        let delivery = json!({
            "id": "d", "customer": "shop", "network": "street", "source": "shop", "destination": "door",
            "payload_kg": 1.0, "status": "created", "created_at": "", "start_time": "", "history": [],
            "recompositions": [],
        });
        let drone = json!({"network": "street", "home": "depot", "payload_max_kg": 2.0});
        Change {
            order: kept(DocumentKind::Delivery, number, &delivery),
            drone: Some(kept(DocumentKind::Drone, 10 + number, &drone)),
            is_told: false,
        }
    }

    #[test]
    fn reservations_in_one_commit_are_decided_on_every_order_and_drone() {
        let commit = together(&[reserved(1), reserved(2)], Timestamp::UNIX_EPOCH);
        let seen: Vec<(&str, Option<u64>)> = commit
            .seen
            .iter()
            .map(|seen| (seen.id.as_str(), seen.version))
            .collect();
        let puts: Vec<(&str, Option<u64>)> = commit
            .puts
            .iter()
            .map(|put| (put.id.as_str(), Some(put.version - 1)))
            .collect();
        assert_eq!(seen.len(), 4);
        assert_eq!(seen, puts);
    }
}
