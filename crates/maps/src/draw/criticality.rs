//! What failures cost, drawn over the network: segments by colour and width, nodes by the size of a disc.

use super::legend::{Legend, Sample};
use super::style::{INK, ORANGE, VERMILLION};
use super::svg::{Document, PathData};
use super::view::View;
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::routing::{Cost, Criticality};

/// Classes of extra metres from the costliest down: the share of the largest cost, colour, width or radius in
/// pixels.
const CLASSES: [(f64, &str, f64); 3] = [
    (0.5, "#7a0177", 4.0),
    (0.2, VERMILLION, 2.8),
    (0.05, ORANGE, 1.8),
];
/// What leaves deliveries without a route.
const LOSS: &str = "stroke-dasharray=\"5 2.5\"";

/// Draws the cost of every segment, node and pad that is worth a mark.
pub(super) fn draw_criticality(
    topology: &Topology,
    criticality: &Criticality,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    draw_segments(topology, criticality, view, map, legend);
    draw_nodes(topology, criticality, view, map, legend);
    draw_losses(topology, criticality, view, map, legend);
}

fn most_m(costs: &[Cost]) -> f64 {
    costs.iter().map(|cost| cost.extra_m).fold(0.0, f64::max)
}

/// The class of a cost; `None` where it is too small for a mark.
fn class(extra_m: f64, most_m: f64) -> Option<usize> {
    CLASSES
        .iter()
        .position(|&(share, ..)| extra_m > share * most_m)
}

fn draw_segments(
    topology: &Topology,
    criticality: &Criticality,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    let most_m = most_m(&criticality.segments);
    let mut lost = PathData::default();
    let mut by_class = CLASSES.map(|_| PathData::default());
    let mut are_lost = false;
    for (segment, cost) in (0..).map(SegmentIx).zip(&criticality.segments) {
        let (from, to) = topology.segment_ends(segment);
        let ends = [view.place(from), view.place(to)];
        if cost.lost > 0.0 {
            lost.add(ends, false);
            are_lost = true;
        } else if let Some(class) = class(cost.extra_m, most_m) {
            by_class[class].add(ends, false);
        }
    }
    let stroke = |colour: &str, width: f64| {
        format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"")
    };
    for (data, (_, colour, width)) in by_class.iter().zip(CLASSES).rev() {
        map.path(data, format_args!("{}", stroke(colour, width)));
    }
    let cut = format!("{} {LOSS}", stroke(INK, 2.4));
    map.path(&lost, format_args!("{cut}"));
    if are_lost {
        legend.add(
            Sample::Lines(vec![cut]),
            "segment without which deliveries are lost",
        );
    }
    for (share, colour, width) in CLASSES {
        let words = format!("segment: > {} extra", kilometres(share * most_m));
        legend.add(Sample::Lines(vec![stroke(colour, width)]), words);
    }
}

fn draw_nodes(
    topology: &Topology,
    criticality: &Criticality,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    let most_m = most_m(&criticality.nodes);
    for (place, (share, colour, radius)) in CLASSES.into_iter().enumerate() {
        let mut data = PathData::default();
        for (node, cost) in (0..).map(NodeIx).zip(&criticality.nodes) {
            if class(cost.extra_m, most_m) == Some(place) {
                data.circle(view.place(topology.position(node)), radius + 1.0);
            }
        }
        let style = format!("fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"0.8\"");
        map.path(&data, format_args!("{style}"));
        let words = format!("node: > {} extra", kilometres(share * most_m));
        legend.add(Sample::Squares(vec![style]), words);
    }
}

/// Diamonds on the nodes that part the network, and rings about those whose pads cannot be missed.
fn draw_losses(
    topology: &Topology,
    criticality: &Criticality,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    let losing = |costs: &[Cost]| {
        let all = (0..).map(NodeIx).zip(costs);
        let losing = all.filter(|(_, cost)| cost.lost > 0.0);
        losing
            .map(|(node, _)| view.place(topology.position(node)))
            .collect::<Vec<_>>()
    };
    let (mut parting, mut ringed) = (PathData::default(), PathData::default());
    let (nodes, pads) = (losing(&criticality.nodes), losing(&criticality.pads));
    for place in &nodes {
        let corners = [(0.0, -6.0), (6.0, 0.0), (0.0, 6.0), (-6.0, 0.0)];
        parting.add(corners.map(|(right, down)| place.moved(right, down)), true);
    }
    for &place in &pads {
        ringed.circle(place, 10.0);
    }
    let losses = [
        (
            parting,
            !nodes.is_empty(),
            INK,
            "node without which deliveries are lost (diamond)",
        ),
        (
            ringed,
            !pads.is_empty(),
            "none",
            "pads without which deliveries are lost (ring)",
        ),
    ];
    for (data, is_any, fill, words) in losses {
        let style = format!("fill=\"{fill}\" stroke=\"{INK}\" stroke-width=\"1.4\"");
        map.path(&data, format_args!("{style}"));
        if is_any {
            legend.add(Sample::Squares(vec![style]), words);
        }
    }
}

fn kilometres(metres: f64) -> String {
    match metres {
        1e7.. => format!("{:.0} thousand km", metres / 1e6),
        _ => format!("{:.0} km", metres / 1e3),
    }
}
