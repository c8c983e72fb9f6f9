//! Reading the native format.
//!
//! The features are read one at a time, so that a large file is never in memory as a tree of
//! values.

use super::feature::{Feature, known, read_feature};
use super::{END_TOLERANCE_GEOGRAPHIC_M, END_TOLERANCE_PLANAR_M, FORMAT};
use crate::error::{FormatError, FormatErrors};
use crate::geo::{Frame, LocalPlane};
use crate::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use crate::place::{Place, in_degrees, object, required, text};
use rustc_hash::FxHashMap;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use std::fmt;

/// Reads a network and checks all that can be seen in the file by itself.
///
/// What concerns the network as a whole (ids borne twice, parallel segments) is checked by
/// [`Topology::build`](crate::network::Topology::build).
///
/// # Errors
/// Up to [`MAX_FORMAT_ERRORS`](crate::MAX_FORMAT_ERRORS) errors, one for each feature at
/// fault: members that the format does not have, values of another kind, positions off the Earth,
/// lines that do not end at their nodes.
pub fn read_network(text: &str) -> Result<NetworkDraft, Vec<FormatError>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut document = Document::default();
    let mut json = serde_json::Deserializer::from_str(text);
    let read = DocumentReader(&mut document)
        .deserialize(&mut json)
        .and_then(|()| json.end());
    if let Err(error) = read {
        document
            .errors
            .push(FormatError::new("", format!("cannot be read: {error}")));
        return document.errors.or(NetworkDraft::default());
    }
    document.finish()
}

/// The document as far as it has been read.
#[derive(Default)]
struct Document {
    kind: Option<Value>,
    name: Option<Value>,
    attribution: Option<Value>,
    skyway: Option<Value>,
    has_features: bool,
    nodes: Vec<Read<NodeDraft>>,
    /// True where a node's id is written as an integer.
    integer_ids: Vec<bool>,
    segments: Vec<Read<(SegmentDraft, [[f64; 2]; 2])>>,
    errors: FormatErrors,
}

/// Something read, with the place of its feature in the list.
struct Read<T> {
    feature: usize,
    value: T,
}

impl Document {
    fn take_feature(&mut self, index: usize, value: &Value) {
        let list = Place::ROOT.member("features");
        match read_feature(value, &list.element(index)) {
            Ok(Feature::Node { node, is_integer }) => {
                self.nodes.push(Read {
                    feature: index,
                    value: node,
                });
                self.integer_ids.push(is_integer);
            }
            Ok(Feature::Segment { segment, ends }) => {
                self.segments.push(Read {
                    feature: index,
                    value: (segment, ends),
                });
            }
            Err(error) => self.errors.push(error),
        }
    }

    fn take_member(&mut self, name: &str, value: Value) -> Result<(), FormatError> {
        let place = Place::ROOT.member(name);
        let slot = match name {
            "type" => &mut self.kind,
            "name" => &mut self.name,
            "attribution" => &mut self.attribution,
            "skyway" => &mut self.skyway,
            "crs" => return check_crs(&value, &place),
            _ => {
                let error = place.error("is not a member that this format has");
                return Err(
                    error.hint("known here: type, name, attribution, skyway, features, bbox, crs")
                );
            }
        };
        match slot.replace(value) {
            None => Ok(()),
            Some(_) => Err(place.error("is there twice")),
        }
    }

    fn finish(mut self) -> Result<NetworkDraft, Vec<FormatError>> {
        let head = self.head().unwrap_or_else(|error| {
            self.errors.push(error);
            Head::default()
        });
        self.check_ids();
        self.check_positions(head.coordinates);
        // A node that could not be read would be missed at the end of every line to it.
        if self.errors.is_empty() {
            self.check_lines(head.coordinates);
        }
        let draft = NetworkDraft {
            name: head.name,
            attribution: head.attribution,
            coordinates: head.coordinates,
            integer_ids: self.integer_ids.first() == Some(&true),
            nodes: self.nodes.into_iter().map(|node| node.value).collect(),
            segments: self
                .segments
                .into_iter()
                .map(|segment| segment.value.0)
                .collect(),
            aliases: Vec::new(),
        };
        self.errors.or(draft)
    }

