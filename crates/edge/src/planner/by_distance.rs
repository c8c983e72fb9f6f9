//! The planner without battery and clock: the shortest open way, at nominal times.

use super::{
    Answer, Asked, Course, Displaced, Occasion, Own, Planner, Scene, Stated, Terms, Version, Wanted,
};
use crate::drones::Sighting;
use crate::drones::progress::{self, Ahead};
use crate::network::tables::Tables;
use crate::plans::entry::PlanEntry;
use crate::plans::stops::{with_end, without_end};
use crate::plans::stretches::Stretch;
use crate::replanning::Causes;
use crate::scratches::Scratches;
use jiff::Timestamp;
use skyway_contract::{self as wire, PlanState};
use skyway_engine::airspace::{Airspace, Change, Closure};
use skyway_engine::checked::{
    self, Alternatives, Case, Checked, FallenBackTo, Known, check_answer,
};
use skyway_engine::checker::Fault;
use skyway_engine::compose::{compose, with_contingencies};
use skyway_engine::flight::{Aloft, FailureReport, FailureType, Location, Reentry, ServiceStop};
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::{
    Outcome, Recomposition, Request, Scratch, Strategy, World, recompose,
};
use skyway_engine::routing::Path;
use skyway_formats::ReadWarning;
use skyway_planted as planted;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Airspeed where nobody gives one, in metres per second.
pub(crate) const DEFAULT_AIRSPEED_MPS: f64 = 16.0;
/// Up to this many nodes the exact answer without a table takes well under a millisecond.
const SMALL_NODES: usize = 20_000;

/// The planner without battery and clock.
#[derive(Clone, Debug)]
pub(super) struct ByDistance {
    tables: Tables,
    scratches: Arc<Scratches>,
    headway_s: f64,
}

impl ByDistance {
    pub(super) fn new(tables: Tables, headway_s: f64) -> Self {
        Self {
            tables,
            scratches: Arc::default(),
            headway_s,
        }
    }

    /// The world of a scene, with its tables.
    fn world<'a>(&'a self, scene: Scene<'a>) -> World<'a> {
        World {
            airspace: scene.airspace,
            trees: (!scene.is_imagined).then_some(self.tables.trees()),
        }
    }

    fn searching<T>(&self, topology: &Topology, search: impl FnOnce(&mut Scratch) -> T) -> T {
        let mut scratch = self.scratches.take(topology);
        let found = search(&mut scratch);
        self.scratches.give_back(scratch);
        found
    }
}

impl Planner for ByDistance {
    fn read_terms(
        &self,
        request: &wire::DeliveryRequest,
        stated: &Stated,
        faults: &mut Faults,
    ) -> Option<Terms> {
        refuse_flight(request, faults);
        Some(Terms {
            departs_at: stated.start,
            airspeed_mps: stated.airspeed_mps.unwrap_or(DEFAULT_AIRSPEED_MPS),
            flight: None,
        })
    }

    fn compose(&self, scene: Scene<'_>, wanted: &Wanted<'_>) -> Result<Course, Refusal> {
        let topology = scene.topology();
        let world = World {
            trees: (!wanted.plainly).then_some(self.tables.trees()),
            ..self.world(scene)
        };
        let Wanted { source, terms, .. } = *wanted;
        let destination = wanted.destination.ok_or_else(|| {
            let detail = "nothing says where the delivery goes";
            Refusal::new(Code::PlanInvalid, detail)
        })?;
        let speed_mps = terms.airspeed_mps;
        let composition = self.searching(topology, |scratch| {
            compose(&world, source, destination, speed_mps, scratch)
        });
        let composition = composition.ok_or_else(|| {
            let [from, to] = [source, destination].map(|node| topology.node_id(node));
            let detail = format!(
                "no open way leads from node '{from}' to node '{to}' at revision {}",
                scene.revision
            );
            Refusal::new(Code::NoRoute, detail)
        })?;
        Ok(Course {
            composition,
            flight: None,
            departs_at: terms.departs_at,
            stretch: None,
            stops: Vec::new(),
        })
    }

