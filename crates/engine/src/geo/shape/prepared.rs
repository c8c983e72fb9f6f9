//! A shape made ready for many questions: its edges in an R-tree.
//!
//! Outer rings run counter-clockwise and holes clockwise, so the winding number of all edges together
//! around a point is the number of polygons that cover it: a point is inside when it is above 0,
//! whether or not polygons overlap. It is only asked of points that are out of reach of every edge,
//! where rounding cannot decide it wrongly.

use super::reach::{Edge, Ray};
use super::{Outline, Polygon, Shape};
use crate::geo::{Bounds, Point, TOLERANCE_M};
use rstar::{AABB, RTree};

/// How a box lies to a shape widened by a margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoxRelation {
    /// No point of the box is in the widened shape.
    Outside,
    /// Every point of the box is in the widened shape.
    Inside,
    /// Neither is certain.
    Crosses,
}

/// A shape with an index of its edges.
///
/// Every question takes a margin in metres by which the shape is widened (negative counts as 0), and
/// counts what is within [`TOLERANCE_M`] of the widened shape as belonging to it.
#[derive(Clone, Debug)]
pub struct PreparedShape {
    shape: Shape,
    bounds: Bounds,
    edges: RTree<Edge>,
}

impl PartialEq for PreparedShape {
    fn eq(&self, other: &Self) -> bool {
        self.shape == other.shape
    }
}

fn envelope(bounds: Bounds) -> AABB<[f64; 2]> {
    AABB::from_corners([bounds.min.x, bounds.min.y], [bounds.max.x, bounds.max.y])
}

/// How far from the shape counts as in it.
fn reach_m(margin_m: f64) -> f64 {
    margin_m.max(0.0) + TOLERANCE_M
}

impl PreparedShape {
    /// Indexes the edges of a shape.
    pub fn new(shape: Shape) -> Self {
        let edges: Vec<Edge> = match shape.outline() {
            Outline::Circle { .. } => Vec::new(),
            Outline::Polygons(polygons) => polygons
                .iter()
                .flat_map(Polygon::rings)
                .flat_map(|ring| ring.edges())
                .map(|(from, to)| Edge::new(from, to))
                .collect(),
        };
        Self {
            bounds: shape.bounds(),
            edges: RTree::bulk_load(edges),
            shape,
        }
    }

    /// The shape itself.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The smallest box around the shape, without any margin.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// True when a point lies in the shape widened by `margin_m`.
    ///
    /// Then [`PreparedShape::meets_segment`] is true of every line that begins or ends there.
    pub fn covers_point(&self, point: Point, margin_m: f64) -> bool {
        let reach_m = reach_m(margin_m);
        let around = Bounds {
            min: point,
            max: point,
        };
        if !around.grown(reach_m).meets(self.bounds) {
            return false;
        }
        if let Outline::Circle { centre, radius_m } = *self.shape.outline() {
            return point.distance_m(centre) <= radius_m + reach_m;
        }
        let near = |edge: &Edge| edge.distance_m(point) <= reach_m;
        self.edges_near(around, reach_m).any(near) || self.winding_number(point) > 0
    }

    /// True when the straight line from `from` to `to`, ends included, meets the shape widened by `margin_m`.
    pub fn meets_segment(&self, from: Point, to: Point, margin_m: f64) -> bool {
        let reach_m = reach_m(margin_m);
        let around = box_around(from, to);
        if !around.grown(reach_m).meets(self.bounds) {
            return false;
        }
        let ray = Ray::new(from, to);
        if let Outline::Circle { centre, radius_m } = *self.shape.outline() {
            return ray.part_near_point(centre, radius_m + reach_m).is_some();
        }
        self.edges_near(around, reach_m)
            .any(|edge| ray.part_near_edge(edge, reach_m).is_some())
            || self.winding_number(from) > 0
    }

    /// The parts of the straight line from `from` to `to` that lie in the shape widened by `margin_m`.
    ///
    /// As fractions of the way, `(first, last)` with `0 <= first <= last <= 1`, rising and disjoint.
    /// There are some exactly when [`PreparedShape::meets_segment`] is true.
    pub fn coverage(&self, from: Point, to: Point, margin_m: f64) -> Vec<(f64, f64)> {
        let reach_m = reach_m(margin_m);
        let around = box_around(from, to);
        if !around.grown(reach_m).meets(self.bounds) {
            return Vec::new();
        }
        let ray = Ray::new(from, to);
        if let Outline::Circle { centre, radius_m } = *self.shape.outline() {
            let part = ray.part_near_point(centre, radius_m + reach_m);
            return part.into_iter().collect();
        }
        let mut near_edges: Vec<(f64, f64)> = self
            .edges_near(around, reach_m)
            .filter_map(|edge| ray.part_near_edge(edge, reach_m))
            .collect();
        near_edges.sort_by(|left, right| left.0.total_cmp(&right.0));
        self.with_gaps_inside(from, to, &near_edges)
    }

