//! A registry that is killed, again and again, while zones are written: nothing acknowledged is lost, nothing is done
//! in halves, nothing comes twice.

use crate::daemon::Plan;
use crate::history::{Operation, Outcome, log};
use crate::registry_client::{Answer, Client, NETWORK, circle};
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

/// What a run came to.
#[derive(Debug, Default)]
struct Came {
    violations: Vec<String>,
    acknowledged: usize,
    unknown: usize,
    revisions: u64,
    slowest_start: Duration,
}

async fn killed(bug: Option<&'static str>, kills: usize) -> Came {
    let (folder, seed) = (TempDir::new().expect("a folder"), seed());
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]).with_bug(bug);
    let mut came = Came::default();
    let mut daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed, WRITERS);
    let mut chance = Chance::of(seed, 1_000);
    for kill in 1..=kills {
        tokio::time::sleep(chance.between(LIFE[0], LIFE[1])).await;
        daemon.kill();
        if kill % LOOK_EVERY == 0 {
            let faults = store_file::faults(folder.path()).await;
            let faults = faults.into_iter();
            came.violations
                .extend(faults.map(|fault| format!("after kill {kill}: {fault}")));
        }
        daemon = plan.start().await;
        came.slowest_start = came.slowest_start.max(daemon.ready_after);
    }
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    came.violations.extend(left.violations);
    match client.read_all().await {
        Err(wrong) => came.violations.push(wrong),
        Ok(all) => {
            let run = log::Run {
                operations: recorder.operations(),
                log: all.log(),
                revisions: all.revisions(),
                holding: all.holding.clone(),
                restored: Vec::new(),
            };
            came.revisions = all.head;
            came.violations.extend(run.violations());
            let is_prefix = all.changes.starts_with(&left.followed);
            if !is_prefix {
                let text = "what was followed is not what the log says in the end";
                came.violations.push(text.to_owned());
            }
        }
    }
    came.violations.extend(takes_no_writes(&client).await);
    daemon.stop();
    came.violations
        .extend(store_file::faults(folder.path()).await);
    let operations = recorder.operations();
    came.acknowledged = operations.iter().filter(|it| it.is_done()).count();
    came.unknown = operations.iter().filter(|it| is_unknown(it)).count();
    came
}

fn is_unknown(operation: &Operation) -> bool {
    operation.outcome == Outcome::Unknown
}

/// Whether the registry is of no use in the end.
async fn takes_no_writes(client: &Client) -> Option<String> {
    let zone = circle("last", "last", [50.0, 50.0], 1.0);
    let line = format!("POST /v1/networks/{}/zones", NETWORK);
    match client.ask(&line, &[], &zone).await {
        Answer::Came { status: 201, .. } => None,
        Answer::Came { status, body, .. } => {
            Some(format!("it takes no writes any more: {status} {body}"))
        }
        Answer::Nothing { .. } => Some("it does not answer".to_owned()),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_acknowledged_is_lost() {
    let kills = rounds(20);
    let came = killed(None, kills).await;
    println!(
        "seed {}: {kills} kills, {} acknowledged, {} without an answer, {} revisions, slowest start {:?}",
        seed(),
        came.acknowledged,
        came.unknown,
        came.revisions,
        came.slowest_start
    );
    assert!(
        came.violations.is_empty(),
        "seed {}: {:#?}",
        seed(),
        came.violations
    );
    assert!(came.acknowledged > kills, "too little happened: {came:?}");
}
