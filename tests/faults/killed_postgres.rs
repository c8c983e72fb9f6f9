//! PostgreSQL that is killed in the midst of commits: one of its backends, or all of it. The registry lives on, says
//! that its store does not answer, and loses nothing that it has acknowledged.

#![expect(
    clippy::disallowed_methods,
    reason = "tests of faults look for the processes that they end"
)]

use crate::cluster::{Cluster, cluster};
use crate::daemon::{Plan, run};
use crate::outcome::Came;
use crate::registry_client::Client;
use crate::rounds::{Chance, rounds, seed};
use crate::writers::Crowd;
use std::time::Duration;
use tempfile::TempDir;

const WRITERS: u64 = 4;
/// How long it lives each time: at least, at most.
const LIFE: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(200)];
/// One death takes as long as this many rounds of other stories: the database has to come back each time.
const ROUNDS_EACH: usize = 5;
/// Once in this many deaths it is the whole of it.
const WHOLE_EVERY: usize = 3;

/// The process that starts all others.
fn postmaster(cluster: &Cluster) -> Option<String> {
    let file = cluster.data().join("postmaster.pid");
    let text = std::fs::read_to_string(file).ok()?;
    text.lines().next().map(str::to_owned)
}

/// What it has started.
fn children(of: &str) -> Vec<String> {
    let listed = std::fs::read_to_string(format!("/proc/{of}/task/{of}/children"));
    let listed = listed.unwrap_or_default();
    listed.split_whitespace().map(str::to_owned).collect()
}

fn is_backend(process: &str) -> bool {
    let title = std::fs::read_to_string(format!("/proc/{process}/cmdline"));
    title.is_ok_and(|title| title.contains("[local]"))
}

fn is_there(process: &str) -> bool {
    std::fs::exists(format!("/proc/{process}/cmdline")).unwrap_or(false)
}

fn is_stopped(process: &str) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat"));
    stat.is_ok_and(|stat| {
        stat.rsplit(')')
            .next()
            .is_some_and(|rest| rest.starts_with(" T"))
    })
}

/// Kills one that serves the registry; the others then start anew from the log of the database.
fn kill_backend(cluster: &Cluster, chance: &mut Chance) {
    let Some(postmaster) = postmaster(cluster) else {
        return;
    };
    let backends = children(&postmaster).into_iter();
    let backends: Vec<String> = backends.filter(|process| is_backend(process)).collect();
    let drawn = usize::try_from(chance.below(backends.len() as u64)).unwrap_or_default();
    if let Some(backend) = backends.get(drawn) {
        // It may have ended by itself in between.
        let _ = std::panic::catch_unwind(|| run("kill", &["-KILL", backend]));
    }
}

/// Kills all of it at once, as the power does, and starts it again.
async fn kill_whole(cluster: &Cluster) {
    let Some(postmaster) = postmaster(cluster) else {
        return;
    };
    // What it starts meanwhile would outlive it and keep its memory, with which no other begins.
    run(
        "sh",
        &[
            "-c",
            "kill -STOP \"$1\" 2>/dev/null; true",
            "sh",
            &postmaster,
        ],
    );
    while is_there(&postmaster) && !is_stopped(&postmaster) {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    let mut all = children(&postmaster);
    all.insert(0, postmaster);
    let words: Vec<&str> = ["-c", "kill -KILL \"$@\" 2>/dev/null; true", "sh"]
        .into_iter()
        .chain(all.iter().map(String::as_str))
        .collect();
    run("sh", &words);
    while all.iter().any(|process| is_there(process)) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    tokio::task::block_in_place(|| cluster.start());
}

async fn killed(cluster: &Cluster, bug: Option<&'static str>, kills: usize) -> Came {
    let (folder, seed) = (TempDir::new().expect("a folder"), seed());
    let store = cluster.database(&format!(
        "killed_{}",
        bug.unwrap_or("none").replace('-', "_")
    ));
    let plan = Plan::registry(folder.path(), &store, &[]).with_bug(bug);
    let mut came = Came::default();
    let daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed, WRITERS).followed(&plan.address);
    let mut chance = Chance::of(seed, 2_000);
    let mut acknowledged = 0;
    for kill in 1..=kills {
        acknowledged = crowd.recorder.goes_on(acknowledged).await;
        tokio::time::sleep(chance.between(LIFE[0], LIFE[1])).await;
        match kill % WHOLE_EVERY {
            0 => kill_whole(cluster).await,
            _ => kill_backend(cluster, &mut chance),
        }
        // Until it is back, so that the next death meets commits again.
        client
            .until("GET /readyz", &serde_json::Value::Null, 200)
            .await;
    }
    let last = serde_json::Value::Null;
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    client.until("GET /v1/networks", &last, 200).await;
    came.judge(&client, recorder.operations(), left).await;
    daemon.stop();
    came
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_acknowledged_is_lost() {
    let Some(cluster) = cluster() else {
        return;
    };
    let kills = rounds(30).div_ceil(ROUNDS_EACH);
    let came = killed(&cluster, None, kills).await;
    came.is_right(&format!("PostgreSQL killed {kills} times"), kills);
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bug_is_found() {
    let Some(cluster) = cluster() else {
        return;
    };
    let bug = "acknowledge-before-commit";
    killed(&cluster, Some(bug), 9).await.finds(bug);
}
