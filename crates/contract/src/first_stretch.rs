//! How a drone comes to the first node of its path, and what is said of the safety of its way.

use super::id::Id;
use super::outcome::{Outcome, Path};
use serde::de::{self, Deserializer, SeqAccess, Visitor};
use serde::ser::{SerializeSeq, Serializer};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

/// A position with a height: `[longitude, latitude, height]`, `[x, y, height]` in metres on a planar network; without the
/// height where it is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Longitude in degrees; metres east on a planar network.
    pub x: f64,
    /// Latitude in degrees; metres north on a planar network.
    pub y: f64,
    /// Height in metres, by the reference of the network.
    pub height_m: Option<f64>,
}

impl Serialize for Waypoint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let count = 2 + usize::from(self.height_m.is_some());
        let mut list = serializer.serialize_seq(Some(count))?;
        list.serialize_element(&self.x)?;
        list.serialize_element(&self.y)?;
        if let Some(height_m) = self.height_m {
            list.serialize_element(&height_m)?;
        }
        list.end()
    }
}

impl<'de> Deserialize<'de> for Waypoint {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WaypointVisitor;
        impl<'de> Visitor<'de> for WaypointVisitor {
            type Value = Waypoint;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("two or three numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Waypoint, A::Error> {
                let missing = |length| de::Error::invalid_length(length, &"two or three numbers");
                let x = list.next_element()?.ok_or_else(|| missing(0))?;
                let y = list.next_element()?.ok_or_else(|| missing(1))?;
                let height_m = list.next_element()?;
                match list.next_element::<f64>()? {
                    None => Ok(Waypoint { x, y, height_m }),
                    Some(_) => Err(missing(4)),
                }
            }
        }
        deserializer.deserialize_seq(WaypointVisitor)
    }
}

/// How a first stretch runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StretchKind {
    /// Along the leg that the drone is on.
    Leg,
    /// In a straight line off every leg: obstacles there are unknown.
    Straight,
    /// Nowhere: the drone is at the node.
    None,
}

/// How the drone comes from its place to the first node of the path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FirstStretch<'a> {
    /// How it runs.
    pub kind: StretchKind,
    /// The node behind the drone on the leg that it is on, as it flew before; absent where it runs straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<Id<'a>>,
    /// The node ahead of it there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<Id<'a>>,
    /// Id of that leg's segment; absent where the network has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<Cow<'a, str>>,
    /// Where on the leg it begins, as a fraction of the way from `from` to `to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fraction: Option<f64>,
    /// The first node of the path.
    pub enters: Id<'a>,
    /// Its length in metres, an overrun there and back included: `first_stretch_m`.
    pub length_m: f64,
    /// Metres flown on before the drone can turn; absent where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overrun_m: Option<f64>,
    /// The line: where it begins, where it turns, the node.
    #[schema(value_type = Vec<Vec<f64>>)]
    pub geometry: Vec<Waypoint>,
}

/// What holds of the way told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Flag {
    /// The first stretch begins inside an active zone and leads out of it.
    LeavingZone,
    /// What is closed lies nearer than the drone needs to turn: it flies on into it before it does.
    CannotStop,
    /// The first stretch is a straight line off the network: obstacles there are unknown.
    Unverified,
    /// The plan draws on the reserve of the battery.
    ReserveUsed,
    /// The pad at the end of the way is taken.
    PadOccupied,
    /// Other plans are too near to every way: this one does not keep apart from them.
    Unseparated,
}

/// The least bad way of a drone that has no safe one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct UnsafeWay<'a> {
    /// Why it is not safe, for people.
    pub reason: Cow<'a, str>,
    /// Why it is not safe: a stable code.
    pub code: Cow<'a, str>,
    /// Ids of the nodes that it comes to; none where it ends on a leg.
    pub nodes: Vec<Id<'a>>,
    /// The line flown, from where the drone is.
    #[schema(value_type = Vec<Vec<f64>>)]
    pub geometry: Vec<Waypoint>,
    /// Its length in metres.
    pub length_m: f64,
    /// Battery at its end as a fraction, with the flight model; below 0 where it does not last so far.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub battery_fraction: Option<f64>,
}

/// A node near a drone that has no way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Near<'a> {
    /// Id of the node.
    pub node: Id<'a>,
    /// How far it is in metres.
    pub length_m: f64,
    /// How many pads it has.
    pub pads: u16,
    /// Battery there as a fraction, with the flight model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub battery_fraction: Option<f64>,
    /// Why the path does not lead there: a stable code.
    pub why_not: Cow<'a, str>,
}

/// The answer to a drone that is in the air, where it is unknown whether it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct IfAirborne<'a> {
    /// What it is to do.
    pub outcome: Outcome,
    /// The whole remaining path; empty where there is none.
    pub path: Path<'a>,
    /// How it comes to the first node of the path; null without a path.
    pub first_stretch: Option<FirstStretch<'a>>,
    /// From where it is to the first node of the path, in metres.
    pub first_stretch_m: f64,
    /// The whole remaining route, first stretch included, in metres.
    pub remaining_length_m: Option<f64>,
    /// What holds of the way told.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flags: Vec<Flag>,
    /// The least bad way, where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsafe_way: Option<UnsafeWay<'a>>,
}