    fn head(&self) -> Result<Head, FormatError> {
        let root = Place::ROOT;
        if self.kind.as_ref().and_then(Value::as_str) != Some("FeatureCollection") {
            return Err(root.member("type").error("is not 'FeatureCollection'"));
        }
        let words = |value: &Option<Value>, name: &str| match value {
            None => Ok(String::new()),
            Some(value) => text(value, &root.member(name)).map(str::to_owned),
        };
        let skyway = self.skyway.as_ref().ok_or_else(|| {
            let hint = r#"add "skyway": {"format": 1, "coordinates": "geographic"} or "planar""#;
            root.error("has no member 'skyway'").hint(hint)
        })?;
        let place = root.member("skyway");
        let skyway = object(skyway, &place)?;
        known(skyway, &["format", "coordinates"], &place)?;
        let format = required(skyway, "format", &place)?;
        if format.as_u64() != Some(FORMAT) {
            let error = place.member("format").error(format!("is {format}"));
            return Err(error.hint(format!("this version reads format {FORMAT}")));
        }
        if !self.has_features {
            return Err(root.error("has no member 'features'"));
        }
        let coordinates_place = place.member("coordinates");
        let coordinates = match text(required(skyway, "coordinates", &place)?, &coordinates_place)?
        {
            "geographic" => Coordinates::Geographic,
            "planar" => Coordinates::Planar,
            other => {
                let error = coordinates_place.error(format!("is '{other}'"));
                return Err(error.hint("write 'geographic' or 'planar'"));
            }
        };
        Ok(Head {
            name: words(&self.name, "name")?,
            attribution: words(&self.attribution, "attribution")?,
            coordinates,
        })
    }

    /// All ids are integers, or none is: node order is numeric or by bytes.
    fn check_ids(&mut self) {
        let Some(&first) = self.integer_ids.first() else {
            return;
        };
        let odd = self
            .integer_ids
            .iter()
            .position(|&is_integer| is_integer != first);
        let Some(node) = odd.map(|odd| &self.nodes[odd]) else {
            return;
        };
        let (this, others) = if first {
            ("text", "integers")
        } else {
            ("an integer", "text")
        };
        let list = Place::ROOT.member("features");
        let feature = list.element(node.feature);
        let error = feature
            .member("id")
            .error(format!("is {this}, but earlier ids are {others}"));
        let error = error.of(format!("node '{}'", node.value.id));
        self.errors
            .push(error.hint("write all ids as integers, or all as text"));
    }

    fn check_positions(&mut self, coordinates: Coordinates) {
        if coordinates == Coordinates::Planar {
            return;
        }
        let list = Place::ROOT.member("features");
        for node in &self.nodes {
            let feature = list.element(node.feature);
            let geometry = feature.member("geometry");
            let checked = in_degrees(node.value.position, &geometry.member("coordinates"));
            if let Err(error) = checked {
                self.errors
                    .push(error.of(format!("node '{}'", node.value.id)));
            }
        }
    }

    fn check_lines(&mut self, coordinates: Coordinates) {
        let list = Place::ROOT.member("features");
        let nodes = self.nodes.iter().map(|node| &node.value);
        let positions = nodes
            .map(|node| (node.id.as_str(), node.position))
            .collect();
        for Read { feature, value } in &self.segments {
            let (segment, ends) = value;
            let feature = list.element(*feature);
            if let Err(error) = check_ends(segment, ends, coordinates, &positions, &feature) {
                let label = match &segment.id {
                    Some(id) => format!("segment '{id}'"),
                    None => format!("segment '{}-{}'", segment.from, segment.to),
                };
                self.errors.push(error.of(label));
            }
        }
    }
}

/// What the members beside the features say.
#[derive(Default)]
struct Head {
    name: String,
    attribution: String,
    coordinates: Coordinates,
}

