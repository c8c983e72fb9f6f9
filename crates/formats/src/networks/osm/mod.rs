//! Buildings straight from an extract of OpenStreetMap (`.osm.pbf`).
//!
//! Closed ways with `building` or `building:part`, and multipolygons of them. What the map has wrong (a ring that
//! crosses itself) is widened until it covers what was drawn, and told; what the extract cuts off is refused: a
//! building left out would be an obstacle that no one sees.
//! Source: <https://wiki.openstreetmap.org/wiki/PBF_Format>, <https://wiki.openstreetmap.org/wiki/Simple_3D_Buildings>.

mod blocks;
mod collect;
mod outlines;
mod tags;

#[cfg(test)]
mod tests;

use crate::error::{FormatError, FormatErrors};
use collect::{Collected, collect};
use outlines::{Shape, shape_of_relation, shape_of_way};
use skyway_maps::buildings::{Building, Outline};
use tags::BuildingTags;

/// What has to be named beside every copy of what is made from OpenStreetMap.
pub const OSM_ATTRIBUTION: &str = "© OpenStreetMap contributors, ODbL 1.0";

/// A part of the Earth in degrees, without the line at 180 degrees in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DegreeBox {
    /// Longitude of its western side.
    pub west: f64,
    /// Latitude of its southern side.
    pub south: f64,
    /// Longitude of its eastern side.
    pub east: f64,
    /// Latitude of its northern side.
    pub north: f64,
}

impl DegreeBox {
    /// True for a position in it or on its sides.
    fn holds(&self, [lon, lat]: [f64; 2]) -> bool {
        (self.west..=self.east).contains(&lon) && (self.south..=self.north).contains(&lat)
    }
}

/// The buildings of an extract.
#[derive(Clone, Debug)]
pub struct OsmBuildings {
    /// Ways in the order of the file, then relations.
    pub buildings: Vec<Building>,
    /// What was read otherwise than drawn, a line each.
    pub repairs: Vec<String>,
}

/// Reads the buildings of an extract, or those with a corner in a box.
///
/// # Errors
/// What keeps the extract from being read, or each building that it has only a part of, up to a bound.
pub fn read_osm_buildings(
    extract: &[u8],
    within: Option<&DegreeBox>,
) -> Result<OsmBuildings, Vec<FormatError>> {
    let collected = collect(extract, within).map_err(|error| vec![error])?;
    let mut errors = FormatErrors::default();
    let mut read = OsmBuildings {
        buildings: Vec::new(),
        repairs: Vec::new(),
    };
    let Collected {
        ways,
        relations,
        positions,
        members,
    } = &collected;
    for way in ways {
        let id = format!("way/{}", way.id);
        match shape_of_way(&way.nodes, positions) {
            Ok(shape) => read.take(id, &way.tags, shape),
            Err(fault) => errors.push(fault.error(&id)),
        }
    }
    for relation in relations {
        let id = format!("relation/{}", relation.id);
        match shape_of_relation(relation, members, positions) {
            Ok(shape) => read.take(id, &relation.tags, shape),
            Err(fault) => errors.push(fault.error(&id)),
        }
    }
    errors.or(read)
}

impl OsmBuildings {
    fn take(&mut self, id: String, tags: &BuildingTags, shape: Shape) {
        for unread in &tags.unread {
            self.repairs
                .push(format!("{id}: {unread} is no height that can be read"));
        }
        let outline: Outline = match shape {
            Shape::AsDrawn(outline) => outline,
            Shape::Widened(outline, fault) => {
                self.repairs
                    .push(format!("{id}: {fault}; taken as wide as its corners reach"));
                outline
            }
            Shape::Nothing => {
                self.repairs
                    .push(format!("{id}: encloses nothing, and is left out"));
                return;
            }
        };
        self.buildings.push(Building {
            id,
            name: tags.name.clone(),
            outline,
            height_m: tags.height_m,
            min_height_m: tags.min_height_m,
            extract: None,
        });
    }
}
