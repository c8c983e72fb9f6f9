//! Values of a feed's zone, read as tolerantly as they have one meaning, with the repairs listed.

use super::collected::FeedNote;
use crate::airspace::{ZoneGeometry, ZoneKind};
use crate::place::Place;
use crate::zones::{Problems, ZoneCode, ZoneProblem};
use serde_json::{Map, Value};

/// What is found wrong with one zone, and what was repaired.
#[derive(Default)]
pub(super) struct Sheet {
    pub(super) problems: Problems,
    pub(super) notes: Vec<FeedNote>,
    /// The type of the zone, where it can be read.
    pub(super) kind: Option<ZoneKind>,
    /// By how much it is widened, in metres, where it says so.
    pub(super) margin_m: Option<f64>,
    /// Its shapes that can be read, whatever is wrong beside them.
    pub(super) shapes: Vec<ZoneGeometry>,
}

/// The members of an object with its place.
#[derive(Clone, Copy)]
pub(super) struct Members<'a> {
    pub(super) members: &'a Map<String, Value>,
    pub(super) place: &'a Place<'a>,
}

impl Sheet {
    /// Lists a repair, or what is not acted on.
    pub(super) fn note(&mut self, place: &Place<'_>, message: impl Into<String>) {
        self.notes.push(FeedNote {
            identifier: None,
            pointer: place.pointer(),
            message: message.into(),
        });
    }

    pub(super) fn refuse(
        &mut self,
        code: ZoneCode,
        place: &Place<'_>,
        message: impl Into<String>,
        remedy: &str,
    ) {
        let problem = ZoneProblem::new(code, place.pointer(), message);
        self.problems.push(problem.hint(remedy));
    }

    /// The value as text; a number is taken as it is written.
    pub(super) fn text(&mut self, value: &Value, place: &Place<'_>) -> Option<String> {
        match value {
            Value::String(text) => Some(text.clone()),
            Value::Number(number) => {
                self.note(place, "a number was taken as text");
                Some(number.to_string())
            }
            _ => {
                self.wrong_type(place, "text");
                None
            }
        }
    }

    /// The value as a finite number; one in quotes is taken for it.
    pub(super) fn number(&mut self, value: &Value, place: &Place<'_>) -> Option<f64> {
        let quoted = value.as_str().map(|text| text.trim().parse::<f64>());
        let number = match quoted {
            Some(Ok(number)) => {
                self.note(place, "a number in quotes was taken as a number");
                Some(number)
            }
            _ => value.as_f64(),
        };
        let number = number.filter(|number| number.is_finite());
        if number.is_none() {
            self.wrong_type(place, "a number");
        }
        number
    }

    /// The value as an object.
    pub(super) fn object<'v>(
        &mut self,
        value: &'v Value,
        place: &Place<'_>,
    ) -> Option<&'v Map<String, Value>> {
        if !value.is_object() {
            self.wrong_type(place, "an object");
        }
        value.as_object()
    }

    /// The value as a list; one that is none is the only entry.
    pub(super) fn list<'v>(&mut self, value: &'v Value, place: &Place<'_>) -> &'v [Value] {
        match value {
            Value::Array(list) => list,
            only => {
                self.note(place, "what is no list was taken as a list of one");
                std::slice::from_ref(only)
            }
        }
    }

    /// Reads each object of a list; what is none is refused by its place and passed over.
    pub(super) fn each(
        &mut self,
        list: &[Value],
        place: &Place<'_>,
        mut read: impl FnMut(Members<'_>, &mut Self),
    ) {
        for (index, value) in list.iter().enumerate() {
            let place = place.element(index);
            if let Some(members) = self.object(value, &place) {
                let place = &place;
                read(Members { members, place }, self);
            }
        }
    }

    /// One word of several; its case does not matter.
    pub(super) fn word<T: Copy>(
        &mut self,
        value: &Value,
        place: &Place<'_>,
        words: &[(&str, T)],
    ) -> Option<T> {
        let written = self.text(value, place)?;
        let as_told = written.trim().to_ascii_uppercase();
        let found = words.iter().find(|(word, _)| *word == as_told);
        if found.is_none() {
            let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            let message = format!("nothing is known of '{written}'");
            let remedy = format!("use one of {}", known.join(", "));
            self.refuse(ZoneCode::UnknownValue, place, message, &remedy);
        }
        found.map(|(_, meaning)| *meaning)
    }

    fn wrong_type(&mut self, place: &Place<'_>, expected: &str) {
        let message = format!("is not {expected}");
        let remedy = format!("write {expected}");
        self.refuse(ZoneCode::WrongType, place, message, &remedy);
    }

    pub(super) fn missing(&mut self, place: &Place<'_>, name: &str) {
        let place = place.member(name);
        let message = format!("'{name}' is missing");
        self.refuse(ZoneCode::MissingField, &place, message, "add it");
    }
}

impl<'a> Members<'a> {
    /// The member, unless it is absent, null or an empty text: feeds write all three for nothing.
    pub(super) fn get(&self, name: &str) -> Option<&'a Value> {
        let value = self.members.get(name)?;
        let is_nothing =
            value.is_null() || value.as_str().is_some_and(|text| text.trim().is_empty());
        (!is_nothing).then_some(value)
    }

    /// The first of several names that has a value.
    pub(super) fn first<'n>(&self, names: &[&'n str]) -> Option<(&'n str, &'a Value)> {
        let mut found = names
            .iter()
            .filter_map(|name| Some((*name, self.get(name)?)));
        found.next()
    }

    /// The member as text, where there is one.
    pub(super) fn text(&self, name: &str, sheet: &mut Sheet) -> Option<String> {
        sheet.text(self.get(name)?, &self.place.member(name))
    }
}
