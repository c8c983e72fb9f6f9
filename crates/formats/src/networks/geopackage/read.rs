//! Reading a GeoPackage: rows with their geometries to nodes and segments.

use super::{Cell, NODES_LAYER, SEGMENTS_LAYER, geometry};
use crate::error::{FormatError, FormatErrors};
use crate::network::{Coordinates, NetworkDraft, SegmentDraft};
use crate::networks::attributes::{
    ReadNetwork, Unread, add_node, position_names, read_node, read_segment,
};
use crate::networks::geojson::check_ends;
use crate::networks::load::{LoadError, LoadedNetwork, build_foreign};
use crate::place::Place;
use rustc_hash::FxHashMap;
use serde_json::{Map, Number, Value};
use sha2::{Digest, Sha256};

/// The column that numbers the rows, as tools call it.
const ROW_NUMBER: &str = "fid";

/// A layer as a database has it.
#[derive(Clone, Debug, Default)]
pub struct GeopackageLayer {
    /// The names of its columns.
    pub columns: Vec<String>,
    /// The place of the geometry among them.
    pub geometry: usize,
    /// A cell for each column.
    pub rows: Vec<Vec<Cell>>,
}

/// What a GeoPackage has of a network.
#[derive(Clone, Debug, Default)]
pub struct GeopackageNetwork {
    /// The name, where it is stated.
    pub name: Option<String>,
    /// Who must be named, where it is stated.
    pub attribution: Option<String>,
    /// What positions are, by the reference system of the nodes.
    pub coordinates: Coordinates,
    /// The layer [`NODES_LAYER`].
    pub nodes: GeopackageLayer,
    /// The layer [`SEGMENTS_LAYER`].
    pub segments: GeopackageLayer,
}

/// Loads a network from the layers of a GeoPackage, and from the bytes of its file takes the fingerprint.
///
/// # Errors
/// Everything that is wrong with it, each with its layer and row, up to a bound.
pub fn load_geopackage(
    network: &GeopackageNetwork,
    file: &[u8],
) -> Result<LoadedNetwork, LoadError> {
    let read = read(network).map_err(LoadError::Format)?;
    build_foreign(read, Sha256::digest(file).into())
}

pub(super) fn read(network: &GeopackageNetwork) -> Result<ReadNetwork, Vec<FormatError>> {
    let mut errors = FormatErrors::default();
    let mut draft = NetworkDraft {
        name: network
            .name
            .clone()
            .unwrap_or_else(|| "GeoPackage network".to_owned()),
        attribution: network.attribution.clone().unwrap_or_default(),
        coordinates: network.coordinates,
        integer_ids: true,
        ..NetworkDraft::default()
    };
    for (index, row) in network.nodes.rows.iter().enumerate() {
        let layer = Place::ROOT.member(NODES_LAYER);
        if let Err(error) = take_node(network, row, &layer.element(index), &mut draft) {
            errors.push(error);
        }
        if errors.is_full() {
            return errors.or(unread(network, draft));
        }
    }
    let nodes = std::mem::take(&mut draft.nodes);
    let positions = nodes
        .iter()
        .map(|node| (node.id.as_str(), node.position))
        .collect();
    for (index, row) in network.segments.rows.iter().enumerate() {
        let layer = Place::ROOT.member(SEGMENTS_LAYER);
        let place = layer.element(index);
        match segment_of(
            &network.segments,
            row,
            &place,
            network.coordinates,
            &positions,
        ) {
            Ok(segment) => draft.segments.push(segment),
            Err(error) => errors.push(error),
        }
        if errors.is_full() {
            break;
        }
    }
    draft.nodes = nodes;
    errors.or(unread(network, draft))
}

fn unread(network: &GeopackageNetwork, draft: NetworkDraft) -> ReadNetwork {
    let mut unread = Unread::default();
    unread.of_node(network.nodes.names(), &[ROW_NUMBER]);
    unread.of_segment(network.segments.names(), &[ROW_NUMBER]);
    ReadNetwork { draft, unread }
}

impl GeopackageLayer {
    /// The names of its columns but for the geometry.
    fn names(&self) -> impl Iterator<Item = &str> {
        let columns = self.columns.iter().enumerate();
        let columns = columns.filter(|(place, _)| *place != self.geometry);
        columns.map(|(_, name)| name.as_str())
    }

    fn members(&self, row: &[Cell]) -> Map<String, Value> {
        let columns = self.columns.iter().zip(row);
        columns
            .filter_map(|(name, cell)| Some((name.clone(), value(cell)?)))
            .collect()
    }

    fn positions(&self, row: &[Cell], place: &Place<'_>) -> Result<Vec<[f64; 2]>, FormatError> {
        match row.get(self.geometry) {
            Some(Cell::Blob(blob)) => {
                geometry::positions(blob).map_err(|message| place.member("geometry").error(message))
            }
            _ => Err(place.error("has no geometry")),
        }
    }
}

fn value(cell: &Cell) -> Option<Value> {
    match cell {
        Cell::Whole(number) => Some(Value::from(*number)),
        Cell::Real(number) => Number::from_f64(*number).map(Value::Number),
        Cell::Text(words) => Some(Value::from(words.as_str())),
        Cell::Null | Cell::Blob(_) => None,
    }
}

fn take_node(
    network: &GeopackageNetwork,
    row: &[Cell],
    place: &Place<'_>,
    draft: &mut NetworkDraft,
) -> Result<(), FormatError> {
    let layer = &network.nodes;
    let mut members = layer.members(row);
    // A layer without ids of its own is known by the numbers of its rows.
    if !layer.columns.iter().any(|name| name == "id")
        && let Some(number) = members.get(ROW_NUMBER)
    {
        members.insert("id".to_owned(), number.clone());
    }
    draft.integer_ids &= members.get("id").is_some_and(Value::is_i64);
    let positions = layer.positions(row, place)?;
    let [position] = positions
        .try_into()
        .map_err(|_| place.error("is not a point"))?;
    for name in ["x", "y", "lon", "lat"] {
        members.remove(name);
    }
    for (name, coordinate) in position_names(network.coordinates)
        .into_iter()
        .zip(position)
    {
        let number = Number::from_f64(coordinate).map_or(Value::Null, Value::Number);
        members.insert(name.to_owned(), number);
    }
    add_node(draft, read_node(&members, place)?, place)
}

fn segment_of(
    layer: &GeopackageLayer,
    row: &[Cell],
    place: &Place<'_>,
    coordinates: Coordinates,
    positions: &FxHashMap<&str, [f64; 2]>,
) -> Result<SegmentDraft, FormatError> {
    let segment = read_segment(&layer.members(row), place)?;
    let line = layer.positions(row, place)?;
    let ends: [[f64; 2]; 2] = line.try_into().map_err(|line: Vec<[f64; 2]>| {
        place
            .member("geometry")
            .error(format!("has {} positions, not two", line.len()))
            .hint("a segment is one straight line; put a node at every bend")
    })?;
    check_ends(&segment, &ends, coordinates, positions, place)?;
    Ok(segment)
}
