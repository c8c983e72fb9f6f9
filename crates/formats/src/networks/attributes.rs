//! Nodes and segments as attributes by name: what node-link JSON, GraphML and GeoPackage have in common.
//!
//! Each of these formats hands over a map from names to values, however it writes them, so that an attribute
//! means the same in all of them, and in the native format.

use crate::error::FormatError;
use crate::geo::{Altitude, AltitudeBand, AltitudeReference};
use crate::identifier::id_text;
use crate::network::{Coordinates, NetworkDraft, NodeDraft, Role, SegmentDraft};
use crate::place::{Place, number, optional, required, text};
use serde_json::{Map, Number, Value, json};
use std::collections::BTreeSet;

/// What an attribute holds, for formats that say so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttributeKind {
    /// A whole number.
    Whole,
    /// A number.
    Real,
    /// Text.
    Text,
}

/// What is said of a node beside its id and its position, in the order in which it is written.
pub(crate) const OF_NODES: [(&str, AttributeKind); 5] = [
    ("pads", AttributeKind::Whole),
    ("role", AttributeKind::Text),
    ("altitude_m", AttributeKind::Real),
    ("altitude_reference", AttributeKind::Text),
    ("name", AttributeKind::Text),
];

/// What is said of a segment beside its id and its ends, in the order in which it is written.
pub(crate) const OF_SEGMENTS: [(&str, AttributeKind); 6] = [
    ("length_m", AttributeKind::Real),
    ("lower_m", AttributeKind::Real),
    ("lower_reference", AttributeKind::Text),
    ("upper_m", AttributeKind::Real),
    ("upper_reference", AttributeKind::Text),
    ("speed_limit_mps", AttributeKind::Real),
];

/// Names that a node has besides.
const NODE_ITSELF: [&str; 5] = ["id", "x", "y", "lon", "lat"];
/// Names that a segment has besides; the length goes by the second name where it has not the first.
const SEGMENT_ITSELF: [&str; 6] = ["id", "source", "target", "from", "to", "weight"];
/// The most names that are told, of each kind, of what is not read.
const MAX_UNREAD: usize = 50;

/// A network of another tool as read, with the names of what was passed over.
#[derive(Debug)]
pub struct ReadNetwork {
    /// The network, for [`NetworkDraft::repair`].
    pub draft: NetworkDraft,
    /// What was in the file and is not in the network.
    pub unread: Unread,
}

/// Names of attributes that are another tool's business.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Unread {
    graph: BTreeSet<String>,
    nodes: BTreeSet<String>,
    segments: BTreeSet<String>,
}

impl Unread {
    /// Keeps what the network as a whole has and this program does not know.
    pub(crate) fn of_graph<'n>(&mut self, names: impl Iterator<Item = &'n str>, known: &[&str]) {
        keep(&mut self.graph, names, |name| known.contains(&name));
    }

    /// The same of a node.
    pub(crate) fn of_node<'n>(&mut self, names: impl Iterator<Item = &'n str>, known: &[&str]) {
        keep(&mut self.nodes, names, |name| {
            known.contains(&name)
                || NODE_ITSELF.contains(&name)
                || OF_NODES.iter().any(|(own, _)| *own == name)
        });
    }

    /// The same of a segment.
    pub(crate) fn of_segment<'n>(&mut self, names: impl Iterator<Item = &'n str>, known: &[&str]) {
        keep(&mut self.segments, names, |name| {
            known.contains(&name)
                || SEGMENT_ITSELF.contains(&name)
                || OF_SEGMENTS.iter().any(|(own, _)| *own == name)
        });
    }

    /// The same of a table of nodes: columns that have been found to be no one's.
    pub(crate) fn columns_of_nodes(&mut self, columns: Vec<String>) {
        self.nodes.extend(columns.into_iter().take(MAX_UNREAD));
    }

    /// The same of a table of segments.
    pub(crate) fn columns_of_segments(&mut self, columns: Vec<String>) {
        self.segments.extend(columns.into_iter().take(MAX_UNREAD));
    }

    /// A line for people about each kind of thing that has more than was read.
    pub fn lines(&self) -> Vec<String> {
        let kinds = [
            ("the network", &self.graph),
            ("nodes", &self.nodes),
            ("segments", &self.segments),
        ];
        let told = kinds.into_iter().filter(|(_, names)| !names.is_empty());
        told.map(|(kind, names)| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            format!("attributes of {kind}: {}", names.join(", "))
        })
        .collect()
    }
}

fn keep<'n>(
    names: &mut BTreeSet<String>,
    found: impl Iterator<Item = &'n str>,
    is_known: impl Fn(&str) -> bool,
) {
    for name in found {
        if names.len() < MAX_UNREAD && !is_known(name) && !names.contains(name) {
            names.insert(name.to_owned());
        }
    }
}

