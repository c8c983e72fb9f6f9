//! The places in a failure report: the leg, the plan ahead, where the drone and the cause are.

use super::identifier::{find_node, id_text};
use super::report_problem::{ReportProblem, Warnings};
use crate::flight::Location;
use crate::geo::Point;
use crate::network::{NodeIx, Topology};
use serde_json::{Map, Value};

/// The failed leg and what lies ahead of it.
pub(super) struct ReportedLeg {
    pub(super) nodes: (NodeIx, NodeIx),
    pub(super) remaining_path: Option<Vec<NodeIx>>,
    pub(super) destination: NodeIx,
}

/// Finds the leg: as `service` names it, else the first of `remaining_path`.
pub(super) fn read_leg(
    topology: &Topology,
    fields: &Map<String, Value>,
    warnings: &mut Warnings,
) -> Result<ReportedLeg, ReportProblem> {
    let path = read_path(topology, fields.get("remaining_path"), warnings);
    let named = read_service(topology, fields.get("service"))?;
    let (from, to) = match (named, path.as_deref()) {
        (Some(leg), _) => leg,
        (None, Some([from, to, ..])) => (*from, *to),
        (None, _) => return Err(ReportProblem::NotLocated),
    };
    let mut remaining_path = path.and_then(|path| align(path, (from, to), warnings));
    let planned_end = remaining_path
        .as_ref()
        .and_then(|path| path.last().copied());
    let stated = match fields.get("destination").filter(|value| !value.is_null()) {
        None => None,
        Some(value) => {
            let node = find_node(topology, value);
            if node.is_none() {
                warnings.add(
                    "unknown_destination",
                    format!("the destination {value} is not a node of the network; the end of the plan is taken"),
                );
            }
            node
        }
    };
    let destination = stated.or(planned_end).unwrap_or(to);
    if planned_end.is_some_and(|end| end != destination) {
        remaining_path = cut_at(remaining_path, destination, warnings);
    }
    Ok(ReportedLeg {
        nodes: (from, to),
        remaining_path,
        destination,
    })
}

/// A plan that goes on beyond the destination ends there; one that never comes there is ignored.
fn cut_at(
    path: Option<Vec<NodeIx>>,
    destination: NodeIx,
    warnings: &mut Warnings,
) -> Option<Vec<NodeIx>> {
    let mut path = path?;
    let Some(place) = path.iter().skip(1).position(|&node| node == destination) else {
        warnings.add(
            "remaining_path_ignored",
            "'remaining_path' does not lead to the destination and is ignored",
        );
        return None;
    };
    path.truncate(place + 2);
    Some(path)
}

/// The leg that `service` names; a plan that nobody here knows names none.
fn read_service(
    topology: &Topology,
    service: Option<&Value>,
) -> Result<Option<(NodeIx, NodeIx)>, ReportProblem> {
    let Some(service) = service.and_then(Value::as_object) else {
        return Ok(None);
    };
    let (Some(from), Some(to)) = (service.get("from"), service.get("to")) else {
        return Ok(None);
    };
    let node = |value: &Value, name: &str| {
        let unknown = || ReportProblem::UnknownNode {
            pointer: format!("/service/{name}"),
            id: id_text(value).unwrap_or_else(|| value.to_string()),
        };
        find_node(topology, value).ok_or_else(unknown)
    };
    Ok(Some((node(from, "from")?, node(to, "to")?)))
}

fn read_path(
    topology: &Topology,
    value: Option<&Value>,
    warnings: &mut Warnings,
) -> Option<Vec<NodeIx>> {
    let value = value.filter(|value| !value.is_null())?;
    let found: Option<Vec<NodeIx>> = value
        .as_array()
        .and_then(|ids| ids.iter().map(|id| find_node(topology, id)).collect());
    if found.is_none() {
        warnings.add(
            "remaining_path_ignored",
            "'remaining_path' is not a list of nodes of this network and is ignored",
        );
    }
    found
}

/// The plan from the leg on, the leg first.
fn align(
    mut path: Vec<NodeIx>,
    (from, to): (NodeIx, NodeIx),
    warnings: &mut Warnings,
) -> Option<Vec<NodeIx>> {
    if let Some(leg) = path.windows(2).position(|leg| leg == [from, to]) {
        return Some(path.split_off(leg));
    }
    if path.first() == Some(&to) {
        path.insert(0, from);
        return Some(path);
    }
    warnings.add(
        "remaining_path_ignored",
        "'remaining_path' does not contain the failed leg and is ignored",
    );
    None
}

/// Where the drone was. A report by segment alone means the start of it; one by plan does not know.
pub(super) fn read_location(
    topology: &Topology,
    fields: &Map<String, Value>,
    leg: (NodeIx, NodeIx),
    warnings: &mut Warnings,
) -> Location {
    let names_nodes = fields
        .get("service")
        .and_then(Value::as_object)
        .is_none_or(|service| service.contains_key("from"));
    let Some(value) = fields.get("location").filter(|value| !value.is_null()) else {
        return match names_nodes {
            true => Location::LegStart,
            false => Location::Unknown,
        };
    };
    if let Some(node) = value.get("node").and_then(|id| find_node(topology, id)) {
        return match node == leg.0 {
            true => Location::LegStart,
            false => Location::At(topology.position(node)),
        };
    }
    read_place(topology, value, "location", warnings).map_or(Location::Unknown, Location::At)
}

/// A place: `[lon, lat]`, `{x, y}` of a planar network, or `{node}`.
pub(super) fn read_place(
    topology: &Topology,
    value: &Value,
    name: &str,
    warnings: &mut Warnings,
) -> Option<Point> {
    let frame = topology.frame();
    let found = match value {
        Value::Array(numbers) => match numbers.as_slice() {
            [first, second] => first.as_f64().zip(second.as_f64()),
            _ => None,
        },
        Value::Object(members) => {
            if let Some(id) = members.get("node") {
                let node = find_node(topology, id);
                if node.is_none() {
                    warnings.add(
                        "location_ignored",
                        format!("'{name}' names the node {id}, which the network does not have"),
                    );
                }
                return node.map(|node| topology.position(node));
            }
            let number = |member: &str| members.get(member).and_then(Value::as_f64);
            match frame.is_geographic() {
                true => number("lon").zip(number("lat")),
                false => number("x").zip(number("y")),
            }
        }
        _ => None,
    };
    let Some((first, second)) = found else {
        warnings.add(
            "location_ignored",
            format!("'{name}' is not a place of this network and is ignored"),
        );
        return None;
    };
    let impossible = frame.is_geographic() && (first.abs() > 180.0 || second.abs() > 90.0);
    let place = frame.to_plane([first, second]);
    if impossible || !place.is_finite() {
        warnings.add(
            "location_ignored",
            format!("'{name}' [{first}, {second}] is not on Earth and is ignored; longitude comes first: were they swapped?"),
        );
        return None;
    }
    Some(place)
}
