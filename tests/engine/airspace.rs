//! Snapshots, and the destination trees that must keep up with them.

use super::oracle::generate::{Draw, closures, generate};
use super::strategies::{cases, topology_of};
use jiff::{SignedDuration, Timestamp};
use skyway::airspace::{
    Airspace, Change, Closed, Closure, RequestClosures, Window, Zone, ZoneDraft, ZoneGeometry,
};
use skyway::geo::AltitudeBand;
use skyway::network::{NodeIx, SegmentIx, Topology, sketch};
use skyway::recompose::World;
use skyway::routing::{Baseline, Searcher, Start, TreeCache};
use std::sync::Arc;

const NETWORKS: u64 = 400;

fn minutes(count: i64) -> Timestamp {
    Timestamp::UNIX_EPOCH + SignedDuration::from_mins(count)
}

fn square_zone(topology: &Topology, id: &str, windows: Vec<Window>) -> Arc<Closure> {
    let ring = [
        [-50.0, -50.0],
        [50.0, -50.0],
        [50.0, 50.0],
        [-50.0, 50.0],
        [-50.0, -50.0],
    ];
    let draft = ZoneDraft {
        id: id.to_owned(),
        name: None,
        reason: None,
        authority: None,
        geometry: ZoneGeometry::Polygon(vec![ring.to_vec()]),
        band: AltitudeBand::UNLIMITED,
        windows,
        margin_m: 0.0,
        terms: Default::default(),
    };
    let zone = Zone::new(draft, topology.frame()).expect("a square");
    Arc::new(Closure::of_zone(topology, Arc::new(zone)))
}

/// `a` lies in the zones of these tests, `b` and `c` do not.
fn row() -> (Arc<Topology>, Airspace) {
    let topology = Arc::new(sketch("a..b..c", &[("a", "b"), ("b", "c")]));
    let horizon = SignedDuration::from_mins(60);
    let open = Airspace::open(topology.clone(), 1, minutes(0), horizon);
    (topology, open)
}

#[test]
fn a_thing_is_open_when_its_last_cause_has_ended() {
    let (topology, open) = row();
    let put = |id: &str| Change::Put(square_zone(&topology, id, Vec::new()));
    let lift = |id: &str| Change::Lift(id.to_owned());
    let both = open.apply(&[put("one"), put("two")], minutes(0));
    assert_eq!(both.closed().closed_node_count(), 1);
    assert_eq!(both.closed().blocked_segment_count(), 1);
    let one = both.apply(&[lift("two")], minutes(0));
    assert_eq!(one.closed(), both.closed());
    let none = one.apply(&[lift("one")], minutes(0));
    assert_eq!(none.closed(), open.closed());
    assert_eq!(
        [both.revision(), one.revision(), none.revision()],
        [1, 2, 3]
    );
    assert_eq!(none.opened_at(), 3);
}

#[test]
fn the_same_change_twice_changes_nothing() {
    let (topology, open) = row();
    let change = Change::Put(square_zone(&topology, "one", Vec::new()));
    let once = open.apply(std::slice::from_ref(&change), minutes(0));
    let twice = once.apply(&[change, Change::Lift("unknown".to_owned())], minutes(0));
    assert_eq!(twice.revision(), once.revision());
    assert_eq!(twice.closed(), once.closed());
}

#[test]
fn windows_open_and_close_by_themselves_an_horizon_ahead() {
    let (topology, open) = row();
    let window = Window::new(Some(minutes(120)), Some(minutes(150))).expect("forwards");
    let announced = open.apply(
        &[Change::Put(square_zone(&topology, "noon", vec![window]))],
        minutes(0),
    );
    assert_eq!(
        announced.closed().closed_node_count(),
        0,
        "two hours ahead nothing is closed"
    );
    assert_eq!(
        announced.next_change(),
        Some(minutes(60)),
        "an hour before, it counts"
    );
    let counting = announced.apply(&[], minutes(60));
    assert_eq!(counting.closed().closed_node_count(), 1);
    let at_end = counting.apply(&[], minutes(150));
    assert_eq!(
        at_end.closed().closed_node_count(),
        1,
        "the end belongs to the window"
    );
    let after = at_end.next_change().expect("it ends");
    let over = at_end.apply(&[], after);
    assert_eq!(over.closed().closed_node_count(), 0);
    assert_eq!(over.next_change(), None);
    assert_eq!(
        [counting.revision(), at_end.revision(), over.revision()],
        [2, 2, 3]
    );
}