/// The names of the two numbers of a position.
pub(crate) fn position_names(coordinates: Coordinates) -> [&'static str; 2] {
    match coordinates {
        Coordinates::Geographic => ["lon", "lat"],
        Coordinates::Planar => ["x", "y"],
    }
}

/// A position as files have it: degrees with seven decimals (a centimetre), metres as they are.
pub(crate) fn written_position(coordinates: Coordinates, position: [f64; 2]) -> [f64; 2] {
    position.map(|coordinate| match coordinates {
        // Adding 0 turns a negative zero into zero.
        Coordinates::Geographic => (coordinate * 1e7).round() / 1e7 + 0.0,
        Coordinates::Planar => coordinate + 0.0,
    })
}

/// True for the digits that an integer is written with: neither `07` nor `+7`.
pub(crate) fn is_integer_text(id: &str) -> bool {
    let signed = id.parse::<i64>().map(|number| number.to_string());
    let unsigned = id.parse::<u64>().map(|number| number.to_string());
    [signed, unsigned].contains(&Ok(id.to_owned()))
}

/// The id of a node as JSON, an integer where the network has integers.
pub(crate) fn id_value(id: &str, integer_ids: bool) -> Value {
    let number = serde_json::from_str::<Number>(id).ok();
    match number.filter(|_| integer_ids && is_integer_text(id)) {
        Some(number) => Value::Number(number),
        None => Value::from(id),
    }
}

/// Reads a node: its id, `lon` and `lat` or else `x` and `y`, and [`OF_NODES`].
pub(crate) fn read_node(
    members: &Map<String, Value>,
    place: &Place<'_>,
) -> Result<(NodeDraft, Coordinates), FormatError> {
    let coordinates = match members.contains_key("lon") || members.contains_key("lat") {
        true => Coordinates::Geographic,
        false => Coordinates::Planar,
    };
    let id = id(members, "id", place)?;
    let coordinate = |name: &str| number(required(members, name, place)?, &place.member(name));
    let [first, second] = position_names(coordinates);
    let node = NodeDraft {
        position: [coordinate(first)?, coordinate(second)?],
        altitude: altitude(members, "altitude_m", "altitude_reference", place)?,
        pads: pads(members, place)?,
        role: match optional(members, "role") {
            Some(stated) => role(stated, &place.member("role"))?,
            None => Role::default(),
        },
        name: optional(members, "name").map(words),
        id,
    };
    Ok((node, coordinates))
}

/// Puts a node to those that were read; all of them have the same coordinates.
pub(crate) fn add_node(
    draft: &mut NetworkDraft,
    (node, coordinates): (NodeDraft, Coordinates),
    place: &Place<'_>,
) -> Result<(), FormatError> {
    if draft.nodes.is_empty() {
        draft.coordinates = coordinates;
    }
    let is_alike = draft.coordinates == coordinates;
    draft.nodes.push(node);
    match is_alike {
        true => Ok(()),
        false => Err(place
            .error("has other coordinates than the nodes before it")
            .hint("give all nodes 'x' and 'y', or all of them 'lon' and 'lat'")),
    }
}

/// Reads a segment: `source` and `target` or else `from` and `to`, and [`OF_SEGMENTS`].
///
/// A length of 0 is for the repair to judge.
pub(crate) fn read_segment(
    members: &Map<String, Value>,
    place: &Place<'_>,
) -> Result<SegmentDraft, FormatError> {
    let [from, to] = match members.contains_key("source") {
        true => ["source", "target"],
        false => ["from", "to"],
    };
    let length_m = match optional_number(members, "length_m", place)? {
        Some(length_m) => Some(length_m),
        None => optional_number(members, "weight", place)?,
    };
    Ok(SegmentDraft {
        id: optional(members, "id").and_then(id_text),
        from: id(members, from, place)?,
        to: id(members, to, place)?,
        length_m,
        band: band(members, place)?,
        speed_limit_mps: positive(members, "speed_limit_mps", place)?,
    })
}

fn id(members: &Map<String, Value>, name: &str, place: &Place<'_>) -> Result<String, FormatError> {
    let stated = required(members, name, place)?;
    id_text(stated).ok_or_else(|| place.member(name).wrong_kind(stated, "text or an integer"))
}

/// Tools that keep numbers as doubles write a count as `2.0`.
fn pads(members: &Map<String, Value>, place: &Place<'_>) -> Result<u16, FormatError> {
    let pads = optional_number(members, "pads", place)?.unwrap_or(0.0);
    if pads.fract() != 0.0 || !(0.0..=f64::from(u16::MAX)).contains(&pads) {
        let message = format!("is {pads}, not a whole number from 0 to {}", u16::MAX);
        return Err(place.member("pads").error(message));
    }
    Ok(pads as u16)
}

