//! What a feed says of a zone beside its shape and times, in the words of ED-318, as text for
//! people and for export.

use super::extended::{EXTENDED, IDENTIFIER_MAX};
use super::layer::KINDS;
use super::sheet::{Members, Sheet};
use crate::airspace::ZoneKind;
use crate::place::Place;
use crate::zones::ZoneCode;
use serde_json::{Map, Value, json};

/// What is kept as it is written.
const KEPT: [&str; 7] = [
    "country",
    "region",
    "reason",
    "regulationExemption",
    "uSpaceClass",
    "dataSource",
    "restrictionConditions",
];
/// Texts, which ED-318 has in several languages and ED-269 in one.
const TEXTS: [&str; 3] = ["name", "message", "otherReasonInfo"];
const AUTHORITY_TEXTS: [&str; 3] = ["name", "service", "contactName"];

/// What nothing here acts on.
pub(super) struct Record(Map<String, Value>);

/// The same for people.
#[derive(Clone, Default)]
pub(super) struct RecordTexts {
    pub(super) name: Option<String>,
    pub(super) reason: Option<String>,
    pub(super) authority: Option<String>,
}

impl Record {
    /// Nothing is said.
    pub(super) fn empty() -> Self {
        Self(Map::new())
    }

    /// The record of a zone; `acted_on` names the members that are read elsewhere.
    pub(super) fn read(zone: Members<'_>, acted_on: &[&str], sheet: &mut Sheet) -> Self {
        let mut record = Map::new();
        let mut extended = match zone.get(EXTENDED) {
            Some(Value::Object(members)) => members.clone(),
            Some(other) => Map::from_iter([(EXTENDED.to_owned(), other.clone())]),
            None => Map::new(),
        };
        let mut unknown = Vec::new();
        for name in zone.members.keys() {
            let Some(value) = zone.get(name) else {
                continue;
            };
            let place = zone.place.member(name);
            match name.as_str() {
                EXTENDED => {}
                "variant" => {
                    record.insert(name.clone(), value.clone());
                }
                "reasons" => {
                    sheet.note(&place, "was read as the reason");
                    record.insert("reason".to_owned(), json!(as_list(value)));
                }
                "reason" => {
                    record.insert(name.clone(), json!(sheet.list(value, &place)));
                }
                "restrictionConditions" => {
                    record.insert(name.clone(), joined(value));
                }
                "zoneAuthority" => {
                    let authorities = sheet.list(value, &place).iter().map(authority).collect();
                    record.insert(name.clone(), Value::Array(authorities));
                }
                kept if KEPT.contains(&kept) => {
                    record.insert(name.clone(), value.clone());
                }
                text if TEXTS.contains(&text) => {
                    record.insert(name.clone(), in_languages(value));
                }
                other if acted_on.contains(&other) => {}
                other => {
                    unknown.push(other);
                    extended.insert(name.clone(), value.clone());
                }
            }
        }
        if !unknown.is_empty() {
            let message = format!("kept, and nothing acts on: {}", unknown.join(", "));
            sheet.note(zone.place, message);
        }
        for name in ["country", "zoneAuthority"] {
            if !record.contains_key(name) {
                sheet.note(zone.place, format!("states no {name}"));
            }
        }
        if !extended.is_empty() {
            record.insert(EXTENDED.to_owned(), Value::Object(extended));
        }
        Self(record)
    }

    /// As JSON; `None` where nothing is said.
    pub(super) fn json(&self) -> Option<String> {
        (!self.0.is_empty()).then(|| Value::Object(self.0.clone()).to_string())
    }

    /// Says a member beside what was read.
    pub(super) fn put(&mut self, name: &str, value: Value) {
        self.0.insert(name.to_owned(), value);
    }

