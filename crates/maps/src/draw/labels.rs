//! Names on the map, each put where it hides least.

use super::lettering::{shortened, width_of};
use super::style::{INK, LETTER_PX};
use super::svg::{Document, Px, Spot};
use super::view::View;
use super::{Labels, Picture};
use crate::network::{NodeIx, Topology};
use std::collections::BTreeSet;

/// Labels are cut at this width, in pixels.
const LONGEST_PX: f64 = 190.0;
/// More labels than this hide the map: the rest is left out.
const MAX_LABELS: usize = 400;
/// Of more nodes than this every place hides some, so they are not looked at.
const MAX_NODES_KEPT_FREE: usize = 2_000;
/// Along a line, a place is kept free at this distance in pixels.
const LINE_STEP_PX: f64 = 7.0;
/// What a label costs that leaves the map, against one place hidden.
const OFF_MAP_COST: usize = 1_000;
/// What a label costs that hides another, against one place hidden.
const OVERLAP_COST: usize = 50;

/// A box in pixels.
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Rectangle {
    fn about(centre: Spot, half_width: f64, half_height: f64) -> Self {
        Self {
            left: centre.x - half_width,
            top: centre.y - half_height,
            right: centre.x + half_width,
            bottom: centre.y + half_height,
        }
    }

    fn meets(&self, other: &Self) -> bool {
        let beside = self.right < other.left || other.right < self.left;
        let above = self.bottom < other.top || other.bottom < self.top;
        !beside && !above
    }
}

/// A label in its place.
#[derive(Clone, Debug)]
struct Label {
    words: String,
    /// Where the words begin, on their line.
    foot: Spot,
    importance: Importance,
}

/// What a label is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Importance {
    /// Written in any case, and strongly.
    Key,
    /// Written in any case.
    Zone,
    /// Written where there is room.
    Other,
}

/// Finds places for labels, the most important first.
#[derive(Clone, Debug)]
pub(super) struct Labeller<'a> {
    view: &'a View,
    occupied: Vec<Rectangle>,
    taken: Vec<Rectangle>,
    labels: Vec<Label>,
}

impl<'a> Labeller<'a> {
    pub(super) fn new(view: &'a View) -> Self {
        Self {
            view,
            occupied: Vec::new(),
            taken: Vec::new(),
            labels: Vec::new(),
        }
    }

    /// Keeps a place and its surroundings free where that can be.
    pub(super) fn occupy(&mut self, place: Spot, reach_px: f64) {
        if self.view.holds(place, 0.0) {
            self.occupied
                .push(Rectangle::about(place, reach_px, reach_px));
        }
    }

    /// Keeps a line free where that can be.
    pub(super) fn occupy_line(&mut self, line: &[Spot]) {
        for leg in line.windows(2) {
            let steps = (leg[0].distance(leg[1]) / LINE_STEP_PX)
                .ceil()
                .clamp(1.0, 400.0);
            for step in 0..=steps as u32 {
                self.occupy(leg[0].towards(leg[1], f64::from(step) / steps), 1.5);
            }
        }
    }

    /// Says what a drone does where it stops.
    pub(super) fn name_stop(&mut self, place: Spot, words: &str) {
        self.name(place, 9.0, words, Importance::Zone);
    }

    /// Names a place; `clear_px` is how far the words stay from its middle.
    fn name(&mut self, place: Spot, clear_px: f64, words: &str, importance: Importance) {
        if self.labels.len() >= MAX_LABELS || !self.view.holds(place, 0.0) {
            return;
        }
        let words = shortened(words, LETTER_PX, LONGEST_PX);
        let (half_width, half_height) = (width_of(&words, LETTER_PX) / 2.0, LETTER_PX * 0.6);
        let (beside, above) = (half_width + clear_px, half_height + clear_px);
        let offsets = [
            (beside, 0.0),
            (-beside, 0.0),
            (0.0, -above),
            (0.0, above),
            (beside, -above * 0.7),
            (beside, above * 0.7),
            (-beside, -above * 0.7),
            (-beside, above * 0.7),
            (beside, -above * 1.6),
            (beside, above * 1.6),
            (-beside, -above * 1.6),
            (-beside, above * 1.6),
        ];
        let boxes = offsets.map(|(right, down)| {
            Rectangle::about(place.moved(right, down), half_width, half_height)
        });
        // The first of the cheapest, so that ties always fall the same way.
        let Some(best) = boxes
            .into_iter()
            .min_by_key(|candidate| self.cost(candidate))
        else {
            return;
        };
        if importance == Importance::Other && self.cost(&best) >= OVERLAP_COST {
            return;
        }
        self.taken.push(best);
        self.labels.push(Label {
            words,
            foot: Spot::new(best.left, best.bottom - LETTER_PX * 0.3),
            importance,
        });
    }

