//! A disk that is full, hangs, or says that it failed: airspace stays closed, and no caller is told what is not so.

use crate::memory_disk::{Breakage, MemoryDisk};
use crate::stage::{Stage, circle};
use crate::store_file::Medium;
use serde_json::json;
use skyway::edge::{Code, Decision, Idempotency, PageRequest, Refusal, Table, ZoneWrite};
use std::time::Duration;

async fn put(stage: &Stage, id: &str, x: f64) -> Result<bool, Refusal> {
    let zone = circle(id, x, 0.0, 5.0);
    let write = ZoneWrite::default();
    let put = stage
        .edge
        .create_zone(&stage.caller, zone, write, Idempotency::default());
    put.await.map(|ack| ack.durable)
}

async fn delete(stage: &Stage, id: &str) -> Result<(), Refusal> {
    let write = ZoneWrite {
        id: Some(id.to_owned()),
        if_match: Some("*".to_owned()),
        validate_only: false,
    };
    stage
        .edge
        .delete_zone(&stage.caller, write, None)
        .await
        .map(drop)
}

async fn resize(stage: &Stage, id: &str, radius_m: f64) -> Result<(), Refusal> {
    let write = ZoneWrite {
        id: Some(id.to_owned()),
        if_match: Some("*".to_owned()),
        validate_only: false,
    };
    let zone = circle(id, 350.0, 0.0, radius_m);
    stage
        .edge
        .put_zone(&stage.caller, zone, write)
        .await
        .map(drop)
}

async fn compose(stage: &Stage, id: &str) -> Result<(), Refusal> {
    let request = serde_json::from_value(json!({"id": id, "source": "a0", "destination": "a1"}));
    let composed = stage.edge.compose_plan(
        &stage.caller,
        request.expect("a request"),
        Idempotency::default(),
    );
    composed.await.map(drop)
}

fn code<T>(answer: Result<T, Refusal>) -> (Code, bool) {
    let refusal = answer.err().expect("a refusal");
    (refusal.code, refusal.enforced)
}

