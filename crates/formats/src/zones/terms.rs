//! What a zone means beside its shape: its kind, where it comes from, and what its feed says of it.

use super::member::{Members, known_only, wrong_type};
use super::problem::Problems;
use super::windows::unknown;
use crate::airspace::{Recurrence, ZoneKind, ZoneSource, ZoneTerms};
use serde_json::{Map, Value, json};
use std::sync::Arc;

const SOURCE_MEMBERS: [&str; 2] = ["feed", "id"];

pub(super) fn read_terms(
    properties: &Members<'_>,
    schedules: Vec<Recurrence>,
    problems: &mut Problems,
) -> ZoneTerms {
    ZoneTerms {
        kind: read_kind(properties, problems).unwrap_or_default(),
        is_authorized: properties.flag("authorized", problems).unwrap_or(false),
        schedules,
        source: read_source(properties, problems),
        record: read_record(properties, problems),
    }
}

fn read_kind(properties: &Members<'_>, problems: &mut Problems) -> Option<ZoneKind> {
    let written = properties.text("kind", problems)?;
    let kind = ZoneKind::ALL
        .into_iter()
        .find(|kind| kind.name() == written);
    if kind.is_none() {
        let names = ZoneKind::ALL.map(ZoneKind::name);
        let place = properties.place.member("kind");
        problems.push(unknown(&written, "kind", &names, &place));
    }
    kind
}

fn read_source(properties: &Members<'_>, problems: &mut Problems) -> Option<ZoneSource> {
    let value = properties.optional("source")?;
    let place = properties.place.member("source");
    let Value::Object(members) = value else {
        problems.push(wrong_type(value, "an object", &place));
        return None;
    };
    known_only(members, &SOURCE_MEMBERS, &place, problems);
    let members = Members {
        members,
        place: &place,
    };
    let [feed, id] = SOURCE_MEMBERS.map(|name| {
        members.required(name, problems);
        members.text(name, problems)
    });
    Some(ZoneSource {
        feed: feed?,
        id: id?,
    })
}

fn read_record(properties: &Members<'_>, problems: &mut Problems) -> Option<Arc<str>> {
    let value = properties.optional("record")?;
    if !value.is_object() {
        let place = properties.place.member("record");
        problems.push(wrong_type(value, "an object", &place));
        return None;
    }
    Some(Arc::from(value.to_string()))
}

/// Puts the terms into the properties of a zone; what is as by default is left out.
pub(super) fn put_terms(terms: &ZoneTerms, properties: &mut Map<String, Value>) {
    if terms.kind != ZoneKind::default() {
        properties.insert("kind".to_owned(), json!(terms.kind.name()));
    }
    if terms.is_authorized {
        properties.insert("authorized".to_owned(), json!(true));
    }
    if let Some(ZoneSource { feed, id }) = &terms.source {
        properties.insert("source".to_owned(), json!({"feed": feed, "id": id}));
    }
    if let Some(record) = record_of(terms) {
        properties.insert("record".to_owned(), Value::Object(record));
    }
}

/// The record of a zone; it was JSON when it was read.
pub(crate) fn record_of(terms: &ZoneTerms) -> Option<Map<String, Value>> {
    serde_json::from_str(terms.record.as_deref()?).ok()
}
