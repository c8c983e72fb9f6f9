//! The planner with battery and clock.

use super::answering::Stand;
use super::{FlightTerms, Flights, LegEnds};
use crate::drones::Sighting;
use crate::drones::progress::{self, Ahead, Progress};
use crate::planner::by_distance::{ByDistance, as_asked, standing_at};
use crate::planner::{
    Answer, Asked, Causes, Concern, Course, Displaced, FlownVersion, Occasion, Own, Planner, Scene,
    Stated, Terms, Version, Wanted, later,
};
use crate::plans::entry::PlanEntry;
use crate::plans::stops::without_end;
use crate::plans::stretches::Stretch;
use crate::settings::Settings;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::airspace::Closure;
use skyway_engine::checked::{Alternatives, Case, Known};
use skyway_engine::checker::Fault;
use skyway_engine::delivery::contingencies_of;
use skyway_engine::flight::{Location, ServiceStop};
use skyway_engine::geo::Point;
use skyway_engine::itinerary::Objective;
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::{Outcome, Request, Strategy, Warning};
use skyway_engine::routing::Path;
use skyway_formats::ReadWarning;
use skyway_planted as planted;
use skyway_service::intake::Faults;
use skyway_service::refusal::Refusal;
use std::sync::Arc;

/// A way that is shorter by less, in metres, is not better.
const LEAST_GAIN_M: f64 = 10.0;
/// Nor a landing that is earlier by less, in seconds.
const LEAST_GAIN_S: f64 = 60.0;
/// Nor what saves less energy, in watt hours.
const LEAST_GAIN_WH: f64 = 0.5;

/// The planner with battery and clock. Of whom it knows too little, and what was planned without it, it leaves to the other.
#[derive(Debug)]
pub(in crate::planner) struct Flown {
    flights: Arc<Flights>,
    by_distance: ByDistance,
}

impl Flown {
    /// The planner of an edge that begins at an instant; `None` where its settings name no airframe.
    pub(in crate::planner) fn of(
        settings: &Settings,
        zero: Timestamp,
        by_distance: &ByDistance,
    ) -> Option<Self> {
        Some(Self {
            flights: Arc::new(Flights::of(settings, zero)?),
            by_distance: by_distance.clone(),
        })
    }

    /// The answer to the drone of a plan that stands, with the request that is checked: as from there.
    fn replan_standing(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (stand, sighting): (Stand, Option<&Sighting>),
        goal: (NodeIx, Vec<ServiceStop>),
    ) -> (Request, Answer) {
        let request = |way: &Path| standing_at(stand.node, way, goal.clone());
        let from_there = request(&Path::default());
        let answer = self
            .flights
            .answer_standing(scene, plan, (stand, sighting), &from_there);
        (request(&answer.told.path), answer)
    }
}

impl Planner for Flown {
    fn read_terms(
        &self,
        request: &wire::DeliveryRequest,
        stated: &Stated,
        faults: &mut Faults,
    ) -> Option<Terms> {
        let flight = self.flights.read_terms(request, stated, faults)?;
        Some(Terms {
            // Nobody flies in the past, however clocks differ.
            departs_at: stated.start.max(stated.now),
            airspeed_mps: flight.kind.airframe.airspeed_mps,
            flight: Some(flight),
        })
    }

    fn compose(&self, scene: Scene<'_>, wanted: &Wanted<'_>) -> Result<Course, Refusal> {
        match &wanted.terms.flight {
            Some(terms) => self.flights.compose(scene, wanted, terms),
            None => self.by_distance.compose(scene, wanted),
        }
    }

    fn check_composed(
        &self,
        scene: Scene<'_>,
        wanted: &Wanted<'_>,
        course: &Course,
    ) -> Result<(), Fault> {
        let (Some(FlightTerms { kind, .. }), Some(version)) =
            (&wanted.terms.flight, &course.flight)
        else {
            return self.by_distance.check_composed(scene, wanted, course);
        };
        let Some((request, told)) = as_asked(scene.topology(), wanted, course) else {
            return Ok(());
        };
        let known = Known {
            at_s: self.flights.seconds(course.departs_at),
            ..Known::default()
        };
        let own = scene.traffic.own(None, wanted.drone_id);
        let version = Some((&**version, course.departs_at));
        self.flights
            .check_version(scene, (kind, own), version, &request, &known, &told)
    }

