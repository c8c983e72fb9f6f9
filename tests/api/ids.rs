//! Ids are told as text, and read as text or as integers: every JSON answer of this suite is looked through.

use crate::events::{field, frames};
use crate::harness::Api;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Members that are an id wherever they stand.
const ONE: [&str; 9] = [
    "id",
    "node",
    "from",
    "to",
    "enters",
    "rejoins",
    "source",
    "destination",
    "segment",
];
/// Members that are ids where they are a list; beside a count of the same name.
const MANY: [&str; 10] = [
    "ids",
    "nodes",
    "segments",
    "pads",
    "leg",
    "remaining_path",
    "old_path",
    "close",
    "closed_nodes",
    "removed_nodes",
];

/// Where an answer tells an id as a number.
///
/// A network in GeoJSON is a file, which has its ids as its author wrote them; a description has examples of
/// what may be sent.
pub(crate) fn numbers_for_ids(answer: &Value) -> Vec<String> {
    let mut found = Vec::new();
    if answer.get("skyway").is_none() && answer.get("openapi").is_none() {
        look(answer, "", &mut found);
    }
    found
}

fn look(value: &Value, pointer: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(members) => {
            // The compact form of a network has its pads and ends by index.
            let is_compact = members.contains_key("ids") && members.contains_key("coordinates");
            for (name, member) in members {
                let pointer = format!("{pointer}/{name}");
                let is_list = MANY.contains(&name.as_str()) && (name == "ids" || !is_compact);
                let ids: &[Value] = match member {
                    Value::Array(entries) if is_list => entries,
                    Value::Number(_) if ONE.contains(&name.as_str()) => {
                        std::slice::from_ref(member)
                    }
                    _ => &[],
                };
                let is_number = |id: &Value| match id {
                    Value::Array(pair) => pair.iter().any(Value::is_number),
                    other => other.is_number(),
                };
                if ids.iter().any(is_number) {
                    found.push(format!("{pointer}: {member}"));
                }
                look(member, &pointer, found);
            }
        }
        Value::Array(entries) => {
            for (place, entry) in entries.iter().enumerate() {
                look(entry, &format!("{pointer}/{place}"), found);
            }
        }
        _ => {}
    }
}

/// The report of a failure on a leg, told with these ids.
fn report(id: &str, [from, to, end]: [Value; 3], closed: &Value) -> Value {
    json!({
        "id": id, "type": "navigational", "timestamp": "2026-11-27T18:00:00Z",
        "service": {"from": from, "to": to}, "location": {"node": from}, "node": to,
        "destination": end, "remaining_path": [from, to, end], "close": [closed, [from, to]],
    })
}

#[test]
fn a_number_is_found_wherever_an_id_stands() {
    let told = json!({
        "path": {"nodes": ["1", 2], "segments": ["1-2"]}, "first_stretch": {"enters": 7},
        "leg": [1, "2"], "counts": {"nodes": 2}, "service": {"leg": 3}, "close": [["1", 2]],
        "network": {"ids": [], "coordinates": [], "pads": [1], "segments": [0, 1]},
    });
    let found = numbers_for_ids(&told);
    let mut pointers: Vec<&str> = found.iter().filter_map(|at| at.split(':').next()).collect();
    pointers.sort_unstable();
    assert_eq!(
        pointers,
        ["/close", "/first_stretch/enters", "/leg", "/path/nodes"]
    );
}

#[tokio::test]
async fn every_answer_about_a_delivery_has_its_ids_as_text() {
    let api = Api::start().await;
    let asked = report("r1", [json!(379), json!(406), json!(450)], &json!(291));
    let answer = api.post("/v1/failures", &asked).await.is(200).json();
    let record = format!(
        "/v1/recompositions/{}?certificate=true",
        answer["id"].as_str().expect("an id")
    );
    let plan = json!({"id": "p1", "source": 379, "destination": 450, "drone_id": "drone-7"});
    api.post("/v1/plans", &plan).await.is(201);
    let closure = json!({"id": "c1", "reason": "crane", "segments": ["379-406"], "nodes": [420], "pads": [406]});
    api.post("/v1/closures", &closure).await.is(201);
    let place = json!({"positions": [{"drone_id": "drone-7", "location": {"node": 379}}]});
    api.post("/v1/telemetry", &place).await.is(200);
    for path in [
        "/v1/recompositions",
        &record,
        "/v1/plans",
        "/v1/plans/p1",
        "/v1/closures",
        "/v1/proposals",
        "/v1/alarms",
        "/v1/drones",
        "/v1/nodes/379",
        "/v1/nearest?lon=151.2&lat=-33.86&k=3",
        "/v1/network?format=compact",
    ] {
        // The harness looks through each of them.
        api.get(path).await.is(200);
    }
}

