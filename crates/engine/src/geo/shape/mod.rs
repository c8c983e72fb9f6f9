//! Shapes on the plane: polygons with holes, several polygons, circles.
//!
//! A [`Shape`] can only be made by a constructor that checks it, so everything that holds one may rely
//! on it: all coordinates are finite, rings are simple, holes lie inside. What is accepted:
//!
//! - A ring is closed: its last point repeats its first. Points that repeat the one before them, to
//!   within [`TOLERANCE_M`](crate::geo::TOLERANCE_M), are dropped; points
//!   on a straight stretch are kept and harmless.
//! - A ring neither meets itself nor folds back on itself, and has an area.
//! - Rings of one polygon do not meet, not even in a point; holes lie inside the outer ring and not
//!   inside one another. Either orientation will do.
//! - Polygons of one shape may overlap or touch: the shape is their union.
//! - There is no limit on area; the cost of a shape is bounded by its [`MAX_VERTICES`].
//!
//! [`PreparedShape`] answers questions about a shape: what it meets, covers and contains.

mod check;
mod error;
mod prepared;
mod reach;

pub use error::{ShapeError, ShapeFault, VertexPlace};
pub use prepared::{BoxRelation, PreparedShape};

use super::{Bounds, Point};
use check::checked_polygon;

/// At most this many vertices in all rings of a shape together, each ring's closing point not counted.
pub const MAX_VERTICES: usize = 1_000;

/// The largest circle, in metres.
///
/// A plane that touches the Earth in the middle of a city distorts a circle of this size, around a
/// point of that city, by up to 3 % (at 60 degrees of latitude); polygons it does not distort, as it is
/// linear in longitude and latitude, so they have no such limit.
pub const MAX_RADIUS_M: f64 = 100_000.0;

/// The largest coordinate of a vertex: beyond it doubles are coarser than the engine's tolerance.
pub const MAX_COORDINATE_M: f64 = 1e9;

/// A closed line without crossings, its closing point not repeated: at least three points.
///
/// Outer rings run counter-clockwise and holes clockwise, so that the area of a polygon is always to the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    points: Vec<Point>,
}

impl Ring {
    /// The corners in order; the last is joined to the first.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The sides, each from one corner to the next.
    pub fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let next = self.points.iter().cycle().skip(1);
        self.points.iter().zip(next).map(|(&from, &to)| (from, to))
    }
}

/// An outer ring with the holes in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    outer: Ring,
    holes: Vec<Ring>,
}

impl Polygon {
    /// The outer boundary.
    pub fn outer(&self) -> &Ring {
        &self.outer
    }

    /// The boundaries of what is left out.
    pub fn holes(&self) -> &[Ring] {
        &self.holes
    }

    /// The outer ring, then the holes.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        std::iter::once(&self.outer).chain(&self.holes)
    }
}

/// What a shape is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// The union of one polygon or several.
    Polygons(Vec<Polygon>),
    /// All points within a distance of a centre.
    Circle {
        /// The middle.
        centre: Point,
        /// Above 0 and at most [`MAX_RADIUS_M`], in metres.
        radius_m: f64,
    },
}

/// An area of the plane, boundary included, that has passed every check of this module.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    outline: Outline,
}

impl Shape {
    /// One polygon: an outer ring, then holes, each closed by repeating its first point.
    ///
    /// # Errors
    /// The first rule of this module that is broken, with the place.
    pub fn polygon(rings: &[Vec<Point>]) -> Result<Self, ShapeError> {
        Self::multi_polygon(std::slice::from_ref(&rings))
    }

    /// Several polygons, each an outer ring, then holes; the shape is their union.
    ///
    /// # Errors
    /// The first rule of this module that is broken, with the place.
    pub fn multi_polygon<P: AsRef<[Vec<Point>]>>(polygons: &[P]) -> Result<Self, ShapeError> {
        if polygons.is_empty() {
            return Err(ShapeError::of_shape(ShapeFault::Empty));
        }
        let rings = polygons.iter().flat_map(|polygon| polygon.as_ref());
        let count = rings.map(|ring| ring.len().saturating_sub(1)).sum();
        if count > MAX_VERTICES {
            let limit = MAX_VERTICES;
            return Err(ShapeError::of_shape(ShapeFault::TooManyVertices {
                count,
                limit,
            }));
        }
        let checked: Result<Vec<Polygon>, ShapeError> = polygons
            .iter()
            .enumerate()
            .map(|(index, rings)| checked_polygon(index, rings.as_ref()))
            .collect();
        Ok(Self {
            outline: Outline::Polygons(checked?),
        })
    }

    /// A circle.
    ///
    /// # Errors
    /// A centre that is not finite or beyond [`MAX_COORDINATE_M`]; a radius that is not above 0, or
    /// above [`MAX_RADIUS_M`].
    pub fn circle(centre: Point, radius_m: f64) -> Result<Self, ShapeError> {
        check::check_coordinates(VertexPlace::SHAPE, centre)?;
        if !(radius_m > 0.0 && radius_m <= MAX_RADIUS_M) {
            let limit_m = MAX_RADIUS_M;
            return Err(ShapeError::of_shape(ShapeFault::Radius {
                radius_m,
                limit_m,
            }));
        }
        Ok(Self {
            outline: Outline::Circle { centre, radius_m },
        })
    }

    /// What the shape is made of.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// The smallest box around the shape.
    pub fn bounds(&self) -> Bounds {
        match &self.outline {
            Outline::Circle { centre, radius_m } => Bounds {
                min: *centre,
                max: *centre,
            }
            .grown(*radius_m),
            Outline::Polygons(polygons) => {
                let corners = polygons.iter().flat_map(|polygon| polygon.outer.points());
                let nowhere = Point::new(0.0, 0.0);
                Bounds::around(corners.copied()).unwrap_or(Bounds {
                    min: nowhere,
                    max: nowhere,
                })
            }
        }
    }
}