    fn airspeed_mps(&self, airframe: Option<&str>, plan: Option<&PlanEntry>) -> Option<f64> {
        let named = airframe.and_then(|name| self.flights.airframe(Some(name), None));
        let otherwise = || self.flights.airframe(None, None);
        match (named, plan) {
            (Some(airframe), _) => Some(airframe.airspeed_mps),
            (None, Some(plan)) => Some(plan.airspeed_mps),
            (None, None) => otherwise().map(|airframe| airframe.airspeed_mps),
        }
    }

    fn answers_at_once(&self, _report: &wire::FailureReport, _topology: &Topology) -> bool {
        // Every leg has contingencies that are searched.
        false
    }

    fn recompose(
        &self,
        scene: Scene<'_>,
        asked: &Asked<'_>,
        read: &mut Vec<ReadWarning>,
    ) -> Answer {
        let is_lost = read
            .iter()
            .any(|warning| warning.code == "destination_unknown");
        // Nobody can say whether the drone gets where nobody knows.
        let drone = if is_lost {
            None
        } else {
            self.flights.reporting(scene, asked, read)
        };
        match drone {
            Some(drone) => self.flights.answer_report(scene, drone, asked.request),
            None => self.by_distance.recompose(scene, asked, read),
        }
    }

    fn recompose_plainly(
        &self,
        scene: Scene<'_>,
        request: &Request,
        refused: &Answer,
    ) -> Option<Answer> {
        let drone = refused.flight.as_ref()?.drone.clone();
        let baseline = Request {
            strategy: Strategy::Exact,
            ..request.clone()
        };
        Some(self.flights.answer_without_tables(scene, drone, &baseline))
    }

    fn replan(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        request: Request,
        (leg, sighting): (usize, Option<&Sighting>),
    ) -> (Request, Answer) {
        if plan.reported.flight.is_none() {
            return self
                .by_distance
                .replan(scene, plan, request, (leg, sighting));
        }
        // What its drone has reported does not fit one that stands.
        let may_stand = !request.report.failure.closes_leg();
        let stand = || {
            self.flights
                .stand(scene.topology(), plan, sighting, scene.now)
        };
        if let Some(stand) = may_stand.then(stand).flatten() {
            let at = (stand, sighting);
            let goal = (request.report.destination, request.onward);
            return self.replan_standing(scene, plan, at, goal);
        }
        let at = (leg, sighting);
        let answer = self.flights.answer_in_flight(scene, plan, &request, at);
        (request, answer)
    }

    fn replan_displaced(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        displaced: Displaced<'_>,
    ) -> Option<(Request, Answer)> {
        if plan.reported.flight.is_none() {
            return self.by_distance.replan_displaced(scene, plan, displaced);
        }
        let Displaced {
            before,
            destination,
            onward,
            request,
            leg,
            sighting,
        } = displaced;
        let stand = self
            .flights
            .stand(before, plan, sighting.as_ref(), scene.now);
        let stand = stand.and_then(|stand| {
            let node = scene.topology().node(before.node_id(stand.node))?;
            Some(Stand { node, ..stand })
        });
        if let Some(stand) = stand {
            let at = (stand, sighting.as_ref());
            return Some(self.replan_standing(scene, plan, at, (destination, onward)));
        }
        let request = request?;
        let at = (leg, sighting.as_ref());
        let answer = self.flights.answer_in_flight(scene, plan, &request, at);
        Some((request, answer))
    }

    fn course(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (occasion, request): (Occasion, &Request),
        answer: &Answer,
    ) -> Option<Course> {
        let Some(flight) = &answer.flight else {
            let asked = (occasion, request);
            return self.by_distance.course(scene, plan, asked, answer);
        };
        // Also where it flies on as it was: its legs, its stops and their pads are at other times now.
        let (version, way) = flight.version.as_ref()?;
        let first = *way.way.nodes.first()?;
        let stretch_m = answer.told.first_stretch_m;
        Some(Course {
            composition: way.clone(),
            flight: Some(version.clone()),
            departs_at: flight.departs_at,
            stretch: Stretch::between(scene.airspace, &request.report, first, stretch_m),
            stops: without_end(&request.onward),
        })
    }

