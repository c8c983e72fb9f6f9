//! Many seeds, and the same seed twice.

use crate::rounds::{rounds, seed};
use crate::run::{Came, run};
use std::collections::BTreeMap;

/// Seeds by default.
const FEW: usize = 100;
/// Events that a failure tells.
const LAST: usize = 40;

fn check(seed: u64, came: &Came) {
    let last = came.trace.len().saturating_sub(LAST);
    assert!(
        came.violations.is_empty(),
        "seed {seed}: {:#?}\nthe last events:\n{}\nalone: SKYWAY_FAULT_SEED={seed} SKYWAY_FAULT_ROUNDS=1 SKYWAY_FAULT_TRACE=1",
        came.violations,
        came.trace[last..].join("\n")
    );
}

/// One of two halves of the seeds, for two cores.
fn run_half(half: u64) {
    let mut sums: BTreeMap<&str, u64> = BTreeMap::new();
    let (first, count) = (seed(), rounds(FEW) as u64);
    for seed in (first..first + count).filter(|seed| seed % 2 == half) {
        let came = run(seed);
        check(seed, &came);
        for (what, count) in came.counts {
            *sums.entry(what).or_default() += count;
        }
    }
    println!("half of {count} seeds from {first} on: {sums:?}");
}

#[test]
fn every_even_seed_ends_well() {
    run_half(0);
}

#[test]
fn every_odd_seed_ends_well() {
    run_half(1);
}

#[test]
fn the_same_seed_makes_the_same_run() {
    for seed in seed()..seed() + 5 {
        let (once, again) = (run(seed).trace, run(seed).trace);
        let differs = once
            .iter()
            .zip(&again)
            .position(|(one, other)| one != other);
        if let Some(place) = differs {
            let from = place.saturating_sub(5);
            let lines = |trace: &[String]| trace[from..trace.len().min(place + 3)].join("\n");
            panic!(
                "seed {seed}: once\n{}\nand again\n{}",
                lines(&once),
                lines(&again)
            );
        }
        assert_eq!(once.len(), again.len(), "seed {seed}");
    }
}
