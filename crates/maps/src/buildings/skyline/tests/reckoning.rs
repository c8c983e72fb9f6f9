//! All pairs against all buildings on random boxes, by formulas that share nothing with the
//! builder.

use super::*;

/// What an independent reckoning says of a pair.
#[derive(PartialEq)]
enum Verdict {
    Clear,
    Blocked,
    /// Within a hand's breadth of the limit, where the rounding of positions decides.
    TooClose,
}

/// Positions are rounded to a centimetre and laid on planes that differ by less.
const DOUBT_M: f64 = 0.1;

/// The distance from the flight at a moment to a box: its own formula, for boxes alone.
fn distance_m(from: Point, to: Point, moment: f64, block: &Block) -> f64 {
    let at = from.towards(to, moment);
    let beyond = |value: f64, low: f64, high: f64| (low - value).max(value - high).max(0.0);
    let dx = beyond(at.x, block.x, block.x + block.width_m);
    let dy = beyond(at.y, block.y, block.y + block.depth_m);
    dx.hypot(dy)
}

/// The lowest point of the flight within `margin_m` of a box. The distance to a convex thing is
/// convex along a line, so its minimum is found by thirds and the moments at the margin by halves.
fn lowest_m(ends: [(Point, f64); 2], block: &Block, margin_m: f64) -> Option<f64> {
    let [(from, start_m), (to, end_m)] = ends;
    let distance = |moment: f64| distance_m(from, to, moment, block);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..80 {
        let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(left) <= distance(right) {
            high = right
        } else {
            low = left
        }
    }
    let nearest = low;
    if distance(nearest) > margin_m {
        return None;
    }
    let edge = |mut outside: f64| {
        if distance(outside) <= margin_m {
            return outside;
        }
        let mut inside = nearest;
        for _ in 0..50 {
            let middle = (inside + outside) / 2.0;
            if distance(middle) <= margin_m {
                inside = middle
            } else {
                outside = middle
            }
        }
        inside
    };
    let altitude_m = |moment: f64| start_m + (end_m - start_m) * moment;
    Some(altitude_m(edge(0.0)).min(altitude_m(edge(1.0))))
}

fn reckon(blocks: &[Block], from: usize, to: usize, rules: &LineOfSight) -> Verdict {
    let centre =
        |block: &Block| Point::new(block.x + block.width_m / 2.0, block.y + block.depth_m / 2.0);
    let end = |place: usize| {
        (
            centre(&blocks[place]),
            blocks[place].height_m.expect("a roof") + rules.clearance_m,
        )
    };
    let ends = [end(from), end(to)];
    let length_m = ends[0].0.distance_m(ends[1].0);
    if (length_m - rules.reach_m).abs() < DOUBT_M {
        return Verdict::TooClose;
    }
    if length_m > rules.reach_m {
        return Verdict::Blocked;
    }
    let is_in_the_way = |block: &Block, doubt_m: f64| {
        let top_m = block.height_m.unwrap_or(f64::INFINITY) + rules.clearance_m;
        lowest_m(ends, block, rules.clearance_m + doubt_m)
            .is_some_and(|low_m| low_m < top_m + doubt_m)
    };
    let others = || {
        blocks
            .iter()
            .enumerate()
            .filter(|&(place, _)| place != from && place != to)
            .map(|(_, block)| block)
    };
    if others().any(|block| is_in_the_way(block, -DOUBT_M)) {
        return Verdict::Blocked;
    }
    if others().any(|block| is_in_the_way(block, DOUBT_M)) {
        return Verdict::TooClose;
    }
    Verdict::Clear
}

#[test]
fn every_pair_is_decided_as_by_an_independent_reckoning() {
    let rules = LineOfSight {
        min_roof_area_m2: 150.0,
        ..LineOfSight::default()
    };
    let (mut clear, mut blocked, mut doubtful) = (0, 0, 0);
    for seed in 0..20 {
        let mut seeded = Seeded::new(seed);
        let mut blocks = Vec::new();
        for cell in 0..36 {
            let (column, row) = (f64::from(cell % 6), f64::from(cell / 6));
            let x = column * 60.0 + seeded.between(0.0, 20.0);
            let y = row * 60.0 + seeded.between(0.0, 20.0);
            let drawn_m = seeded.between(3.0, 60.0) + seeded.between(0.0, 60.0);
            // Centimetres keep two heights from being the same by all but rounding.
            let height_m = (seeded.unit() < 0.95).then_some((drawn_m * 100.0).round() / 100.0);
            let (width_m, depth_m) = (seeded.between(8.0, 38.0), seeded.between(8.0, 38.0));
            blocks.push(Block {
                x,
                y,
                width_m,
                depth_m,
                height_m,
            });
        }
        let skyline = build(&blocks, &rules).expect("a skyway");
        let joined = pairs(&skyline);
        let qualifies = |block: &Block| {
            let in_range = block
                .height_m
                .is_some_and(|height_m| (10.0..=115.0).contains(&height_m));
            in_range && block.width_m * block.depth_m >= 150.0
        };
        let roofs: Vec<usize> = (0..blocks.len())
            .filter(|&place| qualifies(&blocks[place]))
            .collect();
        for (index, &from) in roofs.iter().enumerate() {
            for &to in &roofs[index + 1..] {
                let is_joined = joined.contains(&(from, to));
                match reckon(&blocks, from, to, &rules) {
                    Verdict::TooClose => doubtful += 1,
                    Verdict::Clear => {
                        clear += 1;
                        assert!(is_joined, "seed {seed}: {from} and {to} see each other");
                    }
                    Verdict::Blocked => {
                        blocked += 1;
                        assert!(
                            !is_joined,
                            "seed {seed}: {from} and {to} do not see each other"
                        );
                    }
                }
            }
        }
    }
    assert!(
        clear > 1000 && blocked > 1000 && doubtful * 20 < clear,
        "{clear} clear, {blocked} blocked, {doubtful} doubtful"
    );
}
