//! NetworkX node-link JSON, in and out.
//!
//! Edges are under `links` (NetworkX up to 3.3) or `edges` (from 3.4 on). Nodes have `x` and `y` in metres,
//! as the paper's, or `lon` and `lat` in degrees; an edge's length is `length_m`, else `weight`, else the
//! straight line. Attributes this program does not know are another tool's business and are ignored.

use super::error::{FormatError, FormatErrors};
use super::identifier::id_text;
use super::place::{Place, array, number, object, optional, required};
use crate::geo::{Altitude, AltitudeBand, AltitudeReference};
use crate::network::{Coordinates, NetworkDraft, NodeDraft, NodeIx, Role, SegmentDraft, Topology};
use serde_json::{Map, Number, Value, json};

/// Reads node-link JSON. Repairs are for the caller: see [`NetworkDraft::repair`].
///
/// # Errors
/// Each with the JSON Pointer of the place and the node or edge it belongs to, up to a bound.
pub fn read_node_link(text: &str) -> Result<NetworkDraft, Vec<FormatError>> {
    let document: Value = serde_json::from_str(text)
        .map_err(|error| vec![FormatError::new("", format!("is not JSON: {error}"))])?;
    let root = Place::ROOT;
    let members = object(&document, &root).map_err(|error| vec![error])?;
    let mut errors = FormatErrors::default();
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
    read_nodes(members, &mut draft, &mut errors);
    read_edges(members, &mut draft, &mut errors);
    errors.or(draft)
}

/// An attribute of the graph as a whole, where it is text.
fn graph_text<'v>(members: &'v Map<String, Value>, attribute: &str) -> Option<&'v str> {
    members.get("graph")?.get(attribute)?.as_str()
}

fn read_nodes(members: &Map<String, Value>, draft: &mut NetworkDraft, errors: &mut FormatErrors) {
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
        match read_node(node, &place) {
            Ok((read, coordinates)) => {
                draft.integer_ids &= node.get("id").is_some_and(Value::is_i64);
                if index == 0 {
                    draft.coordinates = coordinates;
                } else if draft.coordinates != coordinates {
                    let error = place.error("has other coordinates than the nodes before it");
                    errors.push(
                        error.hint("give all nodes 'x' and 'y', or all of them 'lon' and 'lat'"),
                    );
                }
                draft.nodes.push(read);
            }
            Err(error) => {
                let id = node.get("id").and_then(id_text);
                errors.push(error.of(format!(
                    "node '{}'",
                    id.unwrap_or_else(|| index.to_string())
                )));
            }
        }
    }
}

fn read_node(value: &Value, place: &Place<'_>) -> Result<(NodeDraft, Coordinates), FormatError> {
    let members = object(value, place)?;
    let id = required(members, "id", place)?;
    let id = id_text(id).ok_or_else(|| place.member("id").wrong_kind(id, "text or an integer"))?;
    let pair = |first: &str, second: &str| -> Result<[f64; 2], FormatError> {
        let coordinate = |name: &str| number(required(members, name, place)?, &place.member(name));
        Ok([coordinate(first)?, coordinate(second)?])
    };
    let (position, coordinates) = match members.contains_key("lon") || members.contains_key("lat") {
        true => (pair("lon", "lat")?, Coordinates::Geographic),
        false => (pair("x", "y")?, Coordinates::Planar),
    };
    let altitude_m = optional_number(members, "altitude_m", place)?;
    let pads = optional_number(members, "pads", place)?.unwrap_or(0.0);
    if pads.fract() != 0.0 || !(0.0..=f64::from(u16::MAX)).contains(&pads) {
        let error = place
            .member("pads")
            .error(format!("is {pads}, not a count"));
        return Err(error);
    }
    let role = match optional(members, "role") {
        None => Role::Both,
        Some(role) => serde_json::from_value(role.clone()).map_err(|_| {
            let error = place
                .member("role")
                .error(format!("is {role}, which is no role"));
            error.hint("write delivery_target, recharging_station or both")
        })?,
    };
    let node = NodeDraft {
        id,
        position,
        altitude: altitude_m.map(Altitude::agl),
        pads: pads as u16,
        role,
        name: optional(members, "name")
            .and_then(Value::as_str)
            .map(str::to_owned),
    };
    Ok((node, coordinates))
}

