//! The checks a polygon passes before anything else sees it.
//!
//! Crossings are decided by exact predicates (Shewchuk's, through `geo`), on coordinates already known
//! to be finite; what comes closer than the tolerance counts as touching, so that a ring that touches
//! itself in degrees does so in metres, too. Pairs of edges are found by a sweep along x.

use super::error::{ShapeError, ShapeFault, VertexPlace};
use super::reach::{Edge, Ray, distance_to_segment_m};
use super::{MAX_COORDINATE_M, Polygon, Ring};
use crate::geo::{Point, TOLERANCE_M};
use geo::coordinate_position::{CoordPos, coord_pos_relative_to_ring};
use geo::kernels::{Kernel, Orientation, RobustKernel};
use geo::{Coord, Intersects, Line, LineString};
use std::cmp::Ordering;

/// A ring under examination: its corners, and which point of the input each of them was.
struct Candidate {
    points: Vec<Point>,
    given_as: Vec<usize>,
}

/// An edge of a candidate ring, for the sweep.
struct SweepEdge {
    side: Edge,
    ray: Ray,
    /// Extents: smallest and largest x, smallest and largest y.
    x: (f64, f64),
    y: (f64, f64),
    ring: usize,
    edge: usize,
}

/// Refuses a point that is not finite or too far away.
pub(super) fn check_coordinates(place: VertexPlace, point: Point) -> Result<(), ShapeError> {
    if !point.is_finite() {
        let fault = ShapeFault::NotFinite;
        return Err(ShapeError { place, fault });
    }
    if point.x.abs() > MAX_COORDINATE_M || point.y.abs() > MAX_COORDINATE_M {
        let limit_m = MAX_COORDINATE_M;
        let fault = ShapeFault::TooFar { limit_m };
        return Err(ShapeError { place, fault });
    }
    Ok(())
}

/// The polygon of these rings, if it keeps every rule of the module.
pub(super) fn checked_polygon(polygon: usize, rings: &[Vec<Point>]) -> Result<Polygon, ShapeError> {
    if rings.is_empty() {
        let place = VertexPlace::polygon(polygon);
        let fault = ShapeFault::Empty;
        return Err(ShapeError { place, fault });
    }
    let mut candidates = Vec::with_capacity(rings.len());
    for (ring, points) in rings.iter().enumerate() {
        candidates.push(candidate_ring(polygon, ring, points)?);
    }
    check_spikes(polygon, &candidates)?;
    check_crossings(polygon, &candidates)?;
    check_holes(polygon, &candidates)?;
    let mut checked = candidates
        .into_iter()
        .enumerate()
        .map(|(ring, candidate)| oriented(candidate, ring == 0));
    let Some(outer) = checked.next() else {
        let place = VertexPlace::polygon(polygon);
        let fault = ShapeFault::Empty;
        return Err(ShapeError { place, fault });
    };
    let holes = checked.collect();
    Ok(Polygon { outer, holes })
}

fn candidate_ring(polygon: usize, ring: usize, points: &[Point]) -> Result<Candidate, ShapeError> {
    for (vertex, &point) in points.iter().enumerate() {
        check_coordinates(VertexPlace::vertex(polygon, ring, vertex), point)?;
    }
    let place = VertexPlace::ring(polygon, ring);
    let distinct = distinct_up_to_three(points);
    if distinct < 3 {
        let fault = ShapeFault::TooFewPoints { distinct };
        return Err(ShapeError { place, fault });
    }
    if points.first() != points.last() {
        let place = VertexPlace::vertex(polygon, ring, points.len() - 1);
        let fault = ShapeFault::Unclosed;
        return Err(ShapeError { place, fault });
    }
    let candidate = without_repeats(&points[..points.len() - 1]);
    let distinct = candidate.points.len();
    if distinct < 3 {
        let fault = ShapeFault::TooFewPoints { distinct };
        return Err(ShapeError { place, fault });
    }
    if are_on_one_line(&candidate.points) {
        let fault = ShapeFault::ZeroArea;
        return Err(ShapeError { place, fault });
    }
    Ok(candidate)
}

