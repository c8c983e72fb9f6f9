//! Networks as text: GeoJSON, and what others have of graphs, tables, maps and buildings.

pub(crate) mod attributes;
pub(crate) mod buildings;
pub(crate) mod csv;
pub(crate) mod foreign;
pub(crate) mod geojson;
pub(crate) mod geopackage;
pub(crate) mod graphml;
pub(crate) mod load;
pub(crate) mod node_link;
pub(crate) mod osm;
#[cfg(test)]
mod round_trips;
pub(crate) mod stated;
