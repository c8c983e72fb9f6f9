//! The small network of most stories.

use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};

/// A ladder of two rows of eight nodes, 100 m apart.
pub(crate) fn ladder() -> NetworkDraft {
    let node = |row: &str, place: usize, y: f64| NodeDraft {
        id: format!("{row}{place}"),
        position: [place as f64 * 100.0, y],
        pads: u16::from(place == 0 || place == 7),
        ..NodeDraft::default()
    };
    let nodes = (0..8).flat_map(|place| [node("a", place, 0.0), node("b", place, 100.0)]);
    let mut segments = Vec::new();
    let mut join = |from: String, to: String| segments.push(segment(from, to));
    for place in 0..8 {
        join(format!("a{place}"), format!("b{place}"));
        if place < 7 {
            join(format!("a{place}"), format!("a{}", place + 1));
            join(format!("b{place}"), format!("b{}", place + 1));
        }
    }
    NetworkDraft {
        nodes: nodes.collect(),
        segments,
        coordinates: Coordinates::Planar,
        name: "ladder".to_owned(),
        ..NetworkDraft::default()
    }
}

pub(crate) fn segment(from: impl Into<String>, to: impl Into<String>) -> SegmentDraft {
    SegmentDraft {
        from: from.into(),
        to: to.into(),
        ..SegmentDraft::default()
    }
}
