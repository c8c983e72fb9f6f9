//! Ways over what is open before anything fails, and the tables of distances that guide them.

use crate::airspace::{Closed, RequestClosures};
use crate::flight::FailureReport;
use crate::network::NodeIx;
use crate::recompose::World;
use crate::routing::{Baseline, Path, Searcher, Start, TreeCache};
use std::sync::Arc;

/// The shortest open way between two nodes; `None` when there is none.
///
/// By `exact` where the world has the table of `to`, else by A*. A closed `from` can be left; a closed `to`
/// is never entered.
pub fn shortest_way(
    world: &World<'_>,
    from: NodeIx,
    to: NodeIx,
    searcher: &mut Searcher,
) -> Option<Path> {
    let airspace = world.airspace;
    let topology = airspace.topology();
    let nothing_more = RequestClosures::new(topology);
    let closed = Closed::new(topology, airspace.closed(), &nothing_more);
    let table = world
        .trees
        .and_then(|trees| trees.get(to, world.standing()));
    let start = [Start {
        node: from,
        offset_m: 0.0,
    }];
    let arrival = match &table {
        Some(table) => searcher.exact(&closed, &start, table),
        None => searcher.shortest(&closed, &start, to, Baseline::AStar, None),
    }?;
    let mut way = Path::default();
    searcher.append_way(arrival, table.as_deref(), &mut way);
    Some(way)
}

/// The plan that a failure breaks: as its report states it, or its leg and then the shortest way on over what was open before.
pub fn planned_nodes(
    world: &World<'_>,
    report: &FailureReport,
    searcher: &mut Searcher,
) -> Vec<NodeIx> {
    if let Some(stated) = &report.remaining_path {
        return stated.clone();
    }
    let (from, to) = report.leg;
    let rest = shortest_way(world, to, report.destination, searcher);
    let rest = rest.map_or_else(|| vec![to], |way| way.nodes);
    std::iter::once(from).chain(rest).collect()
}

/// Puts the table of a destination into the world's cache, with the standing closures worked in where there
/// are any. The intact one is computed once: no closure changes it.
///
/// The standing closures are the ones of the world's airspace. Does nothing in a world without a cache.
pub fn prepare_table(world: &World<'_>, destination: NodeIx, searcher: &mut Searcher) {
    let Some(trees) = world.trees else {
        return;
    };
    let airspace = world.airspace;
    let topology = airspace.topology();
    let known = trees.intact(destination, airspace.topology_revision());
    let intact = known.unwrap_or_else(|| {
        let computed = Arc::new(searcher.tree(topology, destination));
        trees.insert(computed.clone(), airspace.topology_revision());
        computed
    });
    if airspace.closed().blocked_segment_count() == 0 {
        trees.drop_taken_in(destination);
        return;
    }
    let nothing_more = RequestClosures::new(topology);
    let closed = Closed::new(topology, airspace.closed(), &nothing_more);
    let blocked = airspace.closed().blocked_segments();
    let repaired = searcher.tree_taking_in(&intact, &closed, blocked);
    trees.insert_repaired(Arc::new(repaired), world.standing());
}

/// The same, unless the cache has a table of the destination already.
pub(super) fn prepare_missing_table(
    world: &World<'_>,
    destination: NodeIx,
    searcher: &mut Searcher,
) {
    // Looking it up would count as a search with or without a table.
    let topology_revision = world.airspace.topology_revision();
    let is_missing = |trees: &TreeCache| !trees.holds(destination, topology_revision);
    if world.trees.is_some_and(is_missing) {
        prepare_table(world, destination, searcher);
    }
}
