//! The answer to a failure report, and what is kept of it.

use super::failure::{FailureReport, FailureType, Strategy};
use super::first_stretch::{FirstStretch, Flag, IfAirborne, Near, UnsafeWay};
use super::flight::{Flight, FlightCause, Opening};
use super::id::Id;
use super::outcome::{Outcome, Path, Warning};
use super::plan::Leg;
use super::status::Stamp;
use super::zone::RecordedClosure;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// Where a search looked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The whole network.
    Global,
    /// A circle.
    Circle,
    /// A window of cells.
    Cells,
    /// The triangle of the two-phased strategy.
    Triangle,
    /// Its rhombus.
    Rhombus,
    /// Its rectangle.
    Rectangle,
    /// The rectangle with nearest neighbours added.
    Grown,
    /// The whole network, for a baseline from one end of the leg to the other.
    Local,
}

/// One attempt to reconnect the old plan over a run of closed legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Repair<'a> {
    /// The last open node before the run.
    pub from: Id<'a>,
    /// The next open node after it, or a later one.
    pub to: Id<'a>,
    /// Length of the new part in metres; null when this attempt found none.
    pub recomposed_length_m: Option<f64>,
    /// Where the last search looked.
    pub stage: Stage,
    /// Areas examined.
    pub searches: u32,
    /// Nodes of the last area.
    pub area_nodes: usize,
    /// Open segments with both ends in the last area.
    pub area_segments: usize,
    /// Nodes settled by all searches.
    pub settled_nodes: usize,
}

/// A cause that cut the drone off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(tag = "cause", rename_all = "snake_case")]
pub enum Severance<'a> {
    /// The failed leg itself, or what the report brought.
    Report,
    /// A standing closure.
    Closure {
        /// Its id.
        id: Cow<'a, str>,
    },
    /// The network has no way, whatever is open.
    Network,
}

/// One stage of a local strategy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct AreaStage<'a> {
    /// Which.
    pub stage: Stage,
    /// Whether it was skipped for having too few nodes.
    pub skipped: bool,
    /// The nodes of its area.
    pub nodes: Vec<Id<'a>>,
    /// The area as GeoJSON geometry.
    #[schema(value_type = Object)]
    pub area: Value,
    /// Whether it was searched.
    pub searched: bool,
    /// Whether the search found a path.
    pub path_found: bool,
}

/// What becomes of what a report closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PublicationState {
    /// It is closed for everyone from the next revision on.
    Published,
    /// It waits for an operator.
    Proposed,
    /// It binds this answer alone.
    None,
}

impl PublicationState {
    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Proposed => "proposed",
            Self::None => "none",
        }
    }
}

/// What becomes of what a report closes, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Publication<'a> {
    /// What becomes of it.
    pub state: PublicationState,
    /// Id of the closure, where one is published.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closure_id: Option<Cow<'a, str>>,
    /// Ids of the proposals, where there are any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub proposal_ids: Vec<Cow<'a, str>>,
    /// Why it is not published.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Cow<'a, str>>,
}

/// The plan that an answer would change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PlanReference<'a> {
    /// Id of the plan.
    pub id: Cow<'a, str>,
    /// The version to acknowledge with `POST /v1/plans/{id}/ack`; null where the answer has no path.
    pub version: Option<u32>,
}

/// What the engine answers: outcome, path, and what tells how it came about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Answer<'a> {
    /// What the drone is to do.
    pub outcome: Outcome,
    /// The whole remaining path; empty where there is none.
    pub path: Path<'a>,
    /// From where the drone is to the first node of the path, in metres.
    pub first_stretch_m: f64,
    /// How the drone comes to the first node of the path; null without a path.
    pub first_stretch: Option<FirstStretch<'a>>,
    /// What holds of the way told.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flags: Vec<Flag>,
    /// For `no_route`: the least bad way, which is never a path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsafe_way: Option<UnsafeWay<'a>>,
    /// For `no_route` in flight: what is near, the nearest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub near: Vec<Near<'a>>,
    /// Where it is unknown whether the drone is in the air: the answer to one that is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub if_airborne: Option<Box<IfAirborne<'a>>>,
    /// The new part without the first stretch, in metres.
    pub recomposed_length_m: Option<f64>,
    /// The whole remaining route, first stretch included, in metres.
    pub remaining_length_m: Option<f64>,
    /// The strategy asked for.
    pub strategy: Strategy,
    /// The strategy that answered.
    pub strategy_used: Strategy,
    /// Why they differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback_reason: Option<Cow<'a, str>>,
    /// Where the last search looked.
    pub stage: Stage,
    /// Areas examined.
    pub searches: u32,
    /// Nodes of the area searched last.
    pub area_nodes: usize,
    /// Open segments with both ends in that area.
    pub area_segments: usize,
    /// Nodes settled by all searches.
    pub settled_nodes: usize,
    /// Optimum from the leg's start to its end in metres, when asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local_optimum_m: Option<f64>,
    /// Optimum from the leg's start to the destination in metres, when asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub global_optimum_m: Option<f64>,
    /// Optimum from the drone to the destination in metres, first stretch included, when asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remaining_optimum_m: Option<f64>,
    /// Every attempt to repair the old plan, where there was more than one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub repairs: Vec<Repair<'a>>,
    /// Where there is no way to the destination: what cut the drone off.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub severed_by: Vec<Severance<'a>>,
    /// The stages in order, when asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<AreaStage<'a>>,
    /// What was assumed or passed over, and what the drone should know.
    pub warnings: Vec<Warning<'a>>,
    /// `checked` where the battery suffices by the flight model and what the drone said, `assumed` where
    /// something in that is a default, `unchecked` where nothing is known of it.
    pub energy: Cow<'a, str>,
    /// What is a default, where energy is `assumed`: `airframe`, `battery`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<Cow<'a, str>>,
}

