//! The program as it is called: its exit codes, and what it writes.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the tests start the program, and a server for it"
)]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::process::{Command, Output};

const SCENARIO: &str = r#"
title = "Reads from a stand-in"
seed = 1
repetitions = 1

[fleet]
plans = 0
reports = 0

[client]
dialects = ["rest"]
rest_connections = 1

[[mix]]
operation = "read"
weight = 1

[[phases]]
name = "steady"
rate_per_s = 50
measured_s = 1

[[objectives]]
phase = "steady"
measure = "p99_ms"
at_most = 60000
"#;

const NETWORK: &str = r#"{"name":"two","attribution":"","geographic":true,"ids":["1","2"],"coordinates":[0.0,0.0,1.0,1.0],"pads":[0,0],"segments":[0,1],"topology_revision":1}"#;

/// Answers everything with the same network until the test ends.
fn stand_in() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("an address");
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.expect("a connection");
            std::thread::spawn(move || {
                let head = format!(
                    "HTTP/1.1 200 OK\r\ncontent-length: {}\r\n\r\n",
                    NETWORK.len()
                );
                let mut part = [0; 4096];
                while stream.read(&mut part).is_ok_and(|count| count > 0) {
                    let answer = format!("{head}{NETWORK}");
                    if stream.write_all(answer.as_bytes()).is_err() {
                        return;
                    }
                }
            });
        }
    });
    address
}

fn run(folder: &Path, scenario: &str) -> Output {
    let file = folder.join("reads.toml");
    std::fs::write(&file, scenario).expect("a scenario is written");
    Command::new(env!("CARGO_BIN_EXE_skyway-loadtest"))
        .args(["run", "--address", &stand_in().to_string()])
        .arg("--out")
        .arg(folder)
        .arg(&file)
        .output()
        .expect("the program runs")
}

#[track_caller]
fn exits_with(output: &Output, code: i32) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    stderr
}

#[test]
fn met_objectives_exit_with_0_and_leave_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = run(folder.path(), SCENARIO);
    exits_with(&output, 0);
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).expect("JSON");
    let phase = &report["scenarios"][0]["runs"][0]["phases"][0];
    assert_eq!(phase["all"]["scheduled"], phase["all"]["answered"]);
    let page = read("report.html");
    for outside in ["http://", "https://", "<script", "<link"] {
        assert!(!page.contains(outside), "the page needs {outside}");
    }
    let table = Command::new(env!("CARGO_BIN_EXE_skyway-loadtest"))
        .arg("table")
        .arg(folder.path().join("report.json"))
        .output();
    let table = table.expect("the program runs");
    let text = String::from_utf8_lossy(&table.stdout).into_owned();
    assert!(
        text.contains("| reads | REST | steady: p99, at most 60000 ms |"),
        "{text}"
    );
}

#[test]
fn a_missed_objective_exits_with_5() {
    let folder = tempfile::tempdir().expect("a folder");
    let impossible = SCENARIO.replace("at_most = 60000", "at_most = 0");
    let stderr = exits_with(&run(folder.path(), &impossible), 5);
    assert!(
        stderr.contains("missed: reads, REST: steady: p99"),
        "{stderr}"
    );
}

#[test]
fn a_scenario_that_is_wrong_exits_with_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let misspelt = SCENARIO.replace("rate_per_s", "rate");
    let stderr = exits_with(&run(folder.path(), &misspelt), 2);
    assert!(
        stderr.contains("reads.toml") && stderr.contains("rate"),
        "{stderr}"
    );
    let registry = format!("{SCENARIO}\n[servers]\nregistry = true\n");
    let stderr = exits_with(&run(folder.path(), &registry), 2);
    assert!(stderr.contains("--server"), "{stderr}");
}

#[test]
fn wrong_arguments_exit_with_2() {
    let output = Command::new(env!("CARGO_BIN_EXE_skyway-loadtest"))
        .arg("run")
        .output();
    exits_with(&output.expect("the program runs"), 2);
}
