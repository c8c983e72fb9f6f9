//! The blocks of an extract: lengths, headers, compressed protocol buffers.
//!
//! The messages have the fields that are read; the others are passed over while they are decoded.

use crate::error::FormatError;
use flate2::read::ZlibDecoder;
use prost::Message;
use std::io::Read;

/// A header is no larger, and a block neither packed nor unpacked (the limits of the format).
const MAX_HEADER_BYTES: usize = 64 << 10;
const MAX_BLOCK_BYTES: usize = 32 << 20;
/// What an extract may require of its reader.
const KNOWN_FEATURES: [&str; 2] = ["OsmSchema-V0.6", "DenseNodes"];
/// The parts of a degree that positions count.
const NANODEGREES: f64 = 1e9;

#[derive(Clone, PartialEq, Message)]
struct BlobHeader {
    #[prost(string, tag = "1")]
    kind: String,
    #[prost(int32, tag = "3")]
    size: i32,
}

#[derive(Clone, PartialEq, Message)]
struct Blob {
    #[prost(bytes = "vec", optional, tag = "1")]
    raw: Option<Vec<u8>>,
    #[prost(bytes = "vec", optional, tag = "3")]
    zlib: Option<Vec<u8>>,
}

#[derive(Clone, PartialEq, Message)]
struct HeaderBlock {
    #[prost(string, repeated, tag = "4")]
    required_features: Vec<String>,
}

/// A block of elements, which share its texts and its grid of positions.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Block {
    #[prost(message, optional, tag = "1")]
    texts: Option<Texts>,
    #[prost(message, repeated, tag = "2")]
    pub(super) groups: Vec<Group>,
    #[prost(int32, optional, tag = "17", default = "100")]
    granularity: Option<i32>,
    #[prost(int64, tag = "19")]
    lat_offset: i64,
    #[prost(int64, tag = "20")]
    lon_offset: i64,
}

#[derive(Clone, PartialEq, Message)]
struct Texts {
    #[prost(bytes = "vec", repeated, tag = "1")]
    texts: Vec<Vec<u8>>,
}

/// Elements of one kind.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Group {
    #[prost(message, repeated, tag = "1")]
    nodes: Vec<Node>,
    #[prost(message, optional, tag = "2")]
    dense: Option<DenseNodes>,
    #[prost(message, repeated, tag = "3")]
    pub(super) ways: Vec<Way>,
    #[prost(message, repeated, tag = "4")]
    pub(super) relations: Vec<Relation>,
}

#[derive(Clone, PartialEq, Message)]
struct Node {
    #[prost(sint64, tag = "1")]
    id: i64,
    #[prost(sint64, tag = "8")]
    lat: i64,
    #[prost(sint64, tag = "9")]
    lon: i64,
}

/// Nodes in columns, each number as its difference from the one before.
#[derive(Clone, PartialEq, Message)]
struct DenseNodes {
    #[prost(sint64, repeated, tag = "1")]
    ids: Vec<i64>,
    #[prost(sint64, repeated, tag = "8")]
    lats: Vec<i64>,
    #[prost(sint64, repeated, tag = "9")]
    lons: Vec<i64>,
}

/// A way, its nodes as differences.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Way {
    #[prost(int64, tag = "1")]
    pub(super) id: i64,
    #[prost(uint32, repeated, tag = "2")]
    pub(super) keys: Vec<u32>,
    #[prost(uint32, repeated, tag = "3")]
    pub(super) values: Vec<u32>,
    #[prost(sint64, repeated, tag = "8")]
    nodes: Vec<i64>,
}

impl Way {
    /// The ids of its nodes.
    pub(super) fn nodes(&self) -> impl Iterator<Item = i64> {
        sums(&self.nodes)
    }
}

/// A relation, its members in columns.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Relation {
    #[prost(int64, tag = "1")]
    pub(super) id: i64,
    #[prost(uint32, repeated, tag = "2")]
    pub(super) keys: Vec<u32>,
    #[prost(uint32, repeated, tag = "3")]
    pub(super) values: Vec<u32>,
    #[prost(int32, repeated, tag = "8")]
    roles: Vec<i32>,
    #[prost(sint64, repeated, tag = "9")]
    members: Vec<i64>,
    #[prost(int32, repeated, tag = "10")]
    kinds: Vec<i32>,
}

impl Relation {
    /// The ids of the ways in it, each with the place of its role among the texts.
    pub(super) fn ways(&self) -> impl Iterator<Item = (i64, u32)> {
        const WAY: i32 = 1;
        let members = sums(&self.members).zip(&self.kinds).zip(&self.roles);
        let ways = members.filter(|((_, kind), _)| **kind == WAY);
        ways.map(|((id, _), role)| (id, u32::try_from(*role).unwrap_or_default()))
    }
}

/// Numbers from their differences. What overflows stays at the largest, which is no position on Earth.
fn sums(differences: &[i64]) -> impl Iterator<Item = i64> {
    differences.iter().scan(0_i64, |sum, difference| {
        *sum = sum.saturating_add(*difference);
        Some(*sum)
    })
}

