//! The two small networks on which what a target reads is tried: one in degrees with integers as ids, one in
//! metres with text.

use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::airspace::Airspace;
use skyway::formats::load_network;
use skyway::network::{Topology, sketch};
use std::sync::{Arc, LazyLock};

const COLUMNS: i64 = 4;
const ROWS: i64 = 3;
const STEP_DEG: f64 = 0.001;
const CORNER: [f64; 2] = [151.208, -33.866];

/// Both networks, open, at a time of 2026.
pub(crate) fn airspaces() -> &'static [Airspace] {
    static AIRSPACES: LazyLock<[Airspace; 2]> = LazyLock::new(|| {
        [degrees(), metres()].map(|topology| {
            let horizon = SignedDuration::from_mins(60);
            Airspace::open(Arc::new(topology), 1, now(), horizon)
        })
    });
    &*AIRSPACES
}

/// The time of both.
pub(crate) fn now() -> Timestamp {
    Timestamp::new(1_795_000_000, 0).unwrap_or(Timestamp::UNIX_EPOCH)
}

fn metres() -> Topology {
    let drawing = "
C...D
.....
A...B.E..Z";
    let segments = [("A", "B"), ("A", "C"), ("C", "D"), ("D", "B"), ("B", "E")];
    sketch(drawing, &segments)
}

/// A grid of streets in Sydney: node 11 in the south-west, 34 in the north-east.
fn degrees() -> Topology {
    let mut features = Vec::new();
    let mut segments = Vec::new();
    for row in 1..=ROWS {
        for column in 1..=COLUMNS {
            features.push(node(row, column));
            if column < COLUMNS {
                segments.push(segment((row, column), (row, column + 1)));
            }
            if row < ROWS {
                segments.push(segment((row, column), (row + 1, column)));
            }
        }
    }
    features.extend(segments);
    let document = json!({
        "type": "FeatureCollection",
        "name": "grid",
        "attribution": "",
        "skyway": {"format": 1, "coordinates": "geographic"},
        "features": features,
    });
    match load_network(&document.to_string()) {
        Ok(loaded) => loaded.topology,
        Err(error) => panic!("the grid is a network: {:?}", error.lines()),
    }
}

fn id(row: i64, column: i64) -> i64 {
    row * 10 + column
}

fn position(row: i64, column: i64) -> [f64; 2] {
    [
        CORNER[0] + column as f64 * STEP_DEG,
        CORNER[1] + row as f64 * STEP_DEG,
    ]
}

fn node(row: i64, column: i64) -> Value {
    json!({
        "type": "Feature",
        "id": id(row, column),
        "geometry": {"type": "Point", "coordinates": position(row, column)},
        "properties": {"pads": column % 2, "altitude_m": 30},
    })
}

fn segment(from: (i64, i64), to: (i64, i64)) -> Value {
    let ends = [position(from.0, from.1), position(to.0, to.1)];
    json!({
        "type": "Feature",
        "geometry": {"type": "LineString", "coordinates": ends},
        "properties": {
            "from": id(from.0, from.1),
            "to": id(to.0, to.1),
            "lower_m": 60,
            "upper_m": 110,
        },
    })
}
