//! The search against brute force: the same value, a plan that can be flown, and proofs that hold.

use crate::events::{Events, Outcome, beats};
use crate::grid::Grid;
use crate::stories::begin;
use crate::world::{Draw, Kind, World, crowded, large_world, world};
use skyway::flight::TimedClosure;
use skyway::itinerary::{FlightAnswer, Limits, Objective, Step, Value};
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology};
use std::ops::Range;
use std::sync::Arc;

/// Worlds of each kind per run; `SKYWAY_CASES` multiplies them.
const WORLDS: u64 = 100;
/// How many times more worlds are crowded, or large, as few of them need what they are for.
const MORE: u64 = 3;
/// Flights that the continuous brute force may try before a case is left out.
const BUDGET: usize = 30_000;

fn seeds() -> Range<u64> {
    let factor = std::env::var("SKYWAY_CASES").ok();
    let factor = factor.and_then(|factor| factor.parse::<u64>().ok());
    0..WORLDS * factor.unwrap_or(1)
}

fn more_seeds() -> Range<u64> {
    let Range { start, end } = seeds();
    start..MORE * end
}

/// A world where about a third of the segments, and in half of the worlds a node, are closed for as long as a request lasts.
fn closed_for_good(seed: u64, mut world: World) -> World {
    let mut draw = Draw::new(seed.wrapping_mul(31));
    let topology = world.topology.clone();
    let nodes = topology.nodes().filter(|_| draw.chance(0.1)).take(1);
    let nodes = nodes.collect();
    let segments = topology.segments().filter(|_| draw.chance(0.3));
    world.situation.closures.push(TimedClosure {
        from_s: f64::NEG_INFINITY,
        until_s: match seed % 2 {
            0 => f64::INFINITY,
            _ => world.deadline_s + 1.0,
        },
        segments: segments.collect(),
        nodes,
        pads: Vec::new(),
        widened: seed.is_multiple_of(3),
    });
    world
}

fn outcome(value: Value) -> Option<Outcome> {
    (value != Value::NONE).then_some((value.weight, value.arrives_s))
}

/// True where the first is better than the second, or the second is none.
fn is_better(one: Option<Outcome>, other: Option<Outcome>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => beats(one, other),
        (Some(_), None) => true,
        (None, _) => false,
    }
}

/// The plan is accepted, has the value that the answer says, and the answer is proved.
#[track_caller]
fn check(world: &World, objective: Objective, answer: &FlightAnswer, case: &str) {
    assert!(answer.proved, "{case}: {answer:?}");
    assert_eq!(answer.plan.is_some(), answer.value != Value::NONE, "{case}");
    let Some(plan) = &answer.plan else {
        return;
    };
    if let Err(fault) = world.check(plan) {
        panic!("{case}: {fault}\n{plan:?}\n{world}");
    }
    let weight = match objective {
        Objective::Distance => plan.distance_m,
        Objective::Energy => plan.energy,
        Objective::Time => 0.0,
    };
    let off = (weight - answer.value.weight).abs();
    assert!(off < 1e-4, "{case}: {weight} {answer:?}");
}

/// Compares the search with brute force in worlds in continuous time.
fn compare_in_continuous_time(seeds: Range<u64>, budget: usize, world_of: impl Fn(u64) -> World) {
    let (mut compared, mut left_out, mut found, mut exact) = (0, 0, 0, 0);
    for seed in seeds {
        let world = world_of(seed);
        for objective in Objective::ALL {
            let case = format!("seed {seed}, {}", objective.name());
            let answer = world.answer(objective, false);
            check(&world, objective, &answer, &case);
            let mut events = Events::new(&world, objective, budget);
            events.search();
            let (ours, theirs) = (outcome(answer.value), events.best);
            assert!(
                !is_better(theirs, ours),
                "{case}: {theirs:?} is better than {ours:?}\n{answer:?}\n{world}"
            );
            if events.budget == 0 {
                left_out += 1;
                continue;
            }
            assert!(
                !is_better(ours, theirs),
                "{case}: {ours:?} is better than {theirs:?}\n{answer:?}\n{world}"
            );
            compared += 1;
            exact += usize::from(answer.step == Step::Exact);
            found += usize::from(ours.is_some());
        }
    }
    eprintln!(
        "continuous: {compared} compared, {found} with a plan, {exact} exactly, {left_out} left out"
    );
    assert!(compared > 2 * left_out && found * 3 > compared);
}

#[test]
fn nothing_in_continuous_time_is_better_and_nothing_worse_is_found() {
    compare_in_continuous_time(seeds(), BUDGET, |seed| world(seed, Kind::Continuous));
}

#[test]
fn nothing_is_better_where_part_of_the_network_is_closed_for_good() {
    compare_in_continuous_time(seeds(), BUDGET, |seed| {
        closed_for_good(seed, world(seed, Kind::Continuous))
    });
}

#[test]
fn nothing_is_better_where_others_crowd_one_segment() {
    compare_in_continuous_time(more_seeds(), BUDGET / 8, |seed| {
        crowded(seed, world(seed, Kind::Continuous))
    });
}

#[test]
fn nothing_on_the_grid_is_better() {
    let (mut found, mut equal) = (0, 0);
    for seed in seeds() {
        let world = world(seed, Kind::Grid);
        for objective in Objective::ALL {
            let case = format!("seed {seed}, {}", objective.name());
            let answer = world.answer(objective, false);
            check(&world, objective, &answer, &case);
            let (ours, theirs) = (outcome(answer.value), Grid::best(&world, objective));
            assert!(
                !is_better(theirs, ours),
                "{case}: {theirs:?} is better than {ours:?}\n{answer:?}\n{world}"
            );
            found += usize::from(theirs.is_some());
            equal += usize::from(theirs.is_some() && !is_better(ours, theirs));
        }
    }
    eprintln!("grid: {found} with a plan on it, {equal} of them with the same value");
    assert!(found > 0 && equal * 3 > found);
}

