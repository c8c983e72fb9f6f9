//! Writing the native format.

use super::FORMAT;
use crate::geo::Altitude;
use crate::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use crate::networks::attributes::{is_integer_text, role_name, written_position};
use rustc_hash::FxHashMap;
use serde_json::{Value, json};
use std::fmt::Write;

/// Writes a network: the same draft gives the same bytes.
///
/// One feature a line, nodes before segments, each in the order of the draft. Longitude and
/// latitude have seven decimals (a centimetre), planar coordinates as many as it takes to read them
/// back unchanged. Ids are written as integers where the draft says so and all of them are. The
/// draft is taken to be one that [`Topology::build`](crate::network::Topology::build) accepts; of
/// others, a coordinate that is not finite is written as null and a segment whose nodes are missing
/// as a line without positions, both of which no reader accepts.
pub fn write_network(draft: &NetworkDraft) -> String {
    let is_integer = |node: &NodeDraft| is_integer_text(&node.id);
    let writer = Writer {
        coordinates: draft.coordinates,
        integer_ids: draft.integer_ids && draft.nodes.iter().all(is_integer),
        positions: draft
            .nodes
            .iter()
            .map(|node| (node.id.as_str(), node.position))
            .collect(),
    };
    let coordinates = match draft.coordinates {
        Coordinates::Geographic => "geographic",
        Coordinates::Planar => "planar",
    };
    let mut text = String::new();
    let head = format!(
        r#"{{"type":"FeatureCollection","name":{},"attribution":{},"skyway":{{"format":{FORMAT},"coordinates":"{coordinates}"}},"features":["#,
        quoted(&draft.name),
        quoted(&draft.attribution),
    );
    text.push_str(&head);
    let mut separator = "\n";
    for node in &draft.nodes {
        text.push_str(separator);
        writer.node(&mut text, node);
        separator = ",\n";
    }
    for segment in &draft.segments {
        text.push_str(separator);
        writer.segment(&mut text, segment);
        separator = ",\n";
    }
    text.push_str("\n]}\n");
    text
}

struct Writer<'a> {
    coordinates: Coordinates,
    integer_ids: bool,
    positions: FxHashMap<&'a str, [f64; 2]>,
}

impl Writer<'_> {
    fn node(&self, text: &mut String, node: &NodeDraft) {
        text.push_str(r#"{"type":"Feature","id":"#);
        text.push_str(&self.node_id(&node.id));
        text.push_str(r#","geometry":{"type":"Point","coordinates":"#);
        self.position(text, node.position);
        text.push_str(r#"},"properties":{"kind":"node""#);
        member(text, "pads", &node.pads.to_string());
        member(text, "role", &quoted(role_name(node.role)));
        altitude(text, "altitude", node.altitude);
        if let Some(name) = &node.name {
            member(text, "name", &quoted(name));
        }
        text.push_str("}}");
    }

    fn segment(&self, text: &mut String, segment: &SegmentDraft) {
        text.push_str(r#"{"type":"Feature""#);
        if let Some(id) = &segment.id {
            member(text, "id", &quoted(id));
        }
        text.push_str(r#","geometry":{"type":"LineString","coordinates":["#);
        let ends = [&segment.from, &segment.to].map(|id| self.positions.get(id.as_str()));
        if let [Some(&from), Some(&to)] = ends {
            self.position(text, from);
            text.push(',');
            self.position(text, to);
        }
        text.push_str(r#"]},"properties":{"kind":"segment""#);
        member(text, "from", &self.node_id(&segment.from));
        member(text, "to", &self.node_id(&segment.to));
        if let Some(length_m) = segment.length_m {
            member(text, "length_m", &number(length_m));
        }
        altitude(text, "lower", segment.band.lower);
        altitude(text, "upper", segment.band.upper);
        if let Some(speed_limit_mps) = segment.speed_limit_mps {
            member(text, "speed_limit_mps", &number(speed_limit_mps));
        }
        text.push_str("}}");
    }

    fn node_id(&self, id: &str) -> String {
        if self.integer_ids {
            id.to_owned()
        } else {
            quoted(id)
        }
    }

    fn position(&self, text: &mut String, position: [f64; 2]) {
        let [first, second] = written_position(self.coordinates, position).map(number);
        push(text, format_args!("[{first},{second}]"));
    }
}

/// `,"name":value`
fn member(text: &mut String, name: &str, value: &str) {
    push(text, format_args!(r#","{name}":{value}"#));
}

/// The members `prefix_m` and `prefix_reference`, where the altitude is known.
fn altitude(text: &mut String, prefix: &str, altitude: Option<Altitude>) {
    let Some(altitude) = altitude else {
        return;
    };
    let reference = altitude.reference.name();
    let value_m = number(altitude.value_m);
    push(
        text,
        format_args!(r#","{prefix}_m":{value_m},"{prefix}_reference":"{reference}""#),
    );
}

fn push(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    text.write_fmt(arguments)
        .expect("writing to a string does not fail");
}

fn quoted(words: &str) -> String {
    Value::from(words).to_string()
}

/// The shortest decimal that reads back as the same double; null for what JSON has no number for.
fn number(value: f64) -> String {
    if !value.is_finite() {
        return json!(null).to_string();
    }
    // Adding 0 turns a negative zero into zero.
    (value + 0.0).to_string()
}
