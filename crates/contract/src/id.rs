//! Names of nodes, and places.

use serde::Serialize;
use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{SerializeSeq, Serializer};
use serde_json::Value;
use std::borrow::Cow;
use std::fmt;

/// The largest whole number that a double can be told from its neighbours, as which many clients read every number.
const WHOLE_MAX: u64 = (1 << 53) - 1;

/// The longest id, in characters.
const TEXT_MAX: usize = 256;

/// The id of a node: the text by which its network knows it.
///
/// A node has one id, whichever form it came in: an integer is read as its decimal digits, as the
/// loaders of networks read it. Told, it is always text. `007` is another id than `7`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(transparent)]
pub struct Id<'a>(Cow<'a, str>);

impl<'a> Id<'a> {
    /// The id of this text.
    pub fn new(text: impl Into<Cow<'a, str>>) -> Self {
        Self(text.into())
    }

    /// The id as text.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// The text of the id.
    pub fn into_text(self) -> String {
        self.0.into_owned()
    }

    /// The same id, borrowing nothing.
    pub fn into_owned(self) -> Id<'static> {
        Id(Cow::Owned(self.into_text()))
    }
}

impl From<i64> for Id<'_> {
    fn from(number: i64) -> Self {
        Self(Cow::Owned(number.to_string()))
    }
}

impl fmt::Display for Id<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.text().fmt(formatter)
    }
}

/// A list whose entries name nodes and segments, with ids as text, whichever form they came in.
pub fn with_ids_as_text(entries: Vec<Value>) -> Vec<Value> {
    let as_text = |entry: Value| match entry {
        Value::Array(ends) => Value::Array(with_ids_as_text(ends)),
        Value::Number(_) => match Id::deserialize(&entry) {
            Ok(id) => Value::String(id.into_text()),
            Err(_) => entry,
        },
        other => other,
    };
    entries.into_iter().map(as_text).collect()
}

impl<'de> Deserialize<'de> for Id<'_> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct IdVisitor;
        impl Visitor<'_> for IdVisitor {
            type Value = Id<'static>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("the id of a node, as text or an integer")
            }

            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Self::Value, E> {
                match number.unsigned_abs() <= WHOLE_MAX {
                    true => Ok(Id::from(number)),
                    false => Err(E::invalid_value(de::Unexpected::Signed(number), &self)),
                }
            }

            fn visit_u64<E: de::Error>(self, number: u64) -> Result<Self::Value, E> {
                match i64::try_from(number) {
                    Ok(number) => self.visit_i64(number),
                    Err(_) => Err(E::invalid_value(de::Unexpected::Unsigned(number), &self)),
                }
            }

            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Self::Value, E> {
                // Some clients write every number with a point; beyond 2^53 a double is no longer one integer.
                let is_whole = number.fract() == 0.0 && number.abs() <= 9_007_199_254_740_991.0;
                match is_whole {
                    true => Ok(Id::from(number as i64)),
                    false => Err(E::invalid_value(de::Unexpected::Float(number), &self)),
                }
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Self::Value, E> {
                match text.chars().count() <= TEXT_MAX {
                    true => Ok(Id::new(text.to_owned())),
                    false => Err(E::custom(format!(
                        "an id has at most {TEXT_MAX} characters"
                    ))),
                }
            }
        }
        deserializer.deserialize_any(IdVisitor)
    }
}

/// A place: `[longitude, latitude]`, `{x, y}` in metres on a planar network, or `{node}`.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// Longitude and latitude in degrees; on a planar network its two coordinates in metres.
    Pair([f64; 2]),
    /// Metres on a planar network.
    Planar {
        /// Metres east.
        x: f64,
        /// Metres north.
        y: f64,
    },
    /// Where a node is.
    Node(Id<'static>),
}

impl Serialize for Place {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        match self {
            Self::Pair(pair) => {
                let mut list = serializer.serialize_seq(Some(2))?;
                list.serialize_element(&pair[0])?;
                list.serialize_element(&pair[1])?;
                list.end()
            }
            Self::Planar { x, y } => {
                let mut map = serializer.serialize_map(Some(2))?;
                map.serialize_entry("x", x)?;
                map.serialize_entry("y", y)?;
                map.end()
            }
            Self::Node(node) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry("node", node)?;
                map.end()
            }
        }
    }
}

