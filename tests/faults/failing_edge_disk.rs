//! An edge whose disk is full or fails: airspace closes all the same and says that it is not durable, everything else is
//! refused, answers go on, and it is over as soon as the disk is well again, without a restart.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::daemon::{Daemon, Plan};
use crate::edge::holding_of;
use crate::failing_disk::{Ballast, RECOVERY, is_root, left_out, small_disk};
use crate::history::{Outcome, Recorder, objects};
use crate::outcome::Came;
use crate::registry_client::{Answer, Client};
use crate::rounds::{Chance, rounds, seed};
use crate::square::{circle, network};
use crate::tracing::{self, Tracer};
use crate::writers::{Crowd, Habit};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const WRITERS: u64 = 2;
/// How long is written between two troubles.
const WHILE: Duration = Duration::from_millis(100);
/// How long the edge is left with its trouble when it is killed with it.
const TROUBLE: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(300)];

/// An edge over the square without a registry.
pub(crate) fn alone(folder: &Path, store: &Path) -> Plan {
    let file = folder.join("square.geojson").display().to_string();
    crate::daemon::write(&file, &network());
    let store = store.display().to_string();
    let what = ["edge", "--network", &file, "--store", &store];
    Plan::new("edge", folder, &what)
}

/// Posts zones until one is answered so; the id of that one, and how long it took.
async fn post_until(client: &Client, wanted: u16, number: &mut u64) -> (String, Duration, Value) {
    let begun = Instant::now();
    let mut last = 0;
    while begun.elapsed() < crate::daemon::WAIT_AT_MOST {
        *number += 1;
        let id = format!("probe-{number}");
        let zone = circle(&id, &id, [350.0, 350.0], 10.0);
        if let Answer::Came { status, body, .. } = client.ask("POST /v1/zones", &[], &zone).await {
            if status == wanted {
                let body = serde_json::from_str(&body).unwrap_or_default();
                return (id, begun.elapsed(), body);
            }
            last = status;
        }
    }
    panic!("seed {}: no zone is answered {wanted}, but {last}", seed())
}

/// What does not hold while the disk takes nothing, with a zone that was posted meanwhile, and whether that zone is gone.
///
/// What is in the log already may go into the file, and gives its room back: then a deletion fits where the zone before did not.
async fn in_trouble(client: &Client, zone: &str, told: &Value) -> (Vec<String>, bool) {
    let mut wrong = Vec::new();
    let mut expect = |what: &str, is_so: bool, found: &Value| {
        if !is_so {
            wrong.push(format!("{what}: {found}"));
        }
    };
    expect("507 says why", told["code"] == "not_durable", told);
    expect(
        "507 says that it is in force",
        told["enforced"] == true,
        told,
    );
    let report =
        json!({"service": {"from": "n22", "to": "n32"}, "destination": "n55", "dry_run": true});
    let zone_line = format!("/v1/zones/{zone}");
    let delete = format!("DELETE {zone_line}");
    let deleted = client
        .ask(&delete, &[("if-match", "*")], &Value::Null)
        .await;
    let is_gone = matches!(deleted, Answer::Came { status: 200, .. });
    let is_refused = matches!(deleted, Answer::Came { status: 507, .. });
    expect(
        "it is deleted or not",
        is_gone || is_refused,
        &json!(delete),
    );
    let shown = if is_gone { 404 } else { 200 };
    let lines = [
        ("GET", zone_line.as_str(), &Value::Null, shown),
        ("GET", "/readyz", &Value::Null, 200),
        ("POST", "/v1/failures", &report, 200),
    ];
    for (method, path, body, wanted) in lines {
        let line = format!("{method} {path}");
        match client.ask(&line, &[("if-match", "*")], body).await {
            Answer::Came { status, body, .. } => {
                expect(&line, status == wanted, &json!([status, body]));
            }
            Answer::Nothing { .. } => expect(&line, false, &Value::Null),
        }
    }
    (wrong, is_gone)
}

