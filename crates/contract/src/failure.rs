//! The failure report `<FT, DDS, LOC, TS>` of the paper's Definition 3, as a drone sends it.

use super::id::{Id, Place, with_ids_as_text};
use super::weight::value_bytes;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;
use std::marker::PhantomData;

/// The failure types of the paper's Definition 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailureType {
    /// Adverse weather on the leg.
    Environmental,
    /// An obstacle in the way.
    Navigational,
    /// A no-fly zone or airspace restriction.
    Regulatory,
    /// No recharging pad at the node ahead.
    Infrastructure,
    /// Battery or payload limits of this drone.
    Operational,
    /// Early, late or off the plan.
    ServiceLevel,
}

/// How a new path is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// The true optimum from the drone to its destination.
    Exact,
    /// Paper, Algorithm 3.
    TwoPhased,
    /// Paper, Algorithm 2.
    CellDensity,
    /// Paper, Algorithm 1.
    Radius,
    /// Dijkstra's algorithm; the paper's baseline.
    Dijkstra,
    /// A* with the straight line.
    Astar,
    /// Bellman-Ford.
    BellmanFord,
}

/// Which problem a baseline solves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// From the start of the failed leg to its end, then on as planned.
    Local,
    /// From the drone to its destination.
    Global,
}

/// A failure report: the body of `POST /v1/failures`.
///
/// Only a place has to be named: the service, the remaining path, the location, or a drone whose telemetry or
/// plan is known. What cannot be read is passed over with a warning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FailureReport {
    /// The report's id: the same id again gets the same answer, while that still holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<Id<'static>>,
    /// What failed; without it the failure counts as navigational.
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub failure: Option<FailureType>,
    /// For `operational`: what it is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detail: Option<OperationalDetail>,
    /// For `infrastructure`: where pads have failed; at the end of the leg where none is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub node: Option<Id<'static>>,
    /// For `infrastructure`: how many pads have failed; all where none is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pads: Option<u32>,
    /// For `environmental`: the mean wind measured, in metres per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wind_mps: Option<f64>,
    /// For `environmental`: the gusts measured, in metres per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gust_mps: Option<f64>,
    /// For `environmental`: how far one sees, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visibility_m: Option<f64>,
    /// Whether the drone is in the air.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub airborne: Option<bool>,
    /// The failed drone delivery service: a leg of a plan, or a leg by its nodes.
    #[serde(deserialize_with = "object", skip_serializing_if = "Option::is_none")]
    pub service: Option<Service>,
    /// Where the drone was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub location: Option<Place>,
    /// How old that place was when the report was sent, in seconds; by `timestamp` where none is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub location_age_s: Option<f64>,
    /// Which leg of its plan it was on, counted from 0; as `service.leg`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leg: Option<u32>,
    /// How far along its leg it was, from 0 to 1; `location` counts where both are given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fraction: Option<f64>,
    /// Its height in metres, by `altitude_reference`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_m: Option<f64>,
    /// What the height is above: `agl`, `amsl` or `wgs84`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_reference: Option<String>,
    /// The drone's place is unknown, so the worst is assumed; `location` counts where both are given.
    ///
    /// Without either, the last telemetry of the drone gives its place; without telemetry it is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub location_unknown: Option<bool>,
    /// Where the cause of the failure is, if the drone could tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause_location: Option<Place>,
    /// When it happened, RFC 3339.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub timestamp: Option<String>,
    /// A no-fly zone that the drone learned of: a GeoJSON feature, as in `POST /v1/zones`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Object)]
    pub zone: Option<Value>,
    /// Who reports.
    #[serde(deserialize_with = "object", skip_serializing_if = "Option::is_none")]
    pub drone: Option<DroneFacts>,
    /// Ids of the nodes ahead, the failed leg first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining_path: Option<Vec<Id<'static>>>,
    /// Where the delivery goes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub destination: Option<Id<'static>>,
    /// How the new path is found; exact by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strategy: Option<Strategy>,
    /// For baselines: which problem they solve.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scope: Option<Scope>,
    /// Numbers that the paper leaves open.
    #[serde(deserialize_with = "object", skip_serializing_if = "Option::is_none")]
    pub parameters: Option<Parameters>,
    /// What is made least: `distance`, `time` or `energy`; without the flight model `distance` alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub objective: Option<String>,
    /// Also tell the optima that the answer is measured against.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimum: Option<bool>,
    /// The latest arrival that the delivery allows, RFC 3339.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub deadline: Option<String>,
    /// Also tell the search areas, stage by stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explain: Option<bool>,
    /// The same answer; nothing is published and no plan changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dry_run: Option<bool>,
    /// Only in files of requests: what is closed beforehand, node ids and `[A, B]` for segments.
    #[serde(
        deserialize_with = "ids_as_text",
        skip_serializing_if = "Option::is_none"
    )]
    #[schema(ignore)]
    pub close: Option<Vec<Value>>,
}

