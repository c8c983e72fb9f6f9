//! `skyway demo`: how it starts, what it invites to, and how it ends.

use crate::binary::{Workspace, skyway};
use serde_json::Value;

/// Ports that no program has, so that demos do not meet.
const FREE_PORTS: [&str; 4] = ["--listen", "127.0.0.1:0", "--admin-listen", "127.0.0.1:0"];

fn demo<'a>(further: &[&'a str]) -> Vec<&'a str> {
    [&["demo"], &FREE_PORTS[..], further].concat()
}

#[test]
fn a_demo_says_where_to_look_and_ends_when_its_time_is_over() {
    let desk = Workspace::new();
    let ports_file = desk.path("ports.json");
    let run = skyway(&demo(&["--for", "0", "--ports-file", &ports_file])).exits(0);
    assert_eq!(run.stdout, "");
    // The clock of both edges is one.
    let warnings = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("warning:"));
    assert_eq!(warnings.count(), 1, "{}", run.stderr);
    let ports: Value = serde_json::from_str(&desk.read("ports.json")).expect("JSON");
    let url = format!("http://127.0.0.1:{}", ports["listen"]);
    let commands: Vec<&str> = run
        .stderr
        .lines()
        .filter(|line| line.starts_with("  curl "))
        .collect();
    assert_eq!(commands.len(), 3, "{}", run.stderr);
    for command in commands {
        assert!(command.contains(&url), "{command}");
        // What is pasted into a shell is the JSON that was meant.
        if let Some((_, body)) = command.split_once("--json '") {
            let body = body.strip_suffix('\'').expect("the closing quote");
            serde_json::from_str::<Value>(body).expect("JSON");
        }
    }
}

#[test]
fn a_demo_that_cannot_start_says_why() {
    let off_loopback = skyway(&["demo", "--listen", "0.0.0.0:0", "--for", "0"]).exits(78);
    assert!(
        off_loopback.stderr.contains("loopback"),
        "{}",
        off_loopback.stderr
    );
    let rate = skyway(&demo(&["--for", "0", "--rate", "fast"])).exits(78);
    assert!(rate.stderr.contains("--rate"), "{}", rate.stderr);
    skyway(&demo(&["--drones", "0"])).exits(2);
}