    fn with_contingencies(&self, scene: Scene<'_>, plan: &PlanEntry, version: Version) -> Version {
        let Some(flown) = version.flight.clone() else {
            return self.by_distance.with_contingencies(scene, plan, version);
        };
        let ground = self.flights.ground_of(scene, plan);
        let departs_s = self.flights.seconds(version.departs_at);
        let absolute = flown.composition_at(departs_s);
        let contingencies = self.flights.with_scratch(scene.topology(), |scratch| {
            contingencies_of(&ground.world(), &absolute, scratch)
        });
        let mut composition = version.composition.clone();
        for (leg, contingency) in composition.legs.iter_mut().zip(&contingencies) {
            leg.if_closed = Some(contingency.if_closed.contingency.clone());
            leg.safe = contingency
                .safe
                .as_ref()
                .map(|alternate| alternate.safe.clone());
        }
        let ends = contingencies.iter();
        let flown = FlownVersion {
            ends: ends.map(|leg| LegEnds::of(leg, departs_s)).collect(),
            ..(*flown).clone()
        };
        Version {
            composition,
            flight: Some(Arc::new(flown)),
            ..version
        }
    }

    fn check(
        &self,
        scene: Scene<'_>,
        request: &Request,
        known: &Known,
        answer: &Answer,
    ) -> Result<(), Fault> {
        match &answer.flight {
            Some(_) if planted::is_unchecked() => Ok(()),
            Some(flight) => {
                let known = self.flights.known(flight, known, scene.now);
                self.flights
                    .check_report(scene, flight, request, &known, &answer.told)
            }
            None => self.by_distance.check(scene, request, known, answer),
        }
    }

    fn fall_back(
        &self,
        scene: Scene<'_>,
        request: &Request,
        known: &Known,
        alternatives: Alternatives<'_>,
        refused: (Answer, Fault),
    ) -> (Answer, Case) {
        let known = match &refused.0.flight {
            Some(flight) => self.flights.known(flight, known, scene.now),
            None => *known,
        };
        self.by_distance
            .fall_back(scene, request, &known, alternatives, refused)
    }

    fn still_valid(&self, scene: Scene<'_>, answer: &Answer, answered_at: Timestamp) -> bool {
        let Some(flight) = &answer.flight else {
            return self.by_distance.still_valid(scene, answer, answered_at);
        };
        let told = &answer.told;
        let is_diversion = told.outcome == Outcome::Diverted;
        let end = told.path.nodes.last().filter(|_| is_diversion);
        self.flights.still_holds(scene, flight, answered_at)
            && end.is_none_or(|&end| !scene.airspace.closes_pads(end))
    }

    fn obstruction(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        version: &Version,
        ahead: Ahead<'_>,
    ) -> Option<Vec<String>> {
        let Some(flown) = version.flight.as_deref() else {
            return self.by_distance.obstruction(scene, plan, version, ahead);
        };
        let (from_leg, stretch) = ahead;
        let mut ids = self
            .flights
            .closures_met(scene, plan, (version, flown), from_leg);
        ids.extend(progress::closures_at_ends(version, stretch, scene.airspace));
        let exceeds_battery = || {
            self.flights
                .exceeds_battery(scene, plan, (version, flown), from_leg)
        };
        (!ids.is_empty() || exceeds_battery()).then_some(ids)
    }

    fn affected_by(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        ahead: Ahead<'_>,
        obstruction: Option<Vec<String>>,
        causes: &Causes,
    ) -> Vec<String> {
        match plan.reported.flight {
            Some(_) => obstruction.unwrap_or_default(),
            None => self
                .by_distance
                .affected_by(scene, plan, ahead, obstruction, causes),
        }
    }

