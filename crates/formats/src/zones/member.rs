//! Members of JSON objects in zones, read strictly, with the place of what is wrong.

use super::problem::{Problems, ZoneCode, ZoneProblem};
use crate::place::Place;
use crate::suggestion::nearest;
use jiff::Timestamp;
use serde_json::{Map, Value};

/// The members of an object, with its place.
#[derive(Clone, Copy)]
pub(super) struct Members<'a> {
    pub(super) members: &'a Map<String, Value>,
    pub(super) place: &'a Place<'a>,
}

impl<'a> Members<'a> {
    /// The member, `None` where it is absent or null.
    pub(super) fn optional(&self, name: &str) -> Option<&'a Value> {
        self.members.get(name).filter(|value| !value.is_null())
    }

    /// The member, which has to be there.
    pub(super) fn required(&self, name: &str, problems: &mut Problems) -> Option<&'a Value> {
        let found = self.optional(name);
        if found.is_none() {
            self.missing(name, problems);
        }
        found
    }

    pub(super) fn missing(&self, name: &str, problems: &mut Problems) {
        let pointer = self.place.member(name).pointer();
        let message = format!("'{name}' is missing");
        problems.push(ZoneProblem::new(ZoneCode::MissingField, pointer, message));
    }

    pub(super) fn expect_type(&self, expected: &str, problems: &mut Problems) {
        let place = self.place.member("type");
        let Some(value) = self.required("type", problems) else {
            return;
        };
        if value.as_str() != Some(expected) {
            problems.push(wrong_type(value, &format!("'{expected}'"), &place));
        }
    }

    pub(super) fn text(&self, name: &str, problems: &mut Problems) -> Option<String> {
        let value = self.optional(name)?;
        text(value, &self.place.member(name), problems).map(str::to_owned)
    }

    pub(super) fn number(&self, name: &str, problems: &mut Problems) -> Option<f64> {
        number(self.optional(name)?, &self.place.member(name), problems)
    }

    pub(super) fn flag(&self, name: &str, problems: &mut Problems) -> Option<bool> {
        let value = self.optional(name)?;
        if !value.is_boolean() {
            problems.push(wrong_type(value, "true or false", &self.place.member(name)));
        }
        value.as_bool()
    }

    /// `Some(None)` where it is absent, `None` where it is no instant.
    pub(super) fn instant(&self, name: &str, problems: &mut Problems) -> Option<Option<Timestamp>> {
        let Some(value) = self.optional(name) else {
            return Some(None);
        };
        let place = self.place.member(name);
        let written = text(value, &place, problems)?;
        match written.parse::<Timestamp>() {
            Ok(instant) => Some(Some(instant)),
            Err(error) => {
                let message = format!("'{written}' is no instant: {error}");
                let problem = ZoneProblem::new(ZoneCode::TimeInvalid, place.pointer(), message);
                problems.push(problem.hint("write it as in 2026-11-27T18:00:00Z"));
                None
            }
        }
    }
}

/// Refuses members that nothing is known of.
pub(super) fn known_only(
    members: &Map<String, Value>,
    known: &[&str],
    place: &Place<'_>,
    problems: &mut Problems,
) {
    let unknown = members
        .keys()
        .filter(|name| !known.contains(&name.as_str()));
    for name in unknown {
        let hint = match nearest(name, known.iter().copied(), 1).first() {
            Some(meant) => format!("did you mean '{meant}'?"),
            None if name == "crs" => {
                "leave it out: positions are longitude and latitude (RFC 7946), or as the network's"
                    .to_owned()
            }
            None => format!("known here: {}", known.join(", ")),
        };
        let pointer = place.member(name).pointer();
        let message = format!("nothing is known of a field '{name}'");
        problems.push(ZoneProblem::new(ZoneCode::UnknownField, pointer, message).hint(hint));
        if problems.is_full() {
            return;
        }
    }
}

pub(super) fn text<'v>(
    value: &'v Value,
    place: &Place<'_>,
    problems: &mut Problems,
) -> Option<&'v str> {
    if !value.is_string() {
        problems.push(wrong_type(value, "text", place));
    }
    value.as_str()
}

pub(super) fn number(value: &Value, place: &Place<'_>, problems: &mut Problems) -> Option<f64> {
    let found = value.as_f64().filter(|number| number.is_finite());
    if found.is_none() {
        let quoted = value
            .as_str()
            .is_some_and(|text| text.trim().parse::<f64>().is_ok());
        let problem = wrong_type(value, "a number", place);
        problems.push(if quoted {
            problem.hint("remove the quotes")
        } else {
            problem
        });
    }
    found
}

pub(super) fn wrong_type(value: &Value, expected: &str, place: &Place<'_>) -> ZoneProblem {
    let found = match value {
        Value::Null => "null".to_owned(),
        Value::Bool(_) => "a boolean".to_owned(),
        Value::Number(_) => "a number".to_owned(),
        Value::String(text) if text.len() <= 40 => format!("'{text}'"),
        Value::String(_) => "text".to_owned(),
        Value::Array(_) => "an array".to_owned(),
        Value::Object(_) => "an object".to_owned(),
    };
    let message = format!("is {found}, not {expected}");
    ZoneProblem::new(ZoneCode::WrongType, place.pointer(), message)
}
