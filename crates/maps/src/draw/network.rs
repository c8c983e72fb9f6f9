//! The layers of the network: buildings, segments, nodes, zones, and what is closed.

use super::legend::{Legend, Sample};
use super::marks::{Mark, draw_rings};
use super::style::{
    BUILDING_EDGE, BUILDING_UNKNOWN, CLOSED_SEGMENT, HEIGHT_CLASSES, SEGMENT, VERMILLION, ZONE,
};
use super::svg::{Document, PathData, Px, Spot};
use super::view::View;
use super::{GroundPlan, Picture};
use crate::airspace::Zone;
use crate::geo::{Bounds, Outline, Point};
use crate::network::NodeIx;
use std::collections::{BTreeMap, BTreeSet};

/// Distance between nodes, in pixels, at which they are drawn at their full size.
const FULL_SIZE_SPACING_PX: f64 = 30.0;
/// The legend shows at most this many sizes of node.
const MAX_SIZES_IN_LEGEND: usize = 4;

/// How large nodes and segments are drawn: the denser they lie, the finer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grain(f64);

impl Grain {
    pub(super) fn of(picture: &Picture<'_>, view: &View) -> Self {
        let positions = picture.topology.positions().iter();
        let in_view = positions.filter(|&&position| view.shows(position)).count();
        let spacing_px = (view.width_px * view.height_px / in_view.max(1) as f64).sqrt();
        Self((spacing_px / FULL_SIZE_SPACING_PX).clamp(0.3, 1.4))
    }

    /// The radius of a node with this many pads, in pixels: the area grows with the pads.
    fn radius_px(self, pads: u16) -> f64 {
        let full_px = match pads {
            0 => 1.2,
            _ => 1.2 + 1.0 * f64::from(pads).sqrt(),
        };
        full_px * self.0
    }

    /// The radius of the dot on a node of a search area, in pixels.
    pub(super) fn dot_px(self) -> f64 {
        (2.8 * self.0).max(1.0)
    }

    fn segment_px(self) -> f64 {
        (0.8 * self.0).clamp(0.25, 0.8)
    }
}

/// Draws the buildings, the tallest last: towers stand on podiums.
pub(super) fn draw_buildings(
    picture: &Picture<'_>,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    let mut unknown = PathData::default();
    let mut by_height = HEIGHT_CLASSES.map(|_| PathData::default());
    let mut seen = HEIGHT_CLASSES.map(|_| false);
    let mut unknown_seen = false;
    for building in picture
        .buildings
        .iter()
        .filter(|plan| is_in_view(plan, view))
    {
        let class = building.height_m.and_then(|height_m| {
            let mut classes = HEIGHT_CLASSES.iter();
            classes.position(|&(upper_m, _)| height_m < upper_m)
        });
        let data = match class {
            Some(class) => {
                seen[class] = true;
                &mut by_height[class]
            }
            None => {
                unknown_seen = true;
                &mut unknown
            }
        };
        add_ground_plan(building, view, data);
    }
    map.path(&unknown, format_args!("{BUILDING_UNKNOWN}"));
    for (data, (_, fill)) in by_height.iter().zip(HEIGHT_CLASSES) {
        map.path(data, format_args!("fill=\"{fill}\" {BUILDING_EDGE}"));
    }
    list_buildings(&seen, unknown_seen, legend);
}

fn list_buildings(seen: &[bool], unknown_seen: bool, legend: &mut Legend) {
    let is_seen = |(class, &seen): (usize, &bool)| seen.then_some(HEIGHT_CLASSES[class]);
    let classes: Vec<(f64, &str)> = seen.iter().enumerate().filter_map(is_seen).collect();
    let samples = classes
        .iter()
        .map(|(_, fill)| format!("fill=\"{fill}\" {BUILDING_EDGE}"));
    let limits = classes
        .iter()
        .map(|&(upper_m, _)| match upper_m.is_finite() {
            true => format!("< {upper_m} m"),
            false => "higher".to_owned(),
        });
    if !classes.is_empty() {
        let limits: Vec<String> = limits.collect();
        let words = format!("building {}", limits.join(", "));
        legend.add(Sample::Squares(samples.collect()), words);
    }
    if unknown_seen {
        let sample = Sample::Squares(vec![BUILDING_UNKNOWN.to_owned()]);
        legend.add(sample, "building of unknown height");
    }
}

