//! The text of a certificate, read strictly: every member there, once, of its type, and no other.

use super::fault::CertificateFault;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::marker::PhantomData;

/// Reads the text of a certificate, without asking what it means.
pub(super) fn read(text: &str) -> Result<Document, CertificateFault> {
    match serde_json::from_str(text) {
        Ok(Object(document)) => Ok(document),
        Err(error) => Err(CertificateFault::Unreadable {
            reason: error.to_string(),
        }),
    }
}

/// A certificate as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    pub(super) network_sha256: String,
    pub(super) starts: Vec<Object<WrittenStart>>,
    pub(super) destination: WrittenId,
    pub(super) closed_nodes: Vec<WrittenId>,
    pub(super) closed_segments: Vec<Object<WrittenSegment>>,
    /// Null, but not absent, when there is no way.
    #[serde(deserialize_with = "Option::deserialize")]
    pub(super) length_m: Option<f64>,
    pub(super) settled: Vec<Object<WrittenLabel>>,
    pub(super) h_m: WrittenBounds,
    pub(super) path: Object<WrittenPath>,
}

/// A way into the network, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStart {
    pub(super) node: WrittenId,
    pub(super) offset_m: f64,
}

/// A closed segment, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenSegment {
    pub(super) id: String,
    pub(super) from: WrittenId,
    pub(super) to: WrittenId,
}

/// A settled node, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenLabel {
    pub(super) node: WrittenId,
    pub(super) d_m: f64,
}

/// The path, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenPath {
    pub(super) nodes: Vec<WrittenId>,
    pub(super) segments: Vec<String>,
}

/// A JSON object. Derived readers would also take an array of the members' values in their order.
#[derive(Debug)]
pub(super) struct Object<T>(pub(super) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ObjectVisitor(PhantomData))
    }
}

struct ObjectVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
    type Value = Object<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(members)).map(Object)
    }
}

/// A node's id: text, or an integer as older certificates have it.
#[derive(Debug)]
pub(super) struct WrittenId(pub(super) String);

impl<'de> Deserialize<'de> for WrittenId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(IdVisitor)
    }
}

struct IdVisitor;

impl Visitor<'_> for IdVisitor {
    type Value = WrittenId;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a node id: text or an integer")
    }

    fn visit_u64<E: Error>(self, id: u64) -> Result<WrittenId, E> {
        Ok(WrittenId(id.to_string()))
    }

    fn visit_i64<E: Error>(self, id: i64) -> Result<WrittenId, E> {
        Ok(WrittenId(id.to_string()))
    }

    fn visit_str<E: Error>(self, id: &str) -> Result<WrittenId, E> {
        Ok(WrittenId(id.to_owned()))
    }
}

/// The bounds by node id as written, an id that is written twice included; null is infinite.
#[derive(Debug)]
pub(super) struct WrittenBounds(pub(super) Vec<(String, Option<f64>)>);

impl<'de> Deserialize<'de> for WrittenBounds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(BoundsVisitor)
    }
}

struct BoundsVisitor;

impl<'de> Visitor<'de> for BoundsVisitor {
    type Value = WrittenBounds;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object from node ids to metres or null")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<WrittenBounds, A::Error> {
        let mut bounds = Vec::new();
        while let Some(member) = members.next_entry()? {
            bounds.push(member);
        }
        Ok(WrittenBounds(bounds))
    }
}
