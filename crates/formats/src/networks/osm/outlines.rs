//! Outlines from the nodes of ways: rings put together, what is drawn wrong covered.

use super::collect::{BuildingRelation, Members, Positions};
use crate::error::FormatError;
use geo::{Contains, ConvexHull, Coord, LineString, MultiPoint, Polygon};
use rustc_hash::FxHashMap;
use skyway_maps::buildings::{Outline, OutlineFault};

/// The ground that a building stands on.
pub(super) enum Shape {
    /// What the map has.
    AsDrawn(Outline),
    /// The map is wrong: the convex hull of all corners, in which the building lies, and what is wrong.
    Widened(Outline, String),
    /// All corners lie on a line.
    Nothing,
}

/// Why an outline is not known.
#[derive(Debug)]
pub(super) enum ShapeFault {
    /// The extract was cut through it.
    CutOff(&'static str),
    /// A position is none.
    Position(OutlineFault),
}

impl ShapeFault {
    pub(super) fn error(&self, id: &str) -> FormatError {
        let error = match self {
            Self::CutOff(part) => FormatError::new("", format!("has {part} that the extract lacks"))
                .hint("make the extract with complete ways and multipolygons, or leave its edge out with --bbox"),
            Self::Position(fault) => FormatError::new("", fault.to_string()),
        };
        error.of(format!("building '{id}'"))
    }
}

type Ring = Vec<[f64; 2]>;

/// The outline of a way.
pub(super) fn shape_of_way(nodes: &[i64], positions: &Positions) -> Result<Shape, ShapeFault> {
    shape(vec![placed(nodes, positions)?], Vec::new())
}

/// The outline of a multipolygon.
pub(super) fn shape_of_relation(
    relation: &BuildingRelation,
    members: &Members,
    positions: &Positions,
) -> Result<Shape, ShapeFault> {
    let rings = |ways: &[i64]| -> Result<Vec<Ring>, ShapeFault> {
        let ways = ways.iter().map(|way| members.get(way).map(Vec::as_slice));
        let ways: Option<Vec<&[i64]>> = ways.collect();
        let ways = ways.ok_or(ShapeFault::CutOff("a way"))?;
        let rings = joined(&ways).into_iter();
        rings.map(|ring| placed(&ring, positions)).collect()
    };
    let mut holes = rings(&relation.inner)?;
    // How far one goes that is open is unknown: there is building.
    holes.retain(|hole| hole.first() == hole.last());
    shape(rings(&relation.outer)?, holes)
}

fn placed(nodes: &[i64], positions: &Positions) -> Result<Ring, ShapeFault> {
    let places = nodes.iter().map(|node| positions.get(node).copied());
    let places: Option<Ring> = places.collect();
    places.ok_or(ShapeFault::CutOff("a corner"))
}

/// Ways put together at their ends as long as they fit; what does not close stays open.
fn joined(ways: &[&[i64]]) -> Vec<Vec<i64>> {
    let mut at_end: FxHashMap<i64, Vec<usize>> = FxHashMap::default();
    for (place, way) in ways.iter().enumerate() {
        for end in [way.first(), way.last()].into_iter().flatten() {
            at_end.entry(*end).or_default().push(place);
        }
    }
    let mut is_used = vec![false; ways.len()];
    let mut rings = Vec::new();
    for place in 0..ways.len() {
        if is_used[place] || ways[place].is_empty() {
            continue;
        }
        is_used[place] = true;
        let mut ring = ways[place].to_vec();
        while ring.len() < 2 || ring.first() != ring.last() {
            let end = ring[ring.len() - 1];
            let candidates = at_end.get(&end).into_iter().flatten().copied();
            let Some(next) = candidates.into_iter().find(|next| !is_used[*next]) else {
                break;
            };
            is_used[next] = true;
            let way = ways[next];
            match way[0] == end {
                true => ring.extend(&way[1..]),
                false => ring.extend(way.iter().rev().skip(1)),
            }
        }
        rings.push(ring);
    }
    rings
}

/// The outline of rings; without the holes, or as wide as the corners reach, where the map is wrong.
fn shape(outer: Vec<Ring>, inner: Vec<Ring>) -> Result<Shape, ShapeFault> {
    let whole: Vec<Vec<Ring>> = outer.iter().map(|ring| with_holes(ring, &inner)).collect();
    let fault = match Outline::new(&whole) {
        Ok(outline) => return Ok(Shape::AsDrawn(outline)),
        Err(fault @ OutlineFault::NotOnEarth { .. }) => return Err(ShapeFault::Position(fault)),
        Err(fault) => fault,
    };
    let corners: Vec<[f64; 2]> = outer.into_iter().flatten().collect();
    let hull = MultiPoint::from(corners).convex_hull();
    let hull: Ring = hull
        .exterior()
        .coords()
        .map(|corner| [corner.x, corner.y])
        .collect();
    match Outline::new(&[vec![hull]]) {
        Ok(outline) => Ok(Shape::Widened(outline, fault.to_string())),
        Err(fault @ OutlineFault::NotOnEarth { .. }) => Err(ShapeFault::Position(fault)),
        Err(_) => Ok(Shape::Nothing),
    }
}

/// An outer ring with the holes that have a corner in it.
fn with_holes(outer: &Ring, inner: &[Ring]) -> Vec<Ring> {
    let line = |ring: &Ring| LineString::from_iter(ring.iter().map(|&[x, y]| Coord { x, y }));
    let mut rings = vec![outer.clone()];
    if inner.is_empty() {
        return rings;
    }
    let area = Polygon::new(line(outer), Vec::new());
    let is_in = |ring: &&Ring| line(ring).coords().any(|corner| area.contains(corner));
    rings.extend(inner.iter().filter(is_in).cloned());
    rings
}
