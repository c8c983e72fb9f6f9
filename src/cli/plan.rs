//! Ways over what is open, without a failure: the plan that a composition makes and a failure breaks.

use crate::airspace::{Airspace, Closed, RequestClosures};
use crate::flight::FailureReport;
use crate::network::NodeIx;
use crate::recompose::World;
use crate::routing::{Baseline, Searcher, Start, TreeCache, Way};
use std::sync::Arc;

/// Bytes that the tables of destinations may take.
const TABLE_BYTES: usize = 256 << 20;

/// An empty cache of tables.
pub(super) fn tables() -> TreeCache {
    TreeCache::new(TABLE_BYTES)
}

/// The shortest open way between two nodes; `None` when there is none.
pub(super) fn shortest_way(airspace: &Airspace, from: NodeIx, to: NodeIx) -> Option<Way> {
    let topology = airspace.topology();
    let nothing_more = RequestClosures::new(topology);
    let closed = Closed::new(topology, airspace.closed(), &nothing_more);
    let start = Start {
        node: from,
        offset_m: 0.0,
    };
    let mut searcher = Searcher::new(topology);
    let arrival = searcher.shortest(&closed, &[start], to, Baseline::AStar, None)?;
    let mut way = Way::default();
    searcher.append_way(arrival, None, &mut way);
    Some(way)
}

/// The plan that a failure breaks: its leg, then the shortest way on over what was open before.
pub(super) fn planned_nodes(airspace: &Airspace, report: &FailureReport) -> Vec<NodeIx> {
    if let Some(stated) = &report.remaining_path {
        return stated.clone();
    }
    let (from, to) = report.leg;
    let rest = shortest_way(airspace, to, report.destination);
    let rest = rest.map_or_else(|| vec![to], |way| way.nodes);
    std::iter::once(from).chain(rest).collect()
}

/// Puts the table of a destination into the cache, with the standing closures worked in where there are any.
///
/// The standing closures are the ones of the world's airspace.
pub(super) fn prepare_table(world: &World<'_>, destination: NodeIx, searcher: &mut Searcher) {
    let Some(trees) = world.trees else {
        return;
    };
    let airspace = world.airspace;
    let topology = airspace.topology();
    let intact = Arc::new(searcher.tree(topology, destination));
    trees.insert(intact.clone(), airspace.topology_revision());
    if airspace.closed().blocked_segment_count() == 0 {
        return;
    }
    let nothing_more = RequestClosures::new(topology);
    let closed = Closed::new(topology, airspace.closed(), &nothing_more);
    let blocked = airspace.closed().blocked_segments();
    let taken_in = searcher.tree_taking_in(&intact, &closed, blocked);
    trees.insert_taken_in(Arc::new(taken_in), world.standing());
}
