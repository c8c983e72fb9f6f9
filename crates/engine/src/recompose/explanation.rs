//! Stages and their search areas: what `explain` tells.

use crate::geo::Point;
use crate::network::NodeIx;
use serde::{Deserialize, Serialize};

/// Where the search that found the path, or the last one that did not, looked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The radius-based strategy's circle.
    Circle,
    /// The cell density-based strategy's squares.
    Cells,
    /// The two-phased strategy's triangle.
    Triangle,
    /// The two-phased strategy's rhombus.
    Rhombus,
    /// The two-phased strategy's rectangle.
    Rectangle,
    /// The rectangle with nearest neighbours added.
    Grown,
    /// The whole network, for a baseline from one end of the leg to the other.
    Local,
    /// The whole network.
    Global,
}

impl Stage {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Cells => "cells",
            Self::Triangle => "triangle",
            Self::Rhombus => "rhombus",
            Self::Rectangle => "rectangle",
            Self::Grown => "grown",
            Self::Local => "local",
            Self::Global => "global",
        }
    }
}

/// The shape of a search area, in metres of the plane.
#[derive(Clone, Debug, PartialEq)]
pub enum AreaShape {
    /// The whole network.
    Everything,
    /// A circle.
    Circle {
        /// Its centre.
        centre: Point,
        /// Its radius in metres.
        radius_m: f64,
    },
    /// The union of axis-aligned squares.
    Squares {
        /// Centre and half-side in metres of each.
        squares: Vec<(Point, f64)>,
    },
    /// A convex polygon, by its corners.
    Polygon {
        /// The corners, in order.
        corners: Vec<Point>,
    },
    /// A polygon and nodes beyond it.
    Grown {
        /// The polygon's corners, in order.
        corners: Vec<Point>,
        /// The nodes that were added.
        added: Vec<NodeIx>,
    },
}

/// One stage of a local strategy.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRecord {
    /// Which stage.
    pub stage: Stage,
    /// True when it was skipped for having few nodes.
    pub skipped: bool,
    /// The nodes of its area, in node order.
    pub nodes: Vec<NodeIx>,
    /// Its shape.
    pub shape: AreaShape,
    /// True when it was searched.
    pub searched: bool,
    /// True when the search found a path.
    pub path_found: bool,
}
