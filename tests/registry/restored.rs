//! A store that was restored from a backup, and one that was exchanged for another.
#![expect(
    clippy::disallowed_methods,
    reason = "a test copies the file of a store, as a backup does"
)]

use crate::drafts::NETWORK;
use crate::harness::{Place, Served};
use serde_json::Value;
use skyway::clock::Clock;
use skyway::registry::{
    HighWater, OpenError, Opening, Registry, Settings, WriteOptions, open_store,
};

async fn summary(served: &Served) -> Value {
    served.ask("GET /v1/networks", &[], "").await.is(200).json()
}

#[tokio::test]
async fn a_restored_store_begins_a_new_epoch_by_itself() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let kept = served.post_zone("kept").await.etag();
    served.end().await;
    let backup = place.path().join("backup.db");
    std::fs::copy(place.store(), &backup).expect("copied");
    let served = place.open(Settings::default(), false).await;
    assert_eq!(
        summary(&served).await["epoch"],
        1,
        "nothing was lost, so nothing is new"
    );
    let lost = served.post_zone("lost").await.etag();
    assert_eq!(lost, "\"1-3\"");
    served.end().await;

    std::fs::copy(&backup, place.store()).expect("restored");
    let served = place.open(Settings::default(), false).await;
    assert_eq!(summary(&served).await["epoch"], 2);
    // A follower at revision 3 of the first epoch is sent to the snapshot, also once there is another revision 3.
    served
        .get("/changes?after=3&epoch=1")
        .await
        .refuses(410, "changes_gone");
    let other = served.post_zone("other").await.etag();
    assert_eq!(other, "\"2-3\"");
    served
        .get("/changes?after=3&epoch=1")
        .await
        .refuses(410, "changes_gone");
    served.get("/changes?after=2&epoch=2").await.is(200);
    // Versions from before stay what they were, and none comes again.
    assert_eq!(served.get("/zones/kept").await.is(200).etag(), kept);
    served
        .write("DELETE /zones/other", &[("if-match", &lost)], &Value::Null)
        .await
        .is(412);
    served.end().await;
    let served = place.open(Settings::default(), false).await;
    assert_eq!(summary(&served).await["epoch"], 2, "and only once");
    served.end().await;
    let served = place.open(Settings::default(), true).await;
    assert_eq!(
        summary(&served).await["epoch"],
        3,
        "or because someone says so"
    );
    served.end().await;
}

/// A commit of which nothing is remembered yet: a kill came first, or another process made it.
#[tokio::test]
async fn what_a_follower_was_told_is_missed_when_it_is_lost() {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    served.post_zone("kept").await;
    served.end().await;
    let restored = Place::new();
    std::fs::copy(place.store(), restored.store()).expect("copied");
    let served = place.open(Settings::default(), false).await;
    let beside = Registry::open(Opening {
        store: open_store(&place.store().display().to_string())
            .await
            .expect("a store"),
        settings: Settings::default(),
        clock: Clock::real(),
        high_water: None,
        new_epoch: false,
    });
    let beside = beside.await.expect("a registry");
    let feature = crate::harness::circle("seen", 10.0);
    let manner = WriteOptions::default();
    let put = beside.put_zone(NETWORK, Some("seen"), feature, &manner);
    put.await.expect("a zone");
    let told = served.get("/changes?after=2&epoch=1").await.is(200).json();
    assert_eq!(told["revision"], 3);
    served.end().await;
    let mark = |place: &Place| place.path().join("high-water");
    std::fs::copy(mark(&place), mark(&restored)).expect("copied");
    let served = restored.open(Settings::default(), false).await;
    assert_eq!(summary(&served).await["epoch"], 2);
    served.end().await;
}

#[tokio::test]
async fn another_store_under_the_same_name_is_refused() {
    let place = Place::new();
    Served::with_network(&place, Settings::default())
        .await
        .end()
        .await;
    let another = Place::new();
    let name = another.store().display().to_string();
    let opened = Registry::open(Opening {
        store: open_store(&name).await.expect("a store"),
        settings: Settings::default(),
        clock: Clock::real(),
        high_water: Some(HighWater::at(place.path().join("high-water"))),
        new_epoch: false,
    });
    let error = opened.await.expect_err("of another registry");
    assert!(matches!(error, OpenError::Foreign { .. }), "{error}");
    assert!(!error.to_string().contains(NETWORK));
}
