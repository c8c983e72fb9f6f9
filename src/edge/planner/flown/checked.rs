//! Flights shown to the checker: against what is closed when, and against the pads that others have.

use super::DroneKind;
use super::{Flights, FlownAnswer, FlownVersion, ReportedFlight, ReportingDrone, Scene};
use crate::checked::{FlightWorld, Known, check_answer, claim_of_flight};
use crate::checker::{ClosedTimes, Fault};
use crate::delivery::with_airframe;
use crate::edge::plan_entry::PlanEntry;
use crate::edge::planner::{Own, stays_at};
use crate::edge::snapshot::Snapshot;
use crate::flight::{Aloft, FailureReport, FailureType, Location, Reentry, Reservation};
use crate::network::NodeIx;
use crate::planted;
use crate::recompose::{Recomposition, Request, Strategy};
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
        let who = (&drone.kind, scene.snapshot.own(drone.plan.as_deref()));
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
    pub(in crate::edge) fn check_version(
        &self,
        scene: Scene<'_>,
        (kind, own): (&DroneKind, Own<'_>),
        version: Option<(&FlownVersion, Timestamp)>,
        request: &Request,
        known: &Known,
        answer: &Recomposition,
    ) -> Result<(), Fault> {
        let sky = self.sky(scene.airspace, scene.now);
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
        let refuge = version.refuge.map(|refuge| Reservation {
            from_s: refuge.from_s + departs_s,
            until_s: refuge.until_s + departs_s,
            ..refuge
        });
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
            refuge_stay_s: self.settings.refuge_stay_s,
        };
        let claim = claim_of_flight(&timed, refuge, version.is_energy_checked);
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

/// An answer that does not pass, with what was asked and the rule that it breaks.
pub(in crate::edge) struct RefusedAnswer {
    pub(in crate::edge) request: Request,
    pub(in crate::edge) answer: Recomposition,
    pub(in crate::edge) fault: Fault,
}

impl Flights {
    /// The answer to the drone of a plan, if it does not pass.
    pub(in crate::edge) fn refused(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        told: &FlownAnswer,
    ) -> Option<RefusedAnswer> {
        let (version, way) = told.version.as_ref()?;
        if planted::is_unchecked() {
            return None;
        }
        let start = &version.composition.plan.start;
        let nodes = &way.way.nodes;
        let stands = Request::exact(FailureReport {
            failure: FailureType::ServiceLevel,
            leg: (start.node, nodes.get(1).copied().unwrap_or(start.node)),
            location: Location::LegStart,
            cause_location: None,
            destination: plan.destination,
            remaining_path: None,
        });
        let request = told.asked.as_deref().cloned().unwrap_or(stands);
        let answer = Recomposition {
            outcome: told.outcome,
            path: way.way.clone(),
            remaining_length_m: Some(version.composition.plan.distance_m),
            first_stretch_m: start.flown_m,
            reentry: start.reentry(),
            flags: told.flags.clone(),
            ..Recomposition::without_path(Strategy::Exact)
        };
        let known = Known {
            stands_at: told.asked.is_none().then_some(start.node),
            at_s: self.seconds(scene.now),
            ..Known::default()
        };
        let drone = (&self.kind_of(plan), scene.snapshot.own(Some(&plan.id)));
        let flown = Some((&**version, told.departs_at));
        let checked = self.check_version(scene, drone, flown, &request, &known, &answer);
        let fault = checked.err()?;
        Some(RefusedAnswer {
            request,
            answer,
            fault,
        })
    }
}

/// Whether another plan has a pad at some time between two instants, in seconds of Unix time.
fn is_taken(
    snapshot: &Snapshot,
    own: Own<'_>,
    (node, pad): (NodeIx, u16),
    (from_s, until_s): (f64, f64),
) -> bool {
    stays_at(snapshot, node).any(|(key, stay)| {
        !own.has(&key.plan) && stay.pad == pad && from_s < stay.until_s && stay.from_s < until_s
    })
}
