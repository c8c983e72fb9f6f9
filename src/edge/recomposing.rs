//! What a settled report is answered, in flight or by distance, and what becomes of the plan of its drone.

use super::Edge;
use super::failures::{DEFAULT_AIRSPEED_MPS, as_reported};
use super::plan_entry::PlanEntry;
use super::planner::{Flights, FlownVersion, ReportedFlight, Reporter, ReportingDrone, Scene};
use super::progress;
use super::records::{Flown, PlanChange};
use super::snapshot::{FIRST_TOPOLOGY, Snapshot};
use super::traces;
use crate::airspace::Airspace;
use crate::compose::{Composition, equip, flight_time_s};
use crate::formats::ReadWarning;
use crate::planted::{self, Bug};
use crate::recompose::{Outcome, Recomposition, Request, Scratch, World, recompose};
use crate::wire;
use jiff::Timestamp;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A report that has been settled, and what is known beside it.
#[derive(Clone, Copy)]
pub(super) struct Case<'a> {
    pub(super) snapshot: &'a Arc<Snapshot>,
    pub(super) report: &'a wire::FailureReport,
    pub(super) request: &'a Request,
    /// The plan that it is about.
    pub(super) plan: Option<&'a Arc<PlanEntry>>,
    /// Whether the answer may change that plan.
    pub(super) may_change: bool,
    /// The drone, where the caller may speak for it.
    pub(super) drone_id: Option<&'a str>,
    pub(super) now: Timestamp,
}

/// An answer, and what comes with it.
pub(super) struct Recomposed {
    pub(super) answer: Recomposition,
    /// How it is flown; `None` where the flight model is off, or nobody knows the battery.
    pub(super) flown: Option<Flown>,
    /// What it changes of a plan.
    pub(super) plan: Option<PlanChange>,
    /// `None` without a path.
    pub(super) remaining_time_s: Option<f64>,
}

impl Edge {
    /// Answers a report: in flight where the flight model is on and the battery known, else by distance.
    pub(super) fn recompose(&self, case: &Case<'_>, read: &mut Vec<ReadWarning>) -> Recomposed {
        let _span = traces::of_search().entered();
        match self.recompose_in_flight(case, read) {
            Some(flown) => flown,
            None => self.recompose_by_distance(case, read),
        }
    }

    fn recompose_in_flight(
        &self,
        case: &Case<'_>,
        read: &mut Vec<ReadWarning>,
    ) -> Option<Recomposed> {
        let flights = self.flights.as_ref()?;
        if read
            .iter()
            .any(|warning| warning.code == "destination_unknown")
        {
            // Nobody can say whether the drone gets where nobody knows.
            return None;
        }
        let before = self.stale_airspace(case);
        let scene = Scene {
            snapshot: case.snapshot,
            airspace: before.as_ref().unwrap_or(&case.snapshot.airspace),
            now: case.now,
        };
        let plan = case.plan.map(|plan| &**plan);
        let topology = case.snapshot.topology();
        let progress =
            plan.and_then(|plan| progress::progress(topology, plan, &self.drones, case.now));
        let sighting = case.drone_id.and_then(|id| self.drones.last(id));
        let reporter = Reporter {
            plan,
            leg: progress.map(|progress| progress.leg),
            sighting: sighting.as_ref(),
        };
        let drone = flights.reporting(scene, case.report, case.request, reporter, read)?;
        let told = flights.answer_report(scene, &drone, case.request);
        Some(flown(case, flights, drone, told, read))
    }

    /// The answer that a drone in flight would get without any table: the baseline of the flight model.
    pub(super) fn recompose_without_tables(
        &self,
        case: &Case<'_>,
        refused: &Flown,
        read: &mut Vec<ReadWarning>,
    ) -> Recomposed {
        let scene = Scene {
            snapshot: case.snapshot,
            airspace: &case.snapshot.airspace,
            now: case.now,
        };
        let flights = &refused.flights;
        let told = flights.answer_without_tables(scene, &refused.drone, case.request);
        flown(case, flights, refused.drone.clone(), told, read)
    }

    fn recompose_by_distance(&self, case: &Case<'_>, read: &mut Vec<ReadWarning>) -> Recomposed {
        let airspace = &case.snapshot.airspace;
        let before = self.stale_airspace(case);
        let world = World {
            airspace: before.as_ref().unwrap_or(airspace),
            trees: before.is_none().then_some(&self.trees),
        };
        let mut scratch = self.scratches.take(case.snapshot.topology());
        let answer = recompose(&world, case.request, &mut scratch);
        self.scratches.give_back(scratch);
        self.tables.want(case.request.report.destination, &world);
        self.by_distance(case, answer, read)
    }

    /// What comes with an answer by distance.
    pub(super) fn by_distance(
        &self,
        case: &Case<'_>,
        answer: Recomposition,
        read: &mut Vec<ReadWarning>,
    ) -> Recomposed {
        let airspace = &case.snapshot.airspace;
        let changed = case.plan.filter(|_| case.may_change);
        let change = changed.map(|plan| {
            let mut scratch = self.scratches.take(case.snapshot.topology());
            let (request, now) = (case.request, case.now);
            let way = new_way(plan, request, &answer, airspace, &mut scratch, now);
            self.scratches.give_back(scratch);
            change_of(plan, now, way.map(|way| (None, way)))
        });
        let airspeed_mps = airspeed_mps(case.report, case.plan.map(|plan| &**plan));
        let has_path = !answer.path.nodes.is_empty();
        let remaining_time_s = has_path.then(|| {
            flight_time_s(
                case.snapshot.topology(),
                &answer.path,
                answer.first_stretch_m,
                airspeed_mps,
            )
        });
        warn_of_missed_deadline(case.report, remaining_time_s, case.now, read);
        Recomposed {
            answer,
            flown: None,
            plan: change,
            remaining_time_s,
        }
    }