/// A recomposition: the edge's answer to a failure report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Recomposition<'a> {
    /// Id of this answer, for `GET /v1/recompositions/{id}` and `skyway replay`.
    pub id: Cow<'a, str>,
    /// What the drone is to do, and how it came about.
    #[serde(flatten)]
    pub answer: Answer<'a>,
    /// Time to the end of the path in seconds; null without a path.
    pub remaining_time_s: Option<f64>,
    /// `computed` by the flight model; `nominal` without it: at the airspeed, without wind, climb or stops.
    pub times: Cow<'a, str>,
    /// `none` where the edge plans by distance; absent elsewhere, where `flight` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub airframe: Option<Cow<'a, str>>,
    /// What becomes of what the report closes.
    pub publication: Publication<'a>,
    /// The plan that this answer would change, where the edge knows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanReference<'a>>,
    /// The legs of the new path with their contingencies, where the edge knows the plan.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub legs: Vec<Leg<'a>>,
    /// How the path is flown, with the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<Flight<'a>>,
    /// Where the destination cannot be reached, with the flight model: all that keeps the drone from it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<FlightCause<'a>>,
    /// Where only the deadline keeps the drone from its destination: the plan that there would be without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opens: Option<Opening<'a>>,
    /// True when this is the stored answer of a report sent before.
    pub replayed: bool,
    /// A drone that has not begun to follow this answer by then asks again, RFC 3339: windows may have turned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_until: Option<Cow<'a, str>>,
    /// The world it was computed on.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// The answer to `POST /v1/failures:batch`: one entry for each report, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct BatchAnswer<'a> {
    /// The entries.
    pub answers: Vec<BatchEntry<'a>>,
}

/// One report's answer, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BatchEntry<'a> {
    /// The answer.
    Recomposition(Box<Recomposition<'a>>),
    /// Why there is none.
    Problem(Box<super::Problem>),
}

/// A line of the list of what was answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RecordSummary<'a> {
    /// Id of the answer.
    pub id: Cow<'a, str>,
    /// When it was given, RFC 3339.
    pub answered_at: Cow<'a, str>,
    /// What failed.
    pub failure: FailureType,
    /// The drone, where the report names one.
    pub drone_id: Option<Cow<'a, str>>,
    /// The plan, where the edge knows it.
    pub plan_id: Option<Cow<'a, str>>,
    /// The failed leg: its two nodes; absent where none could be found.
    pub leg: Option<[Id<'a>; 2]>,
    /// What the drone is to do.
    pub outcome: Outcome,
    /// The new path.
    pub path: Path<'a>,
    /// The path before the failure, the failed leg first.
    pub old_path: Vec<Id<'a>>,
    /// The whole remaining route in metres; null without a path.
    pub remaining_length_m: Option<f64>,
    /// True when nothing was published.
    pub dry_run: bool,
    /// Revision of the world it was computed on.
    pub revision: Cow<'a, str>,
}

/// What was answered, latest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Recompositions<'a> {
    /// The answers.
    pub recompositions: Vec<RecordSummary<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world at the time of this list.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// The world an answer was computed on, as far as it can be told again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RecordedWorld<'a> {
    /// Revision of the edge.
    pub revision: Cow<'a, str>,
    /// Changes with nodes and segments.
    pub topology_revision: u64,
    /// SHA-256 of the network's file.
    pub network_sha256: Cow<'a, str>,
    /// The time it was computed for, RFC 3339.
    pub as_of: Cow<'a, str>,
    /// How far ahead a window counted as closing already, in seconds.
    pub horizon_s: f64,
    /// Every closure that counted.
    pub closures: Vec<RecordedClosure<'a>>,
    /// With the flight model: the drone, its battery, the wind, the rules, and what other plans take.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub flight: Option<Value>,
}

/// All that is kept of an answer: enough to compute it again, and to explain it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Record<'a> {
    /// Id of the answer.
    pub id: Cow<'a, str>,
    /// When it was given, RFC 3339.
    pub answered_at: Cow<'a, str>,
    /// The report as it was read.
    pub report: FailureReport,
    /// The report with everything that was looked up or assumed put in: by itself it gives the same answer.
    pub settled_report: FailureReport,
    /// The answer.
    pub answer: Recomposition<'a>,
    /// The world it was computed on.
    pub world: RecordedWorld<'a>,
    /// The proof that an exact answer is the optimum, with `?certificate=true`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub certificate: Option<Value>,
    /// The answer that the checker did not let pass, which this one stands in for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checker_case: Option<CheckerCase<'a>>,
}

/// An answer that the checker did not let pass, and what went instead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct CheckerCase<'a> {
    /// The rule that it breaks: a stable code.
    pub rule: Cow<'a, str>,
    /// Where it breaks it, for people.
    pub place: Cow<'a, str>,
    /// What is wrong with it, for people.
    pub message: Cow<'a, str>,
    /// The figure that it stated, where the rule is about one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stated: Option<f64>,
    /// What that figure is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found: Option<f64>,
    /// What it would have told.
    pub outcome: Outcome,
    /// The nodes that it would have led over.
    pub nodes: Vec<Id<'a>>,
    /// What went instead: `baseline`, `reported`, `contingency`, `alternate`, `no_route`, or `refusal` of a plan that was asked for.
    pub fallback: Cow<'a, str>,
}
