//! Local strategies that this battery cannot fly go on to the next stage, and finally to `exact`.

use crate::town::{Failure, Town};
use skyway::flight::FailureType;
use skyway::recompose::{Fallback, Outcome, Stage, Strategy};

/// A leg of 4 km whose short way around, by `t`, has no pad, and whose long one, by `p`, has one.
const TWO_WAYS_AROUND: [(&str, f64, f64, u16); 5] = [
    ("a", 0.0, 0.0, 0),
    ("b", 4_000.0, 0.0, 0),
    ("c", 5_000.0, 0.0, 0),
    ("t", 2_000.0, 1_500.0, 0),
    ("p", 2_000.0, -3_500.0, 1),
];
const SEGMENTS: [(&str, &str); 6] = [
    ("a", "b"),
    ("b", "c"),
    ("a", "t"),
    ("t", "b"),
    ("a", "p"),
    ("p", "b"),
];

fn two_ways_around() -> Town {
    Town::new(&TWO_WAYS_AROUND, &SEGMENTS)
}

fn failure(battery: f64, strategy: Strategy) -> Failure<'static> {
    Failure {
        battery,
        strategy,
        ..Failure::of(FailureType::Navigational)
    }
}

#[test]
fn a_local_answer_that_can_be_flown_stands() {
    let town = two_ways_around();
    for strategy in Strategy::ALL {
        let answer = town.answer(&failure(0.9, strategy));
        assert_eq!(answer.outcome, Outcome::Rerouted, "{strategy:?}");
        assert_eq!(answer.strategy_used, strategy);
        assert!(answer.unflyable_stages.is_empty(), "{strategy:?}");
        let nodes = answer.composition.expect("a plan").nodes();
        assert_eq!(town.ids(&nodes), ["a", "t", "b", "c"], "{strategy:?}");
        // Only `exact` knows that nothing is better.
        assert_eq!(answer.proof.proved, strategy == Strategy::Exact);
    }
}

#[test]
fn a_local_answer_that_cannot_be_flown_falls_back_stage_by_stage() {
    let town = two_ways_around();
    let locals = [
        (Strategy::TwoPhased, Stage::Triangle),
        (Strategy::Radius, Stage::Circle),
        (Strategy::CellDensity, Stage::Cells),
    ];
    for (strategy, first) in locals {
        // 6 km by `t` take 0.35 of a battery, the pad at `p` is 4 km away.
        let answer = town.answer(&failure(0.45, strategy));
        assert_eq!(
            answer.outcome,
            Outcome::Rerouted,
            "{strategy:?}: {answer:#?}"
        );
        assert_eq!(
            answer.unflyable_stages.first(),
            Some(&first),
            "{strategy:?}"
        );
        assert_eq!(answer.unflyable_stages.last(), Some(&Stage::Global));
        assert_eq!(answer.strategy, strategy);
        assert_eq!(answer.strategy_used, Strategy::Exact);
        assert_eq!(answer.fallback, Some(Fallback::NotFlyable));
        let composition = answer.composition.expect("a plan");
        assert_eq!(town.ids(&composition.nodes()), ["a", "p", "b", "c"]);
        assert_eq!(composition.plan.stops[0].node, town.node("p"));
        assert!(answer.proof.proved);
    }
}

/// No plan lands before what `lower_bound` says, whichever way is flown.
#[test]
fn the_bound_of_a_local_answer_is_that_of_every_way() {
    let mut nodes = TWO_WAYS_AROUND.to_vec();
    // Past `b` it is shorter, which a strategy that comes back to its leg does not see.
    nodes.push(("x", 2_500.0, -800.0, 0));
    let mut segments = SEGMENTS.to_vec();
    segments.extend([("a", "x"), ("x", "c")]);
    let town = Town::new(&nodes, &segments);
    let best = town.answer(&failure(0.9, Strategy::Exact)).proof.value;
    let local = town.answer(&failure(0.9, Strategy::TwoPhased));
    assert_eq!(local.strategy_used, Strategy::TwoPhased);
    assert!(best.weight < local.proof.value.weight, "{local:#?}");
    for strategy in Strategy::ALL {
        let bound = town.answer(&failure(0.9, strategy)).proof.lower_bound;
        assert!(bound.weight <= best.weight, "{strategy:?}: {bound:?}");
        assert!(bound.arrives_s <= best.arrives_s, "{strategy:?}: {bound:?}");
    }
}
