//! A registry that is killed, again and again, while zones are written: nothing acknowledged is lost, nothing is done
//! in halves, nothing comes twice.

use crate::daemon::Plan;
use crate::outcome::Came;
use crate::registry_client::Client;
use crate::rounds::{Chance, rounds, seed};
use crate::store_file;
use crate::writers::Crowd;
use std::time::Duration;
use tempfile::TempDir;

const WRITERS: u64 = 4;
/// How long it lives each time: at least, at most.
const LIFE: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(60)];
/// After how many deaths the file is looked at.
const LOOK_EVERY: usize = 10;
/// So that the whole log is there in the end.
const KEEP: [&str; 2] = ["--set", "changes.keep=100000000"];

async fn killed(bug: Option<&'static str>, kills: usize) -> Came {
    let (folder, seed) = (TempDir::new().expect("a folder"), seed());
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &KEEP).with_bug(bug);
    let mut came = Came::default();
    let mut daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed, WRITERS).followed(&plan.address);
    let mut chance = Chance::of(seed, 1_000);
    let mut slowest = Duration::ZERO;
    let mut acknowledged = 0;
    for kill in 1..=kills {
        acknowledged = crowd.recorder.goes_on(acknowledged).await;
        tokio::time::sleep(chance.between(LIFE[0], LIFE[1])).await;
        daemon.kill();
        if kill % LOOK_EVERY == 0 {
            let faults = store_file::faults(folder.path()).await;
            came.adds(&format!("after kill {kill}"), faults);
        }
        daemon = plan.start().await;
        slowest = slowest.max(daemon.ready_after);
    }
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    came.judge(&client, recorder.operations(), left).await;
    daemon.stop();
    came.adds("in the end", store_file::faults(folder.path()).await);
    println!("{kills} kills, the slowest start {slowest:?}");
    came
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_acknowledged_is_lost() {
    let kills = rounds(20);
    let came = killed(None, kills).await;
    came.is_right(&format!("registry killed {kills} times"), kills);
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bugs_are_found() {
    for bug in ["acknowledge-before-commit", "half-batch", "skip-tombstone"] {
        killed(Some(bug), rounds(20).min(100)).await.finds(bug);
    }
}
