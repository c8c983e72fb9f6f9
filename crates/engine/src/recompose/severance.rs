//! What cut a drone off: the causes along the rim of all that it can still reach.

use super::answer::Severance;
use super::request::Request;
use crate::airspace::{Airspace, Closed, Closure};
use crate::flight::Reentry;
use crate::network::{NodeIx, SegmentIx};
use crate::routing::Searcher;
use std::collections::BTreeSet;

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
    let mut segments = BTreeSet::new();
    let mut nodes = BTreeSet::new();
    let mut by_report = false;
    for (node, _) in searcher.settled_nodes(topology) {
        for arc in topology.arcs(node) {
            if closed.lets_pass(node, arc) || searcher.has_settled(arc.to) {
                continue;
            }
            by_report |= closed.request_blocks(arc.segment);
            segments.insert(arc.segment);
            nodes.extend([node, arc.to]);
        }
    }
    let is_cause = |closure: &&std::sync::Arc<Closure>| {
        let hits = &closure.hits;
        segments
            .iter()
            .any(|found: &SegmentIx| hits.segments.binary_search(found).is_ok())
            || nodes
                .iter()
                .any(|found: &NodeIx| hits.nodes.binary_search(found).is_ok())
    };
    let standing = airspace.in_force().filter(is_cause);
    let mut causes: Vec<Severance> = by_report.then_some(Severance::Report).into_iter().collect();
    causes.extend(standing.map(|closure| Severance::Closure(closure.id.clone())));
    if causes.is_empty() {
        causes.push(Severance::Network);
    }
    causes
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