    fn is_met(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        ahead: Ahead<'_>,
        closure: &Closure,
    ) -> bool {
        let version = &plan.reported;
        let Some(flown) = version.flight.as_deref() else {
            return self.by_distance.is_met(scene, plan, ahead, closure);
        };
        let (from_leg, stretch) = ahead;
        let met = self
            .flights
            .closures_met(scene, plan, (version, flown), from_leg);
        met.contains(&closure.id) || progress::is_on_stretch(stretch, closure, scene.topology())
    }

    fn first_met(
        &self,
        scene: Scene<'_>,
        version: &Version,
        ahead: Ahead<'_>,
        closure: &Closure,
    ) -> Option<usize> {
        let Some(_) = version.flight else {
            return self.by_distance.first_met(scene, version, ahead, closure);
        };
        let over_at = self.flights.over_at(version);
        let mut windows = closure.windows.iter();
        let counts = windows.any(|window| window.meets(scene.now, over_at));
        if !closure.windows.is_empty() && !counts {
            return None;
        }
        if version.lands_on_pads_of(closure) {
            return Some(ahead.0);
        }
        progress::first_hit(version, ahead, closure, scene.topology())
    }

    fn meets(
        &self,
        scene: Scene<'_>,
        own: Own<'_>,
        version: &Version,
        counts: &dyn Fn(&str) -> bool,
    ) -> bool {
        match version.flight.as_deref() {
            Some(_) => self.flights.meets(scene, own, version, counts),
            None => self.by_distance.meets(scene, own, version, counts),
        }
    }

    fn minds(&self, _concern: Concern, version: Option<&Version>) -> bool {
        version.is_none_or(|version| version.flight.is_some())
    }

    fn improves(&self, plan: &PlanEntry, progress: &Progress, answer: &Answer) -> bool {
        let flight = answer.flight.as_ref();
        let version = flight.and_then(|flight| Some((flight, flight.version.as_ref()?)));
        let (Some((flight, (flown, way))), Some(current)) =
            (version, plan.reported.flight.as_deref())
        else {
            return false;
        };
        let ends_at_stop = |warning: &Warning| matches!(warning, Warning::EndsAtStop { .. });
        let is_whole = plan.ends_early() || !answer.told.warnings.iter().any(ends_at_stop);
        let leads_there =
            is_whole && matches!(answer.told.outcome, Outcome::Rerouted | Outcome::Hold);
        if plan.waits_at().is_some() {
            return leads_there && !flown.composition.plan.legs.is_empty();
        }
        let lands_at = later(flight.departs_at, way.flight_time_s);
        let gains_s = plan
            .reported
            .arrives_at()
            .duration_since(lands_at)
            .as_secs_f64();
        let gains_m = progress.remaining_m - way.length_m;
        let ahead_wh = current.energy_ahead_wh(progress.leg, progress.remaining_m);
        let gains_wh = ahead_wh - flown.composition.figures.energy_wh;
        let lands_earlier = gains_s > LEAST_GAIN_S;
        leads_there
            && match current.composition.objective {
                Objective::Distance => {
                    gains_m > LEAST_GAIN_M || (lands_earlier && gains_m > -LEAST_GAIN_M)
                }
                Objective::Time => lands_earlier,
                Objective::Energy => gains_wh > LEAST_GAIN_WH,
            }
    }

    fn apart_s(
        &self,
        topology: &Topology,
        version: &Version,
        (leg, place): (usize, Point),
        seen_s: f64,
    ) -> Option<f64> {
        let flown = version.flight.as_deref()?;
        Some(flown.expected(topology, leg, place)?.apart_s(seen_s))
    }

    fn is_off(
        &self,
        topology: &Topology,
        version: &Version,
        progress: &Progress,
        sighting: &Sighting,
    ) -> bool {
        let (Some(flown), Location::At(place)) = (version.flight.as_deref(), progress.location)
        else {
            return false;
        };
        let seen_s = sighting
            .seen_at
            .duration_since(version.departs_at)
            .as_secs_f64();
        let expected = flown.expected(topology, progress.leg, place);
        expected.is_some_and(|expected| {
            let settings = &self.flights.settings;
            let tolerances = (settings.late_tolerance_s, settings.battery_tolerance);
            expected.is_missed(seen_s, sighting.battery_here(), tolerances)
        })
    }
}
