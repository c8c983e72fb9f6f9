//! petgraph's Dijkstra on a graph read from the network's own text: what every distance is checked against.
//!
//! It shares nothing with the engine: the text is read as plain JSON, lengths that it does not state are the
//! straight lines between its coordinates, and the search is petgraph's.

use petgraph::graph::{EdgeReference, NodeIndex, UnGraph};
use petgraph::visit::EdgeFiltered;
use rustc_hash::FxHashMap;
use serde_json::Value;
use thiserror::Error;

/// Two lengths are the same when they differ by no more than this share: the same segments added up in
/// another order.
const ROUNDING: f64 = 1e-9;

/// The graph of one network.
#[derive(Debug)]
pub struct Oracle {
    graph: UnGraph<(), f64>,
    nodes: FxHashMap<String, NodeIndex>,
}

/// Why the text of a network cannot be read as a graph.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum OracleError {
    /// It is not JSON with a list of features.
    #[error("the text of the network is not a GeoJSON FeatureCollection")]
    NotFeatures,
    /// A segment names a node that is not there, or has no length.
    #[error("segment {number} of the network (from 0) cannot be read as an edge")]
    Segment {
        /// Its place among the segments.
        number: usize,
    },
}

/// The distances to find for one failure: from A to B and from A to the destination, the leg A - B closed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sought {
    /// The id of A.
    pub from: String,
    /// The id of B.
    pub to: String,
    /// The id of the destination.
    pub destination: String,
}

impl Oracle {
    /// Reads the graph from the text of a network in the native format.
    ///
    /// # Errors
    /// [`OracleError`] where it is no such text, or a geographic network does not state a length.
    pub fn read(text: &str) -> Result<Self, OracleError> {
        let document: Value = serde_json::from_str(text).map_err(|_| OracleError::NotFeatures)?;
        let features = document["features"]
            .as_array()
            .ok_or(OracleError::NotFeatures)?;
        let is_planar = document["skyway"]["coordinates"] == "planar";
        let mut graph = UnGraph::default();
        let mut nodes = FxHashMap::default();
        let of_kind = |kind: &'static str| {
            let features = features.iter();
            features.filter(move |feature| feature["properties"]["kind"] == kind)
        };
        for feature in of_kind("node") {
            nodes.insert(name(&feature["id"]), graph.add_node(()));
        }
        for (number, feature) in of_kind("segment").enumerate() {
            let properties = &feature["properties"];
            let [from, to] = ["from", "to"].map(|end| nodes.get(&name(&properties[end])));
            let straight_m = || is_planar.then(|| straight_line_m(feature)).flatten();
            let length_m = properties["length_m"].as_f64().or_else(straight_m);
            let (Some(&from), Some(&to), Some(length_m)) = (from, to, length_m) else {
                return Err(OracleError::Segment { number });
            };
            graph.add_edge(from, to, length_m);
        }
        Ok(Self { graph, nodes })
    }

    /// The shortest distances for a failure, to B and to the destination, in metres; `None` where there is no
    /// way.
    pub fn distances_m(&self, sought: &Sought) -> [Option<f64>; 2] {
        let node = |id: &String| self.nodes.get(id).copied();
        let (Some(from), Some(to)) = (node(&sought.from), node(&sought.to)) else {
            return [None, None];
        };
        let failed = self.graph.find_edge(from, to);
        let open = EdgeFiltered::from_fn(&self.graph, |edge: EdgeReference<'_, f64>| {
            Some(petgraph::visit::EdgeRef::id(&edge)) != failed
        });
        let distance_m = |goal: NodeIndex| {
            let length = |edge: EdgeReference<'_, f64>| *edge.weight();
            let found = petgraph::algo::dijkstra(&open, from, Some(goal), length);
            found.get(&goal).copied()
        };
        [Some(to), node(&sought.destination)].map(|goal| goal.and_then(distance_m))
    }
}

/// True for lengths that differ by rounding alone, or that both are not there.
pub(super) fn same_m(one_m: Option<f64>, other_m: Option<f64>) -> bool {
    match (one_m, other_m) {
        (Some(one_m), Some(other_m)) => (one_m - other_m).abs() <= ROUNDING * other_m.max(1.0),
        (None, None) => true,
        _ => false,
    }
}

/// An id, written as a number or as text.
fn name(id: &Value) -> String {
    match id {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn straight_line_m(feature: &Value) -> Option<f64> {
    let ends = feature["geometry"]["coordinates"].as_array()?;
    let at = |end: usize, axis: usize| ends.get(end)?.get(axis)?.as_f64();
    let (dx, dy) = (at(1, 0)? - at(0, 0)?, at(1, 1)? - at(0, 1)?);
    Some((dx * dx + dy * dy).sqrt())
}
