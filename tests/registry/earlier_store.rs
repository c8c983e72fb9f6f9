//! A store file that an earlier version wrote, and this one opens: `stores/2026-11-21.db`, by the first version whose edges
//! kept one.

#![expect(
    clippy::disallowed_methods,
    reason = "the test copies a file that an earlier version wrote"
)]

use crate::drafts::NETWORK;
use crate::harness::{Place, Told};
use serde_json::json;
use skyway::registry::Settings;
use skyway::registry::documents::DocumentKind;

const WRITTEN: &[u8] = include_bytes!("stores/2026-11-21.db");

/// The kinds and ids of the log, in its order.
fn logged(told: &Told) -> Vec<(String, String)> {
    let page = told.json();
    let changes = page["changes"].as_array().expect("changes").iter();
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    changes
        .map(|change| (text(&change["kind"]), text(&change["id"])))
        .collect()
}

#[tokio::test]
async fn the_log_of_an_earlier_version_is_followed_and_written_on() {
    let place = Place::new();
    std::fs::write(place.store(), WRITTEN).expect("a copy");
    let before = [
        ("network", ""),
        ("zone", "fire"),
        ("zone", "gone"),
        ("zone", "gone"),
        ("closure", "works"),
    ];
    let mut expected = before
        .map(|(kind, id)| (kind.to_owned(), id.to_owned()))
        .to_vec();
    let served = place.open(Settings::default(), false).await;
    served.ask("GET /readyz", &[], "").await.is(200);
    let page = served.get("/changes?after=0").await.is(200);
    assert_eq!(logged(&page), expected);
    assert_eq!(page.json()["epoch"], 1, "nothing was lost");
    let zones = served.get("/zones").await.is(200).json();
    assert_eq!(zones["objects"][0]["id"], "fire");
    assert_eq!(zones["objects"].as_array().map(Vec::len), Some(1));
    served.post_zone("new").await;
    expected.push(("zone".to_owned(), "new".to_owned()));
    served.end().await;

    let served = place.open(Settings::default(), false).await;
    let page = served.get("/changes?after=0").await.is(200);
    assert_eq!(logged(&page), expected);
    let snapshot = served.get("/snapshot").await.is(200).json();
    assert_eq!(snapshot["object_count"], 4, "{snapshot}");
    // It has room for documents since, and for where edges are reached.
    let documents = served.registry.documents();
    let count = documents.count_documents(DocumentKind::Delivery, None);
    assert_eq!(count.await, Ok(0));
    assert_eq!(documents.next_due().await, Ok(None));
    let report = json!({"epoch": 1, "revision": 1, "url": "http://127.0.0.1:8080"});
    served.write("PUT /edges/e1", &[], &report).await.is(200);
    let edges = served.registry.edges_of(NETWORK).await.expect("answers");
    let urls: Vec<Option<&str>> = edges.iter().map(|edge| edge.url.as_deref()).collect();
    assert_eq!(urls, [Some("http://127.0.0.1:8080")]);
    served.end().await;
}
