//! Positions and lengths as the builders state them, so that a file says what the topology
//! computes.

use crate::geo::{Bounds, LocalPlane, Point};

/// Stated positions have this many decimals of a degree: about a centimetre.
const DECIMALS_OF_A_DEGREE: f64 = 1e7;
/// Stated lengths are whole centimetres.
const CENTIMETRES_PER_METRE: f64 = 100.0;

/// A longitude and latitude rounded to the decimals that a file holds.
pub fn stated_position(degrees: [f64; 2]) -> [f64; 2] {
    degrees.map(|angle| (angle * DECIMALS_OF_A_DEGREE).round() / DECIMALS_OF_A_DEGREE)
}

/// The plane that a topology of these longitudes and latitudes lies in: about the centre of their
/// box.
pub fn plane_about(positions: impl IntoIterator<Item = [f64; 2]>) -> Option<LocalPlane> {
    let corners = positions.into_iter().map(|[lon, lat]| Point::new(lon, lat));
    let centre = Bounds::around(corners)?.centre();
    Some(LocalPlane::about(centre.x, centre.y))
}

/// The length of a straight flight over a plane distance with a climb, in whole centimetres.
///
/// Rounded to the nearest, but up where that fell short of the plane distance: a search whose
/// bound is the straight line must never find a stated length below it.
pub fn stated_length_m(straight_m: f64, climb_m: f64) -> f64 {
    let length_m = (straight_m * straight_m + climb_m * climb_m).sqrt();
    let nearest_m = (length_m * CENTIMETRES_PER_METRE).round() / CENTIMETRES_PER_METRE;
    if nearest_m >= straight_m {
        return nearest_m;
    }
    (straight_m * CENTIMETRES_PER_METRE).ceil() / CENTIMETRES_PER_METRE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stated_length_is_never_below_the_straight_line() {
        assert_eq!(stated_length_m(3.0, 4.0), 5.0);
        assert_eq!(stated_length_m(10.004, 0.0), 10.01);
        assert_eq!(stated_length_m(10.006, 0.0), 10.01);
    }
}
