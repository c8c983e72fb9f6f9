//! What a customer sees of a flight while it is flown: how it stands, when it is expected, and where its drone is.

use super::Dispatch;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{DeliveryStatus, DeliveryTrack, FleetPosition};
use skyway_service::access::Caller;
use skyway_service::refusal::Refusal;

/// How old a position may be that is told as the last.
const RECENT: SignedDuration = SignedDuration::from_secs(60);
/// The most positions that are read for the last one.
const READ_MAX: u64 = 1_000;

impl Dispatch {
    /// How a delivery stands, and where its drone is while it flies for it. No other flight is told.
    ///
    /// # Errors
    /// When there is no such delivery that the caller may see, or the store does not answer.
    pub async fn track(&self, caller: &Caller, id: &str) -> Result<DeliveryTrack, Refusal> {
        let order = self.seen_order(caller, id).await?.value;
        let delivery = order.delivery;
        let place = match &delivery.allocation {
            Some(allocation) if is_under_way(delivery.status) => {
                let since = delivery
                    .history
                    .iter()
                    .rfind(|change| change.status == DeliveryStatus::Assigned);
                let since = since.and_then(|change| change.at.parse().ok());
                self.last_place(&allocation.drone_id, since).await?
            }
            _ => None,
        };
        Ok(DeliveryTrack {
            id: delivery.id,
            status: delivery.status,
            reason: delivery.reason,
            expected_at: delivery.expected_at,
            place,
        })
    }

    /// Where a drone was last, not before an instant.
    async fn last_place(
        &self,
        drone: &str,
        since: Option<Timestamp>,
    ) -> Result<Option<FleetPosition>, Refusal> {
        let now = self.clock.now();
        let recent = now.saturating_sub(RECENT).unwrap_or(now);
        let from = since.map_or(recent, |since| since.max(recent));
        let (from_ms, until_ms) = (
            from.as_millisecond(),
            now.as_millisecond().saturating_add(1),
        );
        let positions = self
            .documents
            .positions(drone, from_ms, until_ms, READ_MAX)
            .await?;
        Ok(positions.last().map(|last| FleetPosition {
            at: Timestamp::from_millisecond(last.at_ms)
                .unwrap_or_default()
                .to_string(),
            lon: last.lon,
            lat: last.lat,
            battery_fraction: last.battery_fraction,
        }))
    }
}

/// Whether a drone flies for a delivery that stands so.
fn is_under_way(status: DeliveryStatus) -> bool {
    matches!(
        status,
        DeliveryStatus::PickingUp
            | DeliveryStatus::InFlight
            | DeliveryStatus::Holding
            | DeliveryStatus::Returning
    )
}