    /// How fast a drone flies that does not say so: as the airframe that it names, as its plan has it, as the default airframe.
    pub(super) fn airspeed_mps(
        &self,
        report: &wire::FailureReport,
        plan: Option<&Arc<PlanEntry>>,
    ) -> Option<f64> {
        let flights = self.flights.as_ref();
        let named = report.drone.as_ref();
        let named = named.and_then(|drone| drone.airframe.as_deref());
        let named = named
            .zip(flights)
            .and_then(|(name, flights)| flights.airframe(Some(name), None));
        let otherwise = || flights.and_then(|flights| flights.airframe(None, None));
        match (named, plan) {
            (Some(airframe), _) => Some(airframe.airspeed_mps),
            (None, Some(plan)) => Some(plan.airspeed_mps),
            (None, None) => otherwise().map(|airframe| airframe.airspeed_mps),
        }
    }

    /// The world as it was before anything closed: with a planted defect, answers are computed on it.
    fn stale_airspace(&self, case: &Case<'_>) -> Option<Arc<Airspace>> {
        planted::is(Bug::StaleAnswer).then(|| {
            let topology = case.snapshot.topology().clone();
            let horizon = self.settings.horizon;
            Arc::new(Airspace::open(topology, FIRST_TOPOLOGY, case.now, horizon))
        })
    }
}

/// What comes with an answer in flight.
fn flown(
    case: &Case<'_>,
    flights: &Arc<Flights>,
    drone: ReportingDrone,
    (answer, flight): (Recomposition, ReportedFlight),
    read: &mut Vec<ReadWarning>,
) -> Recomposed {
    let version = flight.version.as_ref();
    if version.is_some_and(|(version, _)| version.reserve_used) {
        let message = "the plan draws on the reserve of the battery, to reach a safe node";
        read.push(ReadWarning::new("reserve_used", message));
    }
    let remaining_time_s = version.map(|(_, way)| {
        let until_departure = flight.departs_at.duration_since(case.now);
        until_departure.as_secs_f64() + way.flight_time_s
    });
    let changed = case.plan.filter(|_| case.may_change);
    let change = changed.map(|plan| {
        // Also where it flies on as it was: its legs, its stops and their pads are at other times now.
        change_of(
            plan,
            flight.departs_at,
            version.map(|(version, way)| (Some(version.clone()), way.clone())),
        )
    });
    Recomposed {
        answer,
        plan: change,
        remaining_time_s,
        flown: Some(Flown {
            flight,
            drone,
            flights: flights.clone(),
            snapshot: case.snapshot.clone(),
        }),
    }
}

fn airspeed_mps(report: &wire::FailureReport, plan: Option<&PlanEntry>) -> f64 {
    let stated = report.drone.as_ref().and_then(|drone| drone.airspeed_mps);
    let possible = stated.filter(|speed_mps| *speed_mps > 0.0 && *speed_mps <= 100.0);
    let planned = plan.map(|plan| plan.airspeed_mps);
    possible.or(planned).unwrap_or(DEFAULT_AIRSPEED_MPS)
}

/// What an answer changes of a plan: nothing without a way.
fn change_of(
    plan: &PlanEntry,
    departs_at: Timestamp,
    way: Option<(Option<Arc<FlownVersion>>, Composition)>,
) -> PlanChange {
    let version = way
        .is_some()
        .then(|| plan.next_version.fetch_add(1, Ordering::Relaxed));
    let (flight, composition) = match way {
        Some((flight, composition)) => (flight, Some(composition)),
        None => (None, None),
    };
    PlanChange {
        plan: plan.id.clone(),
        version,
        composition,
        flight,
        departs_at,
    }
}

/// What the drone of a plan flies after an answer by distance; `None` where it goes on as it was.
fn new_way(
    plan: &PlanEntry,
    request: &Request,
    answer: &Recomposition,
    airspace: &Airspace,
    scratch: &mut Scratch,
    now: Timestamp,
) -> Option<Composition> {
    let destination = match answer.outcome {
        // A drone that holds on the ground keeps its plan until the zone over it has ended.
        Outcome::NoRoute | Outcome::Unaffected | Outcome::Hold => None,
        Outcome::Diverted => answer.path.nodes.last().copied(),
        Outcome::Rerouted => Some(request.report.destination),
    };
    let airspace = as_reported(airspace, request, now);
    let world = World {
        airspace: &airspace,
        trees: None,
    };
    let (way, stretch_m) = (answer.path.clone(), answer.first_stretch_m);
    destination.map(|destination| {
        equip(
            &world,
            way,
            stretch_m,
            destination,
            plan.airspeed_mps,
            scratch,
        )
    })
}

fn warn_of_missed_deadline(
    report: &wire::FailureReport,
    remaining_time_s: Option<f64>,
    now: Timestamp,
    read: &mut Vec<ReadWarning>,
) {
    let deadline = report
        .deadline
        .as_deref()
        .and_then(|text| text.parse::<Timestamp>().ok());
    if let (Some(deadline), Some(time_s)) = (deadline, remaining_time_s)
        && super::planner::later(now, time_s) > deadline
    {
        read.push(ReadWarning {
            code: "deadline_missed",
            message: format!(
                "at nominal speed the path takes {time_s:.0} s and ends after {deadline}"
            ),
        });
    }
}
