//! The old plan: what the drone was going to fly before the failure.

use super::request::Request;
use super::starts::Leg;
use crate::airspace::Closed;
use crate::network::{NodeIx, SegmentIx};
use crate::routing::{Area, Arrival, Baseline, DestinationTree, Entrance, Path, Searcher, Start};

/// Writes the nodes of the old plan from the failed leg's start on into `plan`.
///
/// Where the report does not say, the leg and then the shortest way over what was open before it; the leg
/// alone where it led nowhere.
pub(super) fn old_plan(
    request: &Request,
    leg: &Leg,
    before: &Closed<'_>,
    tree: Option<&DestinationTree>,
    searcher: &mut Searcher,
    plan: &mut Path,
) {
    plan.nodes.clear();
    plan.segments.clear();
    if let Some(stated) = &request.report.remaining_path {
        plan.nodes.extend_from_slice(stated);
        return;
    }
    let start = Start {
        node: leg.to,
        offset_m: 0.0,
    };
    plan.nodes.push(leg.from);
    plan.nodes.push(leg.to);
    let arrival = to_destination(before, &[start], request.report.destination, tree, searcher);
    if let Some(arrival) = arrival {
        searcher.append_way(arrival, tree, plan);
    }
}

/// The shortest way to the destination: by its tree where there is one, else by A*.
pub(super) fn to_destination(
    closed: &Closed<'_>,
    starts: &[impl Entrance],
    destination: NodeIx,
    tree: Option<&DestinationTree>,
    searcher: &mut Searcher,
) -> Option<Arrival> {
    match tree {
        Some(tree) => searcher.exact(closed, starts, tree),
        None => searcher.shortest(closed, starts, destination, Baseline::AStar, None),
    }
}

/// The segment of a plan's leg if the drone can fly it; a leg without a segment cannot be flown.
///
/// The first node is where the drone is: it may be closed. Any other has to be entered first.
pub(super) fn open_leg(closed: &Closed<'_>, plan: &[NodeIx], at: usize) -> Option<SegmentIx> {
    let (from, to) = (plan[at], plan[at + 1]);
    let mut arcs = closed.topology().arcs(from).iter();
    let arc = arcs.find(|arc| arc.to == to)?;
    let is_open = match at {
        0 => closed.lets_pass(from, arc),
        _ => !closed.blocks(arc.segment),
    };
    is_open.then_some(arc.segment)
}

/// The part of a plan from a place on as a way, if all of it is open.
pub(super) fn open_rest(closed: &Closed<'_>, plan: &[NodeIx], first: usize) -> Option<Path> {
    let rest = plan.get(first..)?;
    let mut way = Path {
        nodes: vec![*rest.first()?],
        segments: Vec::new(),
    };
    for at in 0..rest.len() - 1 {
        way.push(open_leg(closed, rest, at)?, rest[at + 1]);
    }
    Some(way)
}

/// The first node that a way comes to twice.
pub(super) fn first_loop(way: &Path, passed: &mut Area) -> Option<NodeIx> {
    passed.clear();
    way.nodes.iter().copied().find(|&node| !passed.insert(node))
}