/// Everything that was done at an edge against what it has once it was killed and started again.
async fn judge(plan: &Plan, daemon: Daemon, recorder: &Recorder, came: &mut Came) {
    daemon.kill();
    let daemon = plan.start().await;
    let client = Client::of_edge(&plan.address);
    let operations = recorder.operations();
    match holding_of(&client).await {
        Some(holding) => came
            .violations
            .extend(objects::violations(&operations, &holding)),
        None => came
            .violations
            .push("it shows nothing in the end".to_owned()),
    }
    came.acknowledged = operations.iter().filter(|it| it.is_done()).count();
    let unknown = operations
        .iter()
        .filter(|it| it.outcome == Outcome::Unknown);
    came.unknown = unknown.count();
    daemon.stop();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_keeps_no_airspace_from_closing() {
    if !is_root() {
        left_out("a small disk, which is for root to mount");
        return;
    }
    let folder = TempDir::new().expect("a folder");
    let (disk, under) = small_disk(&folder);
    let plan = alone(folder.path(), &disk.join("edge.db")).under(under);
    let daemon = plan.start().await;
    let client = Client::of_edge(&plan.address);
    let recorder = Recorder::default();
    let crowd = Crowd::of(&client, "w", Habit::AT_EDGE, (seed(), WRITERS), &recorder);
    let (mut came, mut slowest, mut number) = (Came::default(), Duration::ZERO, 0);
    let times = rounds(20).div_ceil(10).min(20);
    let mut acknowledged = 0;
    for time in 0..times {
        acknowledged = recorder.goes_on(acknowledged).await;
        tokio::time::sleep(WHILE).await;
        let ballast = Ballast::fill(&daemon, &disk);
        let (zone, _, told) = post_until(&client, 507, &mut number).await;
        let (wrong, is_gone) = in_trouble(&client, &zone, &told).await;
        came.adds("with a full disk", wrong);
        drop(ballast);
        let (_, took, told) = post_until(&client, 201, &mut number).await;
        slowest = slowest.max(took);
        if told["durable"] != true {
            came.adds("with space", [format!("{told}")]);
        }
        if !is_gone {
            came.adds(&format!("time {time}"), is_there(&client, &zone).await);
        }
    }
    crowd.end().await;
    // It is in memory: a process of its own has a file system of its own, which goes with it.
    came.acknowledged = recorder
        .operations()
        .iter()
        .filter(|it| it.is_done())
        .count();
    let holding = holding_of(&client).await.unwrap_or_default();
    came.violations
        .extend(objects::violations(&recorder.operations(), &holding));
    daemon.stop();
    println!("{times} times a full disk of an edge, the slowest recovery {slowest:?}");
    assert!(slowest < RECOVERY, "{slowest:?}");
    came.is_right("on a disk of an edge that was full", times);
}

async fn is_there(client: &Client, zone: &str) -> Option<String> {
    let line = format!("GET /v1/zones/{zone}");
    match client.ask(&line, &[], &Value::Null).await {
        Answer::Came { status: 200, .. } => None,
        _ => Some(format!("{zone} is not there any more")),
    }
}

async fn failing(bug: Option<&'static str>, times: usize) -> Came {
    let folder = TempDir::new().expect("a folder");
    let plan = alone(folder.path(), &folder.path().join("edge.db")).with_bug(bug);
    let mut daemon = plan.start().await;
    let client = Client::of_edge(&plan.address);
    let recorder = Recorder::default();
    let crowd = Crowd::of(&client, "w", Habit::AT_EDGE, (seed(), WRITERS), &recorder);
    let (mut came, mut number, mut acknowledged) = (Came::default(), 0, 0);
    let mut chance = Chance::of(seed(), 11_000);
    for time in 0..times {
        acknowledged = recorder.goes_on(acknowledged).await;
        tokio::time::sleep(WHILE).await;
        let tracer = Tracer::failing_syncs(&daemon);
        if bug.is_none() {
            let (zone, _, told) = post_until(&client, 507, &mut number).await;
            let (wrong, is_gone) = in_trouble(&client, &zone, &told).await;
            came.adds("while syncs fail", wrong);
            let deleted = is_gone.then(|| "while syncs fail a deletion is acknowledged".to_owned());
            came.adds("while syncs fail", deleted);
        }
        if bug.is_some() {
            // Besides what was under way, something is acknowledged of which nothing gets to the disk.
            let under_way = recorder.done() + WRITERS as usize;
            acknowledged = recorder.goes_on(under_way).await;
        }
        tokio::time::sleep(chance.between(TROUBLE[0], TROUBLE[1])).await;
        // Every other time it dies with its trouble.
        if time % 2 == 0 {
            daemon.kill();
            drop(tracer);
        } else {
            drop(tracer);
            post_until(&client, 201, &mut number).await;
            daemon.kill();
        }
        daemon = plan.start().await;
    }
    crowd.end().await;
    judge(&plan, daemon, &recorder, &mut came).await;
    came
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_failed_sync_is_no_success() {
    if !tracing::is_there() {
        left_out("strace");
        return;
    }
    let times = rounds(20).div_ceil(10).min(20);
    let came = failing(None, times).await;
    came.is_right(&format!("syncs of an edge failed {times} times"), times);
}

/// How many of the zones written were acknowledged without anything having been put on the disk since the one before.
async fn unsynced(bug: Option<&'static str>, zones: usize) -> usize {
    let folder = TempDir::new().expect("a folder");
    let plan = alone(folder.path(), &folder.path().join("edge.db")).with_bug(bug);
    let daemon = plan.start().await;
    let client = Client::of_edge(&plan.address);
    let mut number = 0;
    post_until(&client, 201, &mut number).await;
    let tracer = Tracer::of_syncs_and_answers(&daemon);
    for _ in 0..zones {
        post_until(&client, 201, &mut number).await;
    }
    let (unsynced, answers) = tracer.unsynced();
    assert_eq!(answers, zones, "the trace has every answer");
    unsynced
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_acknowledged_zone_is_on_the_disk() {
    if !tracing::is_there() {
        left_out("strace");
        return;
    }
    let zones = rounds(20);
    assert_eq!(unsynced(None, zones).await, 0);
    println!("{zones} zones acknowledged at an edge, each after a sync");
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bugs_are_found() {
    let bug = "ignore-failed-commit";
    failing(Some(bug), 6).await.finds(bug);
    let unsynced = unsynced(Some("acknowledge-before-commit"), 10).await;
    println!("acknowledge-before-commit is found: {unsynced} of 10 answers came before their sync");
    assert!(unsynced > 0, "early answers are not found");
}
