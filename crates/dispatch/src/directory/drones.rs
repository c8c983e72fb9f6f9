//! The drones of providers.

use super::{
    AIRFRAME_BYTES_MAX, Checked, Entry, Listed, Place, Tagged, check_payload, check_repeated,
    tenant_before_colon,
};
use crate::Dispatch;
use crate::records::drone_state;
use skyway_contract::{FleetDrone, FleetDroneState};
use skyway_registry::documents::DocumentKind;
use skyway_service::access::Caller;
use skyway_service::intake::{Faults, PageRequest};
use skyway_service::refusal::{Code, Refusal};

impl Entry for FleetDrone {
    const KIND: DocumentKind = DocumentKind::Drone;
    const IS_OFFERED: bool = false;
    const OF_TENANT_MAX: u64 = 5_000;
    const MAX: u64 = 100_000;

    fn tenant(&self, caller: &Caller, id: &str) -> Result<String, Refusal> {
        tenant_before_colon(caller, Self::KIND, id)
    }

    fn checked<'a>(
        self,
        dispatch: &'a Dispatch,
        place: Place<'a>,
        before: Option<&'a Self>,
    ) -> Checked<'a, Self> {
        Box::pin(check(self, dispatch, place, before))
    }

    fn state(&self, _place: Place<'_>) -> &'static str {
        drone_state(self.state)
    }

    fn shown(self, _caller: &Caller, _tenant: &str) -> Self {
        self
    }

    fn check_unused<'a>(&'a self, _dispatch: &'a Dispatch, place: Place<'a>) -> Checked<'a, ()> {
        let unused = match &self.delivery_id {
            Some(delivery) => Err(busy(place.id, delivery)),
            None => Ok(()),
        };
        Box::pin(async move { unused })
    }
}

impl Dispatch {
    /// The drones that a caller sees, by id, with where each was last.
    ///
    /// # Errors
    /// When the page is none, or the store does not answer.
    pub async fn fleet_drones(
        &self,
        caller: &Caller,
        page: &PageRequest,
    ) -> Result<Listed<FleetDrone>, Refusal> {
        let mut page = self.entries::<FleetDrone>(caller, page).await?;
        let ids = page.entries.iter().filter_map(|drone| drone.id.clone());
        let mut places = self.last_positions(&ids.collect::<Vec<_>>()).await?;
        for drone in &mut page.entries {
            let id = drone.id.as_deref().unwrap_or_default();
            drone.last = places.remove(id);
        }
        Ok(page)
    }

    /// A drone, with where it was last.
    ///
    /// # Errors
    /// When there is none that the caller may see, or the store does not answer.
    pub async fn fleet_drone(
        &self,
        caller: &Caller,
        id: &str,
    ) -> Result<Tagged<FleetDrone>, Refusal> {
        let mut found = self.entry::<FleetDrone>(caller, id).await?;
        let mut places = self.last_positions(&[id.to_owned()]).await?;
        found.value.last = places.remove(id);
        Ok(found)
    }
}

fn busy(id: &str, delivery: &str) -> Refusal {
    let detail = format!("drone '{id}' is assigned to the delivery '{delivery}'; wait for its end");
    Refusal::new(Code::InUse, detail)
}

async fn check(
    mut drone: FleetDrone,
    dispatch: &Dispatch,
    place: Place<'_>,
    before: Option<&FleetDrone>,
) -> Result<FleetDrone, Refusal> {
    let mut faults = Faults::default();
    check_repeated(&mut faults, "/id", drone.id.as_deref(), place.id);
    check_payload(&mut faults, drone.payload_max_kg);
    faults.text("/airframe", drone.airframe.as_deref(), AIRFRAME_BYTES_MAX);
    faults.fraction("/battery_health_fraction", drone.battery_health_fraction);
    faults.instant("/maintenance_until", drone.maintenance_until.as_deref());
    if let Some(topology) = dispatch.network_of(&drone.network, &mut faults).await?
        && let Some(home) = faults.node("/home", &topology, &drone.home)
        && topology.pads(home) == 0
    {
        let message = format!("node '{}' has no pad to stand on", drone.home);
        faults.add("no_pads", "/home", message, None);
    }
    let delivery = before.and_then(|before| before.delivery_id.as_deref());
    let is_flying = matches!(
        drone.state,
        FleetDroneState::Assigned | FleetDroneState::InFlight
    );
    if is_flying && delivery.is_none() {
        let message = format!("'{}' follows from flights", drone_state(drone.state));
        let hint = "state available, charging or out_of_service".to_owned();
        faults.add("state_read_only", "/state", message, Some(hint));
    }
    faults.check(Code::BodyInvalid, FleetDrone::KIND.name())?;
    drone.id = Some(place.id.to_owned());
    drone.last = None;
    drone.delivery_id = delivery.map(str::to_owned);
    drone.free_at = before.and_then(|before| before.free_at.clone());
    if let (Some(before), Some(delivery)) = (before, delivery) {
        let is_as_flown = drone.network == before.network
            && drone.home == before.home
            && drone.airframe == before.airframe
            && drone.state != FleetDroneState::OutOfService;
        if !is_as_flown {
            return Err(busy(place.id, delivery));
        }
        drone.state = before.state;
    }
    Ok(drone)
}
