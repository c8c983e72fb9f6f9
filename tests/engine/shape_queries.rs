//! What shapes meet and cover, against plain geometry that shares nothing with the engine's.

use super::shape_cases::{below, square, star, uniform};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use skyway::geo::{Bounds, BoxRelation, Outline, Point, PreparedShape, Shape, TOLERANCE_M};

/// Distances this close to a limit are left to rounding.
const ROUNDING_M: f64 = 1e-7;

/// Plain geometry on the coordinates given.
struct Oracle {
    polygons: Vec<Vec<Vec<Point>>>,
    circle: Option<(Point, f64)>,
}

impl Oracle {
    fn covers(&self, point: Point) -> bool {
        let in_ring = |ring: &Vec<Point>| {
            let edges = ring.windows(2);
            let crossed = edges.filter(|edge| {
                let (a, b) = (edge[0], edge[1]);
                (a.y > point.y) != (b.y > point.y)
                    && point.x < (b.x - a.x) * (point.y - a.y) / (b.y - a.y) + a.x
            });
            crossed.count() % 2 == 1
        };
        let in_polygon =
            |rings: &Vec<Vec<Point>>| in_ring(&rings[0]) && !rings[1..].iter().any(in_ring);
        match self.circle {
            Some((centre, radius_m)) => point.distance_m(centre) <= radius_m,
            None => self.polygons.iter().any(in_polygon),
        }
    }

    /// Distance of a point from the shape, 0 inside.
    fn distance_m(&self, point: Point) -> f64 {
        if self.covers(point) {
            return 0.0;
        }
        if let Some((centre, radius_m)) = self.circle {
            return point.distance_m(centre) - radius_m;
        }
        let rings = self.polygons.iter().flatten();
        let edges = rings.flat_map(|ring| ring.windows(2));
        edges
            .map(|edge| distance_to_line_m(point, edge[0], edge[1]))
            .fold(f64::INFINITY, f64::min)
    }

    /// Distance of a line from the shape, 0 where they meet.
    fn line_distance_m(&self, from: Point, to: Point) -> f64 {
        if self.covers(from) || self.covers(to) {
            return 0.0;
        }
        if let Some((centre, radius_m)) = self.circle {
            return (distance_to_line_m(centre, from, to) - radius_m).max(0.0);
        }
        let rings = self.polygons.iter().flatten();
        let edges = rings.flat_map(|ring| ring.windows(2));
        edges
            .map(|edge| lines_distance_m((from, to), (edge[0], edge[1])))
            .fold(f64::INFINITY, f64::min)
    }
}

fn distance_to_line_m(point: Point, from: Point, to: Point) -> f64 {
    let length_squared = (to.x - from.x).powi(2) + (to.y - from.y).powi(2);
    let along = (point.x - from.x) * (to.x - from.x) + (point.y - from.y) * (to.y - from.y);
    let fraction = match length_squared > 0.0 {
        true => (along / length_squared).clamp(0.0, 1.0),
        false => 0.0,
    };
    point.distance_m(from.towards(to, fraction))
}

