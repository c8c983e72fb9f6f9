//! Properties of the oracle and of the generator on random networks; a failure names the seed.

use std::collections::{BTreeMap, BTreeSet};

use super::super::generate::{self, Draw, KINDS, Kind, SIZES};
use super::*;

const SEEDS: std::ops::Range<u64> = 0..600;

const LOCAL_STRATEGIES: [Strategy; 4] = [
    Strategy::Radius,
    Strategy::CellDensity {
        cell_m: None,
        slices: false,
    },
    Strategy::TwoPhased {
        val_ratio: 0.5,
        stage_skipping: true,
    },
    Strategy::TwoPhased {
        val_ratio: 0.3,
        stage_skipping: false,
    },
];

/// A report on a random leg of the network of a seed, with random closures.
fn random_report(seed: u64, network: &OracleNetwork) -> Report<'_> {
    let mut draw = Draw::new(seed ^ 0x5eed);
    let share = [0.0, 0.1, 0.3][draw.below(3)];
    let closures = generate::closures(&mut draw, network, share, share);
    Report {
        network,
        standing_closed_nodes: closures.nodes,
        standing_closed_segments: closures.segments,
        failed: generate::failed_leg(&mut draw, network),
        destination: draw.below(network.nodes.len()),
    }
}

#[test]
fn generated_networks_are_valid_and_repeatable() {
    let mut kinds_with_ties = BTreeMap::new();
    for seed in SEEDS {
        let (kind, network) = generate::generate(seed);
        assert_eq!(
            (kind, &network),
            (generate::generate(seed).0, &generate::generate(seed).1),
            "seed {seed}"
        );
        let count = network.nodes.len();
        assert!(
            (SIZES.0..=SIZES.1).contains(&count) && !network.segments.is_empty(),
            "seed {seed}"
        );
        let ids: BTreeSet<&str> = network.nodes.iter().map(|node| node.id.as_str()).collect();
        let ranks: BTreeSet<usize> = network.rank.iter().copied().collect();
        assert_eq!((ids.len(), ranks.len()), (count, count), "seed {seed}");
        let mut ends = BTreeSet::new();
        let mut lengths = BTreeSet::new();
        for segment in &network.segments {
            assert!(
                segment.a < segment.b && segment.b < count,
                "seed {seed}: {segment:?}"
            );
            assert!(
                ends.insert((segment.a, segment.b)),
                "seed {seed}: parallel {segment:?}"
            );
            assert!(
                segment.length_m.is_finite() && segment.length_m > 0.0,
                "seed {seed}: {segment:?}"
            );
            lengths.insert(segment.length_m.to_bits());
        }
        *kinds_with_ties.entry(format!("{kind:?}")).or_insert(0) +=
            usize::from(lengths.len() < ends.len());
    }
    assert_eq!(kinds_with_ties.len(), KINDS.len());
    assert!(
        kinds_with_ties[&format!("{:?}", Kind::Grid)] > 50,
        "{kinds_with_ties:?}"
    );
}

/// The shortest simple path by trying all of them.
fn shortest_of_all(world: &World, to: usize, path: &mut Vec<usize>) -> Option<f64> {
    let here = *path.last().expect("a path has a start");
    if here == to {
        return world.path_length_m(path);
    }
    let mut best: Option<f64> = None;
    for next in 0..world.network.nodes.len() {
        if path.contains(&next) || world.network.segments_between(here, next).is_empty() {
            continue;
        }
        path.push(next);
        let length_m = shortest_of_all(world, to, path);
        path.pop();
        best = [best, length_m]
            .into_iter()
            .flatten()
            .min_by(f64::total_cmp);
    }
    best
}

#[test]
fn the_search_agrees_with_trying_every_path() {
    for seed in SEEDS {
        let mut draw = Draw::new(seed);
        let kind = KINDS[draw.below(KINDS.len())];
        let size = 2 + draw.below(6);
        let network = generate::network(&mut draw, kind, size);
        let closures = generate::closures(&mut draw, &network, 0.15, 0.15);
        let world = World {
            network: &network,
            closed_nodes: closures.nodes,
            closed_segments: closures.segments,
        };
        for from in 0..size {
            for to in 0..size {
                let found = shortest(&world, from, to, None);
                let best_m = shortest_of_all(&world, to, &mut vec![from]);
                assert_eq!(
                    found.is_some(),
                    best_m.is_some(),
                    "seed {seed}, {from} -> {to}"
                );
                if let (Some((found_m, path)), Some(best_m)) = (found, best_m) {
                    let walked_m = world.path_length_m(&path);
                    assert!(
                        (found_m - best_m).abs() <= 1e-9 * best_m,
                        "seed {seed}, {from} -> {to}"
                    );
                    assert!(
                        walked_m.is_some_and(|m| (m - found_m).abs() <= 1e-9 * best_m),
                        "seed {seed}"
                    );
                }
            }
        }
    }
}

