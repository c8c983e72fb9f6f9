//! A file in which an older version wrote the ids of nodes as integers.

use crate::memory_disk::MemoryDisk;
use crate::stage::{DAWN, EPOCH};
use serde_json::{Value, json};
use skyway::clock::Clock;
use skyway::edge::{Caller, Edge, Opening, Row, Settings, Table, Transaction};
use skyway::formats::{load_network, parse_report};
use skyway::network::bundled::SYDNEY_CBD;
use std::sync::Arc;

/// The members that older versions wrote as integers.
const IDS: [&str; 10] = [
    "node",
    "from",
    "to",
    "enters",
    "nodes",
    "pads",
    "leg",
    "remaining_path",
    "old_path",
    "destination",
];

async fn edge_over(disk: &MemoryDisk) -> Arc<Edge> {
    let topology = load_network(SYDNEY_CBD).expect("a network").topology;
    let clock = Clock::by_hand(DAWN.parse().expect("an instant")).0;
    let settings = Settings::default();
    let opening = Opening::new(
        Arc::new(topology),
        SYDNEY_CBD.into(),
        EPOCH,
        settings,
        clock,
    );
    let edge = Edge::open(opening, disk.open()).await;
    edge.expect("an edge")
}

async fn answer(edge: &Arc<Edge>, body: &Value) -> Value {
    let parsed = parse_report(body.to_string().as_bytes()).expect("a report");
    let answered = edge.report_failure(&Caller::anyone(), parsed).await;
    edge.tick().await.expect("the writer works");
    serde_json::to_value(answered.expect("an outcome").to_wire()).expect("JSON")
}

async fn record(edge: &Arc<Edge>, id: &str) -> Value {
    let record = edge.recomposition(&Caller::anyone(), id, false).await;
    serde_json::to_value(record.expect("a record").to_wire()).expect("JSON")
}

/// The body of a row as an older version wrote it, and how many ids were turned into integers.
fn aged(body: &str) -> (String, usize) {
    let mut value: Value = serde_json::from_str(body).expect("JSON");
    let count = age(&mut value, false);
    (value.to_string(), count)
}

fn age(value: &mut Value, is_id: bool) -> usize {
    match value {
        Value::Object(members) => {
            let aged = members.iter_mut().map(|(name, member)| match member {
                // The answer to a report is kept as text.
                Value::String(text) if name == "answer" => {
                    let (older, count) = aged(text);
                    *text = older;
                    count
                }
                member => age(member, IDS.contains(&name.as_str())),
            });
            aged.sum()
        }
        Value::Array(entries) => entries.iter_mut().map(|entry| age(entry, is_id)).sum(),
        Value::String(text) if is_id => match text.parse::<i64>() {
            Ok(number) => {
                *value = json!(number);
                1
            }
            Err(_) => 0,
        },
        _ => 0,
    }
}

#[tokio::test]
async fn what_an_older_version_kept_is_told_with_ids_as_text() {
    let disk = MemoryDisk::default();
    let edge = edge_over(&disk).await;
    let report = json!({
        "id": "r1", "type": "navigational", "service": {"from": "379", "to": "406"},
        "location": {"node": "379"}, "remaining_path": ["379", "406", "420", "450"],
    });
    let first = answer(&edge, &report).await;
    let kept = record(&edge, first["id"].as_str().expect("an id")).await;
    edge.end().await;

    let mut rows = Vec::new();
    for table in [Table::Replies, Table::Decisions, Table::Parts] {
        for (key, body) in disk.rows(table) {
            let (body, count) = aged(&body);
            assert!(table == Table::Parts || count > 3, "{body}");
            rows.push(Row::put(table, key, body));
        }
    }
    let mut file = disk.open();
    let number = file.number().await.expect("a number") + 1;
    let writer = EPOCH;
    let older = Transaction {
        number,
        writer,
        rows,
    };
    file.commit(&older).await.expect("committed");
    drop(file);

    let edge = edge_over(&disk).await;
    let again = answer(&edge, &report).await;
    assert_eq!(
        (&again["replayed"], &again["path"]),
        (&json!(true), &first["path"])
    );
    assert_eq!(again["first_stretch"], first["first_stretch"]);
    let told = record(&edge, first["id"].as_str().expect("an id")).await;
    for part in ["report", "settled_report"] {
        assert_eq!(told[part], kept[part], "{part}");
    }
    assert_eq!(told["answer"]["path"], kept["answer"]["path"]);
    edge.end().await;
}
