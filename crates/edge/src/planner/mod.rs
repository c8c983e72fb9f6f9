//! What drones are to fly: composed, recomposed, checked, and held against what changes.
//!
//! There are two planners. [`ByDistance`] knows neither clock nor battery; [`Flown`] computes both, and leaves to the first what
//! it knows too little of. An edge has one of them, and nothing outside this folder asks which.

mod answer;
mod by_distance;
mod flown;
mod scene;
mod traffic;
mod version;

pub(super) use answer::{Answer, Course, Sent};
pub(super) use by_distance::{DEFAULT_AIRSPEED_MPS, way_is_open};
pub(super) use flown::{Assumed, DetourEnd, DetourStop, FlightOrder, FlownVersion, LegEnds};
pub(super) use scene::{
    AT_NODE_M, Asked, Concern, Displaced, ON_PAD_M, Occasion, Scene, Stated, Terms, Wanted,
};
pub(super) use traffic::{Own, Traffic, legs, occupation, occupied, stays};
pub(super) use version::{Version, later};

use crate::drones::Sighting;
use crate::drones::progress::{Ahead, Progress};
use crate::network::tables::Tables;
use crate::plans::entry::PlanEntry;
use crate::replanning::Causes;
use crate::settings::Settings;
use by_distance::ByDistance;
use flown::Flown;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::airspace::Closure;
use skyway_engine::checked::{Alternatives, Case, Known};
use skyway_engine::checker::Fault;
use skyway_engine::geo::Point;
use skyway_engine::network::Topology;
use skyway_engine::recompose::Request;
use skyway_formats::ReadWarning;
use skyway_service::intake::Faults;
use skyway_service::refusal::Refusal;
use std::fmt::Debug;
use std::sync::Arc;

/// The planner that settings ask for, of an edge that begins at an instant.
pub(super) fn planner_of(settings: &Settings, zero: Timestamp, tables: Tables) -> Arc<dyn Planner> {
    let by_distance = ByDistance::new(tables, settings.headway_s);
    match Flown::of(settings, zero, &by_distance) {
        Some(flown) => Arc::new(flown),
        None => Arc::new(by_distance),
    }
}

/// Works out what drones are to fly, in a scene: what is closed, the wind, the traffic of all plans, and the time.
pub(super) trait Planner: Debug + Send + Sync {
    /// Reads what a delivery request asks for of its flight; `None` where it has faults, which are added.
    fn read_terms(
        &self,
        request: &wire::DeliveryRequest,
        stated: &Stated,
        faults: &mut Faults,
    ) -> Option<Terms>;

    /// Composes a delivery.
    ///
    /// # Errors
    /// When there is no way: every cause.
    fn compose(&self, scene: Scene<'_>, wanted: &Wanted<'_>) -> Result<Course, Refusal>;

    /// Checks what was composed.
    ///
    /// # Errors
    /// The first rule that it breaks.
    fn check_composed(
        &self,
        scene: Scene<'_>,
        wanted: &Wanted<'_>,
        course: &Course,
    ) -> Result<(), Fault>;

    /// How fast a drone flies that does not say so: as the airframe that it names, as its plan has it, as drones do here.
    fn airspeed_mps(&self, airframe: Option<&str>, plan: Option<&PlanEntry>) -> Option<f64>;

    /// Whether a report is answered within microseconds, so that it may be answered in place.
    fn answers_at_once(&self, report: &wire::FailureReport, topology: &Topology) -> bool;

    /// Answers a report. What of it cannot be so is passed over with a warning.
    fn recompose(&self, scene: Scene<'_>, asked: &Asked<'_>, read: &mut Vec<ReadWarning>)
    -> Answer;

    /// The same without anything that was worked out before, where that may be another answer.
    fn recompose_plainly(&self, _: Scene<'_>, _: &Request, _refused: &Answer) -> Option<Answer> {
        None
    }

    /// Answers the drone of a plan that is on a leg when the world has changed; gives with it what was asked, which for one
    /// that stands on a pad is asked from there.
    fn replan(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        request: Request,
        at: (usize, Option<&Sighting>),
    ) -> (Request, Answer);

    /// The same where the leg of the drone is gone; `None` where nobody knows where it is.
    fn replan_displaced(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        displaced: Displaced<'_>,
    ) -> Option<(Request, Answer)>;

    /// What the drone of a plan flies after an answer, each leg with its contingencies; `None` where there is nothing, or it
    /// goes on as it was.
    fn course(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        asked: (Occasion, &Request),
        answer: &Answer,
    ) -> Option<Course>;

    /// A version with its contingencies worked out anew.
    fn with_contingencies(&self, scene: Scene<'_>, plan: &PlanEntry, version: Version) -> Version;

    /// Checks an answer, with what is known of who asked.
    ///
    /// # Errors
    /// The first rule that it breaks.
    fn check(
        &self,
        scene: Scene<'_>,
        request: &Request,
        known: &Known,
        answer: &Answer,
    ) -> Result<(), Fault>;

    /// What goes instead of an answer that did not pass, by distance: the first that does.
    fn fall_back(
        &self,
        scene: Scene<'_>,
        request: &Request,
        known: &Known,
        alternatives: Alternatives<'_>,
        refused: (Answer, Fault),
    ) -> (Answer, Case);

    /// Whether the path of an answer of an instant can still be flown.
    fn still_valid(&self, scene: Scene<'_>, answer: &Answer, answered_at: Timestamp) -> bool;

    /// What is in the way of a version of a plan from a place on: ids, as far as they are told by times, and none where it is
    /// the wind; `None` where nothing is.
    fn obstruction(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        version: &Version,
        ahead: Ahead<'_>,
    ) -> Option<Vec<String>>;

    /// The ids of all closures that affect a plan, by what is in the way of its drone: those known that still count, and these.
    fn affected_by(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        ahead: Ahead<'_>,
        obstruction: Option<Vec<String>>,
        causes: &Causes,
    ) -> Vec<String>;

    /// Whether a closure meets a plan from a place on.
    fn is_met(
        &self,
        scene: Scene<'_>,
        plan: &PlanEntry,
        ahead: Ahead<'_>,
        closure: &Closure,
    ) -> bool;

    /// The first leg of a version from a place on that a closure may meet.
    fn first_met(
        &self,
        scene: Scene<'_>,
        version: &Version,
        ahead: Ahead<'_>,
        closure: &Closure,
    ) -> Option<usize>;

    /// Whether a version would come too near to what those plans take that count, in the air or on a pad.
    fn meets(
        &self,
        scene: Scene<'_>,
        own: Own<'_>,
        version: &Version,
        counts: &dyn Fn(&str) -> bool,
    ) -> bool;

    /// Whether something makes a difference to a version; to any, where none is named.
    fn minds(&self, _: Concern, _: Option<&Version>) -> bool {
        false
    }

    /// Whether an answer is better than what the drone of a plan flies, by more than it costs to tell.
    fn improves(&self, _: &PlanEntry, _: &Progress, _: &Answer) -> bool {
        false
    }

    /// How much earlier or later a drone is at a place of a leg than its version has it there, in seconds from the departure;
    /// `None` where no times are computed.
    fn apart_s(&self, _: &Topology, _: &Version, _: (usize, Point), _seen_s: f64) -> Option<f64> {
        None
    }

    /// Whether a drone was seen earlier, later or emptier than its version has it where it is, by more than is tolerated.
    fn is_off(&self, _: &Topology, _: &Version, _: &Progress, _: &Sighting) -> bool {
        false
    }
}
