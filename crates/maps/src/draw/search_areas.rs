//! The search areas of a recomposition, stage by stage, and what happened in words.

use super::DrawnRecomposition;
use super::legend::{Legend, Sample};
use super::style::{AREA, EARLIER_AREA, SKIPPED_AREA};
use super::svg::{Document, PathData, Spot};
use super::view::View;
use crate::geo::Point;
use crate::network::Topology;
use crate::recompose::{AreaShape, Outcome, Recomposition, Stage, StageRecord, Strategy};
use geo::{Coord, LineString, Polygon, unary_union};

/// The radius of the halo of a node that was added beyond a polygon, in pixels.
const ADDED_NODE_HALO_PX: f64 = 8.0;
/// The records whose areas are filled: those that found a path, and the last.
pub(super) fn is_decisive(stages: &[StageRecord], index: usize) -> bool {
    stages[index].path_found || index + 1 == stages.len()
}

/// Draws the search areas: earlier stages as outlines, the decisive ones filled.
pub(super) fn draw_areas(
    topology: &Topology,
    drawn: &DrawnRecomposition<'_>,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    let stages = &drawn.answer.stages;
    let (mut earlier, mut skipped, mut decisive) = (Vec::new(), Vec::new(), Vec::new());
    for (index, record) in stages.iter().enumerate() {
        match is_decisive(stages, index) {
            true => decisive.push(record),
            false if record.skipped => skipped.push(record),
            // The rectangle that it grew from is outlined already; every round of growth would be clutter.
            false if record.stage == Stage::Grown => {}
            false => earlier.push(record),
        }
    }
    // The area that decided lies under the outlines of the others.
    for record in &decisive {
        let data = outline_of(topology, &record.shape, view);
        map.path(&data, format_args!("{AREA}"));
    }
    for (records, style) in [(&skipped, SKIPPED_AREA), (&earlier, EARLIER_AREA)] {
        for record in records {
            let data = outline_of(topology, &record.shape, view);
            map.path(&data, format_args!("{style}"));
        }
    }
    list_areas(
        &decisive,
        "search area",
        |words| Sample::Squares(vec![words]),
        AREA,
        legend,
    );
    let line = |style: String| Sample::Lines(vec![style]);
    list_areas(&earlier, "searched before", line, EARLIER_AREA, legend);
    list_areas(
        &skipped,
        "skipped, having few nodes",
        line,
        SKIPPED_AREA,
        legend,
    );
}

fn list_areas(
    records: &[&StageRecord],
    role: &str,
    sample: impl Fn(String) -> Sample,
    style: &str,
    legend: &mut Legend,
) {
    let is_everything = |record: &&&StageRecord| record.shape == AreaShape::Everything;
    let mut names: Vec<&str> = Vec::new();
    for record in records.iter().filter(|record| !is_everything(record)) {
        let name = stage_name(record.stage);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    if !names.is_empty() {
        legend.add(
            sample(style.to_owned()),
            format!("{role}: {}", names.join(", ")),
        );
    }
}

/// A stage in words.
fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Circle => "circle",
        Stage::Cells => "cells",
        Stage::Triangle => "triangle",
        Stage::Rhombus => "rhombus",
        Stage::Rectangle => "rectangle",
        Stage::Grown => "grown rectangle",
        Stage::Local | Stage::Global => "whole network",
    }
}

/// A strategy in words.
fn strategy_name(strategy: Strategy) -> &'static str {
    match strategy {
        Strategy::Exact => "exact",
        Strategy::TwoPhased => "two-phased",
        Strategy::CellDensity => "cell density-based",
        Strategy::Radius => "radius-based",
        Strategy::Dijkstra => "Dijkstra's algorithm",
        Strategy::Astar => "A*",
        Strategy::BellmanFord => "Bellman-Ford",
    }
}

/// What happened, in a sentence without its full stop.
pub(super) fn summary(answer: &Recomposition) -> String {
    let outcome = match answer.outcome {
        Outcome::Rerouted => "rerouted",
        Outcome::Unaffected => "nothing ahead is touched",
        Outcome::Hold => "waits, then rerouted",
        Outcome::Diverted => "diverted to an alternate",
        Outcome::NoRoute => "no route",
    };
    let used = strategy_name(answer.strategy_used);
    let mut text = format!("Recomposition, {used}: {outcome}");
    if !answer.stages.is_empty() {
        let stage = stage_name(answer.stage);
        text.push_str(&match answer.searches {
            1 => format!(" after 1 search, in the {stage}"),
            searches => format!(" after {searches} searches, the last in the {stage}"),
        });
    }
    if let Some(reason) = &answer.fallback {
        let asked = strategy_name(answer.strategy);
        text.push_str(&format!("; not {asked}, as {reason}"));
    }
    text
}

fn outline_of(topology: &Topology, shape: &AreaShape, view: &View) -> PathData {
    let through = |corners: &[Point]| {
        let places = corners.iter().map(|&corner| view.place(corner));
        PathData::through(places, true)
    };
    match shape {
        AreaShape::Everything => PathData::default(),
        AreaShape::Circle { centre, radius_m } => {
            let mut data = PathData::default();
            data.circle(view.place(*centre), view.pixels(*radius_m));
            data
        }
        AreaShape::Squares { squares } => union_of_squares(squares, view),
        AreaShape::Polygon { corners } => through(corners),
        AreaShape::Grown { corners, added } => {
            let mut data = through(corners);
            for &node in added {
                data.circle(view.place(topology.position(node)), ADDED_NODE_HALO_PX);
            }
            data
        }
    }
}

/// The outline of all squares together, in pixels: overlapping squares would hide what area is searched.
fn union_of_squares(squares: &[(Point, f64)], view: &View) -> PathData {
    let square = |&(centre, half_side_m): &(Point, f64)| {
        let at = view.place(centre);
        let reach_px = view.pixels(half_side_m);
        let corner = |right: f64, down: f64| Coord {
            x: at.x + right * reach_px,
            y: at.y + down * reach_px,
        };
        let ring = vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        Polygon::new(LineString(ring), Vec::new())
    };
    let squares: Vec<Polygon<f64>> = squares.iter().map(square).collect();
    let mut data = PathData::default();
    for polygon in &unary_union(&squares) {
        for ring in std::iter::once(polygon.exterior()).chain(polygon.interiors()) {
            let corners = ring.coords().skip(1);
            data.add(corners.map(|corner| Spot::new(corner.x, corner.y)), true);
        }
    }
    data
}