fn coord(point: Point) -> Coord {
    Coord {
        x: point.x,
        y: point.y,
    }
}

/// True when all points lie on one straight line, to within the tolerance.
fn are_on_one_line(points: &[Point]) -> bool {
    let first = points[0];
    let by_distance = |left: &&Point, right: &&Point| {
        first
            .distance_m(**left)
            .total_cmp(&first.distance_m(**right))
    };
    let farthest = points.iter().max_by(by_distance).copied().unwrap_or(first);
    points.iter().all(|&point| {
        let to_line_m = distance_to_segment_m(point, first, farthest);
        to_line_m <= TOLERANCE_M
    })
}

/// How many distinct points there are, counted no further than three.
fn distinct_up_to_three(points: &[Point]) -> usize {
    let mut distinct: Vec<Point> = Vec::with_capacity(3);
    for &point in points {
        if !distinct.contains(&point) {
            distinct.push(point);
        }
        if distinct.len() == 3 {
            break;
        }
    }
    distinct.len()
}

/// The corners of an open chain of points, those dropped that repeat the one before to within the tolerance.
fn without_repeats(points: &[Point]) -> Candidate {
    let mut kept: Vec<(usize, Point)> = Vec::with_capacity(points.len());
    for (vertex, &point) in points.iter().enumerate() {
        let repeats = kept
            .last()
            .is_some_and(|&(_, before)| before.distance_m(point) <= TOLERANCE_M);
        if !repeats {
            kept.push((vertex, point));
        }
    }
    while kept.len() > 1 && kept[kept.len() - 1].1.distance_m(kept[0].1) <= TOLERANCE_M {
        kept.pop();
    }
    Candidate {
        points: kept.iter().map(|&(_, point)| point).collect(),
        given_as: kept.iter().map(|&(vertex, _)| vertex).collect(),
    }
}

/// Refuses an edge that runs back over the edge before it.
fn check_spikes(polygon: usize, rings: &[Candidate]) -> Result<(), ShapeError> {
    for (ring, candidate) in rings.iter().enumerate() {
        let count = candidate.points.len();
        for corner in 0..count {
            let before = candidate.points[(corner + count - 1) % count];
            let tip = candidate.points[corner];
            let after = candidate.points[(corner + 1) % count];
            let width_m = distance_to_segment_m(before, tip, after)
                .min(distance_to_segment_m(after, tip, before));
            if width_m <= TOLERANCE_M {
                let vertex = candidate.given_as[corner];
                let place = VertexPlace::vertex(polygon, ring, vertex);
                let fault = ShapeFault::Spike { vertex };
                return Err(ShapeError { place, fault });
            }
        }
    }
    Ok(())
}

fn sweep_edges(rings: &[Candidate]) -> Vec<SweepEdge> {
    let ordered = |first: f64, second: f64| (first.min(second), first.max(second));
    let mut edges = Vec::new();
    for (ring, candidate) in rings.iter().enumerate() {
        let next = candidate.points.iter().cycle().skip(1);
        for (edge, (&from, &to)) in candidate.points.iter().zip(next).enumerate() {
            edges.push(SweepEdge {
                side: Edge::new(from, to),
                ray: Ray::new(from, to),
                x: ordered(from.x, to.x),
                y: ordered(from.y, to.y),
                ring,
                edge,
            });
        }
    }
    edges.sort_by(|left, right| left.x.0.total_cmp(&right.x.0));
    edges
}

/// Refuses edges that meet, other than neighbours at the corner they share.
fn check_crossings(polygon: usize, rings: &[Candidate]) -> Result<(), ShapeError> {
    let edges = sweep_edges(rings);
    for (place, left) in edges.iter().enumerate() {
        for right in &edges[place + 1..] {
            if right.x.0 > left.x.1 + TOLERANCE_M {
                break;
            }
            let apart = left.y.0 > right.y.1 + TOLERANCE_M || right.y.0 > left.y.1 + TOLERANCE_M;
            if !apart && !are_neighbours(left, right, rings) && meet(left, right) {
                return Err(crossing(polygon, rings, left, right));
            }
        }
    }
    Ok(())
}

