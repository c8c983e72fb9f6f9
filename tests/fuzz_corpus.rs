//! Replays the corpus of the fuzz targets on stable: what fuzzing found once stays found.

#![expect(clippy::disallowed_methods, reason = "tests read the corpus")]

#[path = "../fuzz/bodies/feed.rs"]
mod feed;
#[path = "../fuzz/bodies/json_report.rs"]
mod json_report;
#[path = "../fuzz/bodies/network.rs"]
mod network;
#[path = "../fuzz/bodies/networks.rs"]
mod networks;
#[path = "../fuzz/bodies/protobuf.rs"]
mod protobuf;
#[path = "../fuzz/bodies/zone.rs"]
mod zone;

use std::fs;
use std::path::Path;

/// Runs a body on every file of its corpus; a panic names the file.
fn replay(target: &str, run: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(target);
    let entries = fs::read_dir(&folder).expect("a corpus");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("a readable entry").path())
        .collect();
    files.sort();
    assert!(files.len() >= 10, "{} files in {target}", files.len());
    let failed: Vec<_> = files
        .iter()
        .filter(|file| {
            let bytes = fs::read(file).expect("a readable file");
            std::panic::catch_unwind(|| run(&bytes)).is_err()
        })
        .collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn failure_reports() {
    replay("json_report", json_report::run);
}

#[test]
fn zones() {
    replay("zone", zone::run);
}

#[test]
fn feeds_of_zones() {
    replay("feed", feed::run);
}

#[test]
fn networks_in_files() {
    replay("network", network::run);
}

#[test]
fn messages() {
    replay("protobuf", protobuf::run);
}