/// Accepts the `crs` that map software writes for longitude and latitude; RFC 7946 allows no other.
fn check_crs(value: &Value, place: &Place<'_>) -> Result<(), FormatError> {
    let name = value.pointer("/properties/name").and_then(Value::as_str);
    match name {
        Some("urn:ogc:def:crs:OGC:1.3:CRS84" | "urn:ogc:def:crs:OGC::CRS84") => Ok(()),
        _ => Err(place
            .error("is not WGS 84 longitude and latitude")
            .hint("convert to 'urn:ogc:def:crs:OGC:1.3:CRS84' and remove this member")),
    }
}

/// Checks that a line ends at its nodes.
pub(crate) fn check_ends(
    segment: &SegmentDraft,
    ends: &[[f64; 2]; 2],
    coordinates: Coordinates,
    positions: &FxHashMap<&str, [f64; 2]>,
    feature: &Place<'_>,
) -> Result<(), FormatError> {
    let properties = feature.member("properties");
    let position = |name: &str, id: &str| {
        let found = positions.get(id).copied();
        found.ok_or_else(|| {
            let error = properties.member(name).error(format!(
                "names the node '{id}', which the file does not have"
            ));
            error.hint("add the node, or correct the id")
        })
    };
    let nodes = [
        position("from", &segment.from)?,
        position("to", &segment.to)?,
    ];
    let tolerance_m = match coordinates {
        Coordinates::Geographic => END_TOLERANCE_GEOGRAPHIC_M,
        Coordinates::Planar => END_TOLERANCE_PLANAR_M,
    };
    let apart_m = |end: [f64; 2], node: [f64; 2]| {
        let frame = match coordinates {
            Coordinates::Geographic => Frame::Geographic(LocalPlane::about(node[0], node[1])),
            Coordinates::Planar => Frame::Planar,
        };
        frame.to_plane(end).distance_m(frame.to_plane(node))
    };
    let geometry = feature.member("geometry");
    let line = geometry.member("coordinates");
    for (index, id) in [&segment.from, &segment.to].into_iter().enumerate() {
        let distance_m = apart_m(ends[index], nodes[index]);
        if distance_m <= tolerance_m {
            continue;
        }
        let error = line
            .element(index)
            .error(format!("is {distance_m:.1} m from the node '{id}'"));
        let is_reversed =
            apart_m(ends[0], nodes[1]) <= tolerance_m && apart_m(ends[1], nodes[0]) <= tolerance_m;
        return Err(error.hint(match is_reversed {
            true => "the line runs from 'to' to 'from'; turn it round",
            false => "a segment's line ends at its nodes",
        }));
    }
    Ok(())
}

struct DocumentReader<'a>(&'a mut Document);

impl<'de> DeserializeSeed<'de> for DocumentReader<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for DocumentReader<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a GeoJSON FeatureCollection")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<(), A::Error> {
        while let Some(name) = members.next_key::<String>()? {
            match name.as_str() {
                "features" if self.0.has_features => {
                    members.next_value::<IgnoredAny>()?;
                    self.0
                        .errors
                        .push(Place::ROOT.member("features").error("is there twice"));
                }
                "features" => {
                    self.0.has_features = true;
                    members.next_value_seed(FeaturesReader(self.0))?;
                }
                "bbox" => {
                    members.next_value::<IgnoredAny>()?;
                }
                _ => {
                    let value = members.next_value()?;
                    if let Err(error) = self.0.take_member(&name, value) {
                        self.0.errors.push(error);
                    }
                }
            }
        }
        Ok(())
    }
}

struct FeaturesReader<'a>(&'a mut Document);

impl<'de> DeserializeSeed<'de> for FeaturesReader<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for FeaturesReader<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an array of features")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut features: A) -> Result<(), A::Error> {
        let mut index = 0;
        while let Some(feature) = features.next_element::<Value>()? {
            if !self.0.errors.is_full() {
                self.0.take_feature(index, &feature);
            }
            index += 1;
        }
        Ok(())
    }
}
