//! Following over HTTP: pages, long polls, snapshots, compaction, and digests computed by hand.

use crate::drafts::{NETWORK, square};
use crate::harness::{Place, Served, Told, circle};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use skyway::registry::Settings;
use skyway::wire::{ChangesPage, RegistrySnapshot};

/// SHA-256 of netstrings, written down from the page that describes it and not from the code.
fn digest(fields: &[&str]) -> String {
    let text: String = fields
        .iter()
        .map(|field| format!("{}:{field},", field.len()))
        .collect();
    Sha256::digest(text.as_bytes())
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn fields_of(object: &Value, names: &[&str]) -> Vec<String> {
    names.iter().map(|name| text(&object[*name])).collect()
}

fn digest_of(what: &str, parts: &[String]) -> String {
    let mut fields = vec![what];
    fields.extend(parts.iter().map(String::as_str));
    digest(&fields)
}

#[track_caller]
fn check_page(told: &Told) -> ChangesPage {
    let page = told.json();
    let mut sealed = fields_of(
        &page,
        &[
            "registry_id",
            "epoch",
            "network",
            "after",
            "revision",
            "head",
            "oldest",
        ],
    );
    let changes = page["changes"].as_array().expect("changes");
    sealed.push(changes.len().to_string());
    for change in changes {
        let mut parts = vec![text(&page["network"])];
        parts.extend(fields_of(
            change,
            &[
                "epoch",
                "revision",
                "at",
                "subject",
                "kind",
                "id",
                "operation",
            ],
        ));
        match &change["body"] {
            Value::Null => parts.push("none".to_owned()),
            body => parts.extend(["body".to_owned(), text(body)]),
        }
        assert_eq!(
            text(&change["sha256"]),
            digest_of("skyway-change-1", &parts)
        );
        sealed.push(text(&change["sha256"]));
    }
    assert_eq!(
        text(&page["checksum"]),
        digest_of("skyway-changes-1", &sealed)
    );
    let read: ChangesPage = serde_json::from_str(&told.body).expect("a page");
    assert!(read.is_intact());
    read
}

#[track_caller]
fn check_snapshot(told: &Told) -> RegistrySnapshot {
    let page = told.json();
    let mut sealed = fields_of(
        &page,
        &[
            "registry_id",
            "epoch",
            "network",
            "revision",
            "object_count",
        ],
    );
    let is_empty = page["authoritative_empty"] == true;
    sealed.push(if is_empty { "empty" } else { "not empty" }.to_owned());
    sealed.push(page.get("next_page_token").map(text).unwrap_or_default());
    let objects = page["objects"].as_array().expect("objects");
    sealed.push(objects.len().to_string());
    for object in objects {
        let mut parts = vec![text(&page["network"])];
        parts.extend(fields_of(
            object,
            &["epoch", "revision", "kind", "id", "body"],
        ));
        assert_eq!(
            text(&object["sha256"]),
            digest_of("skyway-object-1", &parts)
        );
        sealed.push(text(&object["sha256"]));
    }
    assert_eq!(
        text(&page["checksum"]),
        digest_of("skyway-snapshot-1", &sealed)
    );
    let read: RegistrySnapshot = serde_json::from_str(&told.body).expect("a page");
    assert!(read.is_intact());
    read
}

#[tokio::test]
async fn the_log_is_read_in_pages_whose_digests_anyone_can_compute() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    for id in ["a", "b", "c"] {
        served.post_zone(id).await;
    }
    let tag = served.get("/zones/b").await.etag();
    served
        .write("DELETE /zones/b", &[("if-match", &tag)], &Value::Null)
        .await
        .is(200);
    let first = check_page(&served.get("/changes?after=0&limit=2").await.is(200));
    assert_eq!(
        (
            first.revision,
            first.head,
            first.oldest,
            first.changes.len()
        ),
        (2, 5, 0, 2)
    );
    let rest = check_page(
        &served
            .get("/changes?after=2&limit=100&epoch=1")
            .await
            .is(200),
    );
    let ids: Vec<&str> = rest
        .changes
        .iter()
        .map(|change| change.id.as_str())
        .collect();
    assert_eq!((ids, rest.revision), (vec!["b", "c", "b"], 5));
    assert_eq!(rest.changes[2].body, None);
    let nothing = check_page(&served.get("/changes?after=5").await.is(200));
    assert_eq!((nothing.revision, nothing.changes.len()), (5, 0));
    // What was bent on the way is found out.
    let mut bent = rest.clone();
    bent.changes[0].id.push('x');
    assert!(!bent.is_intact());
    let mut short = rest.clone();
    short.changes.pop();
    assert!(!short.is_intact());
    for wrong in [
        "after=x",
        "",
        "after=1&limit=-1",
        "after=1&wait=soon",
        "after=1&until=2",
    ] {
        served
            .get(&format!("/changes?{wrong}"))
            .await
            .refuses(400, "parameter_invalid");
    }
    served.end().await;
}

#[tokio::test]
async fn who_waits_is_told_at_once() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    // Waiting to the end would take longer than the client has patience.
    let waiting: Vec<_> = (0..5)
        .map(|number| served.get_later(&format!("/changes?after=1&wait=55s&edge=e{number}")))
        .collect();
    while served.ask_admin("GET /status").await.json()["waiting"] != 5 {
        tokio::task::yield_now().await;
    }
    served.post_zone("z").await;
    for told in waiting {
        let page = check_page(&told.await.expect("an answer").is(200));
        assert_eq!((page.revision, page.changes.len()), (2, 1));
    }
    let patient = check_page(&served.get("/changes?after=2&wait=10ms").await.is(200));
    assert_eq!((patient.revision, patient.changes.len()), (2, 0));
    served.end().await;
}

