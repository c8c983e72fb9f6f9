//! A place in a JSON document, and values read with the place in the error.
//!
//! The path is a chain on the stack; its text (a JSON Pointer, RFC 6901) is only made for an error.

use crate::error::FormatError;
use serde_json::{Map, Value};

/// A place in a JSON document: the root, a member of an object or an element of an array.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    parent: Option<&'a Place<'a>>,
    step: Step<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Step<'a> {
    Root,
    Member(&'a str),
    Element(usize),
}

impl<'a> Place<'a> {
    /// The document itself.
    pub(super) const ROOT: Place<'static> = Place {
        parent: None,
        step: Step::Root,
    };

    /// The member of the object at this place.
    pub(super) fn member(&'a self, name: &'a str) -> Self {
        Self {
            parent: Some(self),
            step: Step::Member(name),
        }
    }

    /// The element of the array at this place, from 0.
    pub(super) fn element(&'a self, index: usize) -> Self {
        Self {
            parent: Some(self),
            step: Step::Element(index),
        }
    }

    /// The JSON Pointer.
    pub(super) fn pointer(&self) -> String {
        let mut text = self.parent.map(Place::pointer).unwrap_or_default();
        match self.step {
            Step::Root => {}
            Step::Member(name) => {
                text.push('/');
                text.push_str(&name.replace('~', "~0").replace('/', "~1"));
            }
            Step::Element(index) => {
                text.push('/');
                text.push_str(&index.to_string());
            }
        }
        text
    }

    /// An error at this place.
    pub(super) fn error(&self, message: impl Into<String>) -> FormatError {
        FormatError::new(self.pointer(), message)
    }

    /// An error at this place: the value is of another kind than it should be.
    pub(super) fn wrong_kind(&self, value: &Value, expected: &str) -> FormatError {
        self.error(format!("is {}, not {expected}", kind_of(value)))
    }
}

/// What a value is, in words.
fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

/// The value as an object.
pub(super) fn object<'v>(
    value: &'v Value,
    place: &Place<'_>,
) -> Result<&'v Map<String, Value>, FormatError> {
    value
        .as_object()
        .ok_or_else(|| place.wrong_kind(value, "an object"))
}

/// The value as an array.
pub(super) fn array<'v>(value: &'v Value, place: &Place<'_>) -> Result<&'v [Value], FormatError> {
    match value {
        Value::Array(elements) => Ok(elements),
        _ => Err(place.wrong_kind(value, "an array")),
    }
}

/// The value as text.
pub(super) fn text<'v>(value: &'v Value, place: &Place<'_>) -> Result<&'v str, FormatError> {
    value
        .as_str()
        .ok_or_else(|| place.wrong_kind(value, "text"))
}

/// The value as a finite number.
pub(super) fn number(value: &Value, place: &Place<'_>) -> Result<f64, FormatError> {
    match value.as_f64() {
        Some(number) if number.is_finite() => Ok(number),
        Some(_) => Err(place.error("is beyond the range of a double")),
        None => {
            let error = place.wrong_kind(value, "a number");
            let quoted = value
                .as_str()
                .is_some_and(|text| text.trim().parse::<f64>().is_ok());
            Err(if quoted {
                error.hint("remove the quotes")
            } else {
                error
            })
        }
    }
}

/// The member of an object, `None` where it is absent or null.
pub(super) fn optional<'v>(members: &'v Map<String, Value>, name: &str) -> Option<&'v Value> {
    members.get(name).filter(|value| !value.is_null())
}

/// The member of an object, which has to be there.
pub(super) fn required<'v>(
    members: &'v Map<String, Value>,
    name: &str,
    place: &Place<'_>,
) -> Result<&'v Value, FormatError> {
    members
        .get(name)
        .ok_or_else(|| place.error(format!("has no member '{name}'")))
}

/// A position: an array of two finite numbers.
pub(super) fn position(value: &Value, place: &Place<'_>) -> Result<[f64; 2], FormatError> {
    match array(value, place)? {
        [first, second] => Ok([
            number(first, &place.element(0))?,
            number(second, &place.element(1))?,
        ]),
        [_, _, _] => Err(place
            .error("has three numbers, not two")
            .hint("an altitude belongs in the properties, with its reference")),
        elements => Err(place.error(format!("has {} numbers, not two", elements.len()))),
    }
}

/// Refuses a position that longitude and latitude in degrees cannot be.
pub(super) fn in_degrees(position: [f64; 2], place: &Place<'_>) -> Result<(), FormatError> {
    let [lon_deg, lat_deg] = position;
    if lat_deg.abs() > 90.0 {
        return Err(place
            .error(format!("has the latitude {lat_deg}, outside -90..90"))
            .hint("longitude comes first; were longitude and latitude swapped?"));
    }
    if lon_deg.abs() > 180.0 {
        return Err(place.error(format!("has the longitude {lon_deg}, outside -180..180")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_are_escaped() {
        let root = Place::ROOT;
        let features = root.member("features");
        let third = features.element(3);
        assert_eq!(third.member("a/b~c").pointer(), "/features/3/a~1b~0c");
        assert_eq!(root.pointer(), "");
    }
}