impl Block {
    /// A text by its place; empty where there is none.
    pub(super) fn text(&self, place: u32) -> &str {
        let texts = self.texts.as_ref();
        let text = texts.and_then(|texts| texts.texts.get(place as usize));
        let text = text.and_then(|text| str::from_utf8(text).ok());
        text.unwrap_or_default()
    }

    /// The tags of an element.
    pub(super) fn tags<'b>(
        &'b self,
        keys: &'b [u32],
        values: &'b [u32],
    ) -> impl Iterator<Item = (&'b str, &'b str)> {
        let places = keys.iter().zip(values);
        places.map(|(key, value)| (self.text(*key), self.text(*value)))
    }

    /// All nodes: ids and positions, longitude first.
    pub(super) fn nodes(&self) -> impl Iterator<Item = (i64, [f64; 2])> {
        self.groups.iter().flat_map(|group| {
            let single = group.nodes.iter().map(|node| (node.id, node.lon, node.lat));
            let dense = group.dense.iter().flat_map(|dense| {
                let lons_lats = sums(&dense.lons).zip(sums(&dense.lats));
                let nodes = sums(&dense.ids).zip(lons_lats);
                nodes.map(|(id, (lon, lat))| (id, lon, lat))
            });
            let nodes = single.chain(dense);
            nodes.map(|(id, lon, lat)| {
                let lon = self.degrees(lon, self.lon_offset);
                (id, [lon, self.degrees(lat, self.lat_offset)])
            })
        })
    }

    fn degrees(&self, steps: i64, offset: i64) -> f64 {
        let nanodegrees = i128::from(steps) * i128::from(self.granularity()) + i128::from(offset);
        nanodegrees as f64 / NANODEGREES
    }
}

/// Hands over the blocks of elements of an extract, one after the other.
pub(super) fn each_block(
    extract: &[u8],
    mut take: impl FnMut(&Block) -> Result<(), FormatError>,
) -> Result<(), FormatError> {
    let mut rest = extract;
    let mut number = 0;
    while !rest.is_empty() {
        number += 1;
        let fault = |message: &str| FormatError::new(format!("/block {number}"), message);
        let cut_off = || fault("ends before its end; copy or download the extract again");
        let (length, after) = rest.split_at_checked(4).ok_or_else(cut_off)?;
        let length = length
            .iter()
            .fold(0, |sum, byte| sum << 8 | usize::from(*byte));
        if length > MAX_HEADER_BYTES {
            return Err(fault(
                "has a header larger than the format allows; is it a .osm.pbf?",
            ));
        }
        let (header, after) = after.split_at_checked(length).ok_or_else(cut_off)?;
        let header = BlobHeader::decode(header)
            .map_err(|error| fault(&format!("has a header that cannot be read: {error}")))?;
        let size = usize::try_from(header.size).ok();
        let size = size.filter(|size| *size <= MAX_BLOCK_BYTES);
        let size = size.ok_or_else(|| fault("is larger than the format allows"))?;
        let (blob, after) = after.split_at_checked(size).ok_or_else(cut_off)?;
        rest = after;
        match header.kind.as_str() {
            "OSMHeader" => check_features(&unpacked(blob).map_err(|told| fault(&told))?, &fault)?,
            "OSMData" => {
                let bytes = unpacked(blob).map_err(|told| fault(&told))?;
                let block = Block::decode(bytes.as_slice())
                    .map_err(|error| fault(&format!("cannot be read: {error}")))?;
                take(&block)?;
            }
            // The format has readers pass over what they do not know.
            _ => {}
        }
    }
    Ok(())
}

fn unpacked(blob: &[u8]) -> Result<Vec<u8>, String> {
    let blob = Blob::decode(blob).map_err(|error| format!("cannot be read: {error}"))?;
    let packed = match (blob.raw, blob.zlib) {
        (Some(raw), _) => return Ok(raw),
        (None, Some(packed)) => packed,
        (None, None) => {
            let told = "is not compressed with zlib; write the extract again, as osmium cat does";
            return Err(told.to_owned());
        }
    };
    let mut bytes = Vec::new();
    let bounded = ZlibDecoder::new(packed.as_slice()).take(MAX_BLOCK_BYTES as u64 + 1);
    let unpacked = { bounded }.read_to_end(&mut bytes);
    match unpacked {
        Ok(count) if count > MAX_BLOCK_BYTES => Err("is larger than the format allows".to_owned()),
        Ok(_) => Ok(bytes),
        Err(error) => Err(format!("cannot be unpacked: {error}")),
    }
}

fn check_features(bytes: &[u8], fault: &dyn Fn(&str) -> FormatError) -> Result<(), FormatError> {
    let header =
        HeaderBlock::decode(bytes).map_err(|error| fault(&format!("cannot be read: {error}")))?;
    let mut required = header.required_features.iter();
    match required.find(|feature| !KNOWN_FEATURES.contains(&feature.as_str())) {
        None => Ok(()),
        Some(feature) => Err(
            fault(&format!("requires '{feature}', which is not read here"))
                .hint("make an extract of the map as it is now, as osmium extract does"),
        ),
    }
}
