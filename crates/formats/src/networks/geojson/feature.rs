//! One feature of the native format: a node or a segment.

use crate::error::FormatError;
use crate::network::{NodeDraft, SegmentDraft};
use crate::networks::attributes::{altitude, band, positive, role};
use crate::place::{Place, array, object, optional, position, required, text};
use serde_json::{Map, Value};

const FEATURE_MEMBERS: &[&str] = &["type", "id", "geometry", "properties", "bbox"];
const NODE_PROPERTIES: &[&str] = &[
    "kind",
    "pads",
    "role",
    "altitude_m",
    "altitude_reference",
    "name",
];
const SEGMENT_PROPERTIES: &[&str] = &[
    "kind",
    "from",
    "to",
    "length_m",
    "lower_m",
    "lower_reference",
    "upper_m",
    "upper_reference",
    "speed_limit_mps",
];

/// A feature as read.
pub(super) enum Feature {
    Node {
        node: NodeDraft,
        is_integer: bool,
    },
    Segment {
        segment: SegmentDraft,
        /// The ends of its line.
        ends: [[f64; 2]; 2],
    },
}

type Members = Map<String, Value>;

/// Reads a feature; the error names it as far as it has a name.
pub(super) fn read_feature(value: &Value, place: &Place<'_>) -> Result<Feature, FormatError> {
    let members = object(value, place)?;
    known(members, FEATURE_MEMBERS, place)?;
    let kind = text(required(members, "type", place)?, &place.member("type"))?;
    if kind != "Feature" {
        return Err(place
            .member("type")
            .error(format!("is '{kind}', not 'Feature'")));
    }
    let geometry_place = place.member("geometry");
    let geometry = object(required(members, "geometry", place)?, &geometry_place)?;
    known(geometry, &["type", "coordinates", "bbox"], &geometry_place)?;
    let shape = text(
        required(geometry, "type", &geometry_place)?,
        &geometry_place.member("type"),
    )?;
    let coordinates = required(geometry, "coordinates", &geometry_place)?;
    let coordinates_place = geometry_place.member("coordinates");
    let properties_place = place.member("properties");
    let nothing = Members::new();
    let properties = match optional(members, "properties") {
        Some(properties) => object(properties, &properties_place)?,
        None => &nothing,
    };
    match shape {
        "Point" => {
            let (id, is_integer) = node_id(required(members, "id", place)?, &place.member("id"))?;
            let label = format!("node '{id}'");
            let node = position(coordinates, &coordinates_place)
                .and_then(|position| node(id, position, properties, &properties_place));
            let node = node.map_err(|error| error.of(label))?;
            Ok(Feature::Node { node, is_integer })
        }
        "LineString" => {
            let id = optional(members, "id").map(|id| node_id(id, &place.member("id")));
            let id = id.transpose()?.map(|(id, _)| id);
            let label = segment_label(id.as_deref(), properties);
            let ends = line(coordinates, &coordinates_place);
            let read =
                ends.and_then(|ends| Ok((segment(id, properties, &properties_place)?, ends)));
            let (segment, ends) = read.map_err(|error| error.of(label))?;
            Ok(Feature::Segment { segment, ends })
        }
        other => Err(geometry_place
            .member("type")
            .error(format!("is '{other}', not 'Point' or 'LineString'"))
            .hint("a node is a Point, a segment a LineString")),
    }
}

/// What a segment is called in errors.
fn segment_label(id: Option<&str>, properties: &Members) -> String {
    let end = |name: &str| match properties.get(name) {
        Some(Value::String(id)) => id.clone(),
        Some(Value::Number(id)) => id.to_string(),
        _ => "?".to_owned(),
    };
    match id {
        Some(id) => format!("segment '{id}'"),
        None => format!("segment '{}-{}'", end("from"), end("to")),
    }
}

/// An id, with whether it is written as an integer.
fn node_id(value: &Value, place: &Place<'_>) -> Result<(String, bool), FormatError> {
    match value {
        Value::String(id) if id.is_empty() => Err(place.error("is empty")),
        Value::String(id) => Ok((id.clone(), false)),
        Value::Number(id) if id.is_i64() || id.is_u64() => Ok((id.to_string(), true)),
        Value::Number(id) => Err(place.error(format!("is {id}; an id is text or an integer"))),
        other => Err(place.wrong_kind(other, "text or an integer")),
    }
}

fn node(
    id: String,
    position: [f64; 2],
    properties: &Members,
    place: &Place<'_>,
) -> Result<NodeDraft, FormatError> {
    known(properties, NODE_PROPERTIES, place)?;
    of_kind("node", properties, place)?;
    let pads = optional(properties, "pads").map(|value| pads(value, &place.member("pads")));
    let role = optional(properties, "role").map(|value| role(value, &place.member("role")));
    let name = optional(properties, "name").map(|value| text(value, &place.member("name")));
    Ok(NodeDraft {
        id,
        position,
        altitude: altitude(properties, "altitude_m", "altitude_reference", place)?,
        pads: pads.transpose()?.unwrap_or_default(),
        role: role.transpose()?.unwrap_or_default(),
        name: name.transpose()?.map(str::to_owned),
    })
}

fn segment(
    id: Option<String>,
    properties: &Members,
    place: &Place<'_>,
) -> Result<SegmentDraft, FormatError> {
    known(properties, SEGMENT_PROPERTIES, place)?;
    of_kind("segment", properties, place)?;
    let end = |name: &str| {
        let stated = required(properties, name, place)?;
        node_id(stated, &place.member(name)).map(|(id, _)| id)
    };
    let band = band(properties, place)?;
    Ok(SegmentDraft {
        id,
        from: end("from")?,
        to: end("to")?,
        length_m: positive(properties, "length_m", place)?,
        band,
        speed_limit_mps: positive(properties, "speed_limit_mps", place)?,
    })
}

fn line(value: &Value, place: &Place<'_>) -> Result<[[f64; 2]; 2], FormatError> {
    match array(value, place)? {
        [from, to] => Ok([
            position(from, &place.element(0))?,
            position(to, &place.element(1))?,
        ]),
        positions => Err(place
            .error(format!("has {} positions, not two", positions.len()))
            .hint("a segment is one straight line; put a node at every bend")),
    }
}

fn of_kind(expected: &str, properties: &Members, place: &Place<'_>) -> Result<(), FormatError> {
    let Some(stated) = optional(properties, "kind") else {
        return Ok(());
    };
    let place = place.member("kind");
    match text(stated, &place)? {
        kind if kind == expected => Ok(()),
        kind => Err(place
            .error(format!(
                "is '{kind}', but the geometry is that of a {expected}"
            ))
            .hint("a node is a Point, a segment a LineString")),
    }
}

fn pads(value: &Value, place: &Place<'_>) -> Result<u16, FormatError> {
    let whole = value.as_u64().and_then(|pads| u16::try_from(pads).ok());
    whole.ok_or_else(|| match value {
        Value::Number(pads) => place.error(format!(
            "is {pads}, not a whole number from 0 to {}",
            u16::MAX
        )),
        other => place.wrong_kind(other, "a whole number"),
    })
}

/// Refuses members that the format does not have: a misspelt one would be lost in silence.
pub(super) fn known(
    members: &Members,
    names: &[&str],
    place: &Place<'_>,
) -> Result<(), FormatError> {
    match members.keys().find(|name| !names.contains(&name.as_str())) {
        None => Ok(()),
        Some(unknown) => Err(place
            .member(unknown)
            .error("is not a member that this format has")
            .hint(format!("known here: {}", names.join(", ")))),
    }
}
