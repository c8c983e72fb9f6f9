//! A registry behind a line that is bad, and one before a database behind such a line.

use crate::cluster::cluster;
use crate::daemon::Plan;
use crate::outcome::Came;
use crate::proxy::{End, Line, Proxy};
use crate::registry_client::{Answer, Client, NETWORK, check_page};
use crate::rounds::{rounds, seed};
use crate::square::circle;
use crate::writers::Crowd;
use serde_json::Value;
use skyway::wire::LoggedChange;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tempfile::TempDir;

const WRITERS: u64 = 2;
/// How long the line is in one state.
const WHILE: Duration = Duration::from_millis(50);
/// How long a page may take before it is asked for again.
const PAGE: Duration = Duration::from_millis(500);
/// How long the log is that is followed.
const REVISIONS: u64 = 50;
const LINES: [Line; 6] = [
    Line::Bent,
    Line::Cut,
    Line::Reset,
    Line::Good,
    Line::Slow,
    Line::BlackHole,
];

/// Follows over a bad line until a revision: pages that are not right are asked for again.
async fn follow(client: &Client, until: u64, wrong: &mut u64) -> Vec<LoggedChange> {
    let (mut after, mut changes) = (0, Vec::new());
    while after < until {
        let page = tokio::time::timeout(PAGE, client.page(after, "0s")).await;
        let Ok(Some(Ok(page))) = page else {
            *wrong += 1;
            continue;
        };
        match check_page(&page, after) {
            Ok(()) => {
                after = page.revision;
                changes.extend(page.changes);
            }
            Err(_) => *wrong += 1,
        }
    }
    changes
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_bent_or_cut_is_taken_for_a_page() {
    let folder = TempDir::new().expect("a folder");
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]);
    let daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed(), WRITERS);
    crowd.recorder.goes_on(9).await;
    while client.read_log().await.expect("a log").head < REVISIONS {
        tokio::time::sleep(WHILE).await;
    }
    let recorder = crowd.recorder.clone();
    let left = crowd.end().await;
    let all = client.read_log().await.expect("a log");
    let proxy = Proxy::to(End::Daemon(plan.address.clone()), seed()).await;
    let times = rounds(12);
    let is_over = AtomicBool::new(false);
    let turning = async {
        for time in 0..times {
            proxy.becomes(LINES[time % LINES.len()]);
            tokio::time::sleep(WHILE).await;
        }
        proxy.becomes(Line::Good);
        is_over.store(true, Ordering::Relaxed);
    };
    let (behind, mut wrong, mut followed) = (Client::through(&proxy.address, &plan.address), 0, 0);
    let following = async {
        loop {
            let changes = follow(&behind, all.head, &mut wrong).await;
            assert_eq!(changes, all.changes, "seed {}", seed());
            followed += 1;
            if is_over.load(Ordering::Relaxed) {
                break;
            }
        }
    };
    tokio::join!(turning, following);
    println!(
        "{times} states of the line, {} connections: the log was followed {followed} times, {wrong} pages were asked for again",
        proxy.accepted()
    );
    let mut came = Came::default();
    came.judge(&client, recorder.operations(), left).await;
    came.is_right("behind a bad line", 10);
    daemon.stop();
}

/// A database that takes everything and says nothing: writes and reads are refused in time, and it is over when the
/// line is good again.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_database_behind_a_bad_line_is_said_not_to_answer() {
    let Some(cluster) = cluster() else {
        return;
    };
    let folder = TempDir::new().expect("a folder");
    cluster.database("line");
    let socket = cluster.data().with_file_name(".s.PGSQL.5432");
    let proxy = Proxy::to(End::Socket(socket), seed()).await;
    let store = format!(
        "postgres://postgres@{}/line?sslmode=disable",
        proxy.socket()
    );
    let plan = Plan::registry(folder.path(), &store, &[]);
    let daemon = plan.start().await;
    let client = Client::patient(&plan.address, Duration::from_secs(40));
    client.put_network().await;
    let line = format!("POST /v1/networks/{NETWORK}/zones");
    for bad in [Line::Reset, Line::BlackHole] {
        proxy.becomes(bad);
        let id = format!("{bad:?}");
        let zone = circle(&id, &id, [50.0, 50.0], 10.0);
        match client.ask(&line, &[], &zone).await {
            Answer::Came { status: 503, .. } => {}
            Answer::Came { status, body, .. } => panic!("{bad:?}: {status} {body}"),
            Answer::Nothing { .. } => panic!("{bad:?}: no answer"),
        }
        client.until("GET /readyz", &Value::Null, 503).await;
        proxy.becomes(Line::Good);
        client.until("GET /readyz", &Value::Null, 200).await;
        client
            .until(
                &line,
                &circle(&format!("after-{id}"), "after", [50.0, 50.0], 10.0),
                201,
            )
            .await;
    }
    daemon.stop();
}
