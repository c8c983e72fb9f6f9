//! Shapes: what is refused, and where.

use super::shape_cases::{below, ring, square};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use skyway::geo::{MAX_RADIUS_M, Point, PreparedShape, Shape, ShapeFault, VertexPlace};

/// A regular polygon, closed.
fn regular(corners: usize, radius_m: f64) -> Vec<Point> {
    let corner = |index: usize| {
        let angle = std::f64::consts::TAU * (index % corners) as f64 / corners as f64;
        Point::new(radius_m * angle.cos(), radius_m * angle.sin())
    };
    (0..=corners).map(corner).collect()
}

fn fault_of(rings: &[Vec<Point>]) -> (VertexPlace, ShapeFault) {
    let error = Shape::polygon(rings).expect_err("refused");
    (error.place, error.fault)
}

#[test]
fn a_ring_that_is_no_boundary_is_refused_with_its_place() {
    let whole = VertexPlace::ring(0, 0);
    let at = |vertex| VertexPlace::vertex(0, 0, vertex);
    let cases = [
        (
            vec![(0.0, 0.0)],
            whole,
            ShapeFault::TooFewPoints { distinct: 1 },
        ),
        (vec![], whole, ShapeFault::TooFewPoints { distinct: 0 }),
        (
            vec![(0.0, 0.0), (9.0, 0.0), (0.0, 0.0)],
            whole,
            ShapeFault::TooFewPoints { distinct: 2 },
        ),
        (
            vec![(0.0, 0.0), (9.0, 0.0), (9.0, 9.0)],
            at(2),
            ShapeFault::Unclosed,
        ),
        (
            vec![(0.0, 0.0), (9.0, 0.0), (4.0, 0.0), (0.0, 0.0)],
            whole,
            ShapeFault::ZeroArea,
        ),
        (
            vec![(0.0, 0.0), (9.0, 9.0), (9.0, 0.0), (0.0, 9.0), (0.0, 0.0)],
            at(2),
            ShapeFault::SelfIntersection {
                edge: 2,
                other_edge: 0,
            },
        ),
        (
            vec![
                (0.0, 0.0),
                (9.0, 0.0),
                (9.0, 9.0),
                (9.0, 20.0),
                (9.0, 9.0),
                (0.0, 9.0),
                (0.0, 0.0),
            ],
            at(3),
            ShapeFault::Spike { vertex: 3 },
        ),
        // Two squares joined in a corner that both rings pass.
        (
            vec![
                (0.0, 0.0),
                (5.0, 5.0),
                (9.0, 5.0),
                (9.0, 9.0),
                (5.0, 5.0),
                (0.0, 9.0),
                (0.0, 0.0),
            ],
            at(4),
            ShapeFault::SelfIntersection {
                edge: 4,
                other_edge: 0,
            },
        ),
        (
            vec![(0.0, f64::NAN), (9.0, 0.0), (0.0, 9.0), (0.0, f64::NAN)],
            at(0),
            ShapeFault::NotFinite,
        ),
        (
            vec![(0.0, 0.0), (f64::INFINITY, 0.0), (0.0, 9.0), (0.0, 0.0)],
            at(1),
            ShapeFault::NotFinite,
        ),
        (
            vec![(0.0, 0.0), (9.0, 2e9), (0.0, 9.0), (0.0, 0.0)],
            at(1),
            ShapeFault::TooFar { limit_m: 1e9 },
        ),
    ];
    for (corners, place, fault) in cases {
        assert_eq!(fault_of(&[ring(&corners)]), (place, fault), "{corners:?}");
    }
}

#[test]
fn a_hole_belongs_inside_and_clear_of_every_other_ring() {
    let outer = square(0.0, 0.0, 100.0);
    let meets = |ring, other_ring| ShapeFault::RingsMeet { ring, other_ring };
    let cases = [
        (
            "outside",
            vec![square(200.0, 0.0, 10.0)],
            ShapeFault::HoleOutside { ring: 1 },
        ),
        (
            "around",
            vec![square(-10.0, -10.0, 200.0)],
            ShapeFault::HoleOutside { ring: 1 },
        ),
        ("crossing", vec![square(95.0, 10.0, 10.0)], meets(1, 0)),
        (
            "along the boundary",
            vec![square(0.0, 10.0, 10.0)],
            meets(1, 0),
        ),
        (
            "touching in a point",
            vec![ring(&[
                (50.0, 0.0),
                (60.0, 10.0),
                (40.0, 10.0),
                (50.0, 0.0),
            ])],
            meets(1, 0),
        ),
        ("the outer ring again", vec![outer.clone()], meets(1, 0)),
        (
            "holes that cross",
            vec![square(10.0, 10.0, 10.0), square(15.0, 15.0, 10.0)],
            meets(2, 1),
        ),
        (
            "a hole in a hole",
            vec![square(10.0, 10.0, 30.0), square(20.0, 20.0, 5.0)],
            ShapeFault::HoleInHole {
                ring: 2,
                other_ring: 1,
            },
        ),
        (
            "a hole around a hole",
            vec![square(20.0, 20.0, 5.0), square(10.0, 10.0, 30.0)],
            ShapeFault::HoleInHole {
                ring: 1,
                other_ring: 2,
            },
        ),
    ];
    for (name, holes, fault) in cases {
        let rings: Vec<Vec<Point>> = std::iter::once(outer.clone()).chain(holes).collect();
        assert_eq!(fault_of(&rings).1, fault, "{name}");
    }
}

