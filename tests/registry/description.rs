//! The description of the REST API of a registry: it has every operation, and `docs/openapi-registry.json` is it.
#![expect(
    clippy::disallowed_methods,
    reason = "a test compares a document with its file, and writes it when asked"
)]

use crate::harness::{Place, Served};
use serde_json::Value;
use skyway::api::operations::{Daemon, Listener, TABLE};
use skyway::registry::Settings;
use std::collections::BTreeSet;

const METHODS: [&str; 5] = ["get", "put", "post", "patch", "delete"];

async fn described() -> Value {
    let place = Place::new();
    let served = Served::with_network(&place, Settings::default()).await;
    let described = served
        .ask("GET /openapi.json", &[], "")
        .await
        .is(200)
        .json();
    served.ask("GET /docs/", &[], "").await.is(200);
    served.end().await;
    described
}

#[tokio::test]
async fn the_file_is_what_the_code_says() {
    let mut built = serde_json::to_string_pretty(&described().await).expect("JSON");
    built.push('\n');
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/openapi-registry.json");
    if std::env::var_os("SKYWAY_BLESS").is_some() {
        std::fs::write(file, &built).expect("writes the file");
    }
    let kept = std::fs::read_to_string(file).unwrap_or_default();
    assert!(
        kept == built,
        "docs/openapi-registry.json is not what the code says; SKYWAY_BLESS=1 writes it"
    );
}

/// What a reader of the description is sent to is there.
#[tokio::test]
async fn every_reference_leads_somewhere() {
    let description = described().await;
    let mut places = vec![&description];
    let mut followed = 0;
    while let Some(place) = places.pop() {
        match place {
            Value::Array(items) => places.extend(items),
            Value::Object(members) => places.extend(members.values()),
            _ => {}
        }
        let Some(reference) = place.get("$ref").and_then(Value::as_str) else {
            continue;
        };
        let pointer = reference.strip_prefix('#').expect("within the document");
        assert!(description.pointer(pointer).is_some(), "{reference}");
        followed += 1;
    }
    assert!(followed > 100, "only {followed} references");
}

#[tokio::test]
async fn it_has_every_operation_and_no_other() {
    let description = described().await;
    let paths = description["paths"].as_object().expect("paths");
    let told: BTreeSet<(String, String)> = paths
        .iter()
        .flat_map(|(path, item)| {
            let offered = METHODS
                .into_iter()
                .filter(|method| item.get(*method).is_some());
            offered.map(|method| (method.to_uppercase(), path.clone()))
        })
        .collect();
    let rows = TABLE
        .iter()
        .filter(|row| row.operation.is_of(Daemon::Registry));
    let rows = rows.filter(|row| row.listener != Some(Listener::Admin));
    let pages = ["/page/", "/docs", "/openapi.json"];
    let is_page = |path: &str| path == "/" || pages.iter().any(|page| path.starts_with(page));
    let served: BTreeSet<(String, String)> = rows
        .flat_map(|row| row.rest.iter())
        .filter(|(_, path)| !is_page(path))
        .map(|(method, path)| (method.to_string(), (*path).to_owned()))
        .collect();
    assert_eq!(told, served);
}
