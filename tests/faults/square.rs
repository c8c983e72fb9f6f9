//! The network of all stories: a square of streets, and where things with tags are in it.

use serde_json::{Value, json};
use skyway::formats::write_network;
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};

/// Nodes in a row, and rows.
const SIDE: u8 = 6;
/// From one to the next, in metres.
const STEP_M: f64 = 100.0;

/// The node of a column and a row, counted from 0.
fn node(x: u8, y: u8) -> String {
    format!("n{x}{y}")
}

/// Where a node is, in metres.
pub(crate) fn place_m(node: &str) -> Option<[f64; 2]> {
    let mut digits = node
        .strip_prefix('n')?
        .chars()
        .map(|digit| digit.to_digit(10));
    let (x, y) = (digits.next()??, digits.next()??);
    Some([f64::from(x) * STEP_M, f64::from(y) * STEP_M])
}

/// All nodes in rows, each joined with those beside it.
pub(crate) fn network() -> String {
    let (mut nodes, mut segments) = (Vec::new(), Vec::new());
    for (x, y) in (0..SIDE).flat_map(|x| (0..SIDE).map(move |y| (x, y))) {
        nodes.push(NodeDraft {
            id: node(x, y),
            position: [f64::from(x) * STEP_M, f64::from(y) * STEP_M],
            pads: 1,
            ..NodeDraft::default()
        });
        let beside = [(x + 1, y), (x, y + 1)].into_iter();
        let beside = beside.filter(|(x, y)| *x < SIDE && *y < SIDE);
        segments.extend(beside.map(|(to_x, to_y)| SegmentDraft {
            from: node(x, y),
            to: node(to_x, to_y),
            ..SegmentDraft::default()
        }));
    }
    write_network(&NetworkDraft {
        name: "Square".to_owned(),
        coordinates: Coordinates::Planar,
        nodes,
        segments,
        ..NetworkDraft::default()
    })
}

/// Where the zone of a tag is, in metres: in the middle of some segment.
pub(crate) fn middle_of(tag: &str) -> [f64; 2] {
    let mixed = tag.bytes().fold(17_u64, |mixed, byte| {
        (mixed ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    });
    let drawn = |shift: u32, bound: u64| ((mixed >> shift) % bound) as f64;
    let along = (drawn(8, u64::from(SIDE) - 1) + 0.5) * STEP_M;
    let across = drawn(24, u64::from(SIDE)) * STEP_M;
    match (mixed >> 40) % 2 {
        0 => [along, across],
        _ => [across, along],
    }
}

/// A circle whose reason is its tag.
pub(crate) fn circle(id: &str, tag: &str, center: [f64; 2], radius_m: f64) -> Value {
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Point", "coordinates": center},
        "properties": {"radius_m": radius_m, "reason": tag},
    })
}

/// The tag of a thing by its text: the reason of a zone or of a closure, the drone of a plan.
pub(crate) fn tag_of(body: &str) -> String {
    let thing: Value = serde_json::from_str(body).unwrap_or_default();
    tag_in(&thing)
}

/// The same of what was read. A zone of a story that is not where its tag says is not the one that was put.
pub(crate) fn tag_in(thing: &Value) -> String {
    let places = [
        &thing["properties"]["reason"],
        &thing["reason"],
        &thing["drone_id"],
    ];
    let tag = places.into_iter().find_map(Value::as_str);
    let tag = tag.unwrap_or_default();
    let center = &thing["geometry"]["coordinates"];
    let is_of_story = thing["id"]
        .as_str()
        .is_some_and(|id| id.starts_with("zone-"));
    match is_of_story && !center.is_null() && *center != json!(middle_of(tag)) {
        true => format!("{tag} at {center}"),
        false => tag.to_owned(),
    }
}
