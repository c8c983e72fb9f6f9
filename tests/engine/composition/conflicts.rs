//! Conflicts: their limits, and any plans against all pairs.

use super::super::oracle::generate::Draw;
use super::super::strategies::cases;
use skyway::compose::{Conflict, Direction, Occupation, conflicts};
use skyway::network::{NodeIx, SegmentIx};

const HEADWAY_S: f64 = 30.0;

fn on_segment(from: u32, enters_s: f64, leaves_s: f64) -> Occupation {
    Occupation {
        segment: SegmentIx(7),
        from: NodeIx(from),
        leg: 0,
        enters_s,
        leaves_s,
    }
}

#[test]
fn opposite_plans_conflict_while_both_are_on_the_segment() {
    let own = [on_segment(1, 100.0, 120.0)];
    let meets = |enters_s, leaves_s| {
        let found = conflicts(&own, &[on_segment(2, enters_s, leaves_s)], HEADWAY_S);
        assert!(
            found
                .iter()
                .all(|conflict| conflict.direction == Direction::Opposite)
        );
        assert!(found.iter().all(|conflict| conflict.gap_s == 0.0));
        !found.is_empty()
    };
    assert!(meets(119.0, 140.0) && meets(80.0, 101.0) && meets(105.0, 106.0));
    assert!(
        !meets(120.0, 140.0) && !meets(80.0, 100.0),
        "one enters as the other leaves"
    );
}

#[test]
fn plans_in_the_same_direction_conflict_within_the_headway() {
    let own = [on_segment(1, 100.0, 120.0)];
    let gap_s = |enters_s| {
        let other = [on_segment(1, enters_s, enters_s + 20.0)];
        let found = conflicts(&own, &other, HEADWAY_S);
        assert!(
            found
                .iter()
                .all(|conflict| conflict.direction == Direction::Same)
        );
        found.first().map(|conflict| conflict.gap_s)
    };
    assert_eq!(gap_s(100.0), Some(0.0));
    assert_eq!(gap_s(70.0), Some(30.0));
    assert_eq!(gap_s(130.0), Some(30.0));
    assert_eq!(gap_s(130.5), None);
    assert_eq!(gap_s(69.5), None);
}

/// A plan of few segments and whole seconds, so that much coincides.
fn draw_plan(draw: &mut Draw) -> Vec<Occupation> {
    let mut time_s = draw.below(200) as f64;
    let legs = draw.below(8);
    let drawn = (0..legs).map(|leg| {
        let enters_s = time_s;
        time_s += 1.0 + draw.below(40) as f64;
        Occupation {
            segment: SegmentIx(draw.below(5) as u32),
            from: NodeIx(draw.below(2) as u32),
            leg,
            enters_s,
            leaves_s: time_s,
        }
    });
    drawn.collect()
}

/// All pairs, by the words of the rule.
fn all_pairs(own: &[Occupation], other: &[Occupation]) -> Vec<Conflict> {
    let mut found = Vec::new();
    for one in own {
        for two in other {
            if one.segment != two.segment {
                continue;
            }
            let conflict = |direction, gap_s| Conflict {
                leg: one.leg,
                other_leg: two.leg,
                segment: one.segment,
                direction,
                gap_s,
            };
            if one.from == two.from {
                let first_s = one.enters_s.min(two.enters_s);
                let second_s = one.enters_s.max(two.enters_s);
                if first_s + HEADWAY_S >= second_s {
                    found.push(conflict(Direction::Same, second_s - first_s));
                }
            } else {
                let both_from_s = one.enters_s.max(two.enters_s);
                let both_until_s = one.leaves_s.min(two.leaves_s);
                if both_until_s > both_from_s {
                    found.push(conflict(Direction::Opposite, 0.0));
                }
            }
        }
    }
    found
}

#[test]
fn conflicts_are_those_of_all_pairs() {
    let (mut opposite, mut same) = (0, 0);
    for seed in 0..2_000 * cases() {
        let mut draw = Draw::new(seed);
        let (own, other) = (draw_plan(&mut draw), draw_plan(&mut draw));
        let found = conflicts(&own, &other, HEADWAY_S);
        assert_eq!(
            found,
            all_pairs(&own, &other),
            "seed {seed}: {own:?} and {other:?}"
        );
        let count = |direction| {
            found
                .iter()
                .filter(|one| one.direction == direction)
                .count()
        };
        opposite += count(Direction::Opposite);
        same += count(Direction::Same);
    }
    assert!(
        opposite > 200 && same > 200,
        "{opposite} opposite, {same} same"
    );
}
