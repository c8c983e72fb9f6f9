//! Rings and random numbers for the tests of shapes and zones.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use skyway::geo::Point;

/// A number from `low` to `high`.
pub(crate) fn uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A whole number below `limit`.
pub(crate) fn below(random: &mut ChaCha8Rng, limit: u64) -> u64 {
    random.next_u64() % limit
}

/// A ring with these corners.
pub(crate) fn ring(corners: &[(f64, f64)]) -> Vec<Point> {
    corners.iter().map(|&(x, y)| Point::new(x, y)).collect()
}

/// A square with its lower left corner at `x`, `y`, closed.
pub(crate) fn square(x: f64, y: f64, side_m: f64) -> Vec<Point> {
    let (far_x, far_y) = (x + side_m, y + side_m);
    ring(&[(x, y), (far_x, y), (far_x, far_y), (x, far_y), (x, y)])
}

/// A ring around a centre, its corners at rising angles, so that it never meets itself.
pub(crate) fn star(
    random: &mut ChaCha8Rng,
    centre: Point,
    radii_m: (f64, f64),
    corners: usize,
) -> Vec<Point> {
    let step = std::f64::consts::TAU / corners as f64;
    let mut points: Vec<Point> = (0..corners)
        .map(|index| {
            let angle = step * (index as f64 + uniform(random, 0.1, 0.9));
            let radius_m = uniform(random, radii_m.0, radii_m.1);
            Point::new(
                centre.x + radius_m * angle.cos(),
                centre.y + radius_m * angle.sin(),
            )
        })
        .collect();
    points.push(points[0]);
    points
}
