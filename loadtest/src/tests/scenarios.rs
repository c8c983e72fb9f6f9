//! Scenario files: those that are shipped, and those that are refused.

use crate::measures::Tally;
use crate::objective::Measure;
use crate::report::{Figures, Judgement, PhaseReport, RunReport, Summary};
use crate::scenario::{Scenario, Unusable};
use std::collections::BTreeMap;
use std::path::Path;

const SMALL: &str = r#"
title = "Small"
seed = 1
repetitions = 3

[[mix]]
operation = "recompose"
weight = 1

[[phases]]
name = "steady"
rate_per_s = 10
measured_s = 1

[[objectives]]
phase = "steady"
measure = "p99_ms"
at_most = 20
"#;

fn parse(text: &str) -> Result<Scenario, Unusable> {
    Scenario::parse(Path::new("scenarios/small.toml"), text)
}

#[track_caller]
fn refused(text: &str) -> String {
    let unusable = parse(text).expect_err("a scenario that is refused");
    unusable.to_string()
}

#[test]
fn every_shipped_scenario_is_good() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let scenario = Scenario::read(&path).unwrap_or_else(|unusable| panic!("{unusable}"));
        assert!(!scenario.objectives.is_empty(), "{}", scenario.name);
        count += 1;
    }
    assert_eq!(count, 13);
}

#[test]
fn an_unknown_key_is_told_with_its_file() {
    let misspelt = SMALL.replace("measured_s", "mesured_s");
    let told = refused(&misspelt);
    assert!(told.contains("scenarios/small.toml"), "{told}");
    assert!(told.contains("mesured_s"), "{told}");
}

#[test]
fn contradictions_are_told_with_file_and_key() {
    let contradictions = [
        ("rate_per_s = 10", "of_capacity = 1", "phases 'steady'"),
        ("repetitions = 3", "repetitions = 0", "repetitions"),
        ("weight = 1", "weight = 1\nbatch = 0", "mix"),
        ("weight = 1", "weight = 1\npublish = true", "live"),
        (
            "at_most = 20",
            "at_most = 20\nat_least = 1",
            "objectives 'p99_ms'",
        ),
        (
            "phase = \"steady\"",
            "phase = \"stedy\"",
            "no phase 'stedy'",
        ),
        ("\"p99_ms\"", "\"capacity_of_echo\"", "echo = true"),
        (
            "seed = 1",
            "seed = 1\necho = true\nfleet.plans = 0",
            "fleet",
        ),
        (
            "measured_s = 1",
            "measured_s = 1\nevent = { kind = \"registry_outage\" }",
            "servers.registry",
        ),
    ];
    for (from, to, expected) in contradictions {
        let told = refused(&SMALL.replacen(from, to, 1));
        assert!(told.contains("small.toml"), "{told}");
        assert!(told.contains(expected), "{to}: {told}");
    }
}

/// A run of the edge in which every request took as long as its number says.
fn run(repetition: usize, server: &str, p99_ms: f64) -> RunReport {
    let figures = Figures {
        p99_ms,
        ..Figures::of(
            &Tally {
                answered: 1,
                ..Tally::default()
            },
            1.0,
        )
    };
    let phase = PhaseReport {
        name: "steady".to_owned(),
        offered_per_s: 10.0,
        measured_s: 1.0,
        server_share: None,
        elsewhere_share: None,
        load_share: None,
        late_p99_ms: 0.0,
        followed_s: None,
        all: figures,
        operations: BTreeMap::new(),
        interval_s: 1.0,
        intervals: Vec::new(),
    };
    RunReport {
        repetition,
        server: server.to_owned(),
        capacity_per_s: Some(p99_ms),
        ramp_per_s: None,
        phases: vec![phase],
    }
}

#[test]
fn the_median_of_the_repetitions_is_judged() {
    let scenario = parse(SMALL).expect("a scenario");
    let judge = |p99_ms: [f64; 3]| {
        let runs: Vec<RunReport> = (0..)
            .zip(p99_ms)
            .map(|(n, ms)| run(n, "edge", ms))
            .collect();
        scenario.objectives[0].judge(&runs)
    };
    let met = judge([90.0, 20.0, 10.0]);
    assert!(met.met);
    assert_eq!(met.measured(), "20.00 ms (of 3, from 10.00 ms to 90.00 ms)");
    assert!(!judge([90.0, 20.1, 10.0]).met);
}

#[test]
fn what_was_never_measured_is_missed() {
    let scenario = parse(SMALL).expect("a scenario");
    assert!(!scenario.objectives[0].judge(&[]).met);
    let mut silent = run(0, "edge", 1.0);
    silent.phases[0].all.answered = 0;
    assert!(!scenario.objectives[0].judge(&[silent]).met);
}

/// Within the pair of one repetition: what the machine does meanwhile is in both.
#[test]
fn the_echo_is_compared_within_its_repetition() {
    let text = SMALL
        .replace("seed = 1", "seed = 1\necho = true")
        .replace("\"p99_ms\"", "\"p99_beyond_echo_ms\"");
    let scenario = parse(&text).expect("a scenario");
    assert_eq!(scenario.objectives[0].measure, Measure::P99BeyondEchoMs);
    let runs = [
        run(0, "edge", 5.0),
        run(0, "echo", 4.0),
        run(1, "echo", 1.0),
        run(1, "edge", 7.0),
    ];
    let judgement = scenario.objectives[0].judge(&runs);
    assert_eq!(judgement.values, [Some(1.0), Some(6.0)]);
}

#[test]
fn a_median_of_enough_values_has_an_interval() {
    let of = |count: u32| Summary::of((1..=count).map(f64::from)).expect("values");
    assert_eq!(of(5).interval, None);
    // By the binomial distribution: between the second and the eighth of nine in 96 of 100 cases.
    assert_eq!(of(9).interval, Some((2.0, 8.0)));
    assert_eq!(of(25).interval, Some((8.0, 18.0)));
    let judgement = Judgement {
        objective: String::new(),
        unit: "ms".to_owned(),
        values: (1..=9).map(|value| Some(f64::from(value))).collect(),
        summary: Some(of(9)),
        met: true,
    };
    assert_eq!(
        judgement.measured(),
        "5.00 ms (of 9, 95 %: 2.00 ms to 8.00 ms; from 1.00 ms to 9.00 ms)"
    );
}
