//! Marks for single places: nodes, ends of paths, drones, the cross on a failed leg.

use super::style::{BLUE, GREEN, INK, NODE, ORANGE, VERMILLION};
use super::svg::{Document, PathData, Spot};

/// A node smaller than this has no room for a ring: it is a dot. In pixels.
const SMALLEST_RING_PX: f64 = 1.8;

/// Marks for single places, told apart by their shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Start,
    Destination,
    Alternate,
    Drone,
    AreaNode,
    ClosedNode,
    Stop,
}

/// Draws rings about places: round dots in two colours, one path each.
pub(super) fn draw_rings(places: &[Spot], radius_px: f64, document: &mut Document) {
    let mut dots = PathData::default();
    for &place in places {
        dots.dot(place);
    }
    let line_px = (radius_px * 0.3).clamp(0.3, 1.0);
    let widths = [
        (NODE, 2.0 * radius_px),
        ("#ffffff", 2.0 * (radius_px - line_px)),
    ];
    let layers = if radius_px < SMALLEST_RING_PX {
        &widths[..1]
    } else {
        &widths[..]
    };
    for (colour, width) in layers {
        document.path(
            &dots,
            format_args!(
                "stroke=\"{colour}\" stroke-width=\"{width:.2}\" stroke-linecap=\"round\""
            ),
        );
    }
}

/// Draws the cross on a failed leg.
pub(super) fn draw_cross(middle: Spot, document: &mut Document) {
    let arm = 5.5;
    let mut cross = PathData::default();
    cross.add([middle.moved(-arm, -arm), middle.moved(arm, arm)], false);
    cross.add([middle.moved(-arm, arm), middle.moved(arm, -arm)], false);
    for (colour, width) in [("#ffffff", 5.5), (VERMILLION, 2.8)] {
        document.path(
            &cross,
            format_args!(
                "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\""
            ),
        );
    }
}

/// Draws a mark about a place, upright.
pub(super) fn draw_mark(mark: Mark, at: Spot, document: &mut Document) {
    draw_mark_towards(mark, at, at.moved(0.0, -1.0), document);
}

/// Draws a mark about a place, its upper side turned to another.
pub(super) fn draw_mark_towards(mark: Mark, at: Spot, ahead: Spot, document: &mut Document) {
    let distance_px = at.distance(ahead);
    let (east, south) = match distance_px > 0.0 {
        true => (
            (ahead.x - at.x) / distance_px,
            (ahead.y - at.y) / distance_px,
        ),
        false => (0.0, -1.0),
    };
    let turned =
        |right: f64, down: f64| at.moved(-south * right - east * down, east * right - south * down);
    let mut shape = PathData::default();
    let corners = |offsets: &[(f64, f64)]| -> Vec<Spot> {
        let offsets = offsets.iter();
        offsets.map(|&(right, down)| turned(right, down)).collect()
    };
    let (fill, edge, width) = match mark {
        Mark::Start => {
            shape.circle(at, 5.5);
            (BLUE, "#ffffff", 1.5)
        }
        Mark::Destination => {
            shape.add(
                corners(&[(-5.5, -5.5), (5.5, -5.5), (5.5, 5.5), (-5.5, 5.5)]),
                true,
            );
            (BLUE, "#ffffff", 1.5)
        }
        Mark::Alternate => {
            shape.add(
                corners(&[(0.0, -7.5), (7.5, 0.0), (0.0, 7.5), (-7.5, 0.0)]),
                true,
            );
            (GREEN, "#ffffff", 1.5)
        }
        Mark::Drone => {
            shape.add(
                corners(&[(0.0, -7.0), (6.0, 5.0), (0.0, 2.0), (-6.0, 5.0)]),
                true,
            );
            (INK, "#ffffff", 1.2)
        }
        Mark::AreaNode => {
            shape.circle(at, 2.8);
            (ORANGE, "#7a5200", 0.8)
        }
        Mark::Stop => {
            shape.add(corners(&[(0.0, -6.5), (6.0, 4.5), (-6.0, 4.5)]), true);
            (GREEN, "#ffffff", 1.4)
        }
        Mark::ClosedNode => {
            shape.circle(at, 3.2);
            ("#ffffff", VERMILLION, 1.2)
        }
    };
    document.path(
        &shape,
        format_args!(
            "fill=\"{fill}\" stroke=\"{edge}\" stroke-width=\"{width}\" stroke-linejoin=\"round\""
        ),
    );
}
