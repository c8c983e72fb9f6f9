//! An edge whose line leads to another registry for a while: one with another id, or the same one as it was before.

use crate::daemon::Plan;
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
    let (outcome, _) = client.act(&zone(id), None, None).await;
    assert!(
        matches!(outcome, crate::history::Outcome::Done(_)),
        "{id}: {outcome:?}"
    );
}

/// Waits until an edge stands so.
async fn until(edge: &Edge, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    let mut last = Value::Null;
    while begun.elapsed() < crate::daemon::PATIENCE {
        last = edge.status().await.unwrap_or_default();
        if is_so(&last) {
            return last;
        }
        tokio::time::sleep(LOOK).await;
    }
    panic!("it never was so: {what}: {last}");
}

/// The line leads to what is at an address, and something is posted at the edge; then back again.
async fn led_astray(stage: &Stage, other: &Plan, code: &str) {
    let edge = &stage.edges[0];
    let before = until(edge, "it is at the head", |it| {
        it["zones"] == 3 && it["registry"]["outbox"] == 0
    })
    .await;
    edge.line.leads_to(End::Daemon(other.address.clone()));
    let astray = until(edge, code, |it| it["registry"]["last_nack"]["code"] == code).await;
    put(&edge.client, "zone-posted-meanwhile").await;
    tokio::time::sleep(LOOK * 100).await;
    let still = until(edge, "it answers", |it| !it.is_null()).await;
    for status in [&astray, &still] {
        assert_eq!(
            status["registry_revision"], before["registry_revision"],
            "{status}"
        );
        assert_eq!(
            status["registry"]["registry_id"],
            before["registry"]["registry_id"]
        );
    }
    assert_eq!(still["zones"], 4, "{still}");
    edge.line
        .leads_to(End::Daemon(stage.registry.address.clone()));
    let begun = Instant::now();
    assert_eq!(stage.heal().await, Vec::<String>::new());
    let holding = stage.client.read_holding().await.expect("zones");
    assert_eq!(
        holding.len(),
        4,
        "what was posted meanwhile is told now: {holding:?}"
    );
    println!(
        "{code}: nothing was taken over or told, recovered after {:?}",
        begun.elapsed()
    );
}

/// A registry that knows the same tokens, over a store in a folder.
fn beside(stage: &Stage, folder: &TempDir) -> Plan {
    let store = folder.path().join("registry.db").display().to_string();
    let more = ["--tokens-file", &stage.tokens_file];
    Plan::registry(folder.path(), &store, &more)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn another_registry_is_not_followed_and_told_nothing() {
    let stage = Stage::set(&["north"], None, &[]).await;
    for id in ["zone-a", "zone-b", "zone-c"] {
        put(&stage.client, id).await;
    }
    let folder = TempDir::new().expect("a folder");
    let plan = beside(&stage, &folder);
    let stranger = plan.start().await;
    let client = Client::new(&plan.address).with_token(&stage.operator);
    client.put_network().await;
    // It has come as far as the right one, with other zones.
    for id in ["zone-x", "zone-y", "zone-z", "zone-x2", "zone-x3"] {
        put(&client, id).await;
    }
    let told = client.read_log().await.expect("a log").head;
    led_astray(&stage, &plan, "foreign_registry").await;
    assert_eq!(client.read_log().await.expect("a log").head, told);
    stranger.stop();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_registry_as_it_was_before_leads_nobody_back() {
    let mut stage = Stage::set(&["north"], None, &[]).await;
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
    led_astray(&stage, &plan, "revision_backwards").await;
    before.stop();
}
