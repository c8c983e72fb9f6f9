//! Flights shown to the checker: against what is closed when, and against the pads that others have.

use super::DroneKind;
use super::others::PadKey;
use super::{Flights, FlownVersion, ReportedFlight, ReportingDrone, Scene};
use crate::checked::{FlightWorld, Known, check_answer, claim_of_flight};
use crate::checker::{ClosedTimes, Fault};
use crate::edge::snapshot::Snapshot;
use crate::flight::Reservation;
use crate::network::NodeIx;
use crate::recompose::{Recomposition, Request};
use jiff::Timestamp;

impl Flights {
    /// Checks how a drone that reported is to fly.
    ///
    /// # Errors
    /// The first rule that the answer breaks.
    pub(in crate::edge) fn check_report(
        &self,
        scene: Scene<'_>,
        (drone, flight): (&ReportingDrone, &ReportedFlight),
        request: &Request,
        known: &Known,
        answer: &Recomposition,
    ) -> Result<(), Fault> {
        let version = flight.version.as_ref().map(|(version, _)| &**version);
        self.check_version(
            scene,
            (&drone.kind, drone.plan.as_deref()),
            version.map(|version| (version, flight.departs_at)),
            request,
            known,
            answer,
        )
    }

    /// Checks an answer with the version that it makes of a plan.
    ///
    /// # Errors
    /// The first rule that the answer breaks.
    pub(in crate::edge) fn check_version(
        &self,
        scene: Scene<'_>,
        (kind, own): (&DroneKind, Option<&str>),
        version: Option<(&FlownVersion, Timestamp)>,
        request: &Request,
        known: &Known,
        answer: &Recomposition,
    ) -> Result<(), Fault> {
        let Some((version, departs_at)) = version else {
            return check_answer(scene.airspace, request, known, answer, None);
        };
        if answer.reentry.is_none() {
            return Ok(());
        }
        let departs_s = self.seconds(departs_at);
        let timed = version.composition_at(departs_s);
        let refuge = version.refuge.map(|refuge| Reservation {
            from_s: refuge.from_s + departs_s,
            until_s: refuge.until_s + departs_s,
            ..refuge
        });
        let sky = self.sky(scene.airspace, scene.now);
        let weather = scene.snapshot.weather.as_ref();
        let compiled = self.compiled(scene.airspace.topology(), kind, weather);
        let closed = sky
            .closed_times
            .get_or_init(|| ClosedTimes::of(sky.skies.airspace(), self.zero));
        let zero_s = self.zero.as_microsecond() as f64 / 1e6;
        let swaps = |node: NodeIx| sky.swap_stations.contains(&node);
        let is_taken = |node: NodeIx, pad: u16, from_s: f64, until_s: f64| {
            let instants = (zero_s + from_s, zero_s + until_s);
            is_taken(scene.snapshot, own, (node, pad), instants)
        };
        let world = FlightWorld {
            setting: &compiled.setting,
            closed,
            swaps: &swaps,
            is_taken: &is_taken,
        };
        let claim = claim_of_flight(&timed, refuge);
        check_answer(
            scene.airspace,
            request,
            known,
            answer,
            Some((&claim, &world)),
        )
    }
}

/// Whether another plan has a pad at some time between two instants, in seconds of Unix time.
fn is_taken(
    snapshot: &Snapshot,
    own: Option<&str>,
    (node, pad): (NodeIx, u16),
    (from_s, until_s): (f64, f64),
) -> bool {
    let there = snapshot.reservations.range(PadKey::first_of(node.0)..);
    let mut there = there.take_while(|(key, _)| key.node == node.0);
    there.any(|(key, stay)| {
        let is_other = own != Some(&*key.plan);
        is_other && stay.pad == pad && from_s < stay.until_s && stay.from_s < until_s
    })
}
