//! The drones of providers: which of them could fly an errand.

use super::Dispatch;
use super::records::{Kept, drone_state};
use super::wanted::Wanted;
use super::ways::Ways;
use jiff::Timestamp;
use skyway_contract::{FleetDrone, FleetDroneState, PublishedService};
use skyway_engine::network::NodeIx;
use skyway_registry::documents::{DocumentKind, DocumentQuery};
use skyway_service::refusal::Refusal;
use std::collections::BTreeSet;

/// How many documents are read at once.
pub(super) const AT_ONCE: u64 = 500;
/// The most drones of a provider that are looked at.
const DRONES_MAX: usize = 5_000;
/// How many are read at once where one is looked for.
const LOOKED_AT_ONCE: u64 = 50;
/// For how long after its time a drone is still waited for, in seconds.
pub(super) const LATE_MAX_S: f64 = 120.0;
/// Those that will be free again.
pub(super) const FLYING: [FleetDroneState; 2] =
    [FleetDroneState::Assigned, FleetDroneState::InFlight];
/// Those that fly, or will again without their provider.
const IN_SERVICE: [FleetDroneState; 4] = [
    FleetDroneState::Available,
    FleetDroneState::Assigned,
    FleetDroneState::InFlight,
    FleetDroneState::Charging,
];

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
        let mut query = drones_of(Some(provider), states, AT_ONCE);
        let mut drones = Vec::new();
        while drones.len() < DRONES_MAX {
            let page = self.next_drones(&mut query).await?;
            let is_last = (page.len() as u64) < AT_ONCE;
            drones.extend(page);
            if is_last {
                break;
            }
        }
        Ok(drones)
    }

    /// The same of several providers.
    ///
    /// # Errors
    /// As for [`Self::fleet`].
    pub(super) async fn fleets(
        &self,
        providers: &BTreeSet<String>,
        states: &[FleetDroneState],
    ) -> Result<Vec<Kept<FleetDrone>>, Refusal> {
        let mut fleets = Vec::new();
        for provider in providers {
            fleets.extend(self.fleet(provider, states).await?);
        }
        Ok(fleets)
    }

    /// Whether a service has a drone that could fly an errand, now or once it is free. It reads no more than it needs: mostly the
    /// first one can.
    ///
    /// # Errors
    /// As for [`Self::fleet`].
    pub(super) async fn has_able(
        &self,
        wanted: &Wanted,
        service: &PublishedService,
    ) -> Result<bool, Refusal> {
        let provider = service.provider.as_deref().unwrap_or_default();
        let demand = Demand {
            network: &wanted.network,
            payload_kg: wanted.payload_kg,
            now: self.clock.now(),
        };
        let is_able = |drone: &Kept<FleetDrone>| {
            let home = wanted.ways.node(drone.value.home.text());
            let is_near = home.is_some_and(|home| wanted.errand.round_m(home).is_some());
            is_near && demand.fits(&drone.value, service)
        };
        let mut query = drones_of(Some(provider), &IN_SERVICE, LOOKED_AT_ONCE);
        let mut looked_at = 0;
        while looked_at < DRONES_MAX {
            let page = self.next_drones(&mut query).await?;
            if page.iter().any(is_able) {
                return Ok(true);
            }
            if (page.len() as u64) < LOOKED_AT_ONCE {
                break;
            }
            looked_at += page.len();
        }
        Ok(false)
    }

    /// A part of the drones that fly or are about to, of all providers, from where the last part ended.
    ///
    /// # Errors
    /// As for [`Self::fleet`].
    pub(super) async fn flying_drones(
        &self,
        after: &mut Option<String>,
    ) -> Result<Vec<Kept<FleetDrone>>, Refusal> {
        let mut query = drones_of(None, &FLYING, AT_ONCE);
        query.after = after.take();
        let drones = self.next_drones(&mut query).await?;
        *after = query.after.filter(|_| drones.len() as u64 == AT_ONCE);
        Ok(drones)
    }

    async fn next_drones(
        &self,
        query: &mut DocumentQuery,
    ) -> Result<Vec<Kept<FleetDrone>>, Refusal> {
        let page = self.documents.documents(query).await?;
        query.after = page.last().map(|last| last.id.clone());
        page.into_iter().map(Kept::read).collect()
    }
}

fn drones_of(provider: Option<&str>, states: &[FleetDroneState], limit: u64) -> DocumentQuery {
    DocumentQuery {
        kind: DocumentKind::Drone,
        of: provider.map(str::to_owned),
        states: states
            .iter()
            .map(|&state| drone_state(state).to_owned())
            .collect(),
        after: None,
        limit,
        is_newest_first: false,
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

/// A drone that may be assigned, now or once it is back.
#[derive(Clone, Debug)]
pub(super) struct Candidate<'a> {
    pub(super) drone: &'a Kept<FleetDrone>,
    /// The node of its home.
    pub(super) home: NodeIx,
    /// In how many seconds it is back from the delivery that it flies for; none where it is free.
    pub(super) free_s: Option<f64>,
}

impl<'a> Candidate<'a> {
    /// A drone, unless its home is not on the network, or it flies and nothing says when it is back, or it should have been.
    fn of(drone: &'a Kept<FleetDrone>, ways: &Ways, now: Timestamp) -> Option<Self> {
        let home = ways.node(drone.value.home.text())?;
        let free_s = match drone.value.state {
            FleetDroneState::Available => None,
            _ => {
                let free_at: Timestamp = drone.value.free_at.as_deref()?.parse().ok()?;
                let free_s = free_at.duration_since(now).as_secs_f64();
                (free_s >= -LATE_MAX_S).then_some(free_s)?;
                Some(free_s)
            }
        };
        Some(Self {
            drone,
            home,
            free_s,
        })
    }
}

/// Those of some drones that may be assigned, now or once they are back.
pub(super) fn candidates_of<'a>(
    drones: &'a [Kept<FleetDrone>],
    ways: &Ways,
    now: Timestamp,
) -> Vec<Candidate<'a>> {
    let drones = drones.iter();
    drones
        .filter_map(|drone| Candidate::of(drone, ways, now))
        .collect()
}