    fn check_composed(
        &self,
        scene: Scene<'_>,
        wanted: &Wanted<'_>,
        course: &Course,
    ) -> Result<(), Fault> {
        match as_asked(scene.topology(), wanted, course) {
            Some((request, told)) => {
                check_answer(scene.airspace, &request, &Known::default(), &told, None)
            }
            None => Ok(()),
        }
    }

    fn airspeed_mps(&self, _airframe: Option<&str>, plan: Option<&PlanEntry>) -> Option<f64> {
        plan.map(|plan| plan.airspeed_mps)
    }

    fn answers_at_once(&self, report: &wire::FailureReport, topology: &Topology) -> bool {
        let strategy = report.strategy;
        let is_exact = strategy.is_none_or(|strategy| strategy == wire::Strategy::Exact);
        let asks_for_more =
            report.optimum == Some(true) || report.explain == Some(true) || report.zone.is_some();
        is_exact && !asks_for_more && topology.node_count() <= SMALL_NODES
    }

    fn recompose(
        &self,
        scene: Scene<'_>,
        asked: &Asked<'_>,
        _read: &mut Vec<ReadWarning>,
    ) -> Answer {
        let world = self.world(scene);
        let told = self.searching(scene.topology(), |scratch| {
            recompose(&world, asked.request, scratch)
        });
        self.tables.want(asked.request.report.destination, &world);
        Answer::by_distance(told)
    }

    fn replan(
        &self,
        scene: Scene<'_>,
        _plan: &PlanEntry,
        request: Request,
        _at: (usize, Option<&Sighting>),
    ) -> (Request, Answer) {
        let world = self.world(scene);
        let told = self.searching(scene.topology(), |scratch| {
            recompose(&world, &request, scratch)
        });
        (request, Answer::by_distance(told))
    }

    fn replan_displaced(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        displaced: Displaced<'_>,
    ) -> Option<(Request, Answer)> {
        let at = (displaced.leg, displaced.sighting.as_ref());
        Some(self.replan(scene, plan, displaced.request?, at))
    }

    fn course(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (occasion, request): (Occasion, &Request),
        answer: &Answer,
    ) -> Option<Course> {
        let told = &answer.told;
        let has_reported = occasion == Occasion::Report;
        let destination = match told.outcome {
            // A drone that holds on the ground keeps its plan until the zone over it has ended.
            Outcome::NoRoute | Outcome::Hold => return None,
            Outcome::Unaffected if has_reported => return None,
            Outcome::Diverted => *told.path.nodes.last()?,
            Outcome::Rerouted | Outcome::Unaffected => request.report.destination,
        };
        // What its drone has reported stays closed in its contingencies too.
        let closes = has_reported || request.report.failure.closes_leg();
        let imagined = closes.then(|| as_reported(scene.airspace, request, scene.now));
        let world = match &imagined {
            Some(airspace) => World {
                airspace,
                trees: None,
            },
            None => self.world(scene),
        };
        let (way, stretch_m) = (told.path.clone(), told.first_stretch_m);
        let speed_mps = plan.airspeed_mps;
        let composition = self.searching(scene.topology(), |scratch| {
            with_contingencies(&world, way, stretch_m, destination, speed_mps, scratch)
        });
        // Who is to start later starts no sooner for that.
        let waits =
            plan.state == PlanState::Accepted && request.circumstances.aloft == Aloft::Grounded;
        let starts_at = plan.reported.departs_at.max(scene.now);
        Some(Course {
            composition,
            flight: None,
            departs_at: if waits { starts_at } else { scene.now },
            stretch: Stretch::of(scene.airspace, told.reentry),
            stops: without_end(&request.onward),
        })
    }

