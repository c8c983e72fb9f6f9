//! The drones of providers: which of them could fly an errand.

use super::Dispatch;
use super::records::{Kept, drone_state};
use crate::network::NodeIx;
use crate::refusal::Refusal;
use crate::registry::documents::{DocumentKind, DocumentQuery};
use crate::wire::{FleetDrone, FleetDroneState, PublishedService};
use jiff::Timestamp;

/// How many documents are read at once.
pub(super) const AT_ONCE: u64 = 500;
/// The most drones of a provider that are looked at.
const DRONES_MAX: usize = 5_000;

impl Dispatch {
    /// Drones of a provider that stand in one of these ways, by id.
    ///
    /// # Errors
    /// When the store does not answer, or is damaged.
    pub(super) async fn fleet(
        &self,
        provider: &str,
        states: &[FleetDroneState],
    ) -> Result<Vec<Kept<FleetDrone>>, Refusal> {
        let mut query = DocumentQuery {
            kind: DocumentKind::Drone,
            of: Some(provider.to_owned()),
            states: states
                .iter()
                .map(|&state| drone_state(state).to_owned())
                .collect(),
            after: None,
            limit: AT_ONCE,
            is_newest_first: false,
        };
        let mut drones = Vec::new();
        while drones.len() < DRONES_MAX {
            let page = self.documents.documents(&query).await?;
            let is_last = (page.len() as u64) < AT_ONCE;
            query.after = page.last().map(|last| last.id.clone());
            for document in page {
                drones.push(Kept::read(document)?);
            }
            if is_last {
                break;
            }
        }
        Ok(drones)
    }
}

/// What an errand asks of a drone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand<'a> {
    pub(super) network: &'a str,
    pub(super) payload_kg: f64,
    pub(super) now: Timestamp,
}

impl Demand<'_> {
    /// Whether a drone may fly it for a service.
    pub(super) fn fits(&self, drone: &FleetDrone, service: &PublishedService) -> bool {
        let maintained = match drone.maintenance_until.as_deref() {
            Some(until) => until
                .parse::<Timestamp>()
                .is_ok_and(|until| until <= self.now),
            None => true,
        };
        let has_airframe = service.airframe.is_none() || service.airframe == drone.airframe;
        drone.network == self.network
            && self.payload_kg <= drone.payload_max_kg
            && maintained
            && has_airframe
    }
}

/// A drone that fits, and the node of its home.
#[derive(Clone, Debug)]
pub(super) struct Candidate<'a> {
    pub(super) drone: &'a Kept<FleetDrone>,
    pub(super) home: NodeIx,
}
