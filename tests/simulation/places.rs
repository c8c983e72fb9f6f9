//! The network that everybody flies over, and circles that close a segment of it.

use crate::history::edges::Circle;
use crate::rounds::Chance;
use serde_json::{Value, json};
use skyway::formats::write_network;
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};

pub(crate) const NETWORK: &str = "lattice";
/// Rows and columns of nodes.
const ROWS: usize = 3;
const COLUMNS: usize = 6;
/// From one node to the next, in metres.
const STEP_M: f64 = 100.0;
/// A circle in the middle of a segment that is not larger than this closes that segment only.
const RADIUS_MAX_M: u64 = 40;

fn node_id(row: usize, column: usize) -> String {
    let letter = char::from(b'a' + row as u8);
    format!("{letter}{column}")
}

/// Where a node is.
pub(crate) fn position_m(id: &str) -> [f64; 2] {
    let mut letters = id.bytes();
    let row = letters.next().map_or(0, |letter| letter - b'a');
    let column = letters.next().map_or(0, |digit| digit - b'0');
    [f64::from(column) * STEP_M, f64::from(row) * STEP_M]
}

/// The ends of all segments.
pub(crate) fn segments() -> Vec<(String, String)> {
    let mut segments = Vec::new();
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            if column + 1 < COLUMNS {
                segments.push((node_id(row, column), node_id(row, column + 1)));
            }
            if row + 1 < ROWS {
                segments.push((node_id(row, column), node_id(row + 1, column)));
            }
        }
    }
    segments
}

/// The network as text.
pub(crate) fn lattice() -> String {
    let nodes = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)));
    let nodes = nodes.map(|(row, column)| {
        let id = node_id(row, column);
        NodeDraft {
            position: position_m(&id),
            pads: u16::from(column % 5 == 0),
            id,
            ..NodeDraft::default()
        }
    });
    let segments = segments().into_iter().map(|(from, to)| SegmentDraft {
        from,
        to,
        ..SegmentDraft::default()
    });
    write_network(&NetworkDraft {
        nodes: nodes.collect(),
        segments: segments.collect(),
        coordinates: Coordinates::Planar,
        name: "lattice".to_owned(),
        ..NetworkDraft::default()
    })
}

/// A node by chance.
pub(crate) fn draw_node(chance: &mut Chance) -> String {
    let row = chance.below(ROWS as u64) as usize;
    node_id(row, chance.below(COLUMNS as u64) as usize)
}

/// A segment by chance.
pub(crate) fn draw_segment(chance: &mut Chance) -> (String, String) {
    let segments = segments();
    let place = chance.below(segments.len() as u64) as usize;
    segments[place].clone()
}

/// A circle in the middle of one of two segments that an id has, so that of two under one id some enclose each other.
pub(crate) fn draw_circle(id: &str, chance: &mut Chance) -> Circle {
    let segments = segments();
    let number: usize = id.bytes().map(usize::from).sum();
    let place = number * 7 + chance.below(2) as usize;
    let (from, to) = &segments[place % segments.len()];
    let ([x, y], [to_x, to_y]) = (position_m(from), position_m(to));
    Circle {
        center_m: [f64::midpoint(x, to_x), f64::midpoint(y, to_y)],
        radius_m: (3 + chance.below(RADIUS_MAX_M - 2)) as f64,
    }
}

/// The circle as a zone whose reason is its tag.
pub(crate) fn zone(id: &str, tag: &str, circle: Circle) -> Value {
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Point", "coordinates": circle.center_m},
        "properties": {"radius_m": circle.radius_m, "margin_m": 0, "reason": tag},
    })
}

/// A tag that ends with the radius, so that a circle that was bent is told from the one that was made.
pub(crate) fn tag(name: &str, circle: Circle) -> String {
    format!("{name}:{}", circle.radius_m)
}

/// The tag of a zone.
pub(crate) fn tag_of(feature: &Value) -> String {
    let properties = &feature["properties"];
    let tag = properties["reason"].as_str().unwrap_or_default();
    let radius_m = properties["radius_m"].as_f64().unwrap_or_default();
    match tag.ends_with(&format!(":{radius_m}")) {
        true => tag.to_owned(),
        false => format!("{tag}, bent to {radius_m}"),
    }
}

/// The tag of a zone by its text.
pub(crate) fn tag_of_text(body: &str) -> String {
    let feature: Value = serde_json::from_str(body).unwrap_or_default();
    tag_of(&feature)
}
