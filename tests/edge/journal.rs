//! What was answered, after a restart.

use crate::memory_disk::{Breakage, MemoryDisk};
use crate::stage::{Stage, circle};
use crate::store_file::Medium;
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Code, Idempotency, Settings, Table, ZoneWrite};
use std::time::Duration;

fn report(id: &str, from: &str, to: &str) -> Value {
    json!({"id": id, "type": "navigational", "service": {"from": from, "to": to}, "destination": "a7", "location": {"x": 150.0, "y": 0.0}})
}

async fn record(stage: &Stage, id: &str, certificate: bool) -> Option<Value> {
    let found = stage
        .edge
        .recomposition(&stage.caller, id, certificate)
        .await;
    found
        .ok()
        .map(|found| serde_json::to_value(found.to_wire()).expect("JSON"))
}

/// Answers in worlds that differ, and their ids.
async fn answers(stage: &Stage) -> Vec<String> {
    let mut ids = Vec::new();
    let mut answer = async |number: usize| {
        let body = json!({"type": "navigational", "service": {"from": "a1", "to": "a2"}, "destination": "a7",
            "id": format!("report-{number}")});
        let answer = stage.answer(body).await;
        ids.push(answer["id"].as_str().expect("an id").to_owned());
    };
    answer(0).await;
    stage.zone(circle("crane", 650.0, 0.0, 10.0)).await;
    answer(1).await;
    answer(2).await;
    stage.zone(circle("fire", 450.0, 100.0, 10.0)).await;
    answer(3).await;
    let (_, etag) = stage.edge.zone(&stage.caller, "crane").expect("a zone");
    let write = || ZoneWrite {
        id: Some("crane".to_owned()),
        if_match: Some(etag.clone()),
        validate_only: false,
    };
    let moved = circle("crane", 650.0, 0.0, 20.0);
    stage
        .edge
        .put_zone(&stage.caller, moved, write())
        .await
        .expect("moved");
    answer(4).await;
    stage
        .edge
        .delete_zone(
            &stage.caller,
            ZoneWrite {
                if_match: Some("*".to_owned()),
                ..write()
            },
            None,
        )
        .await
        .expect("deleted");
    answer(5).await;
    ids
}

#[tokio::test]
async fn every_decision_is_explained_by_its_id_after_restarts() {
    for medium in Medium::both() {
        let mut stage = Stage::over(medium.open().await).await;
        let mut known: Vec<(String, Value)> = Vec::new();
        for _ in 0..3 {
            for id in answers(&stage).await {
                let told = record(&stage, &id, true).await.expect("a record");
                known.push((id, told));
            }
            let fire = ZoneWrite {
                id: Some("fire".to_owned()),
                if_match: Some("*".to_owned()),
                validate_only: false,
            };
            stage
                .edge
                .delete_zone(&stage.caller, fire, None)
                .await
                .expect("deleted");
            stage.edge.end().await;
            stage = stage.again(medium.open().await).await;
            for (id, told) in &known {
                assert_eq!(record(&stage, id, true).await.as_ref(), Some(told), "{id}");
            }
        }
        let zones = |told: &Value| told["world"]["closures"].as_array().map_or(0, Vec::len);
        let counts: Vec<usize> = known.iter().map(|(_, told)| zones(told)).collect();
        assert_eq!(
            counts[..6],
            [0, 1, 1, 2, 2, 1],
            "the worlds of the story differ"
        );
        assert!(
            known
                .iter()
                .all(|(_, told)| told["certificate"].is_object())
        );
        assert_eq!(record(&stage, "7-999", false).await, None);
        assert_eq!(record(&stage, "no id", false).await, None);
    }
}

