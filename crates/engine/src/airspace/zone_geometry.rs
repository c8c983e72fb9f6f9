//! A zone's geometry as written: positions as the file has them, and the shape they mean on the plane.

use crate::geo::{Frame, Point, Shape, ShapeError, ShapeFault, VertexPlace};
use thiserror::Error;

/// At most this many errors are collected from one geometry.
const MAX_ERRORS: usize = 20;
/// Two neighbouring longitudes farther apart than this are joined the short way round by most programs.
const HALF_TURN_DEG: f64 = 180.0;

/// A ring as written: positions, the last repeating the first.
pub type WrittenRing = Vec<[f64; 2]>;

/// What a zone covers, in the coordinates of the network's file: `[longitude, latitude]` in degrees,
/// or `[x, y]` in metres where the network is planar. Not checked; [`ZoneGeometry::to_shape`] does that.
#[derive(Clone, Debug, PartialEq)]
pub enum ZoneGeometry {
    /// An outer ring, then holes.
    Polygon(Vec<WrittenRing>),
    /// Several of these; the zone is their union.
    MultiPolygon(Vec<Vec<WrittenRing>>),
    /// All points within a distance of a centre.
    Circle {
        /// The middle.
        centre: [f64; 2],
        /// In metres.
        radius_m: f64,
    },
}

/// What is wrong with a geometry, and where.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{place}: {fault}")]
pub struct GeometryError {
    /// Where; the centre of a circle is the shape as a whole.
    pub place: VertexPlace,
    /// What.
    pub fault: GeometryFault,
}

/// What is wrong with a geometry.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GeometryFault {
    /// A latitude beyond a pole.
    #[error("the latitude {lat_deg} is not between -90 and 90")]
    Latitude {
        /// The second number of the position, in degrees.
        lat_deg: f64,
        /// True when the numbers would make a position if they were swapped.
        swapped: bool,
    },
    /// A longitude more than half a turn from Greenwich.
    #[error("the longitude {lon_deg} is not between -180 and 180")]
    Longitude {
        /// The first number of the position, in degrees.
        lon_deg: f64,
    },
    /// An edge, or a circle, runs across the antimeridian.
    #[error("the zone runs across the antimeridian")]
    Antimeridian,
    /// A circle reaches over a pole.
    #[error("the circle reaches over a pole")]
    Pole,
    /// The shape itself is not valid.
    #[error(transparent)]
    Shape(ShapeFault),
}

impl From<ShapeError> for GeometryError {
    fn from(error: ShapeError) -> Self {
        Self {
            place: error.place,
            fault: GeometryFault::Shape(error.fault),
        }
    }
}

impl ZoneGeometry {
    /// The shape on the plane of the network.
    ///
    /// # Errors
    /// Every position that is not on Earth and every edge across the antimeridian, up to a bound; where
    /// there are none, the first rule of [`Shape`] that is broken.
    pub fn to_shape(&self, frame: &Frame) -> Result<Shape, Vec<GeometryError>> {
        let mut errors = Vec::new();
        if frame.is_geographic() {
            self.check_degrees(&mut errors);
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let to_plane = |ring: &WrittenRing| -> Vec<Point> {
            let positions = ring.iter().copied();
            positions.map(|position| frame.to_plane(position)).collect()
        };
        let shape = match self {
            Self::Polygon(rings) => {
                let rings: Vec<Vec<Point>> = rings.iter().map(to_plane).collect();
                Shape::polygon(&rings)
            }
            Self::MultiPolygon(polygons) => {
                let on_plane = |rings: &Vec<WrittenRing>| rings.iter().map(to_plane).collect();
                let polygons: Vec<Vec<Vec<Point>>> = polygons.iter().map(on_plane).collect();
                Shape::multi_polygon(&polygons)
            }
            Self::Circle { centre, radius_m } => Shape::circle(frame.to_plane(*centre), *radius_m),
        };
        let shape = shape.map_err(|error| vec![error.into()])?;
        match self.circle_fault(frame, &shape) {
            Some(fault) => {
                let place = VertexPlace::SHAPE;
                Err(vec![GeometryError { place, fault }])
            }
            None => Ok(shape),
        }
    }

    fn check_degrees(&self, errors: &mut Vec<GeometryError>) {
        match self {
            Self::Circle { centre, .. } => {
                let fault = position_fault(*centre);
                let place = VertexPlace::SHAPE;
                errors.extend(fault.map(|fault| GeometryError { place, fault }));
            }
            Self::Polygon(rings) => check_rings(0, rings, errors),
            Self::MultiPolygon(polygons) => {
                for (polygon, rings) in polygons.iter().enumerate() {
                    check_rings(polygon, rings, errors);
                }
            }
        }
    }

    /// What a circle reaches over, if it reaches too far.
    fn circle_fault(&self, frame: &Frame, shape: &Shape) -> Option<GeometryFault> {
        if !matches!(self, Self::Circle { .. }) || !frame.is_geographic() {
            return None;
        }
        let bounds = shape.bounds();
        let corners = [bounds.min, bounds.max].map(|corner| frame.from_plane(corner));
        let reaches_over = |axis: usize, limit_deg: f64| {
            corners.iter().any(|corner| corner[axis].abs() > limit_deg)
        };
        if reaches_over(1, 90.0) {
            return Some(GeometryFault::Pole);
        }
        reaches_over(0, HALF_TURN_DEG).then_some(GeometryFault::Antimeridian)
    }
}

fn check_rings(polygon: usize, rings: &[WrittenRing], errors: &mut Vec<GeometryError>) {
    for (ring, positions) in rings.iter().enumerate() {
        let mut lon_before = None;
        for (vertex, &position) in positions.iter().enumerate() {
            let off_earth = position_fault(position);
            let jumps = |before: f64| (position[0] - before).abs() > HALF_TURN_DEG;
            let across = off_earth.is_none() && lon_before.is_some_and(jumps);
            lon_before = off_earth.is_none().then_some(position[0]);
            let fault = off_earth.or(across.then_some(GeometryFault::Antimeridian));
            let place = VertexPlace::vertex(polygon, ring, vertex);
            errors.extend(fault.map(|fault| GeometryError { place, fault }));
            if errors.len() >= MAX_ERRORS {
                return;
            }
        }
    }
}

fn position_fault([lon_deg, lat_deg]: [f64; 2]) -> Option<GeometryFault> {
    if !(lon_deg.is_finite() && lat_deg.is_finite()) {
        return Some(GeometryFault::Shape(ShapeFault::NotFinite));
    }
    if lat_deg.abs() > 90.0 {
        let swapped = lon_deg.abs() <= 90.0 && lat_deg.abs() <= 180.0;
        return Some(GeometryFault::Latitude { lat_deg, swapped });
    }
    (lon_deg.abs() > 180.0).then_some(GeometryFault::Longitude { lon_deg })
}