/// A name, also where it is a number.
fn words(value: &Value) -> String {
    match value {
        Value::String(words) => words.clone(),
        other => other.to_string(),
    }
}

fn optional_number(
    members: &Map<String, Value>,
    name: &str,
    place: &Place<'_>,
) -> Result<Option<f64>, FormatError> {
    optional(members, name)
        .map(|value| number(value, &place.member(name)))
        .transpose()
}

/// A number above 0, where it is stated.
pub(crate) fn positive(
    members: &Map<String, Value>,
    name: &str,
    place: &Place<'_>,
) -> Result<Option<f64>, FormatError> {
    match optional_number(members, name, place)? {
        Some(value) if value <= 0.0 => {
            let message = format!("is {value}; it has to be above 0");
            Err(place.member(name).error(message))
        }
        stated => Ok(stated),
    }
}

/// What a node is for.
pub(crate) fn role(value: &Value, place: &Place<'_>) -> Result<Role, FormatError> {
    match text(value, place)? {
        "delivery_target" => Ok(Role::DeliveryTarget),
        "recharging_station" => Ok(Role::RechargingStation),
        "both" => Ok(Role::Both),
        other => Err(place
            .error(format!("is '{other}'"))
            .hint("write 'delivery_target', 'recharging_station' or 'both'")),
    }
}

/// How a file calls it.
pub(crate) fn role_name(role: Role) -> &'static str {
    match role {
        Role::DeliveryTarget => "delivery_target",
        Role::RechargingStation => "recharging_station",
        Role::Both => "both",
    }
}

/// The altitudes at which a segment is flown.
pub(crate) fn band(
    members: &Map<String, Value>,
    place: &Place<'_>,
) -> Result<AltitudeBand, FormatError> {
    let lower = altitude(members, "lower_m", "lower_reference", place)?;
    let upper = altitude(members, "upper_m", "upper_reference", place)?;
    if let (Some(lower), Some(upper)) = (lower, upper)
        && lower.reference == upper.reference
        && lower.value_m > upper.value_m
    {
        let message = format!("is {} m, above upper_m {} m", lower.value_m, upper.value_m);
        return Err(place.member("lower_m").error(message).hint("swap them"));
    }
    Ok(AltitudeBand { lower, upper })
}

/// An altitude; its reference is above ground unless stated.
pub(crate) fn altitude(
    members: &Map<String, Value>,
    value_name: &str,
    reference_name: &str,
    place: &Place<'_>,
) -> Result<Option<Altitude>, FormatError> {
    let reference_place = place.member(reference_name);
    let reference = match optional(members, reference_name) {
        None => None,
        Some(value) => Some(match text(value, &reference_place)? {
            "agl" => AltitudeReference::Agl,
            "amsl" => AltitudeReference::Amsl,
            "wgs84" => AltitudeReference::Wgs84,
            other => {
                let error = reference_place.error(format!("is '{other}'"));
                return Err(error.hint("write 'agl', 'amsl' or 'wgs84'"));
            }
        }),
    };
    match (optional(members, value_name), reference) {
        (Some(value), reference) => Ok(Some(Altitude {
            value_m: number(value, &place.member(value_name))?,
            reference: reference.unwrap_or_default(),
        })),
        (None, Some(_)) => Err(reference_place.error(format!("has no '{value_name}' beside it"))),
        (None, None) => Ok(None),
    }
}

/// What is known of [`OF_NODES`].
pub(crate) fn node_members(node: &NodeDraft) -> Map<String, Value> {
    let mut members = Map::new();
    members.insert("pads".to_owned(), json!(node.pads));
    members.insert("role".to_owned(), json!(role_name(node.role)));
    put_altitude(&mut members, "altitude", node.altitude);
    if let Some(name) = &node.name {
        members.insert("name".to_owned(), json!(name));
    }
    members
}

/// What is known of [`OF_SEGMENTS`].
pub(crate) fn segment_members(segment: &SegmentDraft) -> Map<String, Value> {
    let mut members = Map::new();
    if let Some(length_m) = segment.length_m {
        members.insert("length_m".to_owned(), json!(length_m));
    }
    put_altitude(&mut members, "lower", segment.band.lower);
    put_altitude(&mut members, "upper", segment.band.upper);
    if let Some(speed_limit_mps) = segment.speed_limit_mps {
        members.insert("speed_limit_mps".to_owned(), json!(speed_limit_mps));
    }
    members
}

fn put_altitude(members: &mut Map<String, Value>, prefix: &str, altitude: Option<Altitude>) {
    if let Some(altitude) = altitude {
        members.insert(format!("{prefix}_m"), json!(altitude.value_m));
        let reference = json!(altitude.reference.name());
        members.insert(format!("{prefix}_reference"), reference);
    }
}
