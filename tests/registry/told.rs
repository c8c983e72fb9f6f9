//! What edges tell of drones and failures, over HTTP, and what is worked out of it.

use crate::drafts::NETWORK;
use crate::harness::Place;
use crate::market::{NOW_MS, delivery, drone, put, served};
use bytes::Bytes;
use flate2::Compression;
use flate2::write::GzEncoder;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::{Value, json};
use skyway::registry::documents::{Commit, Committed, FailureRow};
use std::io::Write;

#[tokio::test]
async fn positions_are_taken_compressed_and_read_in_parts() {
    let place = Place::new();
    let served = served(&place).await;
    put(&served, "/v1/drones/acme:7", None, &drone())
        .await
        .is(201);
    let entry = |at_ms: i64| json!({"drone_id": "acme:7", "at_ms": at_ms, "lon": 1.0, "lat": 2.0, "battery_fraction": 0.5});
    let mut entries: Vec<Value> = (1..=10)
        .map(|second| entry(NOW_MS - 1000 * second))
        .collect();
    // A clock that is wrong, and a place that is none.
    entries.push(entry(0));
    entries.push(json!({"drone_id": "acme:7", "at_ms": NOW_MS, "lon": 1e9, "lat": 2.0}));
    let batch = json!({"positions": entries, "left_out": 3}).to_string();
    let path = format!("/v1/networks/{NETWORK}/edges/e1/positions");
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(batch.as_bytes()).expect("memory");
    let packed = gzip.finish().expect("memory");
    let told = served
        .post_bytes(&path, "gzip", packed.clone())
        .await
        .is(200);
    assert_eq!(told.json(), json!({"stored": 10}));
    let again = served.post_bytes(&path, "gzip", packed).await.is(200);
    assert_eq!(again.json(), json!({"stored": 0}));
    served
        .post_bytes(&path, "br", vec![1])
        .await
        .refuses(415, "media_type_unsupported");
    served
        .post_bytes(&path, "gzip", vec![1])
        .await
        .refuses(400, "body_invalid");
    let mut bomb = GzEncoder::new(Vec::new(), Compression::default());
    bomb.write_all(&vec![b' '; 9 << 20]).expect("memory");
    let bomb = bomb.finish().expect("memory");
    served
        .post_bytes(&path, "gzip", bomb)
        .await
        .refuses(413, "body_too_large");

    let mut next = Some("?limit=4".to_owned());
    let mut times = Vec::new();
    while let Some(query) = next {
        let line = format!("GET /v1/drones/acme:7/positions{query}");
        let page = served.ask(&line, &[], "").await.is(200).json();
        let positions = page["positions"].as_array().expect("positions");
        assert!(positions.len() <= 4);
        times.extend(positions.iter().filter_map(|entry| entry["at_ms"].as_i64()));
        next = page["next_from"]
            .as_str()
            .map(|from| format!("?limit=4&from={from}"));
    }
    let expected: Vec<i64> = (1..=10)
        .rev()
        .map(|second| NOW_MS - 1000 * second)
        .collect();
    assert_eq!(times, expected);
    let line = "GET /v1/drones/acme:7";
    let tag = served.ask(line, &[], "").await.is(200).etag();
    let known = [("if-none-match", &*tag)];
    // It may be elsewhere by now, in the same version.
    served.ask(line, &known, "").await.is(200);
    let seen = served
        .ask("GET /v1/drones/acme:7", &[], "")
        .await
        .is(200)
        .json();
    assert_eq!(seen["last"]["at"], "2026-11-27T17:59:59Z");
    let listed = served.ask("GET /v1/drones", &[], "").await.is(200).json();
    assert_eq!(listed["drones"][0]["last"], seen["last"]);
    served.end().await;
}

const PARQUET: &str = "application/vnd.apache.parquet";

/// The rows of a Parquet file.
fn rows_of(file: Bytes) -> Vec<Vec<Value>> {
    let reader = SerializedFileReader::new(file).expect("a file");
    let value = |field: &Field| match field {
        Field::Null => Value::Null,
        Field::Str(text) => json!(text),
        Field::Long(count) => json!(count),
        Field::Double(number) => json!(number),
        other => panic!("{other}"),
    };
    let rows = reader
        .get_row_iter(None)
        .expect("rows")
        .map(|row| row.expect("a row"));
    rows.map(|row| {
        row.get_column_iter()
            .map(|(_, field)| value(field))
            .collect()
    })
    .collect()
}

#[tokio::test]
async fn statistics_have_intervals() {
    let place = Place::new();
    let served = served(&place).await;
    let failures = (0..10).map(|number| FailureRow {
        network: NETWORK.to_owned(),
        edge: "e1".to_owned(),
        lineage: 1,
        number,
        at_ms: NOW_MS - 3_600_000,
        failure_type: "environmental".to_owned(),
        segment: "a-b".to_owned(),
        outcome: "rerouted".to_owned(),
    });
    let commit = Commit {
        failures: failures.collect(),
        ..Commit::default()
    };
    let committed = served.registry.documents().commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
    let made_ms = NOW_MS - 3_600_000;
    for (number, late_min) in [(1, 5), (2, -5), (3, 20)] {
        let arrived = format!("2026-11-27T17:{:02}:00Z", 30 + late_min);
        let body = json!({"promised_at": "2026-11-27T17:30:00Z", "proof": {"at": arrived}});
        delivery(
            &served,
            &format!("d{made_ms:012x}{number}"),
            "delivered",
            body,
        )
        .await;
    }
    let told = served
        .ask(&format!("GET /v1/networks/{NETWORK}/statistics"), &[], "")
        .await
        .is(200)
        .json();
    let rate = &told["failures"][0];
    assert_eq!(
        (&rate["segment"], &rate["hour"], &rate["failures"]),
        (&json!("a-b"), &json!(17), &json!(10))
    );
    let per_day = rate["per_day"].as_f64().expect("a number");
    assert!((per_day - 10.0 / 30.0).abs() < 1e-9, "{rate}");
    let late = &told["lateness"][0];
    assert_eq!(late["service_id"], "acme:express");
    assert_eq!(
        (&late["on_time"]["count"], &late["on_time"]["of"]),
        (&json!(1), &json!(3))
    );
    assert_eq!(
        (&late["median_s"], &late["p95_s"]),
        (&json!(300.0), &json!(1200.0))
    );
    let rate = [json!("a-b"), json!(17), json!("environmental"), json!(10)];
    let bounds =
        ["per_day", "low_per_day", "high_per_day"].map(|name| told["failures"][0][name].clone());
    let failures = [&rate[..], &bounds].concat();
    let shares = ["count", "of", "fraction", "low_fraction", "high_fraction"];
    let shares = shares.map(|name| late["on_time"][name].clone());
    let times = [json!(300.0), json!(1200.0)];
    let lateness = [&[json!("acme:express")][..], &shares, &times].concat();
    for (query, row) in [
        ("", &failures),
        ("?table=failures", &failures),
        ("?table=lateness", &lateness),
    ] {
        let line = format!("GET /v1/networks/{NETWORK}/statistics{query}");
        let file = served.ask(&line, &[("accept", PARQUET)], "").await.is(200);
        assert_eq!(file.header("content-type"), PARQUET);
        assert_eq!(rows_of(file.bytes), std::slice::from_ref(row), "{query}");
    }
    let line = format!("GET /v1/networks/{NETWORK}/statistics?from=2027-01-01T00:00:00Z");
    served
        .ask(&line, &[], "")
        .await
        .refuses(400, "parameter_invalid");
    served.end().await;
}
