//! Ids of nodes in the description: text wherever they are told, text or an integer where they are read.
//!
//! The shapes of the wire know one id. What a request has of them is described with both forms; a shape that is
//! also told, as a report is in its record, is described twice.

use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

const SCHEMAS: &str = "#/components/schemas/";
const TOLD: &str = "Id";
const GIVEN: &str = "IdAsGiven";

/// The description with both forms of an id where requests have one.
pub(super) fn with_given_ids(mut document: Value) -> Value {
    let Some(schemas) = document["components"]["schemas"].as_object().cloned() else {
        return document;
    };
    let (mut asked, mut answered) = (BTreeSet::new(), BTreeSet::new());
    collect(&document["components"]["responses"], &mut answered);
    for operation in operations(&mut document) {
        collect(&operation["requestBody"], &mut asked);
        collect(&operation["responses"], &mut answered);
    }
    let answered = reached(answered, &schemas);
    // No operation names the entries of a batch, which are read one by one.
    let unnamed = schemas.keys().filter(|name| !answered.contains(*name));
    asked.extend(unnamed.cloned());
    let has_id = |name: &String| reached(BTreeSet::from([name.clone()]), &schemas).contains(TOLD);
    let mut given = reached(asked, &schemas);
    given.retain(|name| name != TOLD && has_id(name));
    let both: BTreeSet<String> = given.intersection(&answered).cloned().collect();
    let as_told = |name: &str| both.contains(name).then(|| format!("Told{name}"));
    let as_given = |name: &str| (name == TOLD).then(|| GIVEN.to_owned());

    let mut split = BTreeMap::new();
    for (name, schema) in schemas {
        if let Some(copy) = as_told(&name) {
            let mut told = schema.clone();
            rename(&mut told, &as_told);
            split.insert(copy, told);
        }
        let mut schema = schema;
        match given.contains(&name) {
            true => rename(&mut schema, &as_given),
            false => rename(&mut schema, &as_told),
        }
        split.insert(name, schema);
    }
    if !given.is_empty() {
        split.insert(GIVEN.to_owned(), given_id());
    }
    for operation in operations(&mut document) {
        if let Some(responses) = operation.get_mut("responses") {
            rename(responses, &as_told);
        }
    }
    rename(&mut document["components"]["responses"], &as_told);
    document["components"]["schemas"] = split.into_iter().collect();
    document
}

/// Integers as far as a double can tell them from their neighbours, as which many clients write every number.
fn given_id() -> Value {
    json!({
        "oneOf": [
            {"type": "string", "maxLength": 256},
            {"type": "integer", "maximum": 9_007_199_254_740_991_i64, "minimum": -9_007_199_254_740_991_i64},
        ],
        "description": "The id of a node; an integer stands for its decimal digits.",
    })
}

fn operations(document: &mut Value) -> impl Iterator<Item = &mut Value> {
    let paths = document.get_mut("paths").and_then(Value::as_object_mut);
    let items = paths.into_iter().flat_map(Map::values_mut);
    items
        .filter_map(Value::as_object_mut)
        .flat_map(Map::values_mut)
        .filter(|operation| operation.is_object())
}

/// The schemas that a part of the document names.
fn collect(part: &Value, names: &mut BTreeSet<String>) {
    match part {
        Value::Object(members) => {
            let name = members.get("$ref").and_then(Value::as_str);
            let name = name.and_then(|name| name.strip_prefix(SCHEMAS));
            names.extend(name.map(str::to_owned));
            members.values().for_each(|member| collect(member, names));
        }
        Value::Array(entries) => entries.iter().for_each(|entry| collect(entry, names)),
        _ => {}
    }
}

/// These schemas, and those that they lead to.
fn reached(names: BTreeSet<String>, schemas: &Map<String, Value>) -> BTreeSet<String> {
    let mut reached = BTreeSet::new();
    let mut next: Vec<String> = names.into_iter().collect();
    while let Some(name) = next.pop() {
        let mut led_to = BTreeSet::new();
        if let Some(schema) = schemas.get(&name)
            && reached.insert(name)
        {
            collect(schema, &mut led_to);
        }
        next.extend(led_to);
    }
    reached
}

/// Gives the schemas that a part of the document names other names.
fn rename(part: &mut Value, renamed: &impl Fn(&str) -> Option<String>) {
    match part {
        Value::Object(members) => {
            for (key, member) in members {
                let name = member.as_str().filter(|_| key == "$ref");
                let name = name.and_then(|name| renamed(name.strip_prefix(SCHEMAS)?));
                match name {
                    Some(name) => *member = Value::from(format!("{SCHEMAS}{name}")),
                    None => rename(member, renamed),
                }
            }
        }
        Value::Array(entries) => entries.iter_mut().for_each(|entry| rename(entry, renamed)),
        _ => {}
    }
}