    pub(super) fn texts(&self) -> RecordTexts {
        let listed = |name: &str| self.0.get(name).map(as_list).unwrap_or_default();
        let reasons = listed("reason");
        let words = reasons
            .iter()
            .filter_map(Value::as_str)
            .map(ToOwned::to_owned);
        let others = listed("otherReasonInfo")
            .into_iter()
            .find_map(|it| text_of(&it));
        let reasons: Vec<String> = words.chain(others).collect();
        let authorities = listed("zoneAuthority");
        let authorities = authorities.iter().filter_map(|authority| {
            let name = authority.get("name").or_else(|| authority.get("service"))?;
            as_list(name).first().and_then(text_of)
        });
        let authorities: Vec<String> = authorities.collect();
        let told = |texts: Vec<String>| (!texts.is_empty()).then(|| texts.join(", "));
        RecordTexts {
            name: listed("name").first().and_then(text_of),
            reason: told(reasons),
            authority: told(authorities),
        }
    }
}

/// The kind of a zone; the name of the other standard, and its spelling, are read too.
pub(super) fn read_kind(
    zone: Members<'_>,
    names: [&str; 2],
    sheet: &mut Sheet,
) -> Option<ZoneKind> {
    let is_kind = |value: &Value| {
        let word = value.as_str().map(str::to_ascii_uppercase);
        word.is_some_and(|word| KINDS.iter().any(|(kind, _)| *kind == word))
    };
    let [usual, other] = names;
    let found = zone.get(usual).filter(|value| is_kind(value));
    let from_other = || zone.get(other).filter(|value| is_kind(value));
    let (name, value) = match (found, zone.get(usual)) {
        (Some(value), _) => (usual, value),
        (None, stated) => match (from_other(), stated) {
            (Some(value), _) => {
                sheet.note(
                    &zone.place.member(other),
                    format!("was read as the {usual}"),
                );
                (other, value)
            }
            (None, Some(value)) => (usual, value),
            (None, None) => {
                sheet.missing(zone.place, usual);
                return None;
            }
        },
    };
    sheet.kind = sheet.word(value, &zone.place.member(name), &KINDS);
    sheet.kind
}

/// The identifier, without which a zone cannot be told from others.
pub(super) fn read_identifier(zone: Members<'_>, sheet: &mut Sheet) -> Option<String> {
    let Some(identifier) = zone.text("identifier", sheet) else {
        if zone.get("identifier").is_none() {
            sheet.missing(zone.place, "identifier");
        }
        return None;
    };
    let identifier = plain_identifier(&identifier, &zone.place.member("identifier"), sheet)?;
    if identifier.chars().count() > IDENTIFIER_MAX {
        let place: Place<'_> = zone.place.member("identifier");
        sheet.note(
            &place,
            "the identifier is longer than the 7 letters of the standard",
        );
    }
    Some(identifier)
}

/// An identifier without the blanks around it, which people can write.
pub(super) fn plain_identifier(
    identifier: &str,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<String> {
    let identifier = identifier.trim().to_owned();
    if identifier.chars().any(char::is_control) {
        let remedy = "use letters and digits";
        let message = "has control characters";
        sheet.refuse(ZoneCode::IdMismatch, place, message, remedy);
        return None;
    }
    Some(identifier)
}

fn as_list(value: &Value) -> Vec<Value> {
    match value {
        Value::Array(list) => list.clone(),
        only => vec![only.clone()],
    }
}

/// Conditions are one text; some feeds have a list of them.
fn joined(value: &Value) -> Value {
    let texts: Vec<String> = as_list(value)
        .iter()
        .filter_map(|text| text.as_str().map(str::to_owned))
        .collect();
    match texts.is_empty() {
        true => value.clone(),
        false => json!(texts.join("\n")),
    }
}

/// A text as ED-318 has it: a list of texts with their languages.
fn in_languages(value: &Value) -> Value {
    let texts = as_list(value).into_iter().map(|text| match text {
        Value::String(text) => json!({"text": text}),
        other => other,
    });
    Value::Array(texts.collect())
}

fn text_of(value: &Value) -> Option<String> {
    let text = value.get("text").unwrap_or(value);
    text.as_str().map(str::to_owned)
}

fn authority(value: &Value) -> Value {
    let Value::Object(members) = value else {
        return json!({"name": in_languages(value)});
    };
    let members = members.iter().filter(|(_, value)| !value.is_null());
    let told = members.map(|(name, value)| {
        let value = match AUTHORITY_TEXTS.contains(&name.as_str()) {
            true => in_languages(value),
            false => value.clone(),
        };
        (name.clone(), value)
    });
    Value::Object(told.collect())
}