fn is_in_view(plan: &GroundPlan, view: &View) -> bool {
    let outer_rings = plan.polygons.iter().filter_map(|rings| rings.first());
    let corners = outer_rings
        .flatten()
        .copied()
        .filter(|corner| corner.is_finite());
    Bounds::around(corners).is_some_and(|around| around.meets(view.bounds))
}

/// Adds polygons with outer rings one way round and holes the other, so that overlaps stay filled.
fn add_ground_plan(plan: &GroundPlan, view: &View, data: &mut PathData) {
    for rings in &plan.polygons {
        for (index, ring) in rings.iter().enumerate() {
            let is_hole = index > 0;
            let open = match ring.split_last() {
                Some((last, before)) if before.first() == Some(last) => before,
                _ => ring,
            };
            let places = open.iter().map(|&corner| view.place(corner));
            match (doubled_area(ring) > 0.0) == is_hole {
                true => data.add(places.rev(), true),
                false => data.add(places, true),
            }
        }
    }
}

/// Twice the area of a ring, above 0 when it runs counter-clockwise.
fn doubled_area(ring: &[Point]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    let corners = ring.iter().zip(next);
    corners
        .map(|(one, other)| one.x * other.y - other.x * one.y)
        .sum()
}

/// Draws all segments as one path.
pub(super) fn draw_segments(
    picture: &Picture<'_>,
    view: &View,
    grain: Grain,
    map: &mut Document,
    legend: &mut Legend,
) {
    let topology = picture.topology;
    let mut data = PathData::default();
    let mut seen = false;
    for segment in topology.segments() {
        let (from, to) = topology.segment_ends(segment);
        if view.shows_line(from, to) {
            data.add([view.place(from), view.place(to)], false);
            seen = true;
        }
    }
    let width = grain.segment_px();
    map.path(&data, format_args!("{SEGMENT} stroke-width=\"{width:.2}\""));
    if seen {
        legend.add(
            Sample::Lines(vec![format!("{SEGMENT} stroke-width=\"1\"")]),
            "skyway segment",
        );
    }
}

/// Draws the closed segments, those of closed nodes included.
pub(super) fn draw_closed_segments(
    picture: &Picture<'_>,
    view: &View,
    grain: Grain,
    map: &mut Document,
    legend: &mut Legend,
) {
    let topology = picture.topology;
    let at_closed_nodes = picture
        .closed
        .nodes
        .iter()
        .flat_map(|&node| topology.arcs(node));
    let closed: BTreeSet<_> = at_closed_nodes
        .map(|arc| arc.segment)
        .chain(picture.closed.segments.iter().copied())
        .filter(|&segment| {
            let (from, to) = topology.segment_ends(segment);
            view.shows_line(from, to)
        })
        .collect();
    let mut data = PathData::default();
    for &segment in &closed {
        let (from, to) = topology.segment_ends(segment);
        data.add([view.place(from), view.place(to)], false);
    }
    let width = grain.segment_px() + 0.1;
    map.path(
        &data,
        format_args!("{CLOSED_SEGMENT} stroke-width=\"{width:.2}\""),
    );
    if !closed.is_empty() {
        let sample = format!("{CLOSED_SEGMENT} stroke-width=\"1\"");
        legend.add(Sample::Lines(vec![sample]), "closed segment");
    }
}