#[test]
fn the_place_counts_as_the_caller_does() {
    let bowtie = ring(&[
        (0.0, 0.0),
        (0.0, 0.0),
        (9.0, 9.0),
        (9.0, 0.0),
        (0.0, 9.0),
        (0.0, 0.0),
    ]);
    let polygons = [
        vec![square(0.0, 0.0, 5.0)],
        vec![square(-9.0, -9.0, 99.0), bowtie],
    ];
    let error = Shape::multi_polygon(&polygons).expect_err("a bowtie");
    assert_eq!(error.place, VertexPlace::vertex(1, 1, 3));
    assert_eq!(
        error.fault,
        ShapeFault::SelfIntersection {
            edge: 3,
            other_edge: 0
        }
    );
    assert_eq!(
        error.to_string(),
        "polygon 1 ring 1 vertex 3: the ring meets itself: edge 3 meets edge 0"
    );
}

#[test]
fn bounds_on_vertices_and_radius() {
    assert!(Shape::polygon(&[regular(1_000, 50.0)]).is_ok());
    let too_many = ShapeFault::TooManyVertices {
        count: 1_001,
        limit: 1_000,
    };
    assert_eq!(
        fault_of(&[regular(1_001, 50.0)]),
        (VertexPlace::SHAPE, too_many)
    );
    let centre = Point::new(1.0, 2.0);
    for radius_m in [0.0, -1.0, f64::NAN, f64::INFINITY, MAX_RADIUS_M * 1.01] {
        let error = Shape::circle(centre, radius_m).expect_err("refused");
        assert!(
            matches!(error.fault, ShapeFault::Radius { .. }),
            "{radius_m}"
        );
    }
    assert!(Shape::circle(Point::new(f64::NAN, 0.0), 5.0).is_err());
    assert_eq!(fault_of(&[]), (VertexPlace::polygon(0), ShapeFault::Empty));
    let nothing: [Vec<Vec<Point>>; 0] = [];
    let error = Shape::multi_polygon(&nothing).expect_err("empty");
    assert_eq!(error.fault, ShapeFault::Empty);
}

#[test]
fn repeated_points_and_either_orientation_are_the_same_shape() {
    let plain = Shape::polygon(&[square(0.0, 0.0, 9.0)]).expect("valid");
    let stuttering = ring(&[
        (0.0, 0.0),
        (0.0, 0.0),
        (9.0, 0.0),
        (9.0, 5e-7),
        (9.0, 9.0),
        (0.0, 9.0),
        (0.0, 9.0),
        (0.0, 4e-7),
        (0.0, 0.0),
    ]);
    assert_eq!(Shape::polygon(&[stuttering]).expect("valid"), plain);
    let mut clockwise = square(0.0, 0.0, 9.0);
    clockwise.reverse();
    let turned = PreparedShape::new(Shape::polygon(&[clockwise]).expect("valid"));
    assert!(turned.covers_point(Point::new(4.0, 4.0), 0.0));
    assert!(!turned.covers_point(Point::new(-1.0, 4.0), 0.5));
}

/// Crossing and touching of rings on small grids, where whole numbers decide exactly.
#[test]
fn rings_are_refused_exactly_when_whole_numbers_say_so() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let (mut accepted, mut refused) = (0, 0);
    for case in 0..20_000 {
        let count = 3 + below(&mut random, 5) as usize;
        let mut corners: Vec<(i64, i64)> = Vec::new();
        while corners.len() < count {
            let corner = (below(&mut random, 5) as i64, below(&mut random, 5) as i64);
            if corners.last() != Some(&corner)
                && (corners.len() + 1 < count || corners[0] != corner)
            {
                corners.push(corner);
            }
        }
        let closed = corners.iter().chain(&corners[..1]);
        let points: Vec<Point> = closed
            .map(|&(x, y)| Point::new(x as f64, y as f64))
            .collect();
        let outcome = Shape::polygon(&[points]);
        assert_eq!(
            outcome.is_ok(),
            is_simple(&corners),
            "case {case}: {corners:?}: {outcome:?}"
        );
        match outcome {
            Ok(_) => accepted += 1,
            Err(_) => refused += 1,
        }
    }
    assert!(
        accepted > 1_000 && refused > 1_000,
        "{accepted} accepted, {refused} refused"
    );
}

fn is_simple(corners: &[(i64, i64)]) -> bool {
    let turn = |a: (i64, i64), b: (i64, i64), c: (i64, i64)| {
        ((b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)).signum()
    };
    let between = |a: (i64, i64), b: (i64, i64), c: (i64, i64)| {
        turn(a, b, c) == 0
            && (a.0.min(b.0)..=a.0.max(b.0)).contains(&c.0)
            && (a.1.min(b.1)..=a.1.max(b.1)).contains(&c.1)
    };
    let count = corners.len();
    let edge = |index: usize| (corners[index], corners[(index + 1) % count]);
    for first in 0..count {
        for second in first + 1..count {
            let ((a, b), (c, d)) = (edge(first), edge(second));
            let crosses = turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
            let neighbours = second == first + 1 || (first == 0 && second == count - 1);
            let touches = match neighbours {
                // The shared corner apart, neither far end may lie on the other edge.
                true if second == first + 1 => between(a, b, d) || between(c, d, a),
                true => between(a, b, c) || between(c, d, b),
                false => {
                    between(a, b, c) || between(a, b, d) || between(c, d, a) || between(c, d, b)
                }
            };
            if crosses || touches {
                return false;
            }
        }
    }
    true
}
