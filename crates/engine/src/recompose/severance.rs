//! What cut a drone off: the causes along the rim of all that it can still reach.

use super::answer::Severance;
use super::request::Request;
use crate::airspace::{Airspace, Closed, Closure};
use crate::flight::Reentry;
use crate::network::{NodeIx, SegmentIx};
use crate::routing::Searcher;

/// The causes that close a segment, or its far node, on the rim of what can be reached from the starts.
///
/// Where nothing on the rim is closed the network itself ends there.
pub(super) fn severances(
    airspace: &Airspace,
    closed: &Closed<'_>,
    starts: &[Reentry],
    searcher: &mut Searcher,
) -> Vec<Severance> {
    searcher.nearest(closed, starts, |_| false);
    let topology = closed.topology();
    let mut segments: Vec<SegmentIx> = Vec::new();
    let mut nodes: Vec<NodeIx> = Vec::new();
    let mut by_report = false;
    for (node, _) in searcher.settled_nodes(topology) {
        for arc in topology.arcs(node) {
            if closed.lets_pass(node, arc) || searcher.has_settled(arc.to) {
                continue;
            }
            by_report |= closed.request_blocks(arc.segment);
            segments.push(arc.segment);
            nodes.extend([node, arc.to]);
        }
    }
    segments.sort_unstable();
    nodes.sort_unstable();
    nodes.dedup();
    let is_cause = |closure: &&std::sync::Arc<Closure>| {
        let hits = &closure.hits;
        share_any(&hits.segments, &segments) || share_any(&hits.nodes, &nodes)
    };
    let standing = airspace.in_force().filter(is_cause);
    let mut causes: Vec<Severance> = by_report.then_some(Severance::Report).into_iter().collect();
    causes.extend(standing.map(|closure| Severance::Closure(closure.id.clone())));
    if causes.is_empty() {
        causes.push(Severance::Network);
    }
    causes
}

/// Whether two sorted lists have anything in common: each of the shorter one is sought in the other, as a thousand small
/// closures and a long rim are as usual as the reverse.
fn share_any<T: Ord>(one: &[T], other: &[T]) -> bool {
    let (short, long) = match one.len() <= other.len() {
        true => (one, other),
        false => (other, one),
    };
    short.iter().any(|it| long.binary_search(it).is_ok())
}

/// All that closes the leg of a request or its ends; the network where nothing does.
pub(crate) fn causes_of_leg(airspace: &Airspace, request: &Request) -> Vec<Severance> {
    let (from, to) = request.report.leg;
    let segment = airspace.topology().segment_between(from, to);
    let mut causes = Vec::new();
    if request.report.failure.closes_leg() || request.zone.is_some() {
        causes.push(Severance::Report);
    }
    let cuts = |closure: &&std::sync::Arc<Closure>| {
        let hits = &closure.hits;
        segment.is_some_and(|segment| hits.segments.binary_search(&segment).is_ok())
            || hits.nodes.binary_search(&from).is_ok()
            || hits.nodes.binary_search(&to).is_ok()
    };
    let cutting = airspace.in_force().filter(cuts);
    causes.extend(cutting.map(|closure| Severance::Closure(closure.id.clone())));
    if causes.is_empty() || segment.is_none() {
        causes.push(Severance::Network);
    }
    causes
}
