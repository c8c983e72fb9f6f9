//! The description of the API: it has every operation, its examples are answered, and `docs/openapi.json` is it.
#![expect(
    clippy::disallowed_methods,
    reason = "a test compares a document with its file, and writes it when asked"
)]

use crate::harness::Api;
use serde_json::Value;
use skyway::api::operations::{Daemon, Listener, TABLE};
use std::collections::BTreeSet;

const METHODS: [&str; 5] = ["get", "put", "post", "patch", "delete"];

async fn described(api: &Api) -> Value {
    api.get("/openapi.json").await.is(200).json()
}

/// Method, path and description of every operation.
fn operations(description: &Value) -> Vec<(String, String, &Value)> {
    let paths = description["paths"].as_object().expect("paths");
    let operations = paths.iter().flat_map(|(path, item)| {
        let methods = METHODS
            .into_iter()
            .filter_map(move |method| Some((method, item.get(method)?)));
        methods.map(move |(method, operation)| (method.to_uppercase(), path.clone(), operation))
    });
    operations.collect()
}

#[tokio::test]
async fn the_file_is_what_the_code_says() {
    let api = Api::start().await;
    let mut built = serde_json::to_string_pretty(&described(&api).await).expect("JSON");
    built.push('\n');
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/openapi.json");
    if std::env::var_os("SKYWAY_BLESS").is_some() {
        std::fs::write(file, &built).expect("writes the file");
    }
    let kept = std::fs::read_to_string(file).unwrap_or_default();
    let differs = kept
        .lines()
        .zip(built.lines())
        .find(|(kept, built)| kept != built);
    assert!(
        kept == built,
        "docs/openapi.json is not what the code says; SKYWAY_BLESS=1 writes it: {differs:?}"
    );
}

#[tokio::test]
async fn it_has_every_operation_and_no_other() {
    let api = Api::start().await;
    let description = described(&api).await;
    assert_eq!(description["openapi"], "3.1.0");
    let told: BTreeSet<(String, String)> = operations(&description)
        .into_iter()
        .map(|(method, path, _)| (method, path))
        .collect();
    let rows = TABLE
        .iter()
        .filter(|row| row.operation.is_of(Daemon::Edge) && row.listener != Some(Listener::Admin));
    let routes = rows.flat_map(|row| row.rest.iter());
    let pages = ["/", "/page/", "/docs", "/openapi.json"];
    let is_page = |path: &str| path == "/" || pages[1..].iter().any(|page| path.starts_with(page));
    let served: BTreeSet<(String, String)> = routes
        .filter(|(_, path)| !is_page(path))
        .map(|(method, path)| (method.to_string(), (*path).to_owned()))
        .collect();
    assert_eq!(told, served);
}

#[tokio::test]
async fn operations_have_their_own_ids_and_a_tag() {
    let api = Api::start().await;
    let description = described(&api).await;
    let tags: Vec<&Value> = description["tags"]
        .as_array()
        .expect("tags")
        .iter()
        .map(|tag| &tag["name"])
        .collect();
    let mut ids = BTreeSet::new();
    for (method, path, operation) in operations(&description) {
        let id = operation["operationId"].as_str().expect("an id");
        assert!(ids.insert(id.to_owned()), "{id} is there twice");
        assert!(operation["summary"].is_string(), "{method} {path}");
        let tag = &operation["tags"][0];
        assert!(tags.contains(&tag), "{method} {path} {tag}");
        let needs_token = path.starts_with("/v1/");
        assert_eq!(
            operation.get("security").is_some(),
            needs_token,
            "{method} {path}"
        );
        assert_eq!(
            operation["responses"].get("401").is_some(),
            needs_token,
            "{method} {path}"
        );
    }
}

#[tokio::test]
async fn every_example_of_a_body_is_answered() {
    let api = Api::start().await;
    let description = described(&api).await;
    let mut count = 0;
    for (method, path, operation) in operations(&description) {
        let Some(content) = operation["requestBody"]["content"].as_object() else {
            continue;
        };
        let examples: Vec<_> = content
            .iter()
            .filter_map(|(kind, content)| Some((kind, content.get("example")?)))
            .collect();
        assert_eq!(examples.len(), 1, "{method} {path}");
        // What an id names is made first; nothing is there to acknowledge or to change.
        let expected = match path.as_str() {
            "/v1/plans/{id}/ack"
            | "/v1/plans/{id}/decline"
            | "/v1/plans/{id}/complete"
            | "/v1/plans/{id}/release"
            | "/v1/closures/{id}" => 404,
            // No client moves the clock of this edge.
            "/v1/clock:advance" => 409,
            "/v1/zones" | "/v1/zones/{id}" | "/v1/plans" | "/v1/closures" => 201,
            _ => 200,
        };
        for (kind, example) in examples {
            // An import has to name its feed.
            let query = match path.as_str() {
                "/v1/zones:import" => "?feed=national",
                _ => "",
            };
            let line = format!("{method} {}{query}", path.replace("{id}", "another"));
            let told = api
                .ask(
                    &line,
                    &[("content-type", kind.as_str())],
                    &example.to_string(),
                )
                .await;
            assert_eq!(told.status, expected, "{line}: {}", told.body);
            count += 1;
        }
    }
    assert_eq!(count, 17);
}

#[tokio::test]
async fn the_pages_ask_nothing_of_other_hosts() {
    let api = Api::start().await;
    assert_eq!(
        api.get("/docs").await.is(303).header("location"),
        Some("/docs/")
    );
    let page = api.get("/docs/").await.is(200);
    assert!(page.body.contains("swagger-ui"), "{}", page.body);
    assert!(!page.body.contains("://"), "{}", page.body);
    let start = api.get("/docs/swagger-initializer.js").await.is(200);
    assert!(
        start.body.contains("\"/openapi.json\"") && start.body.contains("none"),
        "{}",
        start.body
    );
    assert_eq!(
        api.get("/docs/nothing.js").await.is(404).code(),
        "not_found"
    );
    let problems = api.get("/docs/problems").await.is(200);
    assert!(problems.body.contains("id=\"zone_invalid\"") && !problems.body.contains("src="));
}

/// Every text under a name, anywhere in a document.
fn texts<'a>(json: &'a Value, name: &str, found: &mut Vec<&'a str>) {
    match json {
        Value::Object(members) => {
            found.extend(members.get(name).and_then(Value::as_str));
            members.values().for_each(|value| texts(value, name, found));
        }
        Value::Array(values) => values.iter().for_each(|value| texts(value, name, found)),
        _ => {}
    }
}

#[tokio::test]
async fn every_reference_leads_somewhere() {
    let api = Api::start().await;
    let description = described(&api).await;
    let mut references = Vec::new();
    texts(&description, "$ref", &mut references);
    assert!(!references.is_empty());
    for reference in references {
        let pointer = reference.strip_prefix('#').expect("within the document");
        assert!(description.pointer(pointer).is_some(), "{reference}");
    }
}

#[tokio::test]
async fn no_parameter_is_ever_null() {
    let api = Api::start().await;
    let description = described(&api).await;
    for (method, path, operation) in operations(&description) {
        for parameter in operation["parameters"].as_array().into_iter().flatten() {
            let kind = &parameter["schema"]["type"];
            assert!(kind.is_string(), "{method} {path} {parameter}");
        }
    }
}
