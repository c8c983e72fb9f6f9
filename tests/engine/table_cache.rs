//! The bounded cache of tables: what is evicted is answered without a table, at once and no longer.

use super::strategies::cases;
use skyway::airspace::{Airspace, Change, Closure};
use skyway::compose::prepare_table;
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::network::{Components, Generated, Joining, NodeIx, SegmentIx, Topology};
use skyway::recompose::{Outcome, Recomposition, Request, Scratch, World, recompose};
use skyway::routing::TreeCache;
use std::sync::Arc;

/// Destinations asked for, of which the cache holds a few.
const DESTINATIONS: usize = 9;
/// Intact tables that fit; with closures worked in an entry takes half as much again.
const TABLES_THAT_FIT: usize = 4;

pub(crate) fn topology(seed: u64) -> Arc<Topology> {
    let generated = Generated {
        nodes: 120,
        max_neighbours: 5,
        map_size_m: 1_000.0,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed,
    };
    let draft = generated.network().expect("in range");
    Arc::new(Topology::build(draft, [0; 32]).expect("valid"))
}

/// The airspace with every seventeenth segment closed.
fn with_closures(topology: &Arc<Topology>) -> Airspace {
    let now = jiff::Timestamp::UNIX_EPOCH;
    let open = Airspace::open(
        topology.clone(),
        1,
        now,
        jiff::SignedDuration::from_mins(60),
    );
    let segments: Vec<SegmentIx> = topology.segments().step_by(17).collect();
    let closure =
        Closure::of_operator("works".to_owned(), "works".to_owned(), Vec::new(), segments);
    open.apply(&[Change::Put(Arc::new(closure))], now)
}

/// A failure at the first segment from a node.
pub(crate) fn request(topology: &Topology, from: NodeIx, destination: NodeIx) -> Option<Request> {
    let leg = (from, topology.arcs(from).first()?.to);
    Some(Request::exact(FailureReport {
        failure: FailureType::Navigational,
        leg,
        location: Location::LegStart,
        cause_location: None,
        destination,
        remaining_path: None,
    }))
}

fn assert_as_good(seed: u64, warm: &Recomposition, evicted: &Recomposition) {
    let what = || format!("seed {seed}: {warm:?} with its table, {evicted:?} without");
    assert_eq!(warm.outcome, evicted.outcome, "{}", what());
    match (warm.remaining_length_m, evicted.remaining_length_m) {
        (Some(warm_m), Some(evicted_m)) => {
            assert!((warm_m - evicted_m).abs() <= 1e-9 * warm_m, "{}", what());
        }
        (warm_m, evicted_m) => assert_eq!(warm_m, evicted_m, "{}", what()),
    }
}

#[test]
fn a_full_cache_evicts_by_bytes_and_who_was_evicted_is_answered_as_well() {
    let mut rerouted = 0;
    for seed in 0..20 * cases() {
        let topology = topology(seed);
        let airspace = with_closures(&topology);
        let mut scratch = Scratch::new(&topology);
        let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
        let one_table = scratch.searcher().tree(&topology, connected[0]);
        let capacity_bytes = TABLES_THAT_FIT * one_table.bytes();
        let trees = TreeCache::new(capacity_bytes);
        let world = World {
            airspace: &airspace,
            trees: Some(&trees),
        };
        let every = connected.len() / DESTINATIONS;
        let destinations: Vec<NodeIx> = connected.iter().copied().step_by(every).collect();
        let from = connected[connected.len() / 2];
        let mut warm = Vec::new();
        for &destination in &destinations {
            prepare_table(&world, destination, scratch.searcher());
            let Some(request) = request(&topology, from, destination) else {
                continue;
            };
            let hits_before = trees.figures().hits;
            warm.push((request.clone(), recompose(&world, &request, &mut scratch)));
            let figures = trees.figures();
            assert_eq!(figures.hits, hits_before + 1, "seed {seed}");
            assert!(figures.bytes <= capacity_bytes, "seed {seed}: {figures:?}");
        }
        let figures = trees.figures();
        assert!(
            (1..TABLES_THAT_FIT).contains(&figures.destinations),
            "seed {seed}: copies with closures worked in count too: {figures:?}"
        );
        assert_eq!(figures.misses, 0, "seed {seed}");
        let mut without_table = 0;
        for (request, warm) in &warm {
            let destination = request.report.destination;
            without_table += u64::from(!trees.holds(destination, 1));
            let again = recompose(&world, request, &mut scratch);
            assert_as_good(seed, warm, &again);
            rerouted += usize::from(again.outcome == Outcome::Rerouted);
        }
        let after = trees.figures();
        assert_eq!(after.misses, without_table, "seed {seed}");
        assert_eq!(
            after.hits + after.misses,
            2 * warm.len() as u64,
            "seed {seed}: asking whether a table is held counts as nothing"
        );
        assert!(without_table > 0, "seed {seed}: nothing was evicted");
    }
    assert!(rerouted > 100, "only {rerouted} answers had a new path");
}

#[test]
fn a_change_of_the_airspace_computes_no_intact_table_and_uses_none() {
    let topology = topology(7);
    let closed = with_closures(&topology);
    let now = jiff::Timestamp::UNIX_EPOCH;
    let open = Airspace::open(
        topology.clone(),
        1,
        now,
        jiff::SignedDuration::from_mins(60),
    );
    let mut scratch = Scratch::new(&topology);
    let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
    let [first, second, third] = [connected[0], connected[1], connected[2]];
    let one_table = scratch.searcher().tree(&topology, first).bytes();
    // Two with closures worked in, and not three.
    let trees = TreeCache::new(4 * one_table);
    let world = |airspace| World {
        airspace,
        trees: Some(&trees),
    };
    let before = world(&open).standing();
    prepare_table(&world(&open), first, scratch.searcher());
    prepare_table(&world(&open), second, scratch.searcher());
    let intact = [first, second].map(|node| trees.get(node, before).expect("a table"));
    // The one of the first node was used last.
    assert!(trees.get(first, before).is_some());
    for &node in &[first, second] {
        prepare_table(&world(&closed), node, scratch.searcher());
    }
    for (node, intact) in [first, second].into_iter().zip(&intact) {
        let now = trees.get(node, before).expect("a table");
        assert!(Arc::ptr_eq(&now, intact), "it was computed anew");
    }
    assert!(trees.get(first, before).is_some());
    for &node in &[first, second] {
        prepare_table(&world(&closed), node, scratch.searcher());
    }
    prepare_table(&world(&closed), third, scratch.searcher());
    let held = [first, second, third].map(|node| trees.holds(node, 1));
    assert_eq!(held, [true, false, true], "the least recently used went");
}
