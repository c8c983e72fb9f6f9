//! Flights that nothing is told of any more: one whose edge has lost its store would hold its order and its drone for ever.

use super::Dispatch;
use super::changes::Change;
use super::records::{Asking, Kept, Order};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{DeliveryStatus, FleetDrone, FleetDroneState};
use skyway_registry::documents::{Document, DocumentKind};
use skyway_service::refusal::Refusal;

/// A flight of which its edge tells nothing for so long is given up; edges are asked for as long to call one off.
const TOLD_WITHIN: SignedDuration = SignedDuration::from_hours(24);
/// How often a part of the drones is looked at.
const LOOK_EVERY: SignedDuration = SignedDuration::from_mins(1);
const UNHEARD: &str = "its edge has told nothing of it for a day";

/// How far a process has looked for such flights.
#[derive(Debug, Default)]
pub(super) struct LookedAt {
    /// After which drone the next part begins.
    after: Option<String>,
    /// When the last part was looked at.
    at: Option<Timestamp>,
}

impl Dispatch {
    /// Ends those of the next drones that nothing was told of for a day; nothing where it was done within the last minute.
    ///
    /// # Errors
    /// When the store does not answer, or is damaged.
    pub(super) async fn end_unheard(&self, looked_at: &mut LookedAt) -> Result<(), Refusal> {
        let now = self.clock.now();
        let is_early = |at: Timestamp| now.duration_since(at).abs() < LOOK_EVERY;
        if looked_at.at.is_some_and(is_early) {
            return Ok(());
        }
        looked_at.at = Some(now);
        for drone in self.flying_drones(&mut looked_at.after).await? {
            self.end_if_unheard(drone, now).await?;
        }
        Ok(())
    }

    /// Ends the flight of a drone, unless something was told of its order, or its edge is being asked.
    async fn end_if_unheard(
        &self,
        mut drone: Kept<FleetDrone>,
        now: Timestamp,
    ) -> Result<(), Refusal> {
        let Some(id) = drone.value.delivery_id.clone() else {
            return Ok(());
        };
        let document = self.documents.document(DocumentKind::Delivery, &id).await?;
        let order: Option<Kept<Order>> = document.map(Kept::read).transpose()?;
        let Some(mut order) = order.filter(|order| is_unheard(order, &drone, now)) else {
            return Ok(());
        };
        let is_told = !order.value.delivery.status.is_final() && {
            let reason = Some(UNHEARD.to_owned());
            let failed = DeliveryStatus::Failed;
            order.value.set_status(failed, reason, now, None)
        };
        // Where it is, nobody knows.
        drone.set(FleetDroneState::OutOfService, None);
        let change = Change {
            order,
            drone: Some(drone),
            is_told,
        };
        // Where something was told meanwhile, that counts.
        if self.commit_change(&change, now).await? {
            tracing::warn!(delivery = id, "{UNHEARD}");
        }
        Ok(())
    }
}

/// Whether a document has been the same for long.
fn is_silent(document: &Document, now: Timestamp) -> bool {
    let since_ms = now.as_millisecond().saturating_sub(document.changed_ms);
    i128::from(since_ms) > TOLD_WITHIN.as_millis()
}

/// Whether a drone flies for an order that an edge has told nothing of for long, and is not asked about.
fn is_unheard(order: &Kept<Order>, drone: &Kept<FleetDrone>, now: Timestamp) -> bool {
    is_silent(&order.document, now)
        && order.value.dispatch.asking == Asking::Nothing
        && order.value.drone_id() == Some(&drone.document.id)
}