/// True when two edges cross, or come within the tolerance of each other.
fn meet(left: &SweepEdge, right: &SweepEdge) -> bool {
    if left.ray.is_beside(&right.side, TOLERANCE_M) {
        return false;
    }
    let line = |edge: &Edge| Line::new(coord(edge.from), coord(edge.to));
    let touches = |point: Point, edge: &Edge| edge.distance_m(point) <= TOLERANCE_M;
    let (left, right) = (&left.side, &right.side);
    line(left).intersects(&line(right))
        || touches(left.from, right)
        || touches(left.to, right)
        || touches(right.from, left)
        || touches(right.to, left)
}

/// Neighbours share a corner and, spikes being excluded, nothing else.
fn are_neighbours(left: &SweepEdge, right: &SweepEdge, rings: &[Candidate]) -> bool {
    let count = rings[left.ring].points.len();
    let follows = |first: usize, second: usize| (first + 1) % count == second;
    left.ring == right.ring && (follows(left.edge, right.edge) || follows(right.edge, left.edge))
}

/// The error for two edges that meet, at the one that comes later in the input.
fn crossing(
    polygon: usize,
    rings: &[Candidate],
    left: &SweepEdge,
    right: &SweepEdge,
) -> ShapeError {
    let (earlier, later) = match (left.ring, left.edge) < (right.ring, right.edge) {
        true => (left, right),
        false => (right, left),
    };
    let given_as = |edge: &SweepEdge| rings[edge.ring].given_as[edge.edge];
    let place = VertexPlace::vertex(polygon, later.ring, given_as(later));
    let fault = match later.ring == earlier.ring {
        true => ShapeFault::SelfIntersection {
            edge: given_as(later),
            other_edge: given_as(earlier),
        },
        false => ShapeFault::RingsMeet {
            ring: later.ring,
            other_ring: earlier.ring,
        },
    };
    ShapeError { place, fault }
}

/// Refuses holes outside the outer ring or inside one another; no two rings meet, so one point decides.
fn check_holes(polygon: usize, rings: &[Candidate]) -> Result<(), ShapeError> {
    if rings.len() < 2 {
        return Ok(());
    }
    let closed = |candidate: &Candidate| {
        let mut line = LineString::new(candidate.points.iter().copied().map(coord).collect());
        line.close();
        line
    };
    let lines: Vec<LineString> = rings.iter().map(closed).collect();
    let is_inside = |inner: usize, around: usize| {
        let corner = coord(rings[inner].points[0]);
        coord_pos_relative_to_ring(corner, &lines[around]) == CoordPos::Inside
    };
    for ring in 1..rings.len() {
        let place = VertexPlace::ring(polygon, ring);
        if !is_inside(ring, 0) {
            let fault = ShapeFault::HoleOutside { ring };
            return Err(ShapeError { place, fault });
        }
        let mut others = (1..rings.len()).filter(|&other| other != ring);
        if let Some(other_ring) = others.find(|&other| is_inside(ring, other)) {
            let fault = ShapeFault::HoleInHole { ring, other_ring };
            return Err(ShapeError { place, fault });
        }
    }
    Ok(())
}

/// The ring, turned the way its polygon's area is to the left.
fn oriented(candidate: Candidate, is_outer: bool) -> Ring {
    let mut points = candidate.points;
    if is_counter_clockwise(&points) != is_outer {
        points.reverse();
    }
    Ring { points }
}

/// The way a simple ring turns, told by the turn at its lowest corner (of those, the rightmost), exactly.
fn is_counter_clockwise(points: &[Point]) -> bool {
    let count = points.len();
    let rank = |corner: usize| (points[corner].y, -points[corner].x);
    let below = |left: &usize, right: &usize| {
        let order = rank(*left).partial_cmp(&rank(*right));
        order.unwrap_or(Ordering::Equal)
    };
    let lowest = (0..count).min_by(below).unwrap_or(0);
    let before = coord(points[(lowest + count - 1) % count]);
    let after = coord(points[(lowest + 1) % count]);
    RobustKernel::orient2d(before, coord(points[lowest]), after) == Orientation::CounterClockwise
}