/// Waits for the storekeeper, which tries again by itself.
async fn recovered(stage: &Stage) {
    while stage.edge.status().store.failing.is_some() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

#[tokio::test]
async fn a_full_disk_keeps_no_airspace_from_closing_and_opens_none() {
    for breakage in [Breakage::Full, Breakage::Doubtful, Breakage::Hanging] {
        let disk = MemoryDisk::default();
        let stage = Stage::impatient(disk.open()).await;
        assert_eq!(put(&stage, "before", 350.0).await, Ok(true));
        compose(&stage, "p0").await.expect("a plan");
        disk.set(breakage);
        // The first one finds out; it is enforced all the same.
        assert_eq!(
            code(put(&stage, "first", 150.0).await),
            (Code::NotDurable, true),
            "{breakage:?}"
        );
        let status = stage.edge.status();
        assert!(
            !status.store.durable && status.store.failing.is_some(),
            "{status:?}"
        );
        assert_eq!(
            code(put(&stage, "second", 250.0).await),
            (Code::NotDurable, true)
        );
        assert_eq!(
            code(resize(&stage, "before", 60.0).await),
            (Code::NotDurable, true),
            "it grows"
        );
        let airspace = stage.edge.snapshot().airspace().clone();
        assert!(
            ["before", "first", "second"]
                .iter()
                .all(|id| airspace.is_in_force(id))
        );
        // What a restart must not undo is refused, and nothing of it happens.
        assert_eq!(
            code(delete(&stage, "before").await),
            (Code::StoreFull, false)
        );
        assert_eq!(
            code(resize(&stage, "before", 5.0).await),
            (Code::StoreFull, false)
        );
        assert_eq!(code(compose(&stage, "p1").await), (Code::StoreFull, false));
        let cancelled = stage
            .edge
            .cancel_plan(&stage.caller, "p0", Default::default())
            .await;
        assert_eq!(code(cancelled), (Code::StoreFull, false));
        assert!(stage.edge.plan(&stage.caller, "p1").is_err());
        assert!(stage.edge.snapshot().airspace().is_in_force("before"));
        // Answers go on.
        let report = json!({"service": {"from": "b0", "to": "b1"}, "destination": "b4"});
        assert_eq!(stage.answer(report).await["outcome"], "rerouted");

        disk.set(Breakage::None);
        recovered(&stage).await;
        assert_eq!(put(&stage, "after", 550.0).await, Ok(true));
        delete(&stage, "second").await.expect("as before");
        compose(&stage, "p1").await.expect("as before");
        disk.crash();
        let stage = stage.again(disk.open()).await;
        let zones = stage
            .edge
            .zones(&stage.caller, &PageRequest::default())
            .expect("zones")
            .features;
        let ids: Vec<&str> = zones
            .iter()
            .filter_map(|zone| zone["id"].as_str())
            .collect();
        assert_eq!(ids, ["after", "before", "first"], "{breakage:?}");
        assert_eq!(zones[1]["properties"]["radius_m"], 60.0);
    }
}

#[tokio::test]
async fn a_plan_under_way_when_the_disk_breaks_is_not_told_as_stored() {
    for breakage in [Breakage::Full, Breakage::Hanging] {
        let disk = MemoryDisk::default();
        let stage = Stage::impatient(disk.open()).await;
        disk.set(breakage);
        assert_eq!(
            code(compose(&stage, "p1").await),
            (Code::NotDurable, true),
            "{breakage:?}"
        );
        assert!(disk.rows(Table::Plans).is_empty());
        disk.set(Breakage::None);
        recovered(&stage).await;
        assert_eq!(
            disk.rows(Table::Plans).len(),
            1,
            "stored as soon as the disk took it"
        );
    }
}

#[tokio::test]
async fn decisions_wait_for_a_disk_that_works() {
    let disk = MemoryDisk::default();
    let stage = Stage::impatient(disk.open()).await;
    let brought = json!({"type": "regulatory", "service": {"from": "a3", "to": "a4"}, "destination": "a7",
        "zone": circle("brought", 300.0, 0.0, 5.0)});
    let answer = stage.answer(brought).await;
    let id = answer["publication"]["proposal_ids"][0]
        .as_str()
        .expect("an id")
        .to_owned();
    disk.set(Breakage::Full);
    put(&stage, "z", 150.0).await.expect_err("not stored");
    let decided = stage
        .edge
        .decide_proposal(&stage.caller, &id, Decision::Accept)
        .await;
    assert_eq!(code(decided), (Code::StoreFull, false));
    disk.set(Breakage::None);
    recovered(&stage).await;
    stage
        .edge
        .decide_proposal(&stage.caller, &id, Decision::Accept)
        .await
        .expect("decided");
}

#[tokio::test]
async fn an_edge_without_a_file_says_that_nothing_is_durable() {
    let stage = Stage::set();
    assert_eq!(put(&stage, "z", 150.0).await, Ok(false));
    let status = stage.edge.status();
    assert!(!status.store.kept && !status.store.durable);
}

#[tokio::test]
async fn of_two_edges_on_one_file_the_first_one_stores_nothing_more_and_says_so() {
    for medium in Medium::both() {
        let first = Stage::over(medium.open().await).await;
        assert_eq!(put(&first, "one", 150.0).await, Ok(true));
        let second = Stage::over(medium.open().await).await;
        for id in ["two", "three"] {
            assert_eq!(code(put(&first, id, 250.0).await), (Code::NotDurable, true));
        }
        let failing = first.edge.status().store.failing.expect("a reason");
        assert!(failing.contains("another edge"), "{failing}");
        assert_eq!(put(&second, "four", 350.0).await, Ok(true));
        second.edge.end().await;
        first.edge.end().await;
        let third = second.again(medium.open().await).await;
        let zones = third
            .edge
            .zones(&third.caller, &PageRequest::default())
            .expect("zones")
            .features;
        let ids: Vec<&str> = zones
            .iter()
            .filter_map(|zone| zone["id"].as_str())
            .collect();
        assert_eq!(ids, ["four", "one"]);
    }
}

#[tokio::test]
async fn a_zone_that_could_not_be_stored_is_not_made_again_under_the_same_key() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    disk.set(Breakage::Full);
    let mut unnamed = circle("", 350.0, 0.0, 5.0);
    unnamed.as_object_mut().expect("an object").remove("id");
    for _ in 0..2 {
        let key = Idempotency {
            key: Some("k1".to_owned()),
            fingerprint: [1; 32],
        };
        let (zone, write) = (unnamed.clone(), ZoneWrite::default());
        let put = stage.edge.create_zone(&stage.caller, zone, write, key);
        assert_eq!(code(put.await), (Code::NotDurable, true));
    }
    let zones = stage.edge.zones(&stage.caller, &PageRequest::default());
    assert_eq!(zones.expect("a list").features.len(), 1);
}