fn read_edges(members: &Map<String, Value>, draft: &mut NetworkDraft, errors: &mut FormatErrors) {
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
        match read_edge(edge, &list.element(index)) {
            Ok(segment) => draft.segments.push(segment),
            Err(error) => errors.push(error.of(format!("edge {index}"))),
        }
    }
}

fn read_edge(value: &Value, place: &Place<'_>) -> Result<SegmentDraft, FormatError> {
    let members = object(value, place)?;
    let end = |name: &str| {
        let id = required(members, name, place)?;
        id_text(id).ok_or_else(|| place.member(name).wrong_kind(id, "text or an integer"))
    };
    let (from, to) = (end("source")?, end("target")?);
    let length_m = match optional_number(members, "length_m", place)? {
        Some(length_m) => Some(length_m),
        None => optional_number(members, "weight", place)?,
    };
    Ok(SegmentDraft {
        id: optional(members, "id").and_then(id_text),
        from,
        to,
        length_m,
        band: AltitudeBand::UNLIMITED,
        speed_limit_mps: optional_number(members, "speed_limit_mps", place)?,
    })
}

fn optional_number(
    members: &Map<String, Value>,
    name: &str,
    place: &Place<'_>,
) -> Result<Option<f64>, FormatError> {
    optional(members, name)
        .map(|value| number(value, &place.member(name)))
        .transpose()
}

/// Writes a topology as node-link JSON that `networkx.node_link_graph(data, edges="links")` reads.
///
/// Altitudes are written where they are above ground; the format has no place for another reference.
pub fn write_node_link(topology: &Topology) -> String {
    let mut by_rank: Vec<_> = topology.nodes().collect();
    by_rank.sort_by_key(|&node| topology.rank(node));
    let nodes: Vec<Value> = by_rank
        .into_iter()
        .map(|node| node_json(topology, node))
        .collect();
    let links: Vec<Value> = topology
        .segments()
        .map(|segment| {
            let ends = topology.segment(segment);
            json!({
                "source": file_id(topology, ends.from),
                "target": file_id(topology, ends.to),
                "id": topology.segment_id(segment),
                "length_m": ends.length_m,
            })
        })
        .collect();
    let document = json!({
        "directed": false,
        "multigraph": false,
        "graph": {"name": topology.name(), "attribution": topology.attribution()},
        "nodes": nodes,
        "links": links,
    });
    document.to_string()
}

/// The id of a node as the network's file writes it: what reads the format looks nodes up by it.
fn file_id(topology: &Topology, node: NodeIx) -> Value {
    let id = topology.node_id(node);
    let number = serde_json::from_str::<Number>(id);
    // JSON would not give back a zero-padded `007`.
    let number = number
        .ok()
        .filter(|number| !number.is_f64() && number.to_string() == id);
    match number.filter(|_| topology.has_integer_ids()) {
        Some(number) => Value::Number(number),
        None => Value::from(id),
    }
}

fn node_json(topology: &Topology, node: NodeIx) -> Value {
    let [first, second] = match topology.frame().is_geographic() {
        true => ["lon", "lat"],
        false => ["x", "y"],
    };
    let position = topology.frame().from_plane(topology.position(node));
    let mut members = Map::new();
    members.insert("id".to_owned(), file_id(topology, node));
    members.insert(first.to_owned(), json!(position[0]));
    members.insert(second.to_owned(), json!(position[1]));
    members.insert("pads".to_owned(), json!(topology.pads(node)));
    members.insert("role".to_owned(), json!(topology.role(node)));
    let above_ground = topology
        .node_altitude(node)
        .filter(|altitude| altitude.reference == AltitudeReference::Agl);
    if let Some(altitude) = above_ground {
        members.insert("altitude_m".to_owned(), json!(altitude.value_m));
    }
    if let Some(name) = topology.node_name(node) {
        members.insert("name".to_owned(), json!(name));
    }
    Value::Object(members)
}
