//! The messages of gRPC and the JSON of REST say the same: a field or a value that one of them lacks is found.

use crate::harness::Api;
use prost::Message;
use serde_json::Value;
use skyway::api::grpc::DESCRIPTORS;
use std::collections::{BTreeMap, BTreeSet};

/// Messages whose schema has another name.
const RENAMED: [(&str, &str); 15] = [
    ("AcknowledgePlanRequest", "Ack"),
    ("AdvanceToRequest", "ClockAdvance"),
    ("AdvanceToResponse", "ClockAdvanced"),
    ("CompletePlanRequest", "Completion"),
    ("CreatePlanRequest", "DeliveryRequest"),
    ("DeclinePlanRequest", "Decline"),
    ("GetClockResponse", "ClockReading"),
    ("ListPlansResponse", "Plans"),
    ("NearestResponse", "Nearest"),
    ("ReceivedRequest", "Received"),
    ("RecompositionAnswer", "Recomposition"),
    ("ReportFailuresRequest", "Failures"),
    ("ReportFailuresResponse", "BatchAnswer"),
    ("ReportTelemetryRequest", "Telemetry"),
    ("ReportTelemetryResponse", "TelemetryAnswer"),
];

/// What REST has in the path, the query and the headers, or as a document of its own; and what sessions alone have.
const NO_BODY: [&str; 16] = [
    "EndedSession",
    "GetClockRequest",
    "GetNetworkRequest",
    "GetNetworkResponse",
    "GetPlanRequest",
    "Goodbye",
    "GoodbyeResponse",
    "Hello",
    "HelloDrone",
    "ListPlansRequest",
    "NearestRequest",
    "RefusedDrone",
    "SessionRequest",
    "SessionResponse",
    "WatchEventsRequest",
    "Welcome",
];

/// What JSON says in a form of its own: GeoJSON (RFC 7946), pairs of numbers, alternatives.
const OWN_FORM: [&str; 14] = [
    "Altitude",
    "BatchEntry",
    "Circle",
    "Coordinates",
    "LonLat",
    "MultiPolygon",
    "Place",
    "PlanarPosition",
    "Polygon",
    "Ring",
    "Severance",
    "Waypoint",
    "Window",
    "Zone",
];

/// Fields of messages that REST has in the path or a header.
const OUTSIDE: [(&str, &[&str]); 5] = [
    ("AcknowledgePlanRequest", &["id", "idempotency_key"]),
    ("CompletePlanRequest", &["id", "idempotency_key"]),
    ("CreatePlanRequest", &["idempotency_key"]),
    ("DeclinePlanRequest", &["id", "idempotency_key"]),
    ("ReceivedRequest", &["drone_id"]),
];

/// Fields of JSON that no answer over gRPC has: of the registry, and of writes of operators.
const REST_ALONE: [(&str, &[&str]); 1] = [("Problem", &["oldest_revision", "enforced", "durable"])];

/// Messages whose fields stand in JSON beside those of the message that they are a field of.
const FLATTENED: [(&str, &str); 2] = [("stamp", "Stamp"), ("answer", "Answer")];

/// As much of `google.protobuf.FileDescriptorSet` as names messages, their fields, and enumerations.
#[derive(Clone, PartialEq, Message)]
struct Descriptors {
    #[prost(message, repeated, tag = "1")]
    files: Vec<File>,
}

#[derive(Clone, PartialEq, Message)]
struct File {
    #[prost(string, tag = "2")]
    package: String,
    #[prost(message, repeated, tag = "4")]
    messages: Vec<Described>,
    #[prost(message, repeated, tag = "5")]
    enumerations: Vec<Described>,
}

/// A message with its fields, an enumeration with its values: both have them in the same place.
#[derive(Clone, PartialEq, Message)]
struct Described {
    #[prost(string, tag = "1")]
    name: String,
    #[prost(message, repeated, tag = "2")]
    members: Vec<Member>,
}

#[derive(Clone, PartialEq, Message)]
struct Member {
    #[prost(string, tag = "1")]
    name: String,
}