fn lines_distance_m(first: (Point, Point), second: (Point, Point)) -> f64 {
    let turn = |a: Point, b: Point, c: Point| (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    let parts = |line: (Point, Point), other: (Point, Point)| {
        turn(line.0, line.1, other.0) * turn(line.0, line.1, other.1) < 0.0
    };
    if parts(first, second) && parts(second, first) {
        return 0.0;
    }
    distance_to_line_m(first.0, second.0, second.1)
        .min(distance_to_line_m(first.1, second.0, second.1))
        .min(distance_to_line_m(second.0, first.0, first.1))
        .min(distance_to_line_m(second.1, first.0, first.1))
}

/// A random shape in a square of 1,000 m with what the oracle needs to know of it.
fn random_shape(random: &mut ChaCha8Rng) -> (PreparedShape, Oracle) {
    let centre = |random: &mut ChaCha8Rng| {
        Point::new(uniform(random, 100.0, 900.0), uniform(random, 100.0, 900.0))
    };
    if below(random, 5) == 0 {
        let (centre, radius_m) = (centre(random), uniform(random, 1.0, 300.0));
        let shape = Shape::circle(centre, radius_m).expect("a circle");
        let circle = Some((centre, radius_m));
        let oracle = Oracle {
            polygons: Vec::new(),
            circle,
        };
        return (PreparedShape::new(shape), oracle);
    }
    let polygons: Vec<Vec<Vec<Point>>> = (0..1 + below(random, 3))
        .map(|_| {
            let middle = centre(random);
            // At least five corners, so that the middle with half the smaller radius lies inside.
            let corners = 5 + below(random, 25) as usize;
            let mut rings = vec![star(random, middle, (80.0, 300.0), corners)];
            if below(random, 2) == 0 {
                let corners = 3 + below(random, 9) as usize;
                rings.push(star(random, middle, (2.0, 20.0), corners));
            }
            for ring in &mut rings {
                if below(random, 2) == 0 {
                    ring.reverse();
                }
            }
            rings
        })
        .collect();
    let shape = Shape::multi_polygon(&polygons).expect("stars with stars in them");
    (
        PreparedShape::new(shape),
        Oracle {
            polygons,
            circle: None,
        },
    )
}

fn random_point(random: &mut ChaCha8Rng) -> Point {
    Point::new(
        uniform(random, -100.0, 1_100.0),
        uniform(random, -100.0, 1_100.0),
    )
}

fn random_margin_m(random: &mut ChaCha8Rng) -> f64 {
    match below(random, 3) {
        0 => 0.0,
        1 => 10.0,
        _ => uniform(random, 0.0, 100.0),
    }
}

#[test]
fn lines_and_points_are_met_as_plain_geometry_says() {
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut met = 0;
    for case in 0..400 {
        let (shape, oracle) = random_shape(&mut random);
        for line in 0..50 {
            let from = random_point(&mut random);
            let to = match below(&mut random, 10) {
                0 => from,
                _ => random_point(&mut random),
            };
            let margin_m = random_margin_m(&mut random);
            let place = format!("seed 12, case {case}, line {line}: {from:?} {to:?} {margin_m}");
            let limit_m = margin_m + TOLERANCE_M;
            let meets = shape.meets_segment(from, to, margin_m);
            let distance_m = oracle.line_distance_m(from, to);
            if (distance_m - limit_m).abs() > ROUNDING_M {
                assert_eq!(meets, distance_m <= limit_m, "{place}: {distance_m} m");
            }
            assert_eq!(
                meets,
                !shape.coverage(from, to, margin_m).is_empty(),
                "{place}"
            );
            assert_eq!(meets, shape.meets_segment(to, from, margin_m), "{place}");
            met += usize::from(meets);
            let covers = shape.covers_point(from, margin_m);
            let distance_m = oracle.distance_m(from);
            if (distance_m - limit_m).abs() > ROUNDING_M {
                assert_eq!(covers, distance_m <= limit_m, "{place}: {distance_m} m");
            }
            assert!(meets || !covers, "{place}: an end that is covered");
        }
    }
    assert!(
        (4_000..16_000).contains(&met),
        "{met} of 20,000 lines meet their shape"
    );
}

#[test]
fn the_parts_of_a_line_are_those_its_points_say() {
    let mut random = ChaCha8Rng::seed_from_u64(13);
    let mut several = 0;
    for case in 0..300 {
        let (shape, oracle) = random_shape(&mut random);
        for line in 0..8 {
            let (from, to) = (random_point(&mut random), random_point(&mut random));
            let margin_m = random_margin_m(&mut random);
            let place = format!("seed 13, case {case}, line {line}: {from:?} {to:?} {margin_m}");
            let parts = shape.coverage(from, to, margin_m);
            several += usize::from(parts.len() > 1);
            for part in &parts {
                assert!(
                    0.0 <= part.0 && part.0 <= part.1 && part.1 <= 1.0,
                    "{place}: {parts:?}"
                );
            }
            assert!(
                parts.windows(2).all(|two| two[0].1 < two[1].0),
                "{place}: {parts:?}"
            );
            for sample in 0..=200 {
                let fraction = f64::from(sample) / 200.0;
                let distance_m = oracle.distance_m(from.towards(to, fraction));
                if (distance_m - margin_m - TOLERANCE_M).abs() <= ROUNDING_M {
                    continue;
                }
                let covered = parts
                    .iter()
                    .any(|part| (part.0..=part.1).contains(&fraction));
                let expected = distance_m <= margin_m + TOLERANCE_M;
                assert_eq!(
                    covered, expected,
                    "{place} at {fraction}: {distance_m} m, {parts:?}"
                );
            }
            for end in parts.iter().flat_map(|part| [part.0, part.1]) {
                let distance_m = oracle.distance_m(from.towards(to, end));
                assert!(
                    distance_m <= margin_m + TOLERANCE_M + ROUNDING_M,
                    "{place}: {end}"
                );
            }
        }
    }
    assert!(several > 100, "{several} lines with more than one part");
}

#[test]
fn what_is_said_of_a_box_holds_for_all_its_points() {
    let mut random = ChaCha8Rng::seed_from_u64(14);
    let mut seen = [0; 3];
    for case in 0..1_000 {
        let (shape, oracle) = random_shape(&mut random);
        for _ in 0..5 {
            let min = random_point(&mut random);
            let longest_m = [5.0, 50.0, 500.0][below(&mut random, 3) as usize];
            let max = Point::new(
                min.x + uniform(&mut random, 0.0, longest_m),
                min.y + uniform(&mut random, 0.0, longest_m),
            );
            let margin_m = random_margin_m(&mut random);
            let relation = shape.relation_to_box(Bounds { min, max }, margin_m);
            seen[relation as usize] += 1;
            for _ in 0..40 {
                let within = |random: &mut ChaCha8Rng| {
                    Point::new(uniform(random, min.x, max.x), uniform(random, min.y, max.y))
                };
                let (from, to) = (within(&mut random), within(&mut random));
                let place = format!("seed 14, case {case}: {min:?} {max:?} {margin_m}: {from:?}");
                let covers = shape.covers_point(from, margin_m);
                let meets = shape.meets_segment(from, to, margin_m);
                match relation {
                    BoxRelation::Inside => assert!(covers && meets, "{place}"),
                    BoxRelation::Outside => {
                        assert!(!covers && !meets, "{place}");
                        assert!(oracle.distance_m(from) > margin_m, "{place}");
                    }
                    BoxRelation::Crosses => {}
                }
            }
        }
    }
    assert!(
        seen.iter().all(|&count| count > 100),
        "outside, inside, crosses: {seen:?}"
    );
}

/// Arbitrary points, most of them no polygon at all: nothing panics, and what is accepted can be asked anything.
#[test]
fn whatever_is_handed_in_nothing_panics() {
    let mut random = ChaCha8Rng::seed_from_u64(15);
    let odd = [
        0.0,
        -0.0,
        1e-300,
        -1e-300,
        1e9,
        -1e9,
        1e300,
        f64::NAN,
        f64::INFINITY,
        1e-7,
        1.0,
    ];
    let mut accepted = 0;
    for case in 0..10_000 {
        let coordinate = |random: &mut ChaCha8Rng| match below(random, 12) {
            0 => odd[below(random, odd.len() as u64) as usize],
            1..4 => below(random, 6) as f64,
            _ => uniform(random, -1e3, 1e3),
        };
        let mut rings = Vec::new();
        for _ in 0..1 + below(&mut random, 2) {
            let count = below(&mut random, 7);
            let mut points: Vec<Point> = (0..count)
                .map(|_| Point::new(coordinate(&mut random), coordinate(&mut random)))
                .collect();
            if below(&mut random, 8) > 0 {
                points.extend(points.first().copied());
            }
            rings.push(points);
        }
        let Ok(shape) = Shape::polygon(&rings) else {
            continue;
        };
        accepted += 1;
        let shape = PreparedShape::new(shape);
        assert!(
            shape.bounds().min.is_finite() && shape.bounds().max.is_finite(),
            "case {case}"
        );
        let oracle = Oracle {
            polygons: vec![rings],
            circle: None,
        };
        let finite = |random: &mut ChaCha8Rng| {
            Point::new(uniform(random, -1e3, 1e3), uniform(random, -1e3, 1e3))
        };
        for _ in 0..4 {
            let (from, to) = (finite(&mut random), finite(&mut random));
            let margin_m = random_margin_m(&mut random);
            let meets = shape.meets_segment(from, to, margin_m);
            assert_eq!(
                meets,
                !shape.coverage(from, to, margin_m).is_empty(),
                "case {case}"
            );
            let distance_m = oracle.line_distance_m(from, to);
            // Coordinates of 1e9 m leave fewer digits.
            if (distance_m - margin_m).abs() > 1e-3 {
                assert_eq!(
                    meets,
                    distance_m <= margin_m,
                    "seed 15, case {case}: {distance_m}"
                );
            }
            let around = Bounds::around([from, to]).expect("two points");
            let relation = shape.relation_to_box(around, margin_m);
            assert!(relation != BoxRelation::Outside || !meets, "case {case}");
            assert!(relation != BoxRelation::Inside || meets, "case {case}");
        }
    }
    assert!(accepted > 300, "{accepted} accepted");
}

#[test]
fn a_line_beside_a_shape_is_met_to_within_the_margin() {
    let shape = PreparedShape::new(Shape::polygon(&[square(0.0, 0.0, 100.0)]).expect("a square"));
    let beside = |gap_m: f64| {
        (
            Point::new(-50.0, 100.0 + gap_m),
            Point::new(150.0, 100.0 + gap_m),
        )
    };
    let (from, to) = beside(9.999_999);
    assert_eq!(shape.coverage(from, to, 10.0).len(), 1);
    let (from, to) = beside(10.000_01);
    assert!(shape.coverage(from, to, 10.0).is_empty());
    let (from, to) = (Point::new(-50.0, 50.0), Point::new(150.0, 50.0));
    let parts = shape.coverage(from, to, 10.0);
    assert!(
        (parts[0].0 - 0.2).abs() < 1e-7 && (parts[0].1 - 0.8).abs() < 1e-7,
        "{parts:?}"
    );
    assert!(matches!(shape.shape().outline(), Outline::Polygons(polygons) if polygons.len() == 1));
}
