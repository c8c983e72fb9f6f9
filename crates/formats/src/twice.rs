//! Members that a JSON object has twice: what readers make of them differs, so it is unclear which one was meant.

use serde::de::{self, DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::collections::BTreeSet;
use std::fmt;

/// The most that are told.
const TOLD_MAX: usize = 8;
/// Objects are looked at so deep; what is deeper is nothing that anyone reads.
const DEPTH_MAX: usize = 100;

/// JSON Pointers (RFC 6901) of members that are there twice, in their order, at most eight; none of what is no JSON.
pub fn members_twice(json: &[u8]) -> Vec<String> {
    let mut search = Search::default();
    let mut reader = serde_json::Deserializer::from_slice(json);
    // What is no JSON is told by who reads it.
    let _ = Look(&mut search).deserialize(&mut reader);
    search.found
}

#[derive(Debug, Default)]
struct Search {
    /// The pointer of where the reader is.
    place: String,
    depth: usize,
    found: Vec<String>,
}

impl Search {
    /// Looks at what is under a name.
    fn below<T>(&mut self, name: &str, look: impl FnOnce(&mut Self) -> T) -> T {
        let length = self.place.len();
        self.place.push('/');
        for letter in name.chars() {
            match letter {
                '~' => self.place.push_str("~0"),
                '/' => self.place.push_str("~1"),
                letter => self.place.push(letter),
            }
        }
        self.depth += 1;
        let seen = look(self);
        self.depth -= 1;
        self.place.truncate(length);
        seen
    }
}

/// One look at a value.
struct Look<'a>(&'a mut Search);

impl<'de> DeserializeSeed<'de> for Look<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<(), D::Error> {
        if self.0.depth >= DEPTH_MAX || self.0.found.len() >= TOLD_MAX {
            return reader.deserialize_ignored_any(IgnoredAny).map(drop);
        }
        reader.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Look<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("any JSON value")
    }

    fn visit_unit<E: de::Error>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_bool<E: de::Error>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E: de::Error>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E: de::Error>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E: de::Error>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E: de::Error>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        for number in 0_usize.. {
            let name = number.to_string();
            let next = self
                .0
                .below(&name, |search| list.next_element_seed(Look(search)))?;
            if next.is_none() {
                break;
            }
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut names = BTreeSet::new();
        while let Some(name) = map.next_key::<String>()? {
            let is_first = !names.contains(&name);
            self.0.below(&name, |search| {
                if !is_first
                    && search.found.len() < TOLD_MAX
                    && !search.found.contains(&search.place)
                {
                    search.found.push(search.place.clone());
                }
                map.next_value_seed(Look(search))
            })?;
            names.insert(name);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_told_once_with_its_place() {
        let json = br#"{"a": 1, "b": [{}, {"c/d": 1, "c/d": {"e~": 1, "e~": 2, "e~": 3}}], "a": [], "f": {"a": 1}}"#;
        assert_eq!(members_twice(json), ["/b/1/c~1d", "/b/1/c~1d/e~0", "/a"]);
        for json in ["{}", "[1, 2", "no JSON", r#"{"a": {"a": {"a": 1.5e300}}}"#] {
            assert!(members_twice(json.as_bytes()).is_empty(), "{json}");
        }
    }

    #[test]
    fn neither_many_nor_deep_ones_cost_more_than_reading_them() {
        let many: Vec<String> = (0..100).map(|number| format!(r#""{number}": 1"#)).collect();
        let many = format!("{{{0}, {0}}}", many.join(", "));
        assert_eq!(members_twice(many.as_bytes()).len(), TOLD_MAX);
        let deep = "[".repeat(200_000);
        assert!(members_twice(deep.as_bytes()).is_empty());
    }
}
