//! GeoPackage (OGC 12-128), in and out: a layer of nodes and one of segments.
//!
//! Here are rows and geometries; the caller opens the database around them. Columns have the names of
//! the native format, `from` and `to` for the ends. The network's own name and attribution are the one row of a table
//! of attributes.

mod geometry;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use read::{GeopackageLayer, GeopackageNetwork, load_geopackage};
pub use write::{GeopackageStatement, WrittenGeopackage, write_geopackage};

/// The layer of the nodes.
pub const NODES_LAYER: &str = "nodes";
/// The layer of the segments.
pub const SEGMENTS_LAYER: &str = "segments";
/// The table with the name and the attribution of the network.
pub const NETWORK_TABLE: &str = "network";

/// A value in a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Nothing.
    Null,
    /// A whole number.
    Whole(i64),
    /// A number.
    Real(f64),
    /// Text.
    Text(String),
    /// A geometry.
    Blob(Vec<u8>),
}
