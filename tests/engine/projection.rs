//! How far distances on the local plane are from those on the ellipsoid: the figures of
//! `docs/network.md`.

use geo::{Distance, Geodesic, Point};
use skyway::geo::LocalPlane;

/// The largest error of the distance between any two points of a square about its centre, as a
/// fraction; and in metres.
fn largest_error(lon_deg: f64, lat_deg: f64, side_m: f64) -> (f64, f64) {
    let plane = LocalPlane::about(lon_deg, lat_deg);
    let steps = -4..=4;
    let offset_m = |step: i32| f64::from(step) / 8.0 * side_m;
    let grid: Vec<skyway::geo::Point> = steps
        .clone()
        .flat_map(|x| {
            steps
                .clone()
                .map(move |y| skyway::geo::Point::new(offset_m(x), offset_m(y)))
        })
        .collect();
    let on_earth = |point: skyway::geo::Point| {
        let [lon, lat] = plane.unproject(point);
        Point::new(lon, lat)
    };
    let (mut worst, mut worst_m) = (0.0_f64, 0.0_f64);
    for (index, &from) in grid.iter().enumerate() {
        for &to in &grid[index + 1..] {
            let geodesic_m = Geodesic.distance(on_earth(from), on_earth(to));
            let error_m = (from.distance_m(to) - geodesic_m).abs();
            worst = worst.max(error_m / geodesic_m);
            worst_m = worst_m.max(error_m);
        }
    }
    (worst, worst_m)
}

#[test]
#[expect(clippy::print_stdout, reason = "the figures are what one runs it for")]
fn distances_over_a_city_are_off_by_less_than_the_documented_fraction() {
    let cases = [
        ("Sydney, 2 km", 151.208, -33.865, 2_000.0, 0.000_2),
        ("Sydney, 10 km", 151.208, -33.865, 10_000.0, 0.000_6),
        ("Reykjavik, 10 km", -21.9, 64.15, 10_000.0, 0.002),
        ("the corridor, 80 km", -98.2, 29.65, 80_000.0, 0.004),
    ];
    for (place, lon_deg, lat_deg, side_m, limit) in cases {
        let (worst, worst_m) = largest_error(lon_deg, lat_deg, side_m);
        println!(
            "{place}: {:.4} % at most, {worst_m:.2} m at most",
            100.0 * worst
        );
        assert!(worst < limit, "{place}: {worst}");
    }
}
