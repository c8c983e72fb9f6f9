//! Networks drawn in ASCII, for tests that tell a story: letters are nodes, the drawing gives positions.

use super::draft::{NetworkDraft, NodeDraft, SegmentDraft};
use super::topology::Topology;

/// Metres between two characters, and between two lines, of a sketch.
pub const SKETCH_STEP_M: f64 = 100.0;

/// A planar network from a drawing: every letter or digit is a node of that name, 100 m to a character
/// and to a line, the last line at `y = 0`; segments are named by their ends and are straight.
///
/// # Panics
/// On a drawing that is not a network; it is a drawing in a test.
pub fn sketch(drawing: &str, segments: &[(&str, &str)]) -> Topology {
    let lines: Vec<&str> = drawing
        .lines()
        .filter(|line| !line.trim().is_empty())
        .collect();
    let mut draft = NetworkDraft {
        name: "sketch".to_owned(),
        ..NetworkDraft::default()
    };
    for (row, line) in lines.iter().rev().enumerate() {
        for (column, letter) in line.chars().enumerate() {
            if letter.is_alphanumeric() {
                draft.nodes.push(NodeDraft {
                    id: letter.to_string(),
                    position: [column as f64, row as f64].map(|steps| steps * SKETCH_STEP_M),
                    ..NodeDraft::default()
                });
            }
        }
    }
    draft.segments = segments
        .iter()
        .map(|(from, to)| SegmentDraft {
            from: (*from).to_owned(),
            to: (*to).to_owned(),
            ..SegmentDraft::default()
        })
        .collect();
    match Topology::build(draft, [0; 32]) {
        Ok(topology) => topology,
        Err(errors) => panic!("a sketch is a network: {errors:?}"),
    }
}