    /// Joins the parts that are near edges with the gaps between them that lie inside.
    ///
    /// No edge is within reach of a gap, so a gap lies inside or outside as a whole.
    fn with_gaps_inside(
        &self,
        from: Point,
        to: Point,
        near_edges: &[(f64, f64)],
    ) -> Vec<(f64, f64)> {
        let mut parts: Vec<(f64, f64)> = Vec::new();
        let mut add = |first: f64, last: f64| match parts.last_mut() {
            Some(before) if first <= before.1 => before.1 = before.1.max(last),
            _ => parts.push((first, last)),
        };
        let is_inside = |first: f64, last: f64| {
            let middle = from.towards(to, (first + last) / 2.0);
            self.winding_number(middle) > 0
        };
        if near_edges.is_empty() {
            return match self.winding_number(from) > 0 {
                true => vec![(0.0, 1.0)],
                false => Vec::new(),
            };
        }
        let mut reached = 0.0;
        for &(first, last) in near_edges {
            if first > reached && is_inside(reached, first) {
                add(reached, first);
            }
            add(first, last);
            reached = last.max(reached);
        }
        if reached < 1.0 && is_inside(reached, 1.0) {
            add(reached, 1.0);
        }
        parts
    }

    /// How a box lies to the shape widened by `margin_m`: cautious, for deciding many things at once.
    pub fn relation_to_box(&self, bounds: Bounds, margin_m: f64) -> BoxRelation {
        let reach_m = reach_m(margin_m);
        // Twice the tolerance, so that what is certain here is so whichever way exact tests round.
        let certain_m = reach_m + TOLERANCE_M;
        if !bounds.grown(certain_m).meets(self.bounds) {
            return BoxRelation::Outside;
        }
        if let Outline::Circle { centre, radius_m } = *self.shape.outline() {
            return relation_to_disc(
                bounds,
                centre,
                radius_m + margin_m.max(0.0),
                radius_m + certain_m,
            );
        }
        let near = |edge: &Edge| edge.comes_near_box(bounds, certain_m);
        if self.edges_near(bounds, certain_m).any(near) {
            return BoxRelation::Crosses;
        }
        match self.winding_number(bounds.min) > 0 {
            true => BoxRelation::Inside,
            false => BoxRelation::Outside,
        }
    }

    /// The edges whose boxes come within reach of the box given.
    fn edges_near(&self, bounds: Bounds, reach_m: f64) -> impl Iterator<Item = &Edge> {
        let near = envelope(bounds.grown(reach_m));
        self.edges.locate_in_envelope_intersecting(&near)
    }

    /// How many polygons cover a point that is within reach of no edge.
    fn winding_number(&self, point: Point) -> i32 {
        if !self.bounds.contains(point) {
            return 0;
        }
        let eastwards = AABB::from_corners([point.x, point.y], [self.bounds.max.x, point.y]);
        let crossing = |edge: &Edge| {
            let upward = edge.from.y <= point.y && point.y < edge.to.y;
            let downward = edge.to.y <= point.y && point.y < edge.from.y;
            let leftness = edge.leftness(point);
            i32::from(upward && leftness > 0.0) - i32::from(downward && leftness < 0.0)
        };
        let crossed = self.edges.locate_in_envelope_intersecting(&eastwards);
        crossed.map(crossing).sum()
    }
}

fn box_around(from: Point, to: Point) -> Bounds {
    Bounds {
        min: Point::new(from.x.min(to.x), from.y.min(to.y)),
        max: Point::new(from.x.max(to.x), from.y.max(to.y)),
    }
}

/// A box against two discs about one centre: inside the smaller, or outside the larger.
fn relation_to_disc(bounds: Bounds, centre: Point, inner_m: f64, outer_m: f64) -> BoxRelation {
    let nearest = Point::new(
        centre.x.clamp(bounds.min.x, bounds.max.x),
        centre.y.clamp(bounds.min.y, bounds.max.y),
    );
    if centre.distance_m(nearest) > outer_m {
        return BoxRelation::Outside;
    }
    let farther = |low: f64, high: f64, middle: f64| match middle - low > high - middle {
        true => low,
        false => high,
    };
    let farthest = Point::new(
        farther(bounds.min.x, bounds.max.x, centre.x),
        farther(bounds.min.y, bounds.max.y, centre.y),
    );
    match centre.distance_m(farthest) <= inner_m {
        true => BoxRelation::Inside,
        false => BoxRelation::Crosses,
    }
}