    fn with_contingencies(&self, scene: Scene<'_>, plan: &PlanEntry, version: Version) -> Version {
        let way = version.composition.way.clone();
        let Some(&last) = way.nodes.last() else {
            return version;
        };
        let world = self.world(scene);
        let (stretch_m, speed_mps) = (version.first_stretch_m, plan.airspeed_mps);
        let composition = self.searching(scene.topology(), |scratch| {
            with_contingencies(&world, way, stretch_m, last, speed_mps, scratch)
        });
        Version {
            composition,
            // Its times are nominal from now on.
            flight: None,
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
        if planted::is_unchecked() {
            return Ok(());
        }
        check_answer(scene.airspace, request, known, &answer.told, None)
    }

    fn fall_back(
        &self,
        scene: Scene<'_>,
        request: &Request,
        known: &Known,
        alternatives: Alternatives<'_>,
        (refused, fault): (Answer, Fault),
    ) -> (Answer, Case) {
        let airspace = scene.airspace;
        let (outcome, nodes) = (refused.told.outcome, refused.told.path.nodes.clone());
        let otherwise = Case {
            fault,
            outcome,
            nodes,
            fallback: FallenBackTo::NoRoute,
        };
        let Checked { answer, case } = self.searching(scene.topology(), |scratch| {
            let refused = (refused.told, fault);
            checked::settle(airspace, request, known, alternatives, refused, scratch)
        });
        (Answer::by_distance(answer), case.unwrap_or(otherwise))
    }

    fn still_valid(&self, scene: Scene<'_>, answer: &Answer, _answered_at: Timestamp) -> bool {
        let told = &answer.told;
        let is_diversion = told.outcome == Outcome::Diverted;
        told.path.nodes.is_empty() || way_is_open(&told.path, is_diversion, scene.airspace)
    }

    fn obstruction(
        &self,
        scene: Scene<'_>,
        _plan: &PlanEntry,
        version: &Version,
        (from_leg, stretch): Ahead<'_>,
    ) -> Option<Vec<String>> {
        let ids = progress::closures_at_ends(version, stretch, scene.airspace);
        let is_blocked = progress::is_blocked(scene.airspace, &version.composition, from_leg);
        (is_blocked || !ids.is_empty()).then_some(ids)
    }

    fn affected_by(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (from_leg, stretch): Ahead<'_>,
        _obstruction: Option<Vec<String>>,
        causes: &Causes,
    ) -> Vec<String> {
        let airspace = scene.airspace;
        let is_met = |closure: &Closure| {
            progress::is_hit(closure, &plan.reported.composition, from_leg)
                || progress::is_on_stretch(stretch, closure, airspace.topology())
        };
        let known: BTreeSet<&str> = plan.affected_by.iter().map(String::as_str).collect();
        let still = plan.affected_by.iter().map(String::as_str);
        let still = still.filter(|id| airspace.is_in_force(id));
        let new = causes.iter().map(|cause| &**cause);
        let new = new.filter(|id| {
            let closure = airspace.closure(id).filter(|_| !known.contains(id));
            airspace.is_in_force(id) && closure.is_some_and(|closure| is_met(closure))
        });
        let mut ids: Vec<String> = still.chain(new).map(str::to_owned).collect();
        if ids.is_empty() {
            let all = airspace.in_force();
            let met = all.filter(|closure| is_met(closure));
            ids.extend(met.map(|closure| closure.id.clone()));
        }
        ids
    }

    fn is_met(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        (from_leg, stretch): Ahead<'_>,
        closure: &Closure,
    ) -> bool {
        scene.airspace.is_in_force(&closure.id)
            && (progress::is_hit(closure, &plan.reported.composition, from_leg)
                || progress::is_on_stretch(stretch, closure, scene.topology()))
    }

    fn meets(
        &self,
        scene: Scene<'_>,
        own: Own<'_>,
        version: &Version,
        counts: &dyn Fn(&str) -> bool,
    ) -> bool {
        scene.traffic.meets(own, version, self.headway_s, counts)
    }

    fn first_met(
        &self,
        scene: Scene<'_>,
        version: &Version,
        ahead: Ahead<'_>,
        closure: &Closure,
    ) -> Option<usize> {
        let is_in_force = scene.airspace.is_in_force(&closure.id);
        let first = || match version.lands_on_pads_of(closure) {
            true => Some(ahead.0),
            false => progress::first_hit(version, ahead, closure, scene.topology()),
        };
        is_in_force.then(first).flatten()
    }
}

/// Without battery and clock nothing can be promised of a flight.
fn refuse_flight(request: &wire::DeliveryRequest, faults: &mut Faults) {
    let asked = [
        ("/airframe", request.airframe.is_some()),
        ("/battery_fraction", request.battery_fraction.is_some()),
        ("/objective", request.objective.is_some()),
        ("/deadline", request.deadline.is_some()),
        ("/stops", request.stops.is_some()),
    ];
    for (pointer, _) in asked.into_iter().filter(|(_, is_asked)| *is_asked) {
        let message = "this edge computes neither times nor energy".to_owned();
        let hint = "leave it out, or turn the flight model on in the edge's configuration";
        faults.add("flight_model_off", pointer, message, Some(hint.to_owned()));
    }
}

/// The request that a composition answers, of a drone that stands at its source, and that answer; `None` where nothing is
/// checked.
pub(super) fn as_asked(
    topology: &Topology,
    wanted: &Wanted<'_>,
    course: &Course,
) -> Option<(Request, Recomposition)> {
    let way = &course.composition.way;
    let first = *way.nodes.first().filter(|_| !planted::is_unchecked())?;
    let told = Recomposition {
        outcome: Outcome::Rerouted,
        path: way.clone(),
        remaining_length_m: Some(course.composition.length_m),
        reentry: Some(Reentry::at_node(first, topology.position(first), None)),
        ..Recomposition::without_path(Strategy::Exact)
    };
    let last = *way.nodes.last()?;
    let onward = with_end(wanted.stops, wanted.destination.unwrap_or(last));
    let destination = wanted.destination.unwrap_or(last);
    let request = standing_at(first, way, (destination, onward));
    Some((request, told))
}

/// The request of a drone that stands at a node and is to fly a way, to a destination or by stops.
pub(super) fn standing_at(
    node: NodeIx,
    way: &Path,
    (destination, onward): (NodeIx, Vec<ServiceStop>),
) -> Request {
    let mut request = Request::exact(FailureReport {
        failure: FailureType::ServiceLevel,
        leg: (node, way.nodes.get(1).copied().unwrap_or(node)),
        location: Location::LegStart,
        cause_location: None,
        destination,
        remaining_path: None,
    });
    request.lead_by(onward);
    request
}

/// Whether a way can be flown now; a diversion also needs the pads at its end.
pub(crate) fn way_is_open(way: &Path, is_diversion: bool, airspace: &Airspace) -> bool {
    let closed = airspace.closed();
    let Some(&last) = way.nodes.last() else {
        return false;
    };
    let is_open =
        way.segments.iter().all(|&segment| !closed.blocks(segment)) && !closed.closes_node(last);
    is_open && (!is_diversion || !airspace.closes_pads(last))
}

/// The airspace with what a report closes, published or not: contingencies must not lead over it.
///
/// It is searched without tables, which know worlds by their numbers; the number of this one may come again.
fn as_reported(airspace: &Airspace, request: &Request, now: Timestamp) -> Airspace {
    let report = &request.report;
    let (from, to) = report.leg;
    let leg = airspace.topology().segment_between(from, to);
    let leg = leg.filter(|_| report.failure.closes_leg());
    let brought = request.zone.iter();
    let (segments, nodes): (Vec<_>, Vec<_>) = brought
        .map(|brought| (brought.hits.segments.clone(), brought.hits.nodes.clone()))
        .unzip();
    let segments = segments.into_iter().flatten().chain(leg).collect();
    let nodes = nodes.into_iter().flatten().collect();
    let id = "as-reported".to_owned();
    let closure = Closure::of_operator(id, String::new(), nodes, segments);
    airspace.apply(&[Change::Put(Arc::new(closure))], now)
}