fn described(of: impl Fn(File) -> Vec<Described>) -> BTreeMap<String, BTreeSet<String>> {
    let read = Descriptors::decode(DESCRIPTORS).expect("were compiled in");
    let ours = read
        .files
        .into_iter()
        .filter(|file| file.package == "skyway.v1");
    let named = |one: Described| {
        let members = one.members.into_iter().map(|member| member.name);
        (one.name, members.collect())
    };
    ours.flat_map(of).map(named).collect()
}

fn found<'a, T>(table: &'a [(&str, T)], name: &str) -> Option<&'a T> {
    let row = table.iter().find(|(known, _)| *known == name);
    row.map(|(_, value)| value)
}

/// The names of the members of a schema, those of the schemas that are flattened into it among them.
fn properties(schemas: &Value, name: &str) -> BTreeSet<String> {
    fn of(schemas: &Value, schema: &Value, names: &mut BTreeSet<String>) {
        let stated = schema["properties"].as_object().into_iter().flatten();
        names.extend(stated.map(|(name, _)| name.clone()));
        for part in schema["allOf"].as_array().into_iter().flatten() {
            of(schemas, part, names);
        }
        let reference = schema["$ref"].as_str();
        if let Some(name) = reference.and_then(|reference| reference.rsplit('/').next()) {
            of(schemas, &schemas[name], names);
        }
    }
    let mut names = BTreeSet::new();
    of(schemas, &schemas[name], &mut names);
    names
}

async fn schemas() -> Value {
    let told = Api::start().await.get("/openapi.json").await.is(200);
    told.json()["components"]["schemas"].take()
}

#[tokio::test]
async fn messages_have_the_fields_of_their_schemas() {
    let schemas = schemas().await;
    let messages = described(|file| file.messages);
    let mut compared = 0;
    for (name, fields) in &messages {
        if NO_BODY.contains(&name.as_str()) || OWN_FORM.contains(&name.as_str()) {
            continue;
        }
        let schema = found(&RENAMED, name).copied().unwrap_or(name);
        let mut over_grpc = fields.clone();
        for outside in found(&OUTSIDE, name).copied().unwrap_or_default() {
            assert!(over_grpc.remove(*outside), "{name} has no '{outside}'");
        }
        for (field, part) in FLATTENED {
            if over_grpc.remove(field) {
                over_grpc.extend(messages[part].clone());
            }
        }
        let alone = found(&REST_ALONE, name).copied().unwrap_or_default();
        over_grpc.extend(alone.iter().map(|field| (*field).to_owned()));
        assert_eq!(over_grpc, properties(&schemas, schema), "{name}, {schema}");
        compared += 1;
    }
    let left_out = NO_BODY.len() + OWN_FORM.len();
    assert_eq!(compared + left_out, messages.len(), "a name that is none");
}

#[tokio::test]
async fn enumerations_have_the_values_of_their_schemas() {
    let schemas = schemas().await;
    for (name, values) in described(|file| file.enumerations) {
        let mut prefix = String::new();
        for letter in name.chars() {
            if letter.is_ascii_uppercase() && !prefix.is_empty() {
                prefix.push('_');
            }
            prefix.push(letter.to_ascii_uppercase());
        }
        // In JSON a tag of alternatives, and a parameter of a query.
        if ["SeveranceCause", "NetworkFormat"].contains(&name.as_str()) {
            continue;
        }
        let over_grpc: BTreeSet<String> = values
            .iter()
            .filter_map(|value| value.strip_prefix(&format!("{prefix}_")))
            .filter(|value| *value != "UNSPECIFIED")
            .map(str::to_ascii_lowercase)
            .collect();
        let stated = &schemas[&name]["enum"];
        let stated = stated.as_array().unwrap_or_else(|| panic!("no {name}"));
        let over_rest = stated.iter().filter_map(Value::as_str).map(str::to_owned);
        assert_eq!(over_grpc, over_rest.collect(), "{name}");
    }
}