#[test]
fn local_strategies_find_a_path_where_there_is_one() {
    let mut seen = BTreeSet::new();
    for seed in SEEDS {
        let (_, network) = generate::generate(seed);
        let report = random_report(seed, &network);
        let world = report.world_now();
        let (a, b) = report.failed;
        if network.straight_m(a, b) == 0.0 {
            continue;
        }
        let best = shortest(&world, a, b, None);
        for strategy in LOCAL_STRATEGIES {
            let mut leg = report.clone();
            leg.destination = b;
            let answer = recompose(&leg, Some(vec![a, b]), strategy);
            let place = format!("seed {seed}, {strategy:?}");
            assert_eq!(answer.path.is_some(), best.is_some(), "{place}");
            assert!(answer.area.is_subset(&world.counted_nodes(a, b)), "{place}");
            let local = &answer.repairs[0].answer;
            seen.insert((local.stage, answer.path.is_some()));
            assert_eq!(
                local.searches,
                local.stages.iter().filter(|record| record.searched).count(),
                "{place}"
            );
            let (Some(path), Some((best_m, _))) = (&answer.path, &best) else {
                continue;
            };
            let length_m = world.path_length_m(path).expect("the path is open");
            assert!(length_m >= best_m * (1.0 - 1e-12), "{place}");
            assert!(
                path.iter().all(|node| answer.area.contains(node)),
                "{place}"
            );
            if local.stage == "global" {
                assert!(length_m <= best_m * (1.0 + 1e-12), "{place}");
            }
        }
    }
    let stages = [
        "circle",
        "cells",
        "triangle",
        "rhombus",
        "rectangle",
        "grown",
        "global",
    ];
    for stage in stages {
        assert!(
            seen.contains(&(stage, true)),
            "no path was found in the stage {stage}: {seen:?}"
        );
    }
    assert!(
        seen.contains(&("global", false)) && seen.contains(&("cells", false)),
        "{seen:?}"
    );
}

#[test]
fn recompositions_are_open_and_no_shorter_than_the_optimum() {
    let mut several_repairs = 0;
    let mut fallbacks = BTreeSet::new();
    for seed in SEEDS {
        let (_, network) = generate::generate(seed);
        let report = random_report(seed, &network);
        let world = report.world_now();
        let exact = recompose(&report, None, Strategy::Exact);
        // A plan over the intact network meets closures on later legs too.
        let mut intact = report.clone();
        intact.standing_closed_nodes.clear();
        intact.standing_closed_segments.clear();
        for strategy in LOCAL_STRATEGIES
            .into_iter()
            .chain([Strategy::LocalBaseline, Strategy::GlobalBaseline])
        {
            let answer = recompose(&report, old_plan(&intact), strategy);
            let place = format!("seed {seed}, {strategy:?}");
            assert_eq!(answer.path.is_some(), exact.path.is_some(), "{place}");
            several_repairs += usize::from(
                answer
                    .repairs
                    .iter()
                    .filter(|r| r.answer.path.is_some())
                    .count()
                    > 1,
            );
            fallbacks.insert(format!("{:?}", answer.fallback));
            assert_eq!(answer.global_optimum_m, exact.remaining_length_m, "{place}");
            let Some(path) = answer.path else { continue };
            assert_eq!(
                (path.first(), path.last()),
                (Some(&report.failed.0), Some(&report.destination)),
                "{place}"
            );
            let walked_m = world.path_length_m(&path).expect("the path is open");
            let best_m = exact
                .remaining_length_m
                .expect("the exact path has a length");
            assert!(walked_m >= best_m * (1.0 - 1e-12), "{place}");
        }
    }
    assert!(several_repairs > 20, "{several_repairs}");
    assert!(fallbacks.len() >= 4, "{fallbacks:?}");
}
