//! The buildings that a command works on: GeoJSON, or an extract of OpenStreetMap.

use super::files;
use super::stop::Stop;
use crate::buildings::Building;
use crate::formats::{DegreeBox, ForeignFormat, read_buildings, read_osm_buildings};
use std::path::Path;

/// Buildings as read.
pub(super) struct ReadBuildings {
    pub(super) buildings: Vec<Building>,
    /// What was read otherwise than drawn.
    pub(super) repairs: Vec<String>,
    /// True where they come from OpenStreetMap, which asks to be named.
    pub(super) are_of_osm: bool,
}

/// Reads buildings, of an extract those with a corner in a box where one is given.
pub(super) fn buildings_in(path: &Path, within: Option<&DegreeBox>) -> Result<ReadBuildings, Stop> {
    let source = path.display().to_string();
    let bytes = files::read_bytes(path)?;
    if ForeignFormat::of_bytes(&bytes) == Some(ForeignFormat::OsmPbf) {
        let read = read_osm_buildings(&bytes, within);
        let read = read.map_err(|errors| Stop::all_of(&source, &errors))?;
        return Ok(ReadBuildings {
            buildings: read.buildings,
            repairs: read.repairs,
            are_of_osm: true,
        });
    }
    if within.is_some() {
        return Err(Stop::Usage(format!(
            "--bbox takes a part of an OSM extract (.osm.pbf), which {source} is not; leave it out"
        )));
    }
    let text = files::text_of(path, bytes)?;
    let buildings = read_buildings(&text).map_err(|errors| Stop::all_of(&source, &errors))?;
    Ok(ReadBuildings {
        buildings,
        repairs: Vec::new(),
        are_of_osm: false,
    })
}