#[tokio::test]
async fn a_drain_ends_the_waiting() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let waiting = served.get_later("/changes?after=1&wait=55s");
    while served.ask_admin("GET /status").await.json()["waiting"] != 1 {
        tokio::task::yield_now().await;
    }
    served.ask("GET /readyz", &[], "").await.is(200);
    served.drain.begin();
    let page = check_page(&waiting.await.expect("an answer").is(200));
    assert_eq!((page.revision, page.changes.len()), (1, 0));
    served.end().await;
}

#[tokio::test]
async fn a_snapshot_is_paged_at_one_revision() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let empty = check_snapshot(&served.get("/snapshot").await.is(200));
    assert_eq!((empty.objects.len(), empty.authoritative_empty), (1, true));
    assert_eq!(empty.objects[0].body, square());
    for id in ["a", "b", "c", "d"] {
        served.post_zone(id).await;
    }
    let first = check_snapshot(&served.get("/snapshot?page_size=2").await.is(200));
    assert_eq!(
        (
            first.revision,
            first.object_count,
            first.authoritative_empty
        ),
        (5, 5, false)
    );
    let tag = served.get("/zones/d").await.etag();
    served
        .write("DELETE /zones/d", &[("if-match", &tag)], &Value::Null)
        .await
        .is(200);
    served
        .write("PUT /zones/e", &[], &circle("e", 3.0))
        .await
        .is(201);
    let token = first.next_page_token.expect("a second page");
    let second = served
        .get(&format!("/snapshot?page_size=2&page_token={token}"))
        .await
        .is(200);
    let second = check_snapshot(&second);
    assert_eq!((second.revision, second.next_page_token), (5, None));
    let all = first.objects.iter().chain(&second.objects);
    let ids: Vec<&str> = all.map(|object| object.id.as_str()).collect();
    assert_eq!(ids, ["", "a", "b", "c", "d"]);
    served
        .get("/snapshot?page_token=zz")
        .await
        .refuses(400, "parameter_invalid");
    served.end().await;
}

#[tokio::test]
async fn who_was_away_too_long_takes_the_snapshot() {
    let place = Place::new();
    let settings = Settings {
        revisions_kept: 3,
        ..Settings::default()
    };
    let served = Served::with_network(&place, settings).await;
    let without = json!({"removed_segments": ["c-d"]});
    served
        .write("PATCH ", &[("if-match", "*")], &without)
        .await
        .is(200);
    for id in ["a", "b", "c", "d"] {
        served.post_zone(id).await;
    }
    let before = served.get("/snapshot").await.is(200).body;
    let network = served.get("").await.is(200);
    served.registry.compact().await.expect("compacts");
    let gone = served
        .get("/changes?after=2")
        .await
        .refuses(410, "changes_gone")
        .json();
    assert_eq!(gone["oldest_revision"], 3);
    let page = check_page(&served.get("/changes?after=3").await.is(200));
    assert_eq!((page.oldest, page.changes.len()), (3, 3));
    assert_eq!(served.get("/snapshot").await.is(200).body, before);
    assert_eq!(served.get("").await.is(200).body, network.body);
    let future = served
        .get("/changes?after=7")
        .await
        .refuses(410, "changes_gone")
        .json();
    assert_eq!(future["oldest_revision"], 3);
    served
        .get("/changes?after=6&epoch=2")
        .await
        .refuses(410, "changes_gone");
    served.end().await;
    // The same from the disk alone.
    let served = place.open(Settings::default(), false).await;
    assert_eq!(served.get("/snapshot").await.is(200).body, before);
    assert_eq!(served.get("").await.is(200).body, network.body);
    served.end().await;
}

#[tokio::test]
async fn who_follows_is_listed_with_what_it_refused() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    served.post_zone("z").await;
    served.get("/changes?after=1&edge=north").await.is(200);
    let nack = json!({"revision": 2, "code": "zone_invalid", "object": "zone z", "reason": "it has no shape"});
    let report = json!({"epoch": 1, "revision": 1, "nack": nack});
    served.write("PUT /edges/south", &[], &report).await.is(200);
    let list = async || served.ask("GET /v1/edges", &[], "").await.is(200).json()["edges"].clone();
    let edges = list().await;
    assert_eq!(
        (&edges[0]["id"], &edges[0]["behind"]),
        (&json!("north"), &json!(1))
    );
    assert_eq!(
        (&edges[0]["nack"], &edges[0]["network"]),
        (&Value::Null, &json!(NETWORK))
    );
    assert_eq!(
        (&edges[1]["id"], &edges[1]["nack"]),
        (&json!("south"), &nack)
    );
    // It asks again from where it was: still refused. It has gone beyond: settled.
    served.get("/changes?after=1&edge=south").await.is(200);
    assert_eq!(list().await[1]["nack"], nack);
    served.get("/changes?after=2&edge=south").await.is(200);
    assert_eq!(list().await[1]["nack"], Value::Null);
    served.end().await;
    let served = place.open(Settings::default(), false).await;
    let edges = served.ask("GET /v1/edges", &[], "").await.is(200).json();
    assert_eq!(edges["edges"].as_array().map(Vec::len), Some(2));
    served.end().await;
}
