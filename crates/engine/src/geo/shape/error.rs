//! What can be wrong with a shape, and where.

use std::fmt;
use thiserror::Error;

/// A place in the coordinates a shape was made of; all counted from 0, as they were given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct VertexPlace {
    /// Which polygon; `None` for the shape as a whole.
    pub polygon: Option<usize>,
    /// Which ring of the polygon, 0 being the outer one; `None` for the polygon as a whole.
    pub ring: Option<usize>,
    /// Which point of the ring; `None` for the ring as a whole.
    pub vertex: Option<usize>,
}

impl VertexPlace {
    /// The shape as a whole.
    pub const SHAPE: Self = Self {
        polygon: None,
        ring: None,
        vertex: None,
    };

    /// A polygon.
    pub const fn polygon(polygon: usize) -> Self {
        Self {
            polygon: Some(polygon),
            ring: None,
            vertex: None,
        }
    }

    /// A ring of a polygon.
    pub const fn ring(polygon: usize, ring: usize) -> Self {
        Self {
            polygon: Some(polygon),
            ring: Some(ring),
            vertex: None,
        }
    }

    /// A point of a ring.
    pub const fn vertex(polygon: usize, ring: usize, vertex: usize) -> Self {
        Self {
            polygon: Some(polygon),
            ring: Some(ring),
            vertex: Some(vertex),
        }
    }
}

impl fmt::Display for VertexPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            ("polygon", self.polygon),
            ("ring", self.ring),
            ("vertex", self.vertex),
        ];
        let stated = parts
            .into_iter()
            .filter_map(|(name, index)| Some((name, index?)));
        for (count, (name, index)) in stated.enumerate() {
            let separator = if count == 0 { "" } else { " " };
            write!(formatter, "{separator}{name} {index}")?;
        }
        match self.polygon {
            Some(_) => Ok(()),
            None => write!(formatter, "shape"),
        }
    }
}

/// Why a shape is refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{place}: {fault}")]
pub struct ShapeError {
    /// Where.
    pub place: VertexPlace,
    /// What.
    pub fault: ShapeFault,
}

impl ShapeError {
    pub(super) fn of_shape(fault: ShapeFault) -> Self {
        let place = VertexPlace::SHAPE;
        Self { place, fault }
    }
}

/// What is wrong with a shape. Vertices are counted from 0; edge `n` runs from vertex `n` to the next.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ShapeFault {
    /// No polygon, or a polygon without a ring.
    #[error("there is nothing in it: a polygon has at least an outer ring")]
    Empty,
    /// More vertices than [`MAX_VERTICES`](super::MAX_VERTICES).
    #[error("{count} vertices are more than the {limit} allowed")]
    TooManyVertices {
        /// How many there are.
        count: usize,
        /// How many are allowed.
        limit: usize,
    },
    /// A coordinate that is infinite or not a number.
    #[error("a coordinate is not a finite number")]
    NotFinite,
    /// A coordinate beyond [`MAX_COORDINATE_M`](super::MAX_COORDINATE_M).
    #[error("a coordinate is more than {limit_m:e} m from the origin")]
    TooFar {
        /// The largest coordinate allowed, in metres.
        limit_m: f64,
    },
    /// Fewer than three distinct points.
    #[error("the ring has {distinct} distinct points; an area needs at least 3")]
    TooFewPoints {
        /// How many there are: 0, 1 or 2.
        distinct: usize,
    },
    /// The last point does not repeat the first.
    #[error("the ring is not closed: its last point must repeat its first")]
    Unclosed,
    /// All points lie on one straight line.
    #[error("the ring has no area: all its points lie on one straight line")]
    ZeroArea,
    /// Two edges of a ring that are not neighbours meet.
    #[error("the ring meets itself: edge {edge} meets edge {other_edge}")]
    SelfIntersection {
        /// The edge that begins at the place of the error.
        edge: usize,
        /// The other edge.
        other_edge: usize,
    },
    /// An edge runs back over the edge before it.
    #[error("the ring folds back on itself at vertex {vertex}, a spike without area")]
    Spike {
        /// The tip of the spike.
        vertex: usize,
    },
    /// Two rings of one polygon meet, if only in a point.
    #[error(
        "ring {ring} meets ring {other_ring}: a hole must lie inside, clear of every other ring"
    )]
    RingsMeet {
        /// The ring at the place of the error.
        ring: usize,
        /// The other ring of the same polygon.
        other_ring: usize,
    },
    /// A hole lies outside the outer ring.
    #[error("hole {ring} lies outside the outer ring")]
    HoleOutside {
        /// The hole.
        ring: usize,
    },
    /// A hole lies in another hole.
    #[error("hole {ring} lies inside hole {other_ring}")]
    HoleInHole {
        /// The inner hole.
        ring: usize,
        /// The hole around it.
        other_ring: usize,
    },
    /// A radius that is not above 0, not a number, or above [`MAX_RADIUS_M`](super::MAX_RADIUS_M).
    #[error("the radius {radius_m} m is not above 0 and at most {limit_m} m")]
    Radius {
        /// The radius given, in metres.
        radius_m: f64,
        /// The largest radius allowed, in metres.
        limit_m: f64,
    },
}
