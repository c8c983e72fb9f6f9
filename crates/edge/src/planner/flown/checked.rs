//! Flights shown to the checker: against what is closed when, and against the pads that others have.

use super::terms::DroneKind;
use super::{Flight, Flights, FlownVersion};
use crate::planner::{Own, Scene, Traffic};
use jiff::Timestamp;
use skyway_engine::checked::{FlightWorld, Known, check_answer, claim_of_flight};
use skyway_engine::checker::Fault;
use skyway_engine::delivery::with_airframe;
use skyway_engine::flight::{Aloft, Reentry, Reservation};
use skyway_engine::network::NodeIx;
use skyway_engine::recompose::{Recomposition, Request};

impl Flights {
    /// What is known of who asked, with what is known of its flight.
    pub(super) fn known(&self, flight: &Flight, known: &Known, now: Timestamp) -> Known {
        Known {
            stands_at: flight.drone.stands_at(),
            at_s: self.seconds(now),
            ..*known
        }
    }

    /// Checks how a drone that reported is to fly.
    ///
    /// # Errors
    /// The first rule that the answer breaks.
    pub(super) fn check_report(
        &self,
        scene: Scene<'_>,
        flight: &Flight,
        request: &Request,
        known: &Known,
        answer: &Recomposition,
    ) -> Result<(), Fault> {
        let version = flight.version.as_ref().map(|(version, _)| &**version);
        let who = (&flight.drone.kind, flight.drone.own(scene));
        self.check_version(
            scene,
            who,
            version.map(|version| (version, flight.departs_at)),
            request,
            known,
            answer,
        )?;
        let Some(airborne) = answer.if_airborne.as_deref() else {
            return Ok(());
        };
        let mut request = request.clone();
        request.circumstances.aloft = Aloft::Airborne;
        let version = flight.if_airborne.as_deref();
        let version = version.map(|version| (version, scene.now));
        self.check_version(scene, who, version, &request, known, airborne)
    }

    /// Checks an answer with the version that it makes of a plan.
    ///
    /// # Errors
    /// The first rule that the answer breaks.
    pub(super) fn check_version(
        &self,
        scene: Scene<'_>,
        (kind, own): (&DroneKind, Own<'_>),
        version: Option<(&FlownVersion, Timestamp)>,
        request: &Request,
        known: &Known,
        answer: &Recomposition,
    ) -> Result<(), Fault> {
        let sky = self.sky(scene);
        // What closes later is looked at by the times of the flight.
        let airspace = sky.skies.now();
        let Some((version, departs_at)) = version else {
            return check_answer(airspace, request, known, answer, None);
        };
        // A drone on the ground has no way to where its plan begins.
        let start = &version.composition.plan.start;
        let standing = start.on_ground.then(|| {
            let place = scene.airspace.topology().position(start.node);
            Recomposition {
                reentry: Some(Reentry::at_node(start.node, place, None)),
                ..answer.clone()
            }
        });
        let answer = standing.as_ref().unwrap_or(answer);
        let departs_s = self.seconds(departs_at);
        let timed = version.composition_at(departs_s);
        let alternate = version.alternate.map(|alternate| Reservation {
            from_s: alternate.from_s + departs_s,
            until_s: alternate.until_s + departs_s,
            ..alternate
        });
        let compiled = self.compiled(scene, kind);
        let closed = self.closed_times(&sky);
        let zero_s = self.zero.as_microsecond() as f64 / 1e6;
        let swap_stations = sky.skies.swap_stations();
        let swaps = |node: NodeIx| swap_stations.contains(&node);
        let is_taken = |node: NodeIx, pad: u16, from_s: f64, until_s: f64| {
            let instants = (zero_s + from_s, zero_s + until_s);
            is_taken(scene.traffic, own, (node, pad), instants)
        };
        let world = FlightWorld {
            setting: &compiled.setting,
            closed: &closed,
            swaps: &swaps,
            is_taken: &is_taken,
            refuge_stay_s: self.settings.refuge_stay_s,
        };
        let claim = claim_of_flight(&timed, alternate, version.is_energy_checked);
        let of_airframe = with_airframe(&compiled.setting, request);
        check_answer(
            airspace,
            of_airframe.as_ref().unwrap_or(request),
            known,
            answer,
            Some((&claim, &world)),
        )
    }
}

/// Whether another plan has a pad at some time between two instants, in seconds of Unix time.
fn is_taken(
    traffic: Traffic<'_>,
    own: Own<'_>,
    (node, pad): (NodeIx, u16),
    (from_s, until_s): (f64, f64),
) -> bool {
    traffic.stays_at(node).iter().any(|stay| {
        !own.has(&stay.plan) && stay.pad == pad && from_s < stay.until_s && stay.from_s < until_s
    })
}
