//! Which roofs become nodes of a skyway, and where on its roof each node sits.
//!
//! Map data draws a podium and the tower on it as two outlines that overlap. Outlines that share
//! more than [`OVERLAP_M2`] of ground belong to one building, and one building is one landing site
//! at most: of its roofs that qualify, the highest; the others are counted as overshadowed. What
//! stands higher than a roof, or may do so because its height is unknown, is cut out of it, and the
//! node sits inside the largest piece that is left.

use super::footprint::{Building, Footprint};
use super::skyline::LineOfSight;
use crate::geo::{Bounds, LocalPlane, Point};
use crate::network::survey::stated_position;
use geo::{Area, BooleanOps, Contains, InteriorPoint, MultiPolygon, Polygon};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};
use std::cmp::Ordering;

/// Outlines that share less ground than this, in square metres, only touch: drawing is not exact.
const OVERLAP_M2: f64 = 1.0;

/// All footprints on the plane, with the tree that finds those nearby.
pub(super) struct Footprints {
    pub(super) plane: LocalPlane,
    by_building: Vec<Footprint>,
    nearby: RTree<GeomWithData<Rectangle<[f64; 2]>, usize>>,
}

impl Footprints {
    /// Lays the outlines of all buildings on the plane, in their order.
    pub(super) fn on(plane: LocalPlane, buildings: &[Building]) -> Self {
        let by_building: Vec<Footprint> = buildings
            .iter()
            .map(|building| Footprint::on(&plane, &building.outline))
            .collect();
        let boxes = by_building.iter().enumerate().map(|(building, footprint)| {
            let Bounds { min, max } = footprint.bounds;
            let corners = Rectangle::from_corners([min.x, min.y], [max.x, max.y]);
            GeomWithData::new(corners, building)
        });
        let nearby = RTree::bulk_load(boxes.collect());
        Self {
            plane,
            by_building,
            nearby,
        }
    }

    pub(super) fn of(&self, building: usize) -> &Footprint {
        &self.by_building[building]
    }

    /// The buildings whose boxes meet the box.
    pub(super) fn meeting(&self, bounds: Bounds) -> impl Iterator<Item = usize> {
        let Bounds { min, max } = bounds;
        let envelope = AABB::from_corners([min.x, min.y], [max.x, max.y]);
        self.nearby
            .locate_in_envelope_intersecting(&envelope)
            .map(|entry| entry.data)
    }

    /// The other outlines that share ground with a building's.
    fn overlapping(&self, building: usize) -> Vec<usize> {
        let footprint = self.of(building);
        let mut found: Vec<usize> = self
            .meeting(footprint.bounds)
            .filter(|&other| other != building)
            .filter(|&other| {
                let shared = footprint.polygons.intersection(&self.of(other).polygons);
                shared.unsigned_area() > OVERLAP_M2
            })
            .collect();
        found.sort_unstable();
        found
    }
}

/// A roof that can be a node.
#[derive(Clone, Debug)]
pub(super) struct Rooftop {
    /// Place of its outline among the buildings.
    pub(super) building: usize,
    /// Longitude and latitude of the node, in degrees, as stated.
    pub(super) position: [f64; 2],
    /// The same on the plane.
    pub(super) point: Point,
    /// Height of the roof above ground, in metres.
    pub(super) height_m: f64,
    /// Area of the piece of roof that the node sits on, in square metres.
    pub(super) area_m2: f64,
    /// Its own outline and those that overlap it at the same height: the roof itself.
    pub(super) level: Vec<usize>,
    /// The outlines that overlap its own and are lower: a podium, an annex.
    pub(super) lower: Vec<usize>,
    /// All outlines that overlap its own.
    overlapping: Vec<usize>,
}

/// The roofs that become nodes, west to east and then south to north.
pub(super) struct Rooftops {
    pub(super) chosen: Vec<Rooftop>,
    /// Roofs that qualify but belong to a building whose higher roof is a node.
    pub(super) overshadowed: usize,
}

/// Chooses the roofs by the rules of the line of sight; see the module.
pub(super) fn choose(
    rules: &LineOfSight,
    buildings: &[Building],
    footprints: &Footprints,
) -> Rooftops {
    let mut qualified: Vec<Rooftop> = (0..buildings.len())
        .filter_map(|building| qualify(rules, buildings, footprints, building))
        .collect();
    qualified.sort_by(|left, right| {
        let by_height = right.height_m.total_cmp(&left.height_m);
        let by_area = || right.area_m2.total_cmp(&left.area_m2);
        let by_id = || {
            buildings[left.building]
                .id
                .cmp(&buildings[right.building].id)
        };
        by_height.then_with(by_area).then_with(by_id)
    });
    let count = qualified.len();
    let mut is_node = vec![false; buildings.len()];
    let mut chosen = Vec::new();
    for roof in qualified {
        if roof.overlapping.iter().any(|&other| is_node[other]) {
            continue;
        }
        is_node[roof.building] = true;
        chosen.push(roof);
    }
    chosen.sort_by(|left, right| west_to_east(left, right, buildings));
    Rooftops {
        overshadowed: count - chosen.len(),
        chosen,
    }
}

fn west_to_east(left: &Rooftop, right: &Rooftop, buildings: &[Building]) -> Ordering {
    let by_longitude = left.position[0].total_cmp(&right.position[0]);
    let by_latitude = || left.position[1].total_cmp(&right.position[1]);
    let by_id = || {
        buildings[left.building]
            .id
            .cmp(&buildings[right.building].id)
    };
    by_longitude.then_with(by_latitude).then_with(by_id)
}

fn qualify(
    rules: &LineOfSight,
    buildings: &[Building],
    footprints: &Footprints,
    building: usize,
) -> Option<Rooftop> {
    let candidate = &buildings[building];
    let height_m = candidate.height_m?;
    let in_extract = rules.extract.is_none() || rules.extract == candidate.extract;
    let in_range = (rules.min_height_m..=rules.max_height_m).contains(&height_m);
    let whole = &footprints.of(building).polygons;
    if !in_extract || !in_range || whole.unsigned_area() < rules.min_roof_area_m2 {
        return None;
    }
    let overlapping = footprints.overlapping(building);
    let (mut level, mut lower, mut free) = (vec![building], Vec::new(), whole.clone());
    for &other in &overlapping {
        match buildings[other].height_m {
            Some(top_m) if top_m == height_m => level.push(other),
            Some(top_m) if top_m < height_m => lower.push(other),
            _ => free = free.difference(&footprints.of(other).polygons),
        }
    }
    let (piece, area_m2) = largest_piece(free)?;
    if area_m2 < rules.min_roof_area_m2 {
        return None;
    }
    let middle = piece.interior_point()?;
    let position = stated_position(
        footprints
            .plane
            .unproject(Point::new(middle.x(), middle.y())),
    );
    let point = footprints.plane.project(position[0], position[1]);
    piece
        .contains(&geo::Point::new(point.x, point.y))
        .then_some(Rooftop {
            building,
            position,
            point,
            height_m,
            area_m2,
            level,
            lower,
            overlapping,
        })
}

fn largest_piece(roof: MultiPolygon<f64>) -> Option<(Polygon<f64>, f64)> {
    roof.into_iter()
        .map(|piece| {
            let area_m2 = piece.unsigned_area();
            (piece, area_m2)
        })
        .max_by(|left, right| left.1.total_cmp(&right.1))
}
