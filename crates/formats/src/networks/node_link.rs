//! NetworkX node-link JSON, in and out.
//!
//! Edges are under `links` (NetworkX up to 3.3) or `edges` (from 3.4 on). Nodes have `x` and `y` in metres,
//! as the paper's, or `lon` and `lat` in degrees; an edge's length is `length_m`, else `weight`, else the
//! straight line. Attributes this program does not know are another tool's business: they are passed over,
//! and told by name.

use super::attributes::{
    ReadNetwork, Unread, add_node, id_value, node_members, position_names, read_node, read_segment,
    segment_members, written_position,
};
use super::stated::draft_of;
use crate::error::{FormatError, FormatErrors};
use crate::identifier::id_text;
use crate::network::{NetworkDraft, NodeDraft, Topology};
use crate::place::{Place, array, object, required};
use serde_json::{Map, Value, json};

/// What is read of the network as a whole.
const OF_GRAPH: [&str; 2] = ["name", "attribution"];
/// What NetworkX writes to tell parallel edges apart; one of them is kept.
const PARALLEL_KEY: &str = "key";

/// Reads node-link JSON. Repairs are for the caller: see [`NetworkDraft::repair`].
///
/// # Errors
/// Each with the JSON Pointer of the place and the node or edge it belongs to, up to a bound.
pub fn read_node_link(text: &str) -> Result<ReadNetwork, Vec<FormatError>> {
    let document: Value = serde_json::from_str(text)
        .map_err(|error| vec![FormatError::new("", format!("is not JSON: {error}"))])?;
    let root = Place::ROOT;
    let members = object(&document, &root).map_err(|error| vec![error])?;
    let mut errors = FormatErrors::default();
    let mut unread = Unread::default();
    if let Some(graph) = members.get("graph").and_then(Value::as_object) {
        unread.of_graph(graph.keys().map(String::as_str), &OF_GRAPH);
    }
    let mut draft = NetworkDraft {
        name: graph_text(members, "name")
            .unwrap_or("node-link network")
            .to_owned(),
        attribution: graph_text(members, "attribution")
            .unwrap_or_default()
            .to_owned(),
        integer_ids: true,
        ..NetworkDraft::default()
    };
    if members.get("directed") == Some(&Value::Bool(true)) {
        let error = root
            .member("directed")
            .error("is true; a skyway is undirected");
        errors.push(error.hint("convert with nx.Graph(graph) and write it again"));
    }
    read_nodes(members, &mut draft, &mut unread, &mut errors);
    read_edges(members, &mut draft, &mut unread, &mut errors);
    errors.or(ReadNetwork { draft, unread })
}

/// An attribute of the graph as a whole, where it is text.
fn graph_text<'v>(members: &'v Map<String, Value>, attribute: &str) -> Option<&'v str> {
    members.get("graph")?.get(attribute)?.as_str()
}

fn read_nodes(
    members: &Map<String, Value>,
    draft: &mut NetworkDraft,
    unread: &mut Unread,
    errors: &mut FormatErrors,
) {
    let root = Place::ROOT;
    let listed =
        required(members, "nodes", &root).and_then(|nodes| array(nodes, &root.member("nodes")));
    let nodes = match listed {
        Ok(nodes) => nodes,
        Err(error) => return errors.push(error),
    };
    let list = root.member("nodes");
    for (index, node) in nodes.iter().enumerate() {
        if errors.is_full() {
            return;
        }
        let place = list.element(index);
        let id = node.get("id");
        draft.integer_ids &= id.is_some_and(|id| id.is_i64() || id.is_u64());
        let read = object(node, &place).and_then(|members| {
            unread.of_node(members.keys().map(String::as_str), &[]);
            add_node(draft, read_node(members, &place)?, &place)
        });
        if let Err(error) = read {
            let id = id.and_then(id_text).unwrap_or_else(|| index.to_string());
            errors.push(error.of(format!("node '{id}'")));
        }
    }
}

fn read_edges(
    members: &Map<String, Value>,
    draft: &mut NetworkDraft,
    unread: &mut Unread,
    errors: &mut FormatErrors,
) {
    let root = Place::ROOT;
    let name = match members.contains_key("links") {
        true => "links",
        false => "edges",
    };
    let list = root.member(name);
    let listed = required(members, name, &root).and_then(|edges| array(edges, &list));
    let edges = match listed {
        Ok(edges) => edges,
        Err(error) => return errors.push(error),
    };
    for (index, edge) in edges.iter().enumerate() {
        if errors.is_full() {
            return;
        }
        let place = list.element(index);
        let read = object(edge, &place).and_then(|members| {
            unread.of_segment(members.keys().map(String::as_str), &[PARALLEL_KEY]);
            read_segment(members, &place)
        });
        match read {
            Ok(segment) => draft.segments.push(segment),
            Err(error) => errors.push(error.of(format!("edge {index}"))),
        }
    }
}

/// Writes a topology as node-link JSON that `networkx.node_link_graph(data, edges="links")` reads.
///
/// Segments have the ids they go by, stated or not.
pub fn write_node_link(topology: &Topology) -> String {
    let draft = draft_of(topology);
    let nodes: Vec<Value> = draft
        .nodes
        .iter()
        .map(|node| node_json(&draft, node))
        .collect();
    let mut links = Vec::with_capacity(draft.segments.len());
    for segment in &draft.segments {
        let [source, target] =
            [&segment.from, &segment.to].map(|id| id_value(id, draft.integer_ids));
        let id = called(topology, &segment.from, &segment.to);
        let mut link = Map::new();
        link.insert("source".to_owned(), source);
        link.insert("target".to_owned(), target);
        link.insert("id".to_owned(), json!(id));
        link.extend(segment_members(segment));
        links.push(Value::Object(link));
    }
    let document = json!({
        "directed": false,
        "multigraph": false,
        "graph": {"name": draft.name, "attribution": draft.attribution},
        "nodes": nodes,
        "links": links,
    });
    document.to_string()
}

/// The id that a segment goes by.
fn called(topology: &Topology, from: &str, to: &str) -> Option<String> {
    let segment = topology.segment_between(topology.node(from)?, topology.node(to)?)?;
    Some(topology.segment_id(segment).into_owned())
}

fn node_json(draft: &NetworkDraft, node: &NodeDraft) -> Value {
    let names = position_names(draft.coordinates);
    let position = written_position(draft.coordinates, node.position);
    let mut members = Map::new();
    members.insert("id".to_owned(), id_value(&node.id, draft.integer_ids));
    for (name, coordinate) in names.into_iter().zip(position) {
        members.insert(name.to_owned(), json!(coordinate));
    }
    members.extend(node_members(node));
    Value::Object(members)
}