impl FailureReport {
    /// About how many bytes of memory it takes beside itself: all of any length that its sender put into it.
    pub fn bytes(&self) -> usize {
        let places = [&self.location, &self.cause_location];
        let places = places.into_iter().flatten().map(|place| match place {
            Place::Node(id) => Some(id),
            Place::Pair(_) | Place::Planar { .. } => None,
        });
        let ends = self.service.iter();
        let ends = ends.flat_map(|service| [service.from.as_ref(), service.to.as_ref()]);
        let ids = [&self.id, &self.node, &self.destination].map(Option::as_ref);
        let ids = ids.into_iter().chain(ends).chain(places).flatten();
        let ids = ids.chain(self.remaining_path.iter().flatten());
        let of_drone = self.drone.iter();
        let of_drone = of_drone.flat_map(|drone| [drone.id.as_ref(), drone.airframe.as_ref()]);
        let of_service = self.service.iter().map(|service| service.plan_id.as_ref());
        let texts = [
            &self.altitude_reference,
            &self.timestamp,
            &self.objective,
            &self.deadline,
        ];
        let texts = texts.map(Option::as_ref).into_iter();
        let texts = texts.chain(of_drone).chain(of_service).flatten();
        let values = self.zone.iter().chain(self.close.iter().flatten());
        ids.map(|id| size_of_val(id) + id.text().len())
            .sum::<usize>()
            + texts.map(String::len).sum::<usize>()
            + values.map(value_bytes).sum::<usize>()
    }
}

/// What an operational failure is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OperationalDetail {
    /// Less battery than planned.
    Battery,
    /// More payload than planned.
    Payload,
    /// A motor or a propeller: the nearest node that is not closed will do.
    Propulsion,
    /// It has to land: likewise.
    LandNow,
}

/// The failed drone delivery service: `{plan_id, leg}` of a plan that the edge knows, or `{from, to}`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Service {
    /// Id of a composition plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plan_id: Option<String>,
    /// Which of its legs, counted from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leg: Option<u32>,
    /// The node behind the drone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<Id<'static>>,
    /// The node ahead of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<Id<'static>>,
}

/// What a report says of its drone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DroneFacts {
    /// The drone's id.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// What is left in the battery, from 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub battery_fraction: Option<f64>,
    /// Payload in kilograms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<f64>,
    /// Name of an airframe.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub airframe: Option<String>,
    /// Airspeed in metres per second; 16 where none is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub airspeed_mps: Option<f64>,
}

/// Numbers that the paper leaves open.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Side of the cells of the cell density-based strategy, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_size_m: Option<f64>,
    /// Half the height of the two-phased strategy's rectangle, as a share of the leg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub val_ratio: Option<f64>,
    /// Whether the two-phased strategy skips stages with few nodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage_skipping: Option<bool>,
    /// Whether Dijkstra as a baseline settles everything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub full_tree: Option<bool>,
}

/// Many failure reports at once: the body of `POST /v1/failures:batch`.
///
/// Reports are read one by one, so that one that cannot be read does not spoil the others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Failures {
    /// The reports; answers come in their order.
    #[schema(value_type = Vec<FailureReport>, max_items = 1000)]
    pub failures: Vec<Value>,
}

/// Reads a list of what names nodes and segments.
fn ids_as_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<Value>>, D::Error> {
    let entries = Option::<Vec<Value>>::deserialize(deserializer)?;
    Ok(entries.map(with_ids_as_text))
}

/// Reads an object or null. What is derived would also take a list of the fields in order, which no client means.
fn object<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    struct ObjectVisitor<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
        type Value = Option<T>;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str("an object")
        }

        fn visit_unit<E: de::Error>(self) -> Result<Self::Value, E> {
            Ok(None)
        }

        fn visit_none<E: de::Error>(self) -> Result<Self::Value, E> {
            Ok(None)
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            T::deserialize(MapAccessDeserializer::new(map)).map(Some)
        }
    }
    deserializer.deserialize_any(ObjectVisitor(PhantomData))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Every place of a text, as JSON Pointers.
    fn texts(at: &str, value: &Value, found: &mut Vec<String>) {
        match value {
            Value::String(_) => found.push(at.to_owned()),
            Value::Array(values) => {
                let each = values.iter().enumerate();
                each.for_each(|(place, value)| texts(&format!("{at}/{place}"), value, found));
            }
            Value::Object(members) => {
                let each = members.iter();
                each.for_each(|(name, value)| texts(&format!("{at}/{name}"), value, found));
            }
            Value::Null | Value::Bool(_) | Value::Number(_) => {}
        }
    }

    #[test]
    fn whatever_has_any_length_counts() {
        let full = json!({
            "id": "r", "node": "n", "altitude_reference": "agl", "timestamp": "now",
            "service": {"plan_id": "p", "from": "a", "to": "b"},
            "location": {"node": "a"}, "cause_location": {"node": "b"},
            "zone": {"type": "Feature", "properties": {"name": "z"}},
            "drone": {"id": "d", "airframe": "m100"},
            "remaining_path": ["a", "b"], "destination": "b",
            "objective": "time", "deadline": "soon", "close": ["a-b"],
        });
        let mut places = Vec::new();
        texts("", &full, &mut places);
        assert_eq!(places.len(), 19);
        let read = |value: &Value| FailureReport::deserialize(value).expect("a report");
        let before = read(&full).bytes();
        for place in places {
            let mut longer = full.clone();
            // As long as an id may be.
            *longer.pointer_mut(&place).expect("is there") = Value::from("x".repeat(256));
            assert!(read(&longer).bytes() >= before + 240, "{place}");
        }
    }
}
