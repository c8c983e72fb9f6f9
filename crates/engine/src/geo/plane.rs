//! The local plane on which a geographic network is laid, once, when it is loaded.

use super::Point;

/// Semi-major axis of the WGS 84 ellipsoid, in metres (NIMA TR8350.2).
const WGS84_SEMI_MAJOR_M: f64 = 6_378_137.0;
/// First eccentricity squared of the WGS 84 ellipsoid (NIMA TR8350.2).
const WGS84_ECCENTRICITY_SQUARED: f64 = 6.694_379_990_141_316e-3;

/// A plane that touches the WGS 84 ellipsoid at a point: `x = N cos(lat0) dlon`, `y = M dlat`.
///
/// `N` and `M` are the radii of curvature in the prime vertical and in the meridian at the point
/// of contact. The map is linear in longitude and latitude, so straight lines stay straight. Over 10 km in
/// Sydney a distance is off by at most 0.053 %; `docs/network.md` has the figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalPlane {
    origin_lon_deg: f64,
    origin_lat_deg: f64,
    metres_per_radian_east: f64,
    metres_per_radian_north: f64,
}

impl LocalPlane {
    /// The plane about a longitude and latitude, in degrees.
    pub fn about(lon_deg: f64, lat_deg: f64) -> Self {
        let latitude = lat_deg.to_radians();
        let curvature = 1.0 - WGS84_ECCENTRICITY_SQUARED * latitude.sin() * latitude.sin();
        let prime_vertical_m = WGS84_SEMI_MAJOR_M / curvature.sqrt();
        let meridian_m = WGS84_SEMI_MAJOR_M * (1.0 - WGS84_ECCENTRICITY_SQUARED)
            / (curvature * curvature.sqrt());
        Self {
            origin_lon_deg: lon_deg,
            origin_lat_deg: lat_deg,
            metres_per_radian_east: prime_vertical_m * latitude.cos(),
            metres_per_radian_north: meridian_m,
        }
    }

    /// The point of the plane for a longitude and latitude, in degrees.
    pub fn project(&self, lon_deg: f64, lat_deg: f64) -> Point {
        Point::new(
            self.metres_per_radian_east * (lon_deg - self.origin_lon_deg).to_radians(),
            self.metres_per_radian_north * (lat_deg - self.origin_lat_deg).to_radians(),
        )
    }

    /// Longitude and latitude of a point of the plane, in degrees.
    pub fn unproject(&self, point: Point) -> [f64; 2] {
        [
            self.origin_lon_deg + (point.x / self.metres_per_radian_east).to_degrees(),
            self.origin_lat_deg + (point.y / self.metres_per_radian_north).to_degrees(),
        ]
    }
}

/// What the coordinates of a network's file mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frame {
    /// Metres, used as they are; the paper's networks.
    Planar,
    /// WGS 84 longitude and latitude in degrees, projected on the plane given.
    Geographic(LocalPlane),
}

impl Frame {
    /// File coordinates to metres: `[x, y]` of a planar network, `[longitude, latitude]` of a geographic one.
    pub fn to_plane(&self, coordinates: [f64; 2]) -> Point {
        match self {
            Self::Planar => Point::new(coordinates[0], coordinates[1]),
            Self::Geographic(plane) => plane.project(coordinates[0], coordinates[1]),
        }
    }

    /// Metres back to file coordinates; the inverse of [`Frame::to_plane`].
    pub fn from_plane(&self, point: Point) -> [f64; 2] {
        match self {
            Self::Planar => [point.x, point.y],
            Self::Geographic(plane) => plane.unproject(point),
        }
    }

    /// True for longitude and latitude.
    pub fn is_geographic(&self) -> bool {
        matches!(self, Self::Geographic(_))
    }
}