#[test]
fn with_swaps_alone_the_grid_has_the_best_plan() {
    let mut found = 0;
    for seed in seeds() {
        let world = world(seed, Kind::GridSwaps);
        for objective in Objective::ALL {
            let case = format!("seed {seed}, {}", objective.name());
            let answer = world.answer(objective, false);
            check(&world, objective, &answer, &case);
            let (ours, theirs) = (outcome(answer.value), Grid::best(&world, objective));
            assert!(
                !is_better(theirs, ours) && !is_better(ours, theirs),
                "{case}: {ours:?}, and {theirs:?} on the grid\n{answer:?}\n{world}"
            );
            found += usize::from(theirs.is_some());
        }
    }
    eprintln!("swaps: {found} with a plan");
    assert!(found > 0);
}

/// A crowd in a wind that changes.
fn crowded_in_wind(seed: u64, world: World) -> World {
    let wind = world.wind.clone();
    World {
        wind,
        ..crowded(seed, world)
    }
}

/// What flies the one way has to leave it early, and both are there at the same time: one of them is enough, and one is kept.
#[test]
fn of_two_ways_that_are_alike_the_one_that_stays_open_is_kept() {
    let places = [
        ("s", 0.0, 0.0),
        ("a", 500.0, 300.0),
        ("b", 500.0, -300.0),
        ("d", 1_000.0, 0.0),
    ];
    let node = |(id, x, y): (&str, f64, f64)| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads: 1,
        ..NodeDraft::default()
    };
    let street = |from: &str, to: &str| SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        ..SegmentDraft::default()
    };
    for [first, second] in [["a", "b"], ["b", "a"]] {
        let ways = [("s", first), ("s", second), (first, "d"), (second, "d")];
        let draft = NetworkDraft {
            name: "diamond".to_owned(),
            nodes: places.map(node).to_vec(),
            segments: ways.map(|(from, to)| street(from, to)).to_vec(),
            ..NetworkDraft::default()
        };
        let topology = Arc::new(Topology::build(draft, [0; 32]).expect("a valid network"));
        let at = |id: &str| topology.node(id).expect("a node");
        let mut world = begin(at("s"), 0.0);
        world.destination = at("d");
        world.topology = topology.clone();
        world.starts[0].battery = 1.0;
        for closed in ["a", "b"] {
            let mut world = world.clone();
            world.situation.closures.push(TimedClosure {
                from_s: 1_000.0,
                until_s: f64::INFINITY,
                segments: topology
                    .segment_between(at("s"), at(closed))
                    .into_iter()
                    .collect(),
                nodes: Vec::new(),
                pads: Vec::new(),
                widened: false,
            });
            for objective in Objective::ALL {
                let plain = world.answer(objective, true);
                let case = format!("{first} first, {closed} closes, {}", objective.name());
                assert!(plain.plan.is_some(), "{case}");
                assert_eq!(plain.value, world.answer(objective, false).value, "{case}");
            }
        }
    }
}

#[test]
fn plain_label_setting_gives_the_same_values() {
    for seed in seeds() {
        let worlds = [
            world(seed, Kind::Continuous),
            world(seed, Kind::Grid),
            crowded(seed, world(seed, Kind::Continuous)),
            closed_for_good(seed, world(seed, Kind::Continuous)),
            crowded_in_wind(seed, world(seed, Kind::Continuous)),
        ];
        for (number, world) in worlds.into_iter().enumerate() {
            for objective in Objective::ALL {
                let case = format!("seed {seed}, world {number}, {}", objective.name());
                let steps = world.answer(objective, false);
                let plain = world.answer(objective, true);
                check(&world, objective, &plain, &case);
                let (steps, plain) = (outcome(steps.value), outcome(plain.value));
                assert!(
                    !is_better(steps, plain) && !is_better(plain, steps),
                    "{case}: {steps:?} {plain:?}\n{world}"
                );
            }
        }
    }
}

#[test]
fn on_larger_networks_the_steps_lose_nothing_to_plain_label_setting() {
    let (mut compared, mut left_out) = (0, 0);
    for seed in more_seeds() {
        let kind = [Kind::Continuous, Kind::Grid, Kind::Continuous][seed as usize % 3];
        let world = large_world(seed, kind, 12 + seed as usize % 20);
        let world = match seed % 6 {
            2 => crowded(seed, world),
            3 | 4 => closed_for_good(seed, world),
            5 => closed_for_good(seed, crowded(seed, world)),
            _ => world,
        };
        for objective in Objective::ALL {
            let case = format!("seed {seed}, {kind:?}, {}", objective.name());
            let limits = Limits {
                labels: 20_000,
                ..Limits::THOROUGH
            };
            let steps = world.answer_within(objective, false, limits);
            let plain = world.answer_within(objective, true, limits);
            if !steps.proved || !plain.proved {
                left_out += 1;
                continue;
            }
            check(&world, objective, &steps, &case);
            let (steps, plain) = (outcome(steps.value), outcome(plain.value));
            assert!(
                !is_better(steps, plain) && !is_better(plain, steps),
                "{case}: {steps:?} {plain:?}\n{world}"
            );
            compared += 1;
        }
    }
    eprintln!("larger: {compared} compared, {left_out} not proved by either within the limits");
    assert!(compared > 2 * left_out);
}
