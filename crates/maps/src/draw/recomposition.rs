//! A recomposition on the map: old and new path, the failed leg, nodes of the search area, and marks.

use super::DrawnRecomposition;
use super::labels::Labeller;
use super::legend::{Legend, Sample};
use super::marks::{Mark, draw_cross, draw_mark, draw_mark_towards};
use super::measures::grouped;
use super::network::Grain;
use super::search_areas::is_decisive;
use super::style::{BLUE, FAILED_LEG, FIRST_STRETCH, NEW_PATH, NEW_PATH_EDGE, OLD_PATH, ORANGE};
use super::svg::{Document, PathData, Spot};
use super::view::View;
use crate::network::{NodeIx, Topology};
use crate::recompose::{AreaShape, Outcome};
use std::collections::BTreeSet;

/// Legs shorter than this have no room for an arrowhead, in pixels.
const SHORTEST_LEG_WITH_ARROW_PX: f64 = 34.0;

/// The paths and marks of a recomposition, laid on the map.
pub(super) struct Scene<'a> {
    drawn: &'a DrawnRecomposition<'a>,
    topology: &'a Topology,
    view: &'a View,
    old: Vec<Spot>,
    new: Vec<Spot>,
    leg: [Spot; 2],
    drone: Option<Spot>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(
        topology: &'a Topology,
        drawn: &'a DrawnRecomposition<'a>,
        view: &'a View,
    ) -> Self {
        let place = |node: &NodeIx| view.place(topology.position(*node));
        let (from, to) = drawn.failed_leg;
        let drone = drawn.drone.filter(|drone| drone.is_finite());
        Self {
            drawn,
            topology,
            view,
            old: drawn.old_path.iter().map(place).collect(),
            new: drawn.answer.path.nodes.iter().map(place).collect(),
            leg: [place(&from), place(&to)],
            drone: drone.map(|drone| view.place(drone)),
        }
    }

    /// Dots on the nodes of the areas that decided; none where that was the whole network.
    pub(super) fn draw_area_nodes(&self, grain: Grain, map: &mut Document, legend: &mut Legend) {
        let stages = &self.drawn.answer.stages;
        let decisive = (0..stages.len()).filter(|&index| is_decisive(stages, index));
        let nodes: BTreeSet<NodeIx> = decisive
            .map(|index| &stages[index])
            .filter(|record| record.shape != AreaShape::Everything)
            .flat_map(|record| record.nodes.iter().copied())
            .collect();
        if nodes.is_empty() {
            return;
        }
        let mut dots = PathData::default();
        for &node in &nodes {
            let position = self.topology.position(node);
            if self.view.shows(position) {
                dots.dot(self.view.place(position));
            }
        }
        let radius_px = grain.dot_px();
        for (colour, width) in [
            ("#7a5200", 2.0 * radius_px + 1.2),
            (ORANGE, 2.0 * radius_px),
        ] {
            map.path(
                &dots,
                format_args!(
                    "stroke=\"{colour}\" stroke-width=\"{width:.1}\" stroke-linecap=\"round\""
                ),
            );
        }
        let count = nodes.len();
        let noun = if count == 1 { "node" } else { "nodes" };
        legend.add(
            Sample::Mark(Mark::AreaNode),
            format!("{} {noun} of the search area", grouped(count as f64)),
        );
    }

    pub(super) fn draw_paths(&self, map: &mut Document, legend: &mut Legend) {
        let answer = self.drawn.answer;
        if self.old.len() > 1 {
            let data = PathData::through(self.old.iter().copied(), false);
            map.path(&data, format_args!("{OLD_PATH}"));
            let length = with_length("planned path", planned_length_m(self.topology, self.drawn));
            legend.add(Sample::Lines(vec![OLD_PATH.to_owned()]), length);
        }
        self.draw_new_path(map, legend);
        map.path(
            &PathData::through(self.leg, false),
            format_args!("{FAILED_LEG}"),
        );
        legend.add(Sample::CrossedLine(FAILED_LEG), "failed leg");
        // The way back to the start of the leg runs along it, so it lies above.
        if let (Some(drone), Some(&first)) = (self.drone, self.new.first())
            && answer.first_stretch_m > 0.0
        {
            map.path(
                &PathData::through([drone, first], false),
                format_args!("{FIRST_STRETCH}"),
            );
            let stretch = with_length("way to the first node", Some(answer.first_stretch_m));
            legend.add(Sample::Lines(vec![FIRST_STRETCH.to_owned()]), stretch);
        }
    }

    fn draw_new_path(&self, map: &mut Document, legend: &mut Legend) {
        if self.new.len() < 2 {
            return;
        }
        let answer = self.drawn.answer;
        let data = PathData::through(self.new.iter().copied(), false);
        map.path(&data, format_args!("{NEW_PATH_EDGE}"));
        map.path(&data, format_args!("{NEW_PATH}"));
        self.draw_arrows(map);
        self.draw_stops(map);
        let role = match answer.outcome {
            Outcome::Unaffected => "path flown on",
            Outcome::Diverted => "path to the alternate",
            Outcome::Rerouted | Outcome::Hold | Outcome::NoRoute => "new path",
        };
        let length = with_length(role, answer.remaining_length_m);
        legend.add(Sample::Lines(vec![NEW_PATH.to_owned()]), length);
    }

    /// Arrowheads in the middle of the legs of the new path that have room for one.
    fn draw_arrows(&self, map: &mut Document) {
        let mut heads = PathData::default();
        for leg in self.new.windows(2) {
            let (from, to) = (leg[0], leg[1]);
            let length_px = from.distance(to);
            if length_px < SHORTEST_LEG_WITH_ARROW_PX {
                continue;
            }
            let (right, down) = ((to.x - from.x) / length_px, (to.y - from.y) / length_px);
            let tip = from.towards(to, 0.5).moved(right * 5.0, down * 5.0);
            let foot = tip.moved(-right * 9.0, -down * 9.0);
            let wing = |side: f64| foot.moved(-down * side, right * side);
            heads.add([tip, wing(4.5), wing(-4.5)], true);
        }
        map.path(
            &heads,
            format_args!("fill=\"{BLUE}\" stroke=\"#ffffff\" stroke-width=\"0.6\""),
        );
    }

    /// Rings on the nodes that the new path comes by.
    fn draw_stops(&self, map: &mut Document) {
        let mut rings = PathData::default();
        for &stop in &self.new {
            rings.circle(stop, 2.6);
        }
        map.path(
            &rings,
            format_args!("fill=\"#ffffff\" stroke=\"{BLUE}\" stroke-width=\"1.4\""),
        );
    }

    pub(super) fn draw_marks(&self, map: &mut Document, legend: &mut Legend) {
        draw_cross(self.leg[0].towards(self.leg[1], 0.5), map);
        let mut mark = |mark: Mark, at: Spot, words: &str| {
            if self.view.holds(at, 0.0) {
                draw_mark(mark, at, map);
                legend.add(Sample::Mark(mark), words);
            }
        };
        mark(Mark::Start, self.leg[0], "start of the failed leg");
        if let Some(&destination) = self.old.last() {
            mark(Mark::Destination, destination, "destination");
        }
        if let (Outcome::Diverted, Some(&safe)) = (self.drawn.answer.outcome, self.new.last()) {
            mark(Mark::Alternate, safe, "alternate");
        }
        let [from, to] = self.leg;
        // At the start of the leg the mark of the start says it.
        let is_apart = |drone: &Spot| drone.distance(from) > 1.0 && self.view.holds(*drone, 0.0);
        if let Some(drone) = self.drone.filter(is_apart) {
            draw_mark_towards(
                Mark::Drone,
                drone,
                drone.moved(to.x - from.x, to.y - from.y),
                map,
            );
            legend.add(Sample::Mark(Mark::Drone), "drone when it reported");
        }
    }

    /// Keeps labels off the paths.
    pub(super) fn occupy(&self, labeller: &mut Labeller<'_>) {
        for line in [&self.old[..], &self.new[..], &self.leg[..]] {
            labeller.occupy_line(line);
        }
        for &place in self.drone.iter().chain(&self.new).chain(self.old.last()) {
            labeller.occupy(place, 6.0);
        }
        labeller.occupy(self.leg[0].towards(self.leg[1], 0.5), 8.0);
    }
}

/// The planned path's length in metres, if there is a segment for each of its legs.
fn planned_length_m(topology: &Topology, drawn: &DrawnRecomposition<'_>) -> Option<f64> {
    let legs = drawn.old_path.windows(2);
    let lengths = legs.map(|leg| {
        let segment = topology.segment_between(leg[0], leg[1])?;
        Some(topology.segment(segment).length_m)
    });
    lengths.sum()
}

fn with_length(words: &str, length_m: Option<f64>) -> String {
    match length_m {
        Some(length_m) => format!("{words}, {} m", grouped(length_m)),
        None => words.to_owned(),
    }
}
