//! The areas of the two-phased strategy as polygons: what the paper calls "with polygons".
//!
//! They are built anew for every request and asked by a general test of points in polygons. A point on
//! the boundary is inside; beyond it there is no tolerance, so that a node within a millionth of a metre of
//! it can be judged otherwise than by the leg's frame.

use super::explanation::Stage;
use super::two_phased::{LegFrame, Place};
use crate::geo::Point;
use geo::{Coord, Intersects, LineString, Polygon};

/// Rectangle, its two halves, and rhombus of one leg.
pub(super) struct LegPolygons {
    rectangle: Polygon<f64>,
    left: Polygon<f64>,
    right: Polygon<f64>,
    rhombus: Polygon<f64>,
}

impl LegPolygons {
    pub(super) fn new(frame: &LegFrame) -> Self {
        let val = frame.half_height_m();
        let half = |side_m: f64| {
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, side_m), (0.0, side_m)];
            polygon_of(&corners.map(|(share, off_m)| frame.point(share, off_m)))
        };
        Self {
            rectangle: polygon_of(&frame.corners(Stage::Rectangle, true)),
            left: half(val),
            right: half(-val),
            rhombus: polygon_of(&frame.corners(Stage::Rhombus, true)),
        }
    }

    /// In which of the shapes a point lies; the triangle is tested once its half is known.
    pub(super) fn place(&self, position: Point) -> Place {
        let rectangle = holds(&self.rectangle, position);
        Place {
            rectangle,
            rhombus: holds(&self.rhombus, position),
            left: rectangle && holds(&self.left, position),
            right: rectangle && holds(&self.right, position),
            triangle: false,
        }
    }
}

/// The polygon of these corners.
pub(super) fn polygon_of(corners: &[Point]) -> Polygon<f64> {
    let ring = corners.iter().map(|corner| Coord {
        x: corner.x,
        y: corner.y,
    });
    Polygon::new(LineString::new(ring.collect()), Vec::new())
}

/// True for a point inside a polygon or on its boundary.
pub(super) fn holds(polygon: &Polygon<f64>, position: Point) -> bool {
    polygon.intersects(&Coord {
        x: position.x,
        y: position.y,
    })
}