#[tokio::test]
async fn every_event_has_its_ids_as_text() {
    let api = Api::start().await;
    let plan = json!({"id": "p1", "source": 379, "destination": 450, "drone_id": "drone-7"});
    api.post("/v1/plans", &plan).await.is(201);
    let asked = report("r1", [json!(379), json!(406), json!(450)], &json!(291));
    api.post("/v1/failures", &asked).await.is(200);
    api.post("/v1/closures", &json!({"id": "c1", "nodes": [406]}))
        .await
        .is(201);
    let mut kinds = BTreeSet::new();
    let mut stream = api.open("GET /v1/events?after=7-0", &[], "").await;
    let mut read = 1;
    while !(kinds.contains("recomposed") && kinds.contains("plan_affected")) {
        read += 1;
        for frame in frames(&mut stream, 1).await {
            if let (Some(kind), Some(data)) = (field(&frame, "event"), field(&frame, "data")) {
                let event = serde_json::from_str(data).expect("JSON");
                assert_eq!(numbers_for_ids(&event), [""; 0], "{event}");
                kinds.insert(kind.to_owned());
            }
        }
        assert!(read < 20, "{kinds:?}");
    }
}

#[tokio::test]
async fn a_report_is_the_same_whichever_form_its_ids_have() {
    let api = Api::start().await;
    let numbers = report("r1", [json!(379), json!(406), json!(450)], &json!(291));
    let texts = report(
        "r1",
        [json!("379"), json!("406"), json!("450")],
        &json!("291"),
    );
    let first = api.post("/v1/failures", &numbers).await.is(200).json();
    let again = api.post("/v1/failures", &texts).await.is(200).json();
    assert_eq!(
        (&first["replayed"], &again["replayed"]),
        (&json!(false), &json!(true))
    );
    assert_eq!(first["id"], again["id"]);
    let path = format!(
        "/v1/recompositions/{}",
        first["id"].as_str().expect("an id")
    );
    let record = api.get(&path).await.is(200).json();
    assert_eq!(record["report"], texts);
}

#[tokio::test]
async fn an_id_is_the_digits_of_its_integer_and_nothing_else() {
    let api = Api::start().await;
    for (source, status) in [
        (json!(379), 201),
        (json!("379"), 201),
        (json!(379.0), 201),
        (json!("0379"), 422),
        (json!("+379"), 422),
        (json!(" 379"), 422),
        (json!("379.0"), 422),
    ] {
        let request = json!({"source": source, "destination": "450"});
        let told = api.post("/v1/plans", &request).await;
        assert_eq!(told.status, status, "{source}: {}", told.body);
    }
}

#[tokio::test]
async fn a_segment_is_named_from_either_end_and_told_in_one_way() {
    let api = Api::start().await;
    for (id, named) in [("c1", "379-406"), ("c2", "406-379")] {
        let draft = json!({"id": id, "reason": "crane", "segments": [named]});
        let told = api.post("/v1/closures", &draft).await.is(201).json();
        assert_eq!(told["segments"], json!(["379-406"]), "{named}");
    }
    let report = json!({"service": {"from": 406, "to": 379}, "destination": "1", "dry_run": true});
    let told = api.post("/v1/failures", &report).await.is(200).json();
    assert_eq!(told["first_stretch"]["segment"], "379-406");
    let node = api.get("/v1/nodes/406").await.is(200).json();
    let segments = node["segments"].as_array().expect("a list");
    assert!(segments.iter().any(|segment| segment["id"] == "379-406"));
}

/// The schemas that a part of a description leads to, by name.
fn schemas_of(description: &Value, part: &Value) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let mut parts = vec![part];
    while let Some(part) = parts.pop() {
        match part {
            Value::Object(members) => {
                let reference = members.get("$ref").and_then(Value::as_str);
                let name = reference.and_then(|path| path.strip_prefix("#/components/schemas/"));
                if let Some(name) = name
                    && names.insert(name.to_owned())
                {
                    parts.push(&description["components"]["schemas"][name]);
                }
                parts.extend(members.values());
            }
            Value::Array(entries) => parts.extend(entries),
            _ => {}
        }
    }
    names
}

#[tokio::test]
async fn ids_are_described_as_text_in_answers_and_as_either_in_requests() {
    let api = Api::start().await;
    let description = api.get("/openapi.json").await.is(200).json();
    assert_eq!(description["components"]["schemas"]["Id"]["type"], "string");
    let paths = description["paths"].as_object().expect("paths");
    let operations = paths.values().filter_map(Value::as_object);
    let (mut told, mut given) = (0, 0);
    for (method, operation) in operations.flatten() {
        let answers = schemas_of(&description, &operation["responses"]);
        assert!(!answers.contains("IdAsGiven"), "{method} {operation}");
        told += usize::from(answers.contains("Id"));
        let request = schemas_of(&description, &operation["requestBody"]);
        assert!(!request.contains("Id"), "{method} {operation}");
        given += usize::from(request.contains("IdAsGiven"));
    }
    assert!(told > given && given > 3, "{told} {given}");
}
