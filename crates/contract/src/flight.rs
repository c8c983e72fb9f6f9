//! Plans with times and battery: what the flight model adds to plans and answers.
//!
//! All of it is absent where the model is off, or the drone's battery is unknown.

use super::id::Id;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Why a drone stays on a pad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopKind {
    /// It stands where the plan begins, and takes off later.
    Start,
    /// It charges, or waits.
    Charge,
    /// Its battery is swapped.
    Swap,
}

/// Whether a pad is surely free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PadReservation {
    /// No other plan has it at that time.
    Confirmed,
    /// No other plan of this edge has it; what other edges have given away is not known.
    Unconfirmed,
}

/// A stay on a pad, between two legs or before the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Stop<'a> {
    /// The node.
    pub node: Id<'a>,
    /// Which of its pads, counted from 0.
    pub pad: u16,
    /// Why.
    pub kind: StopKind,
    /// How many legs are flown before it.
    pub before_leg: u32,
    /// From when the pad is taken, RFC 3339.
    pub lands_at: Cow<'a, str>,
    /// Until when, RFC 3339.
    pub takes_off_at: Cow<'a, str>,
    /// How much of that is neither charging nor the time that every stop takes, in seconds.
    pub waits_s: f64,
    /// What is in the battery on landing, from 0 to 1.
    pub battery_before_fraction: f64,
    /// What is in it on take-off, from 0 to 1.
    pub battery_after_fraction: f64,
    /// Whether the pad is surely free.
    pub reservation: PadReservation,
    /// For how long the delivery is served here at least, in seconds; absent where the drone stops for its battery or to wait.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub service_s: Option<f64>,
}

/// A place where a delivery is served on its way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ServiceStop<'a> {
    /// The node.
    pub node: Id<'a>,
    /// For how long at least, in seconds; as long as every stop takes where none is given.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 3600)]
    pub service_s: f64,
}

/// Where a drone waits until its way opens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PadHold<'a> {
    /// The node.
    pub node: Id<'a>,
    /// Which of its pads, counted from 0.
    pub pad: u16,
    /// Until when, RFC 3339.
    pub until: Cow<'a, str>,
}

/// How a plan is flown: with which drone, how the battery lasts, and how good that is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Flight<'a> {
    /// Name of the airframe.
    pub airframe: Cow<'a, str>,
    /// What is made least: `distance`, `time` or `energy`.
    pub objective: Cow<'a, str>,
    /// What is in the battery where the plan begins, from 0 to 1.
    pub battery_at_departure_fraction: f64,
    /// What is in it at the end, from 0 to 1.
    pub battery_at_arrival_fraction: f64,
    /// What the legs, climbs and descents draw, in watt-hours.
    pub energy_wh: f64,
    /// What the delivery costs by the tariff, in US dollars.
    pub cost_usd: f64,
    /// The battery is never lower than this at a node, from 0 to 1.
    pub reserve_fraction: f64,
    /// True where the plan draws on the reserve, down to the floor, to reach an alternate.
    pub reserve_used: bool,
    /// True where no plan is better.
    pub proved: bool,
    /// What is made least: metres, seconds from the plan's beginning to the landing, or watt-hours.
    pub value: f64,
    /// No plan is better than this, in the same unit.
    pub lower_bound: f64,
    /// Why it is not proved: the bound of the search that was reached, `label_limit`, `check_limit` or `time_limit`; or `parts`, as a
    /// plan with stops is composed part by part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unproved_reason: Option<Cow<'a, str>>,
    /// Where the drone is to wait first, of a plan whose outcome is `hold`; the first of the stops.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hold: Option<PadHold<'a>>,
    /// The stays on pads, in order.
    pub stops: Vec<Stop<'a>>,
}

/// How a leg is flown: with its nodes and its times the paper's drone delivery service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct LegFlight<'a> {
    /// Id of the drone delivery service, unique within the plan's version.
    pub service_id: Cow<'a, str>,
    /// Flying time in seconds.
    pub time_s: f64,
    /// Airspeed in metres per second.
    pub airspeed_mps: f64,
    /// Mean ground speed in metres per second.
    pub ground_speed_mps: f64,
    /// What the leg draws, in watt-hours.
    pub energy_wh: f64,
    /// What is in the battery at its start, from 0 to 1.
    pub battery_before_fraction: f64,
    /// What is in it at its end, from 0 to 1.
    pub battery_after_fraction: f64,
    /// Payload carried, in kilograms.
    pub payload_kg: f64,
    /// What the leg costs by the tariff, in US dollars.
    pub cost_usd: f64,
}

/// How a contingency of a leg is flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DetourFlight<'a> {
    /// When it ends, RFC 3339.
    pub arrives_at: Cow<'a, str>,
    /// What is in the battery then, from 0 to 1.
    pub battery_at_arrival_fraction: f64,
    /// True where it draws on the reserve, down to the floor.
    pub reserve_used: bool,
}

/// Something that keeps a drone from its destination.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FlightCause<'a> {
    /// What kind: `closure`, `report`, `traffic`, `pads`, `unflyable`, `battery`, `below_reserve`, `deadline` or
    /// `network`.
    pub code: Cow<'a, str>,
    /// For people.
    pub message: Cow<'a, str>,
    /// The zone or closure.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<Cow<'a, str>>,
    /// The other plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan_id: Option<Cow<'a, str>>,
    /// The node whose pads are taken, or from which a leg cannot be flown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<Id<'a>>,
    /// The segment that cannot be flown, or that another plan takes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<Cow<'a, str>>,
    /// How much more battery the leg takes that lacks least, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing_fraction: Option<f64>,
    /// From when it is in the way, RFC 3339; absent: all the time until then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<Cow<'a, str>>,
    /// Until when, RFC 3339; absent: without a known end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<Cow<'a, str>>,
}

/// The plan that there would be but for the deadline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Opening<'a> {
    /// When it would enter its first leg, RFC 3339.
    pub departs_at: Cow<'a, str>,
    /// When it would land, RFC 3339.
    pub arrives_at: Cow<'a, str>,
}
