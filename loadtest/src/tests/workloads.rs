//! Workload files: those that are shipped, and those that are refused.

use crate::scenario::Unusable;
use crate::workload::Workload;
use std::path::Path;

const SMALL: &str = r#"
title = "Small"
seed = 1
network = { bundled = "sydney" }
airframe = "phantom3"
plans = 10
departures_s = 60
fill_within_s = 10
samples = 5
zones = { large = 1, small = 1, storm = 1 }
goals = [{ measure = "told_ms", at_most = 250 }]
"#;

fn parse(text: &str) -> Result<Workload, Unusable> {
    Workload::parse(Path::new("workloads/small.toml"), text)
}

#[track_caller]
fn refused(text: &str) -> String {
    parse(text)
        .expect_err("a workload that is refused")
        .to_string()
}

#[test]
fn every_shipped_workload_is_good() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("workloads");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let workload = Workload::read(&path).unwrap_or_else(|unusable| panic!("{unusable}"));
        assert!(!workload.goals.is_empty(), "{}", workload.name);
        assert!(workload.quickened().plans <= 30);
        count += 1;
    }
    assert_eq!(count, 8);
}

#[test]
fn what_contradicts_itself_is_told_with_its_file_and_its_key() {
    assert!(parse(SMALL).is_ok());
    let airframe = r#"airframe = "phantom3""#;
    let cases = [
        ("plans = 10", "plans = 0", "plans"),
        ("departures_s = 60", "departures_s = -1", "departures_s"),
        ("samples = 5", "samples = 5\nmark = 10", "mark"),
        ("samples = 5", "samples = 5\nclock_rate = 0", "clock_rate"),
        (
            "samples = 5",
            "samples = 5\nairspeed_mps = 1",
            "airspeed_mps",
        ),
        ("storm = 1 ", "storm = 0, kills = 1 ", "zones"),
        (
            "zones = { large = 1, small = 1, storm = 1 }",
            "clock_rate = 2\nzones = { large = 1, small = 1, storm = 1, kills = 1 }",
            "clock_rate",
        ),
        ("told_ms", "compose_growth", "compose_growth"),
        (airframe, "", "airframe"),
        (airframe, "airfame = \"phantom3\"", "airfame"),
    ];
    for (from, to, key) in cases {
        let told = refused(&SMALL.replace(from, to));
        assert!(
            told.contains("workloads/small.toml") && told.contains(key),
            "{to}: {told}"
        );
    }
}