#[test]
fn a_tree_with_closures_worked_in_is_the_tree_of_the_network_without_them() {
    for seed in 0..NETWORKS * cases() {
        let (_, network) = generate(seed);
        let topology = Arc::new(topology_of(&network));
        let mut draw = Draw::new(seed ^ 0xc105e);
        let destination = NodeIx(draw.below(network.nodes.len()) as u32);
        let mut airspace = Airspace::open(
            topology.clone(),
            1,
            minutes(0),
            SignedDuration::from_mins(60),
        );
        let mut searcher = Searcher::new(&topology);
        let mut tree = searcher.tree(&topology, destination);
        let nothing = RequestClosures::new(&topology);
        for round in 0..3 {
            let drawn = closures(&mut draw, &network, 0.05, 0.1);
            let closure = Closure::of_operator(
                format!("round {round}"),
                String::new(),
                drawn
                    .nodes
                    .iter()
                    .map(|&node| NodeIx(node as u32))
                    .collect(),
                drawn
                    .segments
                    .iter()
                    .map(|&segment| SegmentIx(segment as u32))
                    .collect(),
            );
            airspace = airspace.apply(&[Change::Put(Arc::new(closure))], minutes(0));
            let closed = Closed::new(&topology, airspace.closed(), &nothing);
            tree = searcher.tree_taking_in(&tree, &closed, airspace.closed().blocked_segments());
            for node in topology.nodes().filter(|&node| !closed.closes_node(node)) {
                let start = [Start {
                    node,
                    offset_m: 0.0,
                }];
                let dijkstra = Baseline::Dijkstra { full_tree: false };
                let found = searcher.shortest(&closed, &start, destination, dijkstra, None);
                let expected_m = found.map_or(f64::INFINITY, |arrival| arrival.length_m);
                let told_m = tree.distance_m(node);
                let same = told_m == expected_m || (told_m - expected_m).abs() <= 1e-9 * expected_m;
                assert!(
                    same,
                    "seed {seed}, round {round}, {node:?}: {told_m} against {expected_m}"
                );
            }
        }
    }
}

#[test]
fn the_cache_hands_out_a_worked_in_tree_only_while_its_closures_stand() {
    let (topology, open) = row();
    let trees = TreeCache::new(1 << 20);
    let mut searcher = Searcher::new(&topology);
    let destination = topology.node("c").expect("drawn");
    let intact = Arc::new(searcher.tree(&topology, destination));
    trees.insert(intact.clone(), 1);
    let standing = |airspace: &Airspace| {
        World {
            airspace,
            trees: None,
        }
        .standing()
    };

    let closing = open.apply(
        &[Change::Put(square_zone(&topology, "one", Vec::new()))],
        minutes(0),
    );
    let nothing = RequestClosures::new(&topology);
    let closed = Closed::new(&topology, closing.closed(), &nothing);
    let blocked = closing.closed().blocked_segments();
    let worked_in = Arc::new(searcher.tree_taking_in(&intact, &closed, blocked));
    assert_ne!(worked_in, intact, "the way from a is cut");
    trees.insert_repaired(worked_in.clone(), standing(&closing));

    let got = |airspace: &Airspace| trees.get(destination, standing(airspace)).expect("held");
    assert!(Arc::ptr_eq(&got(&closing), &worked_in));
    let more = closing.apply(
        &[Change::Put(square_zone(&topology, "two", Vec::new()))],
        minutes(0),
    );
    assert!(
        Arc::ptr_eq(&got(&more), &worked_in),
        "what it knows still stands"
    );
    let lifted = more.apply(&[Change::Lift("one".to_owned())], minutes(0));
    assert!(
        Arc::ptr_eq(&got(&lifted), &intact),
        "something has been opened since"
    );
    assert!(
        Arc::ptr_eq(&got(&open), &intact),
        "a reader of the snapshot before"
    );
}

#[test]
fn the_cache_is_bounded_in_bytes_and_keeps_what_is_used() {
    let (topology, open) = row();
    let mut searcher = Searcher::new(&topology);
    let mut tree = |id: &str| {
        let destination = topology.node(id).expect("drawn");
        Arc::new(searcher.tree(&topology, destination))
    };
    let (a, b, c) = (tree("a"), tree("b"), tree("c"));
    let trees = TreeCache::new(2 * a.bytes());
    let standing = World {
        airspace: &open,
        trees: None,
    }
    .standing();
    trees.insert(a.clone(), 1);
    trees.insert(b, 1);
    assert!(trees.get(a.destination(), standing).is_some());
    trees.insert(c.clone(), 1);
    let mut kept = [a.destination(), c.destination()];
    kept.sort_unstable();
    assert_eq!(trees.destinations(), kept);
    let figures = trees.figures();
    assert_eq!(
        (figures.destinations, figures.hits, figures.misses),
        (2, 1, 0)
    );
    assert!(figures.bytes <= 2 * a.bytes());
}
