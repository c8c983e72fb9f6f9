//! The segment nearest to a drone that does not say which leg it is on.

use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx, Topology};
use rstar::PointDistance;

/// What single precision may be off by, as a share of the coordinates and of the distance.
const SINGLE_PRECISION: f64 = 1e-6;

/// The segment nearest to a place and how far off it is, in metres; of equally near ones that of the least index.
pub(crate) fn nearest_segment(topology: &Topology, place: Point) -> Option<(SegmentIx, f64)> {
    let around = [place.x as f32, place.y as f32];
    let slack_m = (place.x.abs() + place.y.abs()) * SINGLE_PRECISION;
    let mut best: Option<(SegmentIx, f64)> = None;
    for candidate in topology.segment_tree().nearest_neighbor_iter(&around) {
        let box_m = f64::from(candidate.distance_2(&around)).sqrt();
        let at_least_m = box_m * (1.0 - SINGLE_PRECISION) - slack_m;
        if best.is_some_and(|(_, best_m)| at_least_m > best_m) {
            break;
        }
        let segment = candidate.segment;
        let (from, to) = topology.segment_ends(segment);
        let off_m = place.distance_to_line_m(from, to);
        let is_better = best
            .is_none_or(|(holder, best_m)| off_m < best_m || (off_m == best_m && segment < holder));
        if is_better {
            best = Some((segment, off_m));
        }
    }
    best
}

/// The node nearest to a place.
pub(crate) fn nearest_node(topology: &Topology, place: Point) -> Option<NodeIx> {
    let around = [place.x as f32, place.y as f32];
    let nearest = topology.node_tree().nearest_neighbor(&around)?;
    Some(nearest.node)
}

/// The leg of a path nearest to a place and how far off it is, in metres; of equally near ones the first.
pub(crate) fn nearest_leg(
    topology: &Topology,
    path: &[NodeIx],
    place: Point,
) -> Option<(usize, f64)> {
    let legs = path
        .windows(2)
        .map(|leg| place.distance_to_line_m(topology.position(leg[0]), topology.position(leg[1])));
    let nearer = |one: (usize, f64), other: (usize, f64)| match other.1 < one.1 {
        true => other,
        false => one,
    };
    legs.enumerate().reduce(nearer)
}

/// A segment as a leg: toward a goal where there is one, as the file names its ends where there is none.
pub(crate) fn oriented(
    topology: &Topology,
    segment: SegmentIx,
    goal: Option<NodeIx>,
) -> (NodeIx, NodeIx) {
    let ends = topology.segment(segment);
    let goal_m = |node: NodeIx, goal| topology.position(node).distance_m(topology.position(goal));
    match goal {
        Some(goal) if goal_m(ends.from, goal) < goal_m(ends.to, goal) => (ends.to, ends.from),
        _ => (ends.from, ends.to),
    }
}

/// The leg from a node whose other end is nearest to a goal; the node twice where no segment leads away from it.
pub(crate) fn leg_from(
    topology: &Topology,
    node: NodeIx,
    goal: Option<NodeIx>,
) -> (NodeIx, NodeIx) {
    let goal = topology.position(goal.unwrap_or(node));
    let ends = topology.arcs(node).iter().map(|arc| arc.to);
    let nearest = ends.min_by(|&one, &other| {
        let [one_m, other_m] = [one, other].map(|end| topology.position(end).distance_m(goal));
        one_m.total_cmp(&other_m)
    });
    (node, nearest.unwrap_or(node))
}
