//! Delivery requests and composition plans.

use super::first_stretch::{FirstStretch, Flag, Waypoint};
use super::flight::{DetourFlight, Flight, LegFlight, ServiceStop};
use super::id::Id;
use super::numbers::some_whole_number;
use super::outcome::{Outcome, Path, Warning};
use super::status::Stamp;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A delivery request: the body of `POST /v1/plans`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DeliveryRequest {
    /// Id for the plan; one is made where none is given. 1 to 128 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 128)]
    pub id: Option<String>,
    /// Where the delivery starts.
    pub source: Id<'static>,
    /// Where it goes, by its stops. A delivery with stops and without a destination ends on the nearest pad that is free then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub destination: Option<Id<'static>>,
    /// Where it is served on its way, in order: pickups, drops, visits. Each has to have pads, and takes the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_items = 16)]
    pub stops: Option<Vec<ServiceStop<'static>>>,
    /// When it starts, RFC 3339; now where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub start_time: Option<String>,
    /// Payload in kilograms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0)]
    pub payload_kg: Option<f64>,
    /// The drone that flies it. Without one it is a quote: it takes neither air nor pads, and ends at `expires_at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 128)]
    pub drone_id: Option<String>,
    /// Airspeed in metres per second; 16 where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, maximum = 100)]
    pub airspeed_mps: Option<f64>,
    /// Name of the airframe that flies it; the edge's default where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub airframe: Option<String>,
    /// What is in the battery at the start, from 0 to 1; by telemetry, else full, where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub battery_fraction: Option<f64>,
    /// What is made least: `distance`, `time` or `energy`; the edge's default where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objective: Option<String>,
    /// The latest landing, RFC 3339; two and a half hours after the start where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub deadline: Option<String>,
    /// Whose drone is answered first where several in the air, or several on the ground, reach what closed at the same
    /// time: from 0 to 100, the highest first; 50, or the highest that its token may ask for, where none is given.
    #[serde(
        default,
        deserialize_with = "some_whole_number",
        skip_serializing_if = "Option::is_none"
    )]
    #[schema(minimum = 0, maximum = 100)]
    pub priority: Option<u32>,
    /// The delivery at the registry that it is flown for: the registry is told what becomes of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 128)]
    pub delivery_id: Option<String>,
}

/// How a plan stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlanState {
    /// To be flown; its drone has not departed.
    Accepted,
    /// Its drone has departed.
    Activated,
    /// Its drone is elsewhere, higher, lower, earlier or later than anything that it was told has it.
    Nonconforming,
    /// There is no way that its drone could be told, it declines all of them, or it is silent.
    Contingent,
    /// Over; `ended_as` says how.
    Ended,
}

/// What became of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndedAs {
    /// Its drone has landed at the destination.
    Delivered,
    /// Its drone has landed elsewhere.
    Diverted,
    /// It was deleted, or its way is gone.
    Cancelled,
    /// Nothing has been heard of its drone for long.
    Lost,
}

/// What holds of a plan beside its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlanFlag {
    /// Something ahead of its drone has closed; a recomposed version is wanted where there is a way.
    Affected,
    /// Nothing has been heard of its end, some time after its arrival.
    Overdue,
    /// A wanted version was not acknowledged in its time.
    Unacknowledged,
    /// Nothing was heard of its drone in flight for long: it may fly its contingencies.
    Silent,
}

/// A version that was sent to its drone and has not ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct SentVersion<'a> {
    /// Its number.
    pub version: u32,
    /// When its drone could first be told of it, RFC 3339.
    pub sent_at: Cow<'a, str>,
    /// What the drone is to do; a first version is `composed`.
    pub outcome: Cow<'a, str>,
}

/// What to do on a leg that closes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Contingency<'a> {
    /// What the drone would be told.
    pub outcome: Outcome,
    /// The nodes from the leg's start until the detour meets the plan again, or its end.
    pub nodes: Vec<Id<'a>>,
    /// The node of the plan at which the detour meets it again; null where it does not.
    pub rejoins: Option<Id<'a>>,
    /// From the leg's start to the end of the route so changed, in metres.
    pub remaining_length_m: Option<f64>,
    /// How much longer than the plan that is, in metres.
    pub extra_m: Option<f64>,
    /// How it is flown, with the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<DetourFlight<'a>>,
}

/// An alternate: open, with pads, and reachable; the nearest, with the flight model that of most battery.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Alternate<'a> {
    /// The node.
    pub node: Id<'a>,
    /// The nodes from the leg's start to it.
    pub nodes: Vec<Id<'a>>,
    /// How far it is, in metres.
    pub length_m: f64,
    /// How the way to it is flown, with the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<DetourFlight<'a>>,
}

/// A leg of a plan: a drone delivery service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Leg<'a> {
    /// The node it starts from.
    pub from: Id<'a>,
    /// The node it ends at.
    pub to: Id<'a>,
    /// Its segment.
    pub segment: Cow<'a, str>,
    /// Length over ground in metres, as the network states it.
    pub length_m: f64,
    /// Length through the air in metres, up and down included.
    #[serde(default)]
    pub length_air_m: f64,
    /// Its corners, from the height at which the first node is passed to that of the last.
    #[serde(default)]
    #[schema(value_type = Vec<Vec<f64>>)]
    pub geometry: Vec<Waypoint>,
    /// What heights are measured from: `agl`, `amsl` or `wgs84`; absent where they are unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_reference: Option<Cow<'a, str>>,
    /// Mean speed over ground that keeps its times, in metres per second.
    #[serde(default)]
    pub speed_mps: f64,
    /// The speed limit over ground, in metres per second, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_limit_mps: Option<f64>,
    /// Metres climbed on it, in all.
    #[serde(default)]
    pub climb_m: f64,
    /// When it starts, RFC 3339.
    pub departs_at: Cow<'a, str>,
    /// When it ends, RFC 3339.
    pub arrives_at: Cow<'a, str>,
    /// The detour to take if it closes; null while that is being worked out.
    pub if_closed: Option<Contingency<'a>>,
    /// Where to go when nothing else helps; null where there is none. Stored answers of before have its old name.
    #[serde(alias = "nearest_safe_node")]
    pub alternate: Option<Alternate<'a>>,
    /// How it is flown, with the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<LegFlight<'a>>,
}

