//! GraphML, in and out, as NetworkX reads and writes it.
//!
//! Nodes have `lon` and `lat` or `x` and `y`; the length of an edge is its `weight`, so that the algorithms of
//! NetworkX find it. Values are told by the names of their keys: tools differ in the types that they declare.
//! Source: <http://graphml.graphdrawing.org/specification.html>.

mod read;
mod write;

#[cfg(test)]
mod tests;

pub use read::{MAX_GRAPHML_BYTES, read_graphml};
pub use write::{WrittenGraphml, write_graphml};

/// The length of an edge, as NetworkX calls it.
const WEIGHT: &str = "weight";
/// False at the graph where ids are text that looks like integers.
const INTEGER_IDS: &str = "integer_ids";
