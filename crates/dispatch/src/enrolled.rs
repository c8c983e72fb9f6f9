//! Over which network a drone is enrolled, as far as it was asked for.

use super::records::Kept;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::FleetDrone;
use skyway_registry::documents::{DocumentKind, Documents};
use skyway_service::refusal::Refusal;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// For how long it is remembered: edges tell the same drones each second.
const KNOWN_FOR: SignedDuration = SignedDuration::from_secs(60);
/// Of how many drones; beyond it all are asked for anew.
const DRONES_MAX: usize = 100_000;

/// Networks by drone, none for one that is not enrolled, and since when they are remembered.
#[derive(Debug, Default)]
pub(super) struct Enrolled(Mutex<(Timestamp, BTreeMap<String, Option<String>>)>);

impl Enrolled {
    /// Whether a drone is enrolled over another network, as of up to a minute ago.
    ///
    /// # Errors
    /// When the store does not answer, or is damaged.
    pub(super) async fn is_elsewhere(
        &self,
        drone: &str,
        network: &str,
        (documents, now): (&dyn Documents, Timestamp),
    ) -> Result<bool, Refusal> {
        let is_elsewhere = |of: &Option<String>| of.as_ref().is_some_and(|of| of != network);
        {
            let known = self.0.lock();
            let mut known = known.unwrap_or_else(PoisonError::into_inner);
            if now.duration_since(known.0) >= KNOWN_FOR || known.1.len() >= DRONES_MAX {
                *known = (now, BTreeMap::new());
            }
            if let Some(of) = known.1.get(drone) {
                return Ok(is_elsewhere(of));
            }
        }
        let document = documents.document(DocumentKind::Drone, drone).await?;
        let enrolled: Option<Kept<FleetDrone>> = document.map(Kept::read).transpose()?;
        let of = enrolled.map(|drone| drone.value.network);
        let told = is_elsewhere(&of);
        let known = self.0.lock();
        let mut known = known.unwrap_or_else(PoisonError::into_inner);
        known.1.insert(drone.to_owned(), of);
        Ok(told)
    }
}