/// Another active plan on the same segment at nearly the same time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Conflict<'a> {
    /// The other plan.
    pub plan_id: Cow<'a, str>,
    /// The segment.
    pub segment: Cow<'a, str>,
    /// The leg of this plan, counted from 0.
    pub leg: u32,
    /// `opposite` or `same`.
    pub direction: Cow<'a, str>,
    /// Seconds between the two, 0 where they overlap.
    pub gap_s: f64,
}

/// One version of a plan: what is to be flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PlanVersion<'a> {
    /// Counted from 1.
    pub version: u32,
    /// The epoch of the edge that made it. A drone takes only what is higher by `token`, `epoch` and `version`, in this order.
    pub epoch: u64,
    /// Rises when another edge takes the plan over; 0 before.
    pub token: u64,
    /// When the drone could first be told of it, RFC 3339.
    pub sent_at: Cow<'a, str>,
    /// What the drone is to do; a first version is `composed`.
    pub outcome: Cow<'a, str>,
    /// How the drone comes from its place to the first node; null where it is there and a leg begins.
    pub first_stretch: Option<FirstStretch<'a>>,
    /// The way.
    pub path: Path<'a>,
    /// Length in metres, what was flown before it not included.
    pub length_m: f64,
    /// Flying time in seconds; with the flight model from the departure to the landing, stops included.
    pub flight_time_s: f64,
    /// When its first leg starts, RFC 3339.
    pub departs_at: Cow<'a, str>,
    /// When its last leg ends, RFC 3339.
    pub arrives_at: Cow<'a, str>,
    /// The legs with their contingencies.
    pub legs: Vec<Leg<'a>>,
    /// The recomposition it came from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recomposition_id: Option<Cow<'a, str>>,
    /// Until when it is to be acknowledged, RFC 3339; only of a wanted version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledge_by: Option<Cow<'a, str>>,
    /// How it is flown, with the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<Flight<'a>>,
    /// What its drone should know of it, as answers tell it.
    #[serde(default)]
    pub flags: Vec<Flag>,
    /// What the drone should know.
    pub warnings: Vec<Warning<'a>>,
}

/// A composition plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Plan<'a> {
    /// The plan's id.
    pub id: Cow<'a, str>,
    /// How it stands.
    pub state: PlanState,
    /// What became of it, once it has ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_as: Option<EndedAs>,
    /// What holds beside the state.
    pub flags: Vec<PlanFlag>,
    /// The drone, where one is named.
    pub drone_id: Option<Cow<'a, str>>,
    /// The delivery at the registry that it is flown for, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delivery_id: Option<Cow<'a, str>>,
    /// Where the delivery starts.
    pub source: Id<'a>,
    /// Where it goes.
    pub destination: Id<'a>,
    /// Where it is served on its way, in order, from the beginning of the reported version on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stops: Vec<ServiceStop<'a>>,
    /// Payload in kilograms.
    pub payload_kg: f64,
    /// Airspeed in metres per second.
    pub airspeed_mps: f64,
    /// Name of its airframe; `none` where the edge plans by distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub airframe: Option<Cow<'a, str>>,
    /// What is made least, with the flight model: `distance`, `time` or `energy`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objective: Option<Cow<'a, str>>,
    /// The latest landing that it was asked for with, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline: Option<Cow<'a, str>>,
    /// Whose drone is answered first where several reach what closed at the same time: from 0 to 100, the highest first.
    #[schema(minimum = 0, maximum = 100)]
    pub priority: u32,
    /// Until when it is offered, RFC 3339: only of a quote, which names no drone and takes neither air nor pads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_at: Option<Cow<'a, str>>,
    /// What the drone says it flies.
    pub reported: PlanVersion<'a>,
    /// The newest version, until it is acknowledged: what the drone is asked to fly instead.
    pub wanted: Option<PlanVersion<'a>>,
    /// All that were sent and have not ended, in their order: the drone may be flying any of them.
    pub versions: Vec<SentVersion<'a>>,
    /// Ids of the closures that affect the reported version; none where it is the wind.
    pub affected_by: Vec<Cow<'a, str>>,
    /// Other plans too near any of the versions.
    pub conflicts: Vec<Conflict<'a>>,
    /// `checked` where the battery suffices by the flight model and what the client said, `assumed` where
    /// something in that is a default, `unchecked` where nothing is known of it.
    pub energy: Cow<'a, str>,
    /// What is a default, where energy is `assumed`: `airframe`, `battery`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<Cow<'a, str>>,
    /// `computed` by the flight model; `nominal` without it: at the airspeed, without wind, climb or stops.
    pub times: Cow<'a, str>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// How many plans are in each state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PlanCounts {
    /// To be flown.
    pub accepted: u32,
    /// Departed.
    pub activated: u32,
    /// With drones that are elsewhere than they were told.
    pub nonconforming: u32,
    /// Without a way that their drones could be told, or with silent ones.
    pub contingent: u32,
    /// Over, as far as they are still kept.
    pub ended: u32,
}

/// A page of plans, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Plans<'a> {
    /// The plans.
    pub plans: Vec<Plan<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// How many there are in all, whatever was asked for.
    #[serde(default)]
    pub counts: PlanCounts,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}
