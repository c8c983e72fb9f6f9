//! Ids on the wire: told as text, read as text or as integers.

use crate::network::{NodeIx, SegmentIx, Topology};
use crate::wire::Id;
use serde_json::{Value, json};

/// The id of a node.
pub fn node_id(topology: &Topology, node: NodeIx) -> Id<'_> {
    Id::new(topology.node_id(node))
}

/// The id of a node as a JSON value.
pub fn node_id_json(topology: &Topology, node: NodeIx) -> Value {
    json!(node_id(topology, node))
}

/// The id of a segment.
pub fn segment_id_json(topology: &Topology, segment: SegmentIx) -> Value {
    json!(topology.segment_id(segment))
}

/// The text of an id that came as text or as an integer; `None` for anything else.
pub fn id_text(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Number(number) if !number.is_f64() => Some(number.to_string()),
        Value::Number(number) => {
            let whole = number.as_f64().filter(|number| number.fract() == 0.0)?;
            (whole.abs() <= 9_007_199_254_740_991.0).then(|| format!("{whole:.0}"))
        }
        _ => None,
    }
}

/// The node that an id on the wire names.
pub fn find_node(topology: &Topology, value: &Value) -> Option<NodeIx> {
    topology.node(&id_text(value)?)
}
