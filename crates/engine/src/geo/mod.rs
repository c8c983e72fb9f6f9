//! Points, the local plane, altitudes and shapes.
//!
//! All geometry of the engine is planar, in metres, in double precision. A network in longitude and
//! latitude is projected once, when it is loaded ([`LocalPlane`]); a planar network is used as it is.

mod altitude;
mod plane;
mod point;
mod shape;
mod total;

pub use altitude::{Altitude, AltitudeBand, AltitudeReference};
pub use plane::{Frame, LocalPlane};
pub use point::{Bounds, Point};
pub use shape::{
    BoxRelation, MAX_COORDINATE_M, MAX_RADIUS_M, MAX_VERTICES, Outline, Polygon, PreparedShape,
    Ring, Shape, ShapeError, ShapeFault, VertexPlace,
};

/// The tolerance of every shape: inside means inside or within this distance of the boundary, in metres.
pub const TOLERANCE_M: f64 = 1e-6;
pub use total::total_m;
