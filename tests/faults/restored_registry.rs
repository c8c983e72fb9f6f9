//! A registry whose store is put back to a backup while edges remember what came after: it begins a new epoch, and no
//! version comes twice.

use crate::daemon::Plan;
use crate::history::Version;
use crate::outcome::Came;
use crate::registry_client::{Answer, Client, NETWORK};
use crate::rounds::{rounds, seed};
use crate::store_file;
use crate::writers::Crowd;
use serde_json::Value;
use std::time::Duration;
use tempfile::TempDir;

const WRITERS: u64 = 4;
/// How long is written before the backup, after it, and after it was restored.
const WHILE: Duration = Duration::from_millis(150);
/// How often it is restored at most; the history of one run has to be read in the end.
const RESTORATIONS_MAX: usize = 20;

/// The epoch of the registry and the last revision of its network.
async fn stands(client: &Client) -> Version {
    let text = client.until("GET /v1/networks", &Value::Null, 200).await;
    let told: Value = serde_json::from_str(&text).expect("JSON");
    Version {
        epoch: told["epoch"].as_u64().expect("an epoch"),
        revision: told["networks"][0]["head"].as_u64().expect("a head"),
    }
}

async fn restored(bug: Option<&'static str>, times: usize) -> Came {
    let (folder, backup) = (
        TempDir::new().expect("a folder"),
        TempDir::new().expect("a folder"),
    );
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]).with_bug(bug);
    let mut came = Came::default();
    let mut daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed(), WRITERS);
    let mut ends = Vec::new();
    let mut acknowledged = 0;
    for _ in 0..times {
        acknowledged = crowd.recorder.goes_on(acknowledged).await;
        tokio::time::sleep(WHILE).await;
        daemon.kill();
        store_file::copy(folder.path(), backup.path());
        // Read from the backup: writers go on before a started registry can be asked where it stands.
        let revision = store_file::log(backup.path()).await.head;
        daemon = plan.start().await;
        let mut last = stands(&client).await;
        let end = Version { revision, ..last };
        while last.revision < end.revision + 5 {
            tokio::time::sleep(Duration::from_millis(5)).await;
            last = stands(&client).await;
        }
        daemon.kill();
        store_file::copy(backup.path(), folder.path());
        daemon = plan.start().await;
        ends.push(end);
        came.violations.extend(follows(&client, last).await);
    }
    tokio::time::sleep(WHILE).await;
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    let all = store_file::log(folder.path()).await;
    came.judge_restored(&client, recorder.operations(), left, Some(all), ends)
        .await;
    daemon.stop();
    came
}

/// Whether a follower can go on from what was lost, as if nothing had happened.
async fn follows(client: &Client, lost: Version) -> Option<String> {
    let Version { epoch, revision } = lost;
    let line = format!("GET /v1/networks/{NETWORK}/changes?after={revision}&epoch={epoch}");
    match client.ask(&line, &[], &Value::Null).await {
        Answer::Came { status: 410, .. } => None,
        Answer::Came { status, .. } => Some(format!("it can be followed from {lost}: {status}")),
        Answer::Nothing { .. } => Some("it does not answer".to_owned()),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_version_comes_twice() {
    let times = rounds(3).min(RESTORATIONS_MAX);
    let came = restored(None, times).await;
    came.is_right(&format!("registry restored {times} times"), times);
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bug_is_found() {
    restored(Some("keep-epoch"), 2).await.finds("keep-epoch");
}
