//! An edge whose line leads to another registry for a while: one with another id, or the same one as it was before.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::daemon::{Plan, WAIT_AT_MOST};
use crate::edge::Edge;
use crate::history::Act;
use crate::proxy::End;
use crate::registry_client::Client;
use crate::stage::Stage;
use crate::store_file;
use serde_json::Value;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const LOOK: Duration = Duration::from_millis(5);

fn zone(id: &str) -> Act {
    Act::Put {
        id: id.to_owned(),
        tag: format!("{id}-tag"),
    }
}

async fn put(client: &Client, id: &str) {
    let (outcome, ..) = client.act(&zone(id), None, None).await;
    assert!(
        matches!(outcome, crate::history::Outcome::Done(_)),
        "{id}: {outcome:?}"
    );
}

/// How long an edge may take to refuse what it is told; with a bug it never does.
const REFUSED: Duration = Duration::from_secs(5);

/// Waits until an edge stands so, and gives how it stands; at the end also where it never does.
async fn until(edge: &Edge, patience: Duration, is_so: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let status = edge.status().await.unwrap_or_default();
        if is_so(&status) || begun.elapsed() > patience {
            return status;
        }
        tokio::time::sleep(LOOK).await;
    }
}

/// The line leads to what is at an address, and something is posted at the edge; then back again. What must not have
/// happened.
async fn led_astray(stage: &Stage, other: &Plan, code: &str) -> Vec<String> {
    let edge = &stage.edges[0];
    let is_at_head = |it: &Value| it["zones"] == 3 && it["registry"]["outbox"] == 0;
    let before = until(edge, WAIT_AT_MOST, is_at_head).await;
    assert!(is_at_head(&before), "{before}");
    edge.line.leads_to(End::Daemon(other.address.clone()));
    let is_refused = |it: &Value| it["registry"]["last_nack"]["code"] == code;
    let astray = until(edge, REFUSED, is_refused).await;
    put(&edge.client, "zone-posted-meanwhile").await;
    tokio::time::sleep(LOOK * 100).await;
    let still = edge.status().await.unwrap_or_default();
    let mut wrong = Vec::new();
    if !is_refused(&astray) {
        wrong.push(format!("no {code}: {}", astray["registry"]));
    }
    for status in [&astray, &still] {
        let is_same = status["registry_revision"] == before["registry_revision"]
            && status["registry"]["registry_id"] == before["registry"]["registry_id"];
        if !is_same {
            wrong.push(format!("{before} has become {status}"));
        }
    }
    if still["zones"] != 4 {
        wrong.push(format!("something was taken over: {still}"));
    }
    edge.line
        .leads_to(End::Daemon(stage.registry.address.clone()));
    let begun = Instant::now();
    wrong.extend(stage.heal().await);
    let took = begun.elapsed();
    let holding = stage.client.read_holding().await.expect("zones");
    if holding.len() != 4 {
        wrong.push(format!(
            "what was posted meanwhile is not told: {holding:?}"
        ));
    }
    if wrong.is_empty() {
        println!("{code}: nothing was taken over or told, recovered after {took:?}");
    }
    wrong
}

/// A registry that knows the same tokens, over a store in a folder.
fn beside(stage: &Stage, folder: &TempDir) -> Plan {
    let store = folder.path().join("registry.db").display().to_string();
    let more = ["--tokens-file", &stage.tokens_file];
    Plan::registry(folder.path(), &store, &more)
}

async fn stranger(bug: Option<&'static str>) -> Vec<String> {
    let stage = Stage::set(&["north"], bug, &[]).await;
    for id in ["zone-a", "zone-b", "zone-c"] {
        put(&stage.client, id).await;
    }
    let folder = TempDir::new().expect("a folder");
    let plan = beside(&stage, &folder);
    let stranger = plan.start().await;
    let client = Client::new(&plan.address).with_token(&stage.operator);
    client.put_network().await;
    // It has come further than the right one, with other zones.
    for id in ["zone-x", "zone-y", "zone-z", "zone-x2", "zone-x3"] {
        put(&client, id).await;
    }
    let told = client.read_log().await.expect("a log").head;
    let mut wrong = led_astray(&stage, &plan, "foreign_registry").await;
    let head = client.read_log().await.expect("a log").head;
    if head != told {
        wrong.push(format!("it was told {} things", head - told));
    }
    stranger.stop();
    wrong
}

async fn as_it_was(bug: Option<&'static str>) -> Vec<String> {
    let mut stage = Stage::set(&["north"], bug, &[]).await;
    put(&stage.client, "zone-a").await;
    let folder = TempDir::new().expect("a folder");
    stage.kill_registry();
    // Without what remembers how far it had come, it does not know that it is a copy.
    store_file::copy(stage.folder.path(), folder.path());
    stage.start_registry().await;
    for id in ["zone-b", "zone-c"] {
        put(&stage.client, id).await;
    }
    let plan = beside(&stage, &folder);
    let before = plan.start().await;
    let wrong = led_astray(&stage, &plan, "revision_backwards").await;
    before.stop();
    wrong
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn another_registry_is_not_followed_and_told_nothing() {
    assert_eq!(stranger(None).await, Vec::<String>::new());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_registry_as_it_was_before_leads_nobody_back() {
    assert_eq!(as_it_was(None).await, Vec::<String>::new());
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bugs_are_found() {
    let (foreign, older) = ("accept-foreign-id", "accept-older-revision");
    let found = [
        (foreign, stranger(Some(foreign)).await),
        (older, as_it_was(Some(older)).await),
    ];
    for (bug, wrong) in found {
        let first = wrong.first();
        println!(
            "{bug} is found: {} violations, the first: {first:?}",
            wrong.len()
        );
        assert!(first.is_some(), "{bug} is not found");
    }
}