#[tokio::test]
async fn a_decision_reaches_the_disk_by_itself_and_old_ones_go() {
    let disk = MemoryDisk::default();
    let settings = Settings {
        decisions_bytes_max: 12_000,
        ..Settings::default()
    };
    let stage = Stage::over_with(disk.open(), settings).await;
    let mut ids = Vec::new();
    for number in 0..40 {
        stage
            .zone(circle(
                &format!("z{number}"),
                650.0,
                0.0,
                1.0 + f64::from(number),
            ))
            .await;
        let answer = stage
            .answer(json!({"service": {"from": "a1", "to": "a2"}, "destination": "a3"}))
            .await;
        ids.push(answer["id"].as_str().expect("an id").to_owned());
        let zone = ZoneWrite {
            id: Some(format!("z{number}")),
            if_match: Some("*".to_owned()),
            validate_only: false,
        };
        stage
            .edge
            .delete_zone(&stage.caller, zone, None)
            .await
            .expect("deleted");
    }
    // No request waits for it, so it takes a moment.
    let last = ids.last().expect("an id").clone();
    let number = last.split_once('-').expect("a number").1.to_owned();
    while !disk
        .rows(Table::Decisions)
        .iter()
        .any(|(key, _)| key.ends_with(&format!("0{number}")))
    {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    let kept = disk.rows(Table::Decisions);
    let bytes: usize = kept.iter().map(|(_, body)| body.len()).sum();
    assert!(
        bytes <= 12_000 && kept.len() > 2,
        "{} rows with {bytes} bytes",
        kept.len()
    );
    disk.crash();
    let stage = stage.again(disk.open()).await;
    let told = record(&stage, &last, false)
        .await
        .expect("the last one is kept");
    assert_eq!(told["world"]["closures"][0]["id"], "z39");
    assert_eq!(
        record(&stage, &ids[0], false).await,
        None,
        "the first one is gone"
    );
}

#[tokio::test]
async fn the_parts_of_worlds_go_with_the_last_decision_that_needs_them() {
    let disk = MemoryDisk::default();
    let settings = Settings {
        decisions_bytes_max: 12_000,
        ..Settings::default()
    };
    let stage = Stage::over_with(disk.open(), settings).await;
    for number in 0..200 {
        let radius_m = 1.0 + f64::from(number) / 10.0;
        let write = ZoneWrite {
            id: Some("z".to_owned()),
            if_match: (number > 0).then(|| "*".to_owned()),
            validate_only: false,
        };
        stage
            .edge
            .put_zone(&stage.caller, circle("z", 650.0, 0.0, radius_m), write)
            .await
            .expect("a zone");
        stage
            .answer(json!({"service": {"from": "a1", "to": "a2"}, "destination": "a3"}))
            .await;
    }
    stage.edge.end().await;
    let (parts, spans) = (disk.rows(Table::Parts).len(), disk.rows(Table::Spans).len());
    assert_eq!(parts, spans);
    assert!(parts < 100, "{parts} of 200 are kept");
}

#[tokio::test]
async fn a_repeated_report_gets_the_same_answer_after_a_restart_while_its_path_is_open() {
    for medium in Medium::both() {
        let stage = Stage::over(medium.open().await).await;
        let first = stage.answer(report("r1", "a1", "a2")).await;
        stage.edge.end().await;
        let stage = stage.again(medium.open().await).await;
        let mut second = stage.answer(report("r1", "a1", "a2")).await;
        assert_eq!(second["replayed"], true);
        second["replayed"] = json!(false);
        assert_eq!(first.to_string(), second.to_string(), "to the byte");
        let other = stage.answer(report("r1", "a2", "a3")).await;
        assert_eq!(other["publication"]["reason"], "id_reused");

        stage
            .zone(circle("over-the-detour", 150.0, 100.0, 10.0))
            .await;
        let third = stage.answer(report("r1", "a1", "a2")).await;
        assert_eq!(third["replayed"], false, "its path is closed: {third}");
        assert_eq!(third["publication"]["reason"], "sent_before");
        stage.edge.end().await;
        let stage = stage.again(medium.open().await).await;
        let mut fourth = stage.answer(report("r1", "a1", "a2")).await;
        fourth["replayed"] = json!(false);
        assert_eq!(third.to_string(), fourth.to_string(), "the latest one");
        stage.pass(SignedDuration::from_secs(61)).await;
        let late = stage.answer(report("r1", "a1", "a2")).await;
        assert_eq!(late["replayed"], false, "it is not valid any more: {late}");
        stage.hand.advance(SignedDuration::from_hours(25));
        stage.edge.end().await;
        let stage = stage.again(medium.open().await).await;
        assert_eq!(
            stage.answer(report("r1", "a1", "a2")).await["replayed"],
            false,
            "a day is over"
        );
    }
}

#[tokio::test]
async fn a_write_with_a_key_is_done_once_over_restarts() {
    for medium in Medium::both() {
        let stage = Stage::over(medium.open().await).await;
        let key = |fingerprint: u8| Idempotency {
            key: Some("k1".to_owned()),
            fingerprint: [fingerprint; 32],
        };
        let mut unnamed = circle("", 250.0, 0.0, 10.0);
        unnamed.as_object_mut().expect("an object").remove("id");
        let first = stage
            .edge
            .create_zone(&stage.caller, unnamed.clone(), ZoneWrite::default(), key(1))
            .await;
        let first = first.expect("a zone");
        stage.edge.end().await;
        let stage = stage.again(medium.open().await).await;
        let second = stage
            .edge
            .create_zone(&stage.caller, unnamed.clone(), ZoneWrite::default(), key(1))
            .await;
        assert_eq!(first, second.expect("the same answer"));
        let zones = stage
            .edge
            .zones(&stage.caller, &Default::default())
            .expect("zones");
        assert_eq!(zones.features.len(), 1);
        let other = stage
            .edge
            .create_zone(&stage.caller, unnamed, ZoneWrite::default(), key(2))
            .await;
        assert_eq!(
            other.expect_err("another body").code,
            Code::IdempotencyMismatch
        );
    }
}

#[tokio::test]
async fn what_is_answered_while_the_disk_fails_is_noted_when_it_works_again() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    disk.set(Breakage::Full);
    let answer = stage.answer(report("r1", "a1", "a2")).await;
    while stage.edge.status().store.failing.is_none() {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    disk.set(Breakage::None);
    while stage.edge.status().store.failing.is_some() {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    disk.crash();
    let stage = stage.again(disk.open()).await;
    let id = answer["id"].as_str().expect("an id");
    assert!(record(&stage, id, false).await.is_some());
    assert_eq!(stage.edge.status().store.journal_lost, 0);
    assert_eq!(
        stage.answer(report("r1", "a1", "a2")).await["replayed"],
        true
    );
}