impl<'de> Deserialize<'de> for Place {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PlaceVisitor;
        impl<'de> Visitor<'de> for PlaceVisitor {
            type Value = Place;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(
                    "a place: [longitude, latitude], {\"x\": .., \"y\": ..} or {\"node\": ..}",
                )
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Place, A::Error> {
                let missing = |length| de::Error::invalid_length(length, &"two numbers");
                let first = list.next_element()?.ok_or_else(|| missing(0))?;
                let second = list.next_element()?.ok_or_else(|| missing(1))?;
                // A third number is an altitude, which the network knows better.
                let _altitude: Option<f64> = list.next_element()?;
                match list.next_element::<f64>()? {
                    None => Ok(Place::Pair([first, second])),
                    Some(_) => Err(missing(4)),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Place, A::Error> {
                let (mut node, mut first, mut second) = (None, None, None);
                let mut in_degrees = false;
                while let Some(name) = map.next_key::<Cow<'de, str>>()? {
                    match &*name {
                        "node" => node = Some(map.next_value()?),
                        "x" => first = Some(map.next_value()?),
                        "y" => second = Some(map.next_value()?),
                        "lon" => (first, in_degrees) = (Some(map.next_value()?), true),
                        "lat" => (second, in_degrees) = (Some(map.next_value()?), true),
                        other => {
                            return Err(de::Error::unknown_field(
                                other,
                                &["node", "x", "y", "lon", "lat"],
                            ));
                        }
                    }
                }
                match (node, first, second) {
                    (Some(node), ..) => Ok(Place::Node(node)),
                    (None, Some(lon), Some(lat)) if in_degrees => Ok(Place::Pair([lon, lat])),
                    (None, Some(x), Some(y)) => Ok(Place::Planar { x, y }),
                    _ => Err(de::Error::custom(
                        "a place needs both coordinates, or a node",
                    )),
                }
            }
        }
        deserializer.deserialize_any(PlaceVisitor)
    }
}

mod schema {
    use super::{Id, Place};
    use std::borrow::Cow;
    use utoipa::openapi::schema::{
        AdditionalProperties, ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, SchemaType, Type,
    };
    use utoipa::openapi::{Ref, RefOr};
    use utoipa::{PartialSchema, ToSchema};

    fn typed(kind: Type) -> ObjectBuilder {
        ObjectBuilder::new().schema_type(SchemaType::Type(kind))
    }

    fn closed_object() -> ObjectBuilder {
        typed(Type::Object).additional_properties(Some(AdditionalProperties::FreeForm(false)))
    }

    fn pair_of(first: &str, second: &str) -> ObjectBuilder {
        let number = || typed(Type::Number).build();
        closed_object()
            .property(first, number())
            .property(second, number())
            .required(first)
            .required(second)
    }

    impl PartialSchema for Id<'_> {
        fn schema() -> RefOr<Schema> {
            let text = typed(Type::String)
                .description(Some("The id of a node."))
                .max_length(Some(256));
            RefOr::T(text.into())
        }
    }

    impl ToSchema for Id<'_> {
        fn name() -> Cow<'static, str> {
            Cow::Borrowed("Id")
        }
    }

    impl PartialSchema for Place {
        fn schema() -> RefOr<Schema> {
            let pair = ArrayBuilder::new()
                .items(typed(Type::Number))
                .min_items(Some(2))
                .max_items(Some(3));
            let one_of = OneOfBuilder::new()
                .description(Some(
                    "A place: [longitude, latitude], {x, y} on a planar network, or {node}.",
                ))
                .item(pair)
                .item(pair_of("x", "y"))
                .item(pair_of("lon", "lat"))
                .item(
                    closed_object()
                        .property("node", Ref::from_schema_name(Id::name()))
                        .required("node"),
                );
            RefOr::T(one_of.into())
        }
    }

    impl ToSchema for Place {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_id_is_one_whichever_form_it_came_in() {
        for (given, told) in [
            (json!(379), "379"),
            (json!("379"), "379"),
            (json!(379.0), "379"),
            (json!(-0.0), "0"),
            (json!(-7), "-7"),
            (json!("007"), "007"),
            (json!("north"), "north"),
        ] {
            let id: Id<'_> = Id::deserialize(&given).expect("an id");
            assert_eq!(id, Id::new(told), "{given}");
            assert_eq!(json!(id), json!(told), "{given}");
        }
        for given in [json!(0.5), json!(1_u64 << 53), json!(null), json!([1])] {
            assert!(Id::deserialize(&given).is_err(), "{given}");
        }
    }

    #[test]
    fn lists_of_names_have_text_for_integers_and_keep_what_is_no_id() {
        let given = vec![
            json!(1),
            json!(["2", 3]),
            json!("1-2"),
            json!(0.5),
            json!({"a": 1}),
        ];
        let told = vec![
            json!("1"),
            json!(["2", "3"]),
            json!("1-2"),
            json!(0.5),
            json!({"a": 1}),
        ];
        assert_eq!(with_ids_as_text(given), told);
    }
}