/// Draws the nodes as rings that grow with their pads, and closed ones in another colour.
pub(super) fn draw_nodes(
    picture: &Picture<'_>,
    view: &View,
    grain: Grain,
    map: &mut Document,
    legend: &mut Legend,
) {
    let topology = picture.topology;
    let in_view = |node: &NodeIx| view.shows(topology.position(*node));
    let closed: BTreeSet<NodeIx> = picture
        .closed
        .nodes
        .iter()
        .copied()
        .filter(in_view)
        .collect();
    let mut by_pads: BTreeMap<u16, Vec<Spot>> = BTreeMap::new();
    for node in topology
        .nodes()
        .filter(in_view)
        .filter(|node| !closed.contains(node))
    {
        let place = view.place(topology.position(node));
        by_pads.entry(topology.pads(node)).or_default().push(place);
    }
    for (&pads, places) in &by_pads {
        draw_rings(places, grain.radius_px(pads), map);
    }
    let mut data = PathData::default();
    for &node in &closed {
        let place = view.place(topology.position(node));
        data.circle(place, grain.radius_px(topology.pads(node)).max(1.2));
    }
    map.path(
        &data,
        format_args!("fill=\"#ffffff\" stroke=\"{VERMILLION}\" stroke-width=\"1\""),
    );
    list_nodes(&by_pads, grain, legend);
    if !closed.is_empty() {
        legend.add(Sample::Mark(Mark::ClosedNode), "closed node");
    }
}

fn list_nodes(by_pads: &BTreeMap<u16, Vec<Spot>>, grain: Grain, legend: &mut Legend) {
    let all: Vec<u16> = by_pads.keys().copied().collect();
    let (Some(&least), Some(&most)) = (all.first(), all.last()) else {
        return;
    };
    if most == 0 {
        legend.add(Sample::Rings(vec![grain.radius_px(0)]), "node");
        return;
    }
    let shown: Vec<u16> = match all.len() <= MAX_SIZES_IN_LEGEND {
        true => all,
        false => {
            let middle = all[all.len() / 2];
            vec![least, middle, most]
        }
    };
    let radii = shown.iter().map(|&pads| grain.radius_px(pads)).collect();
    let counts: Vec<String> = shown.iter().map(u16::to_string).collect();
    let noun = if most == 1 && shown.len() == 1 {
        "pad"
    } else {
        "pads"
    };
    legend.add(
        Sample::Rings(radii),
        format!("node with {} recharging {noun}", counts.join(" / ")),
    );
}

/// Draws the zones hatched, with the margin that they are widened by.
pub(super) fn draw_zones(
    picture: &Picture<'_>,
    view: &View,
    map: &mut Document,
    legend: &mut Legend,
) {
    let (mut seen, mut margin_seen) = (false, false);
    for zone in picture.zones {
        let reach = zone.shape().shape().bounds().grown(zone.margin_m());
        if !reach.meets(view.bounds) {
            continue;
        }
        seen = true;
        let data = outline_of(zone, view);
        let margin_px = view.pixels(zone.margin_m());
        if margin_px >= 1.0 {
            margin_seen = true;
            let width = Px(2.0 * margin_px);
            map.path(
                &data,
                format_args!(
                    "fill=\"none\" stroke=\"#cc79a7\" stroke-opacity=\"0.18\" stroke-width=\"{width}\" stroke-linejoin=\"round\""
                ),
            );
        }
        map.path(&data, format_args!("{ZONE}"));
    }
    if seen {
        let words = match margin_seen {
            true => "no-fly zone and its margin",
            false => "no-fly zone",
        };
        legend.add(Sample::Squares(vec![ZONE.to_owned()]), words);
    }
}

/// Outer rings and holes run opposite ways, so a union of polygons is filled as one.
fn outline_of(zone: &Zone, view: &View) -> PathData {
    let mut data = PathData::default();
    match zone.shape().shape().outline() {
        Outline::Circle { centre, radius_m } => {
            data.circle(view.place(*centre), view.pixels(*radius_m));
        }
        Outline::Polygons(polygons) => {
            for ring in polygons.iter().flat_map(|polygon| polygon.rings()) {
                data.add(ring.points().iter().map(|&corner| view.place(corner)), true);
            }
        }
    }
    data
}
