//! A disk that is full, and one that fails: writes are refused, reading goes on, nothing acknowledged is lost, and it is
//! over as soon as the disk is well again, without a restart.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults fill the disk of a process"
)]

use crate::daemon::{Daemon, Plan, run};
use crate::outcome::Came;
use crate::registry_client::{Answer, Client, NETWORK};
use crate::rounds::{rounds, seed};
use crate::square::circle;
use crate::tracing::{self, Tracer};
use crate::writers::Crowd;
use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const WRITERS: u64 = 2;
/// How soon it has to take writes again once there is space.
pub(crate) const RECOVERY: Duration = Duration::from_secs(10);
/// How long is written between two troubles.
const WHILE: Duration = Duration::from_millis(100);

/// Says that a test is left out for what this machine lacks; where `CI=true` nothing may be lacking.
pub(crate) fn left_out(lacks: &str) {
    let is_ci = std::env::var("CI").is_ok_and(|value| value == "true");
    assert!(
        !is_ci,
        "CI=true, and this machine lacks {lacks}: give it that, or leave CI unset"
    );
    println!("this machine lacks {lacks}: left out");
}

/// Whether disks may be mounted.
pub(crate) fn is_root() -> bool {
    run("id", &["-u"]).trim() == "0"
}

/// Posts zones until one is answered so.
async fn post_until(client: &Client, wanted: u16, number: &mut u64) -> Duration {
    let begun = Instant::now();
    let line = format!("POST /v1/networks/{NETWORK}/zones");
    let mut last = 0;
    while begun.elapsed() < crate::daemon::WAIT_AT_MOST {
        *number += 1;
        let id = format!("probe-{number}");
        let zone = circle(&id, &id, [50.0, 50.0], 10.0);
        if let Answer::Came { status, .. } = client.ask(&line, &[], &zone).await {
            if status == wanted {
                return begun.elapsed();
            }
            last = status;
        }
    }
    panic!("seed {}: no zone is answered {wanted}, but {last}", seed())
}

/// What goes on while the disk takes nothing.
async fn reads_go_on(client: &Client) -> Vec<String> {
    let mut wrong = Vec::new();
    let paths = [
        "/readyz",
        "/v1/networks",
        "/v1/networks/square/changes?after=0",
    ];
    for path in paths {
        match client.ask(&format!("GET {path}"), &[], &Value::Null).await {
            Answer::Came { status: 200, .. } => {}
            Answer::Came { status, body, .. } => wrong.push(format!("{path}: {status} {body}")),
            Answer::Nothing { .. } => wrong.push(format!("{path} is not answered")),
        }
    }
    wrong
}

/// Zones that this test has posted by itself are in the log, too, and were made by no party that noted it.
fn without_probes(came: &mut Came) {
    came.violations
        .retain(|it| !it.starts_with("no party did it") || !it.contains("probe-"));
}

/// A disk of its own for a process, as small as this, and what it has to be started under.
pub(crate) fn small_disk(folder: &TempDir) -> (PathBuf, Vec<String>) {
    let disk = folder.path().join("disk");
    std::fs::create_dir(&disk).expect("a folder");
    let script = format!(
        "mount -t tmpfs -o size=8m tmpfs '{}' && exec \"$0\" \"$@\"",
        disk.display()
    );
    let under = ["unshare", "--mount", "--propagation", "private", "sh", "-c"];
    let under = under.into_iter().chain([script.as_str()]);
    (disk, under.map(str::to_owned).collect())
}

/// A file on the disk of a process that takes all the space there is.
pub(crate) struct Ballast(PathBuf);

impl Ballast {
    pub(crate) fn fill(daemon: &Daemon, disk: &std::path::Path) -> Self {
        let below = disk.strip_prefix("/").expect("an absolute path");
        let root = PathBuf::from(format!("/proc/{}/root", daemon.pid()));
        let path = root.join(below).join("ballast");
        let mut file = std::fs::File::create(&path).expect("a file");
        let block = [0_u8; 4_096];
        while file.write_all(&block).is_ok() {}
        Self(path)
    }
}

impl Drop for Ballast {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_refuses_writes_and_recovers() {
    if !is_root() {
        left_out("a small disk, which is for root to mount");
        return;
    }
    let folder = TempDir::new().expect("a folder");
    let (disk, under) = small_disk(&folder);
    let store = disk.join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]).under(under);
    let daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed(), WRITERS).followed(&plan.address);
    let (mut came, mut slowest, mut number) = (Came::default(), Duration::ZERO, 0);
    let times = rounds(20).div_ceil(10).min(20);
    let mut acknowledged = 0;
    for _ in 0..times {
        acknowledged = crowd.recorder.goes_on(acknowledged).await;
        tokio::time::sleep(WHILE).await;
        let ballast = Ballast::fill(&daemon, &disk);
        post_until(&client, 507, &mut number).await;
        came.adds("with a full disk", reads_go_on(&client).await);
        drop(ballast);
        slowest = slowest.max(post_until(&client, 201, &mut number).await);
    }
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    came.judge(&client, recorder.operations(), left).await;
    without_probes(&mut came);
    println!("{times} times a full disk, the slowest recovery {slowest:?}");
    assert!(slowest < RECOVERY, "{slowest:?}");
    came.is_right("on a disk that was full", times);
}

async fn failing(bug: Option<&'static str>, times: usize) -> Came {
    let folder = TempDir::new().expect("a folder");
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]).with_bug(bug);
    let mut daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed(), WRITERS).followed(&plan.address);
    let (mut came, mut number) = (Came::default(), 0);
    let mut acknowledged = 0;
    for _ in 0..times {
        acknowledged = crowd.recorder.goes_on(acknowledged).await;
        tokio::time::sleep(WHILE).await;
        let tracer = Tracer::failing_syncs(&daemon);
        match bug {
            None => {
                post_until(&client, 507, &mut number).await;
            }
            Some(_) => tokio::time::sleep(WHILE).await,
        }
        came.adds("while syncs fail", reads_go_on(&client).await);
        drop(tracer);
        post_until(&client, 201, &mut number).await;
        daemon.kill();
        daemon = plan.start().await;
    }
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    came.judge(&client, recorder.operations(), left).await;
    without_probes(&mut came);
    daemon.stop();
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
    came.is_right(&format!("syncs failed {times} times"), times);
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bug_is_found() {
    let bug = "ignore-failed-commit";
    failing(Some(bug), 2).await.finds(bug);
}

/// How many of the zones written were acknowledged without anything having been put on the disk since the one before.
async fn unsynced(bug: Option<&'static str>, zones: usize) -> usize {
    let folder = TempDir::new().expect("a folder");
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]).with_bug(bug);
    let daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let tracer = Tracer::of_syncs_and_answers(&daemon);
    let mut number = 0;
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
    println!("{zones} zones acknowledged, each after a sync");
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_early_answer_is_found() {
    let unsynced = unsynced(Some("acknowledge-before-commit"), 10).await;
    println!("acknowledge-before-commit is found: {unsynced} of 10 answers came before their sync");
    assert!(unsynced > 0, "early answers are not found");
}