    fn cost(&self, candidate: &Rectangle) -> usize {
        let corners = [
            Spot::new(candidate.left, candidate.top),
            Spot::new(candidate.right, candidate.bottom),
        ];
        let off_map = corners.iter().any(|&corner| !self.view.holds(corner, 2.0));
        let overlaps = self
            .taken
            .iter()
            .filter(|label| label.meets(candidate))
            .count();
        let hidden = self
            .occupied
            .iter()
            .filter(|place| place.meets(candidate))
            .count();
        hidden + overlaps * OVERLAP_COST + usize::from(off_map) * OFF_MAP_COST
    }

    /// Draws all labels, with a light edge that lifts them off the map.
    pub(super) fn draw(&self, map: &mut Document) {
        if self.labels.is_empty() {
            return;
        }
        map.open(
            "g",
            format_args!(
                "fill=\"{INK}\" stroke=\"#ffffff\" stroke-width=\"3\" stroke-linejoin=\"round\" paint-order=\"stroke\""
            ),
        );
        for label in &self.labels {
            let (x, y) = (Px(label.foot.x), Px(label.foot.y));
            let weight = if label.importance == Importance::Key {
                " font-weight=\"bold\""
            } else {
                ""
            };
            map.words(
                "text",
                format_args!("x=\"{x}\" y=\"{y}\"{weight}"),
                &label.words,
            );
        }
        map.close();
    }
}

/// Keeps labels off the nodes in view, where there are not too many for that.
pub(super) fn occupy_nodes(topology: &Topology, view: &View, labeller: &mut Labeller<'_>) {
    let positions = topology.positions().iter().copied();
    let in_view: Vec<Spot> = positions
        .filter(|&position| view.shows(position))
        .map(|position| view.place(position))
        .collect();
    if in_view.len() <= MAX_NODES_KEPT_FREE {
        for place in in_view {
            labeller.occupy(place, 2.5);
        }
    }
}

/// Names nodes and zones as the options ask.
pub(super) fn name_nodes_and_zones(
    picture: &Picture<'_>,
    view: &View,
    labeller: &mut Labeller<'_>,
) {
    let topology = picture.topology;
    let wanted = picture.options.labels;
    if wanted == Labels::None {
        return;
    }
    let mut named = BTreeSet::new();
    let mut name = |labeller: &mut Labeller<'_>, node: NodeIx, clear_px: f64, importance| {
        if named.insert(node) {
            let place = view.place(topology.position(node));
            labeller.name(place, clear_px, &words_for(topology, node), importance);
        }
    };
    if let Some(drawn) = &picture.recomposition {
        let (from, to) = drawn.failed_leg;
        let ends = drawn
            .old_path
            .last()
            .into_iter()
            .chain(drawn.answer.path.nodes.last());
        name(labeller, from, 9.0, Importance::Key);
        for &end in ends {
            name(labeller, end, 10.0, Importance::Key);
        }
        name(labeller, to, 6.0, Importance::Key);
    }
    if let Some(drawn) = &picture.flight {
        let ends = drawn.nodes.first().into_iter().chain(drawn.nodes.last());
        for &end in ends {
            name(labeller, end, 10.0, Importance::Key);
        }
    }
    for zone in picture.zones {
        let bounds = zone.shape().bounds();
        let words = zone.name().unwrap_or(zone.id());
        // Above or below the zone, or beside its middle.
        let clear_px = view.pixels(bounds.height_m() / 2.0 + zone.margin_m()) + 2.0;
        labeller.name(
            view.place(bounds.centre()),
            clear_px,
            words,
            Importance::Zone,
        );
    }
    if let (Some(drawn), Labels::Paths | Labels::All) = (&picture.recomposition, wanted) {
        for &node in drawn.answer.path.nodes.iter().chain(drawn.old_path) {
            name(labeller, node, 5.0, Importance::Other);
        }
    }
    if wanted == Labels::All {
        for node in topology.nodes() {
            name(labeller, node, 5.0, Importance::Other);
        }
    }
}

/// A node's name and id, or its id alone.
fn words_for(topology: &Topology, node: NodeIx) -> String {
    let id = topology.node_id(node);
    match topology.node_name(node) {
        Some(name) => format!("{name} ({id})"),
        None => id.to_owned(),
    }
}
