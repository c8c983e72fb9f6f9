//! The passage of a flight along a footprint against distances measured point by point.

use super::*;
use crate::network::Seeded;

fn plane() -> LocalPlane {
    LocalPlane::about(151.2, -33.86)
}

/// The distance from a point to a footprint, 0 inside: by winding number and nearest point of each
/// side.
fn distance_m(footprint: &Footprint, point: Point) -> f64 {
    let mut angle = 0.0;
    let mut nearest_m = f64::INFINITY;
    for &(start, end) in &footprint.sides {
        let (ax, ay, bx, by) = (
            start.x - point.x,
            start.y - point.y,
            end.x - point.x,
            end.y - point.y,
        );
        angle += (ax * by - ay * bx).atan2(ax * bx + ay * by);
        let (dx, dy) = (end.x - start.x, end.y - start.y);
        let along = (-(ax * dx + ay * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        nearest_m = nearest_m.min(point.distance_m(start.towards(end, along)));
    }
    if angle.abs() > 3.0 { 0.0 } else { nearest_m }
}

/// A star with a courtyard; the courtyard runs the other way round, so that its winding cancels
/// out.
fn star(seeded: &mut Seeded) -> Outline {
    let corners = 5 + usize::from(seeded.below(12));
    let ring = |seeded: &mut Seeded, near_m: f64, far_m: f64, turn: f64| {
        let mut corners: Vec<[f64; 2]> = (0..corners)
            .map(|corner| {
                let angle = turn * std::f64::consts::TAU * corner as f64 / corners as f64;
                let radius_m = seeded.between(near_m, far_m);
                plane().unproject(Point::new(radius_m * angle.cos(), radius_m * angle.sin()))
            })
            .collect();
        corners.push(corners[0]);
        corners
    };
    let outer = ring(seeded, 20.0, 60.0, 1.0);
    let courtyard = ring(seeded, 3.0, 12.0, -1.0);
    Outline::new(&[vec![outer, courtyard]]).expect("a star is valid")
}

#[test]
fn the_passage_begins_and_ends_where_the_distance_is_the_margin() {
    let (mut met, mut missed) = (0, 0);
    for seed in 0..400 {
        let mut seeded = Seeded::new(seed);
        let footprint = Footprint::on(&plane(), &star(&mut seeded));
        let margin_m = [1e-6, 5.0][usize::from(seeded.below(2))];
        let mut point = || Point::new(seeded.between(-120.0, 120.0), seeded.between(-120.0, 120.0));
        let (from, to) = (point(), point());
        let distance = |moment: f64| distance_m(&footprint, from.towards(to, moment));
        let passage = footprint.passage(from, to, margin_m);
        for step in 0..=2000 {
            let moment = f64::from(step) / 2000.0;
            let is_near =
                passage.is_some_and(|Passage { first, last }| first <= moment && moment <= last);
            assert!(
                is_near || distance(moment) > margin_m - 1e-9,
                "seed {seed}: near at {moment}"
            );
        }
        let Some(Passage { first, last }) = passage else {
            missed += 1;
            continue;
        };
        met += 1;
        for (moment, end) in [(first, 0.0), (last, 1.0)] {
            let distance_m = distance(moment);
            let is_at_margin = (distance_m - margin_m).abs() < 1e-6;
            assert!(
                is_at_margin || moment == end && distance_m <= margin_m,
                "seed {seed}: {distance_m} m away at {moment}"
            );
        }
    }
    assert!(met > 50 && missed > 50, "{met} met, {missed} missed");
}
