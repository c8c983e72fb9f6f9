//! Feeds of zones that are imported while the network changes, and what they have no more.

use crate::stage::{Stage, circle, loaded};
use crate::topology::renumbered;
use serde_json::{Value, json};
use skyway::edge::{
    Code, Decision, FeedImport, Idempotency, PageRequest, Refusal, Settings, ZoneWrite,
};
use skyway::wire;

#[tokio::test]
async fn a_feed_that_is_read_on_the_old_network_closes_the_same_places_of_the_new() {
    // Some of them are read before the change and carried out after it.
    for _ in 0..30 {
        let stage = Stage::set();
        let mut odd = circle("odd", 250.0, 100.0, 5.0);
        odd["properties"]["upper_m"] = json!("high");
        let feed = json!({"type": "FeatureCollection", "features": [circle("crane", 450.0, 100.0, 5.0), odd]});
        let import = FeedImport {
            feed: "city".to_owned(),
            ..FeedImport::default()
        };
        let change = stage.edge.replace_network(loaded(&renumbered()));
        let import = stage
            .edge
            .import_zones(&stage.caller, feed.to_string(), import);
        let (change, imported) = tokio::join!(change, import);
        change.expect("put into service");
        imported.expect("imported");
        stage.settle().await;
        let page = PageRequest::default();
        let proposals = stage.edge.proposals(&stage.caller, &page);
        let proposal = proposals.expect("proposals").proposals[0].id.to_string();
        let accepted = stage
            .edge
            .decide_proposal(&stage.caller, &proposal, Decision::Accept);
        accepted.await.expect("accepted");
        for (zone, segment) in [("crane", "b4-b5"), ("odd", "b2-b3")] {
            let closure = stage.edge.closure(&stage.caller, zone);
            assert_eq!(closure.expect("in force").segments, [segment]);
        }
    }
}

/// Imports a feed of this many zones beside each other, and of some that are refused.
async fn import(stage: &Stage, sound: usize, refused: &[usize]) -> wire::ImportCounts {
    let zone = |number: usize| circle(&format!("z{number}"), 5.0 * number as f64, 50.0, 1.0);
    let odd = |number: &usize| {
        let mut zone = zone(*number);
        zone["properties"]["upper_m"] = json!("high");
        zone
    };
    let zones: Vec<Value> = (0..sound)
        .map(zone)
        .chain(refused.iter().map(odd))
        .collect();
    let feed = json!({"type": "FeatureCollection", "features": zones}).to_string();
    let import = FeedImport {
        feed: "city".to_owned(),
        ..FeedImport::default()
    };
    let told = stage.edge.import_zones(&stage.caller, feed, import);
    told.await.expect("imported").counts
}

fn standing(stage: &Stage) -> usize {
    stage.edge.snapshot().airspace().closures().count()
}

fn holds(stage: &Stage) -> Vec<wire::Hold<'static>> {
    let held = stage.edge.holds(&stage.caller, &PageRequest::default());
    held.expect("holds").holds
}

#[tokio::test]
async fn held_removals_wait_also_where_the_feed_has_some_of_them_again() {
    let stage = Stage::set();
    import(&stage, 50, &[]).await;
    assert_eq!(import(&stage, 38, &[]).await.held, 12);
    let counts = import(&stage, 41, &[]).await;
    assert_eq!((counts.held, counts.removed), (9, 0), "{counts:?}");
    let held = holds(&stage);
    assert_eq!((held.len(), held[0].closure_count), (1, 9), "{held:?}");
    assert_eq!(standing(&stage), 50);
    // What waits makes no further removals many.
    let counts = import(&stage, 40, &[]).await;
    assert_eq!((counts.held, counts.removed), (9, 1), "{counts:?}");
}

#[tokio::test]
async fn a_zone_that_the_feed_has_again_is_not_lifted_though_it_is_refused() {
    let stage = Stage::set();
    import(&stage, 50, &[]).await;
    import(&stage, 38, &[]).await;
    let counts = import(&stage, 38, &[40, 41]).await;
    assert_eq!((counts.kept, counts.held), (2, 10), "{counts:?}");
    let held = holds(&stage);
    assert_eq!(held[0].closure_count, 10, "{held:?}");
    let released = stage
        .edge
        .decide_hold(&stage.caller, &held[0].id, Decision::Accept);
    released.await.expect("released");
    assert_eq!(standing(&stage), 40);
    stage.edge.zone(&stage.caller, "z40").expect("kept");
}

/// What is said to a zone: to its check, to its preview, and to itself.
async fn said(stage: &Stage, id: &str) -> [Option<Code>; 3] {
    let zone = || circle(id, 50.0, 50.0, 1.0);
    let create = |validate_only| {
        let write = ZoneWrite {
            validate_only,
            ..ZoneWrite::default()
        };
        stage
            .edge
            .create_zone(&stage.caller, zone(), write, Idempotency::default())
    };
    let code = |refusal: Refusal| refusal.code;
    let checked = create(true).await.err().map(code);
    let seen = stage.edge.preview_zone(&stage.caller, zone()).await;
    [
        checked,
        seen.err().map(code),
        create(false).await.err().map(code),
    ]
}

#[tokio::test]
async fn a_preview_is_refused_what_is_refused_afterwards() {
    let settings = Settings {
        zones_max: 2,
        ..Settings::default()
    };
    let stage = Stage::with(settings);
    let draft = json!({"id": "works", "segments": ["a2-a3"]});
    let draft = serde_json::from_value(draft).expect("a draft");
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    closed.await.expect("a closure");
    assert_eq!(said(&stage, "works").await, [Some(Code::AlreadyExists); 3]);
    for id in ["one", "two"] {
        assert_eq!(said(&stage, id).await, [None; 3], "{id}");
    }
    assert_eq!(said(&stage, "three").await, [Some(Code::LimitReached); 3]);
    // Another version of one that stands needs no room.
    let seen = stage
        .edge
        .preview_zone(&stage.caller, circle("one", 50.0, 0.0, 1.0));
    seen.await.expect("a preview");
    for validate_only in [true, false] {
        let import = FeedImport {
            feed: "city".to_owned(),
            validate_only,
            ..FeedImport::default()
        };
        let feed = circle("three", 50.0, 50.0, 1.0).to_string();
        let told = stage.edge.import_zones(&stage.caller, feed, import).await;
        assert_eq!(told.expect_err("full").code, Code::LimitReached);
    }
}
