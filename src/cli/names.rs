//! What people call things: ids on the command line, found in the network or refused with what was
//! probably meant.
//!
//! `A,B` names a segment by its ends. Ids may hold commas themselves, so every comma is tried, and what
//! can be read in two ways is refused.

use super::stop::Stop;
use crate::formats::{CloseTarget, nearest};
use crate::geo::Point;
use crate::network::{NodeIx, Topology};

/// At most this many ids are suggested.
const MAX_SUGGESTIONS: usize = 3;

/// Finds a node.
pub(super) fn node(topology: &Topology, id: &str) -> Result<NodeIx, Stop> {
    topology
        .node(id)
        .ok_or_else(|| Stop::Usage(unknown_node(topology, id)))
}

/// Finds the leg `A,B`, which need not be a segment.
pub(super) fn leg(topology: &Topology, text: &str) -> Result<(NodeIx, NodeIx), Stop> {
    let found: Vec<_> = pairs(topology, text).collect();
    let joined: Vec<_> = found
        .iter()
        .copied()
        .filter(|&(from, to)| topology.segment_between(from, to).is_some())
        .collect();
    match (found.as_slice(), joined.as_slice()) {
        ([only], _) | (_, [only]) => Ok(*only),
        ([], _) => Err(Stop::Usage(no_leg(topology, text))),
        _ => Err(ambiguous(text)),
    }
}

/// Finds a node, a segment by its id, or a segment by its ends.
pub(super) fn close_target(topology: &Topology, text: &str) -> Result<CloseTarget, Stop> {
    let by_ends = pairs(topology, text).filter_map(|(from, to)| topology.segment_between(from, to));
    let segments = topology.find_segment(text).into_iter().chain(by_ends);
    let mut found: Vec<CloseTarget> = segments.map(CloseTarget::Segment).collect();
    found.extend(topology.node(text).map(CloseTarget::Node));
    found.dedup();
    match found.as_slice() {
        [only] => Ok(*only),
        [] => Err(Stop::Usage(nothing_to_close(topology, text))),
        _ => Err(ambiguous(text)),
    }
}

/// Finds a place: a node id, or two coordinates of the network's file.
pub(super) fn place(topology: &Topology, text: &str) -> Result<Point, Stop> {
    if let Some(node) = topology.node(text) {
        return Ok(topology.position(node));
    }
    let coordinates = text.split_once(',').and_then(|(first, second)| {
        let number = |word: &str| word.trim().parse::<f64>().ok();
        Some([number(first)?, number(second)?])
    });
    let is_geographic = topology.frame().is_geographic();
    let (names, kind) = match is_geographic {
        true => ("LON,LAT", "longitude and latitude in degrees"),
        false => ("X,Y", "metres"),
    };
    let Some([first, second]) = coordinates else {
        let problem = format!("'{text}' is no place: give {names} ({kind}) or the id of a node");
        return Err(Stop::Usage(problem));
    };
    if is_geographic && (first.abs() > 180.0 || second.abs() > 90.0) {
        let problem = format!(
            "'{text}' is not on Earth; longitude comes first: were longitude and latitude swapped?"
        );
        return Err(Stop::Usage(problem));
    }
    let place = topology.frame().to_plane([first, second]);
    match place.is_finite() {
        true => Ok(place),
        false => Err(Stop::Usage(format!("'{text}' is not finite"))),
    }
}

/// Every way to read a text as two node ids with a comma between them.
fn pairs<'a>(topology: &'a Topology, text: &'a str) -> impl Iterator<Item = (NodeIx, NodeIx)> + 'a {
    text.match_indices(',').filter_map(|(comma, _)| {
        let from = topology.node(text[..comma].trim())?;
        let to = topology.node(text[comma + 1..].trim())?;
        Some((from, to))
    })
}

fn ambiguous(text: &str) -> Stop {
    Stop::Usage(format!(
        "'{text}' can be read in more than one way; use the id of the segment"
    ))
}

fn no_leg(topology: &Topology, text: &str) -> String {
    let mut halves = text.split(',').map(str::trim);
    match (halves.next(), halves.next(), halves.next()) {
        (Some(from), Some(to), None) => {
            let unknown = [from, to]
                .into_iter()
                .filter(|id| topology.node(id).is_none());
            let problems: Vec<String> = unknown.map(|id| unknown_node(topology, id)).collect();
            problems.join("; ")
        }
        _ => format!("'{text}' is no leg: give the ids of two nodes, as A,B"),
    }
}

fn nothing_to_close(topology: &Topology, text: &str) -> String {
    if let Some((from, to)) = pairs(topology, text).next() {
        let (from, to) = (topology.node_id(from), topology.node_id(to));
        return format!("nodes '{from}' and '{to}' have no segment between them");
    }
    match text.contains(',') {
        true => no_leg(topology, text),
        false => format!(
            "'{text}' is neither a node nor a segment of this network{}",
            suggestions(topology, text)
        ),
    }
}

fn unknown_node(topology: &Topology, id: &str) -> String {
    let network = topology.name();
    let suggestions = suggestions(topology, id);
    format!("the network '{network}' has no node '{id}'{suggestions}")
}

/// The ids that a slip of the pen would turn into this one, else the first and the last there are.
fn suggestions(topology: &Topology, id: &str) -> String {
    let mut nodes: Vec<NodeIx> = topology.nodes().collect();
    nodes.sort_unstable_by_key(|&node| topology.rank(node));
    let ids = || nodes.iter().map(|&node| topology.node_id(node));
    let near = match topology.has_integer_ids() {
        // Every number is near to some other.
        true => Vec::new(),
        false => nearest(id, ids(), MAX_SUGGESTIONS),
    };
    if !near.is_empty() {
        let quoted: Vec<String> = near.into_iter().map(|id| format!("'{id}'")).collect();
        return format!("; did you mean {}?", quoted.join(" or "));
    }
    match (ids().next(), ids().next_back()) {
        (Some(first), Some(last)) => format!("; ids run from '{first}' to '{last}'"),
        _ => String::new(),
    }
}
