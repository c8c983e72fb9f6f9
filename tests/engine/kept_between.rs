//! What a scratch and a tree keep from one question to the next never answers the wrong one.

use super::table_cache::{request, topology};
use skyway::airspace::{Airspace, Closed, RequestClosures};
use skyway::network::{Components, Generated, Joining, NodeIx, SegmentIx, Topology};
use skyway::recompose::{Recomposition, Request, Scratch, Strategy, World, recompose};
use skyway::routing::{Baseline, Searcher, Start};
use std::sync::Arc;

/// The network of a seed after a patch that moves every fifth node and keeps all counts.
fn with_moved_nodes(seed: u64) -> Topology {
    let generated = Generated {
        nodes: 120,
        max_neighbours: 5,
        map_size_m: 1_000.0,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed,
    };
    let mut draft = generated.network().expect("in range");
    for node in draft.nodes.iter_mut().step_by(5) {
        node.position = node.position.map(|metres| 1_000.0 - metres);
    }
    for segment in &mut draft.segments {
        segment.length_m = None;
    }
    Topology::build(draft, [1; 32]).expect("valid")
}

fn answer(topology: &Arc<Topology>, request: &Request, scratch: &mut Scratch) -> Recomposition {
    let now = jiff::Timestamp::UNIX_EPOCH;
    let horizon = jiff::SignedDuration::from_mins(60);
    let airspace = Airspace::open(topology.clone(), 1, now, horizon);
    let world = World {
        airspace: &airspace,
        trees: None,
    };
    recompose(&world, request, scratch)
}

/// A failure between two nodes by their ids, answered by a cell size that is not the network's own.
fn by_cells(topology: &Topology, ids: [&str; 2], destination: &str) -> Option<Request> {
    let node = |id: &str| topology.node(id).expect("the same ids");
    topology.segment_between(node(ids[0]), node(ids[1]))?;
    let mut request = request(topology, node(ids[0]), node(destination))?;
    request.report.leg = (node(ids[0]), node(ids[1]));
    request.strategy = Strategy::CellDensity;
    request.parameters.cell_size_m = Some(90.0);
    Some(request)
}

#[test]
fn a_patch_that_moves_nodes_leaves_no_density_grid_of_before() {
    let mut differing = 0;
    for seed in 0..6 {
        let before = topology(seed);
        let after = Arc::new(with_moved_nodes(seed));
        let counts = |topology: &Topology| (topology.node_count(), topology.segment_count());
        assert_eq!(counts(&before), counts(&after), "seed {seed}");
        let destination = before.node_id(NodeIx(0)).to_owned();
        let mut used = Scratch::new(&before);
        for segment in before.segments().step_by(7) {
            let ends = before.segment(segment);
            let ids = [before.node_id(ends.from), before.node_id(ends.to)];
            let asked = [&before, &after].map(|topology| by_cells(topology, ids, &destination));
            let [Some(first), Some(second)] = asked else {
                continue;
            };
            let earlier = answer(&before, &first, &mut used);
            let kept = answer(&after, &second, &mut used);
            let fresh = answer(&after, &second, &mut Scratch::new(&after));
            assert_eq!(kept, fresh, "seed {seed}, {ids:?}");
            differing += usize::from(kept.area_nodes != earlier.area_nodes);
        }
    }
    assert!(
        differing > 20,
        "only {differing} areas changed with the nodes"
    );
}

#[test]
fn a_repaired_tree_answers_a_request_that_closes_nothing_of_it() {
    for seed in 0..20 {
        let topology = topology(seed);
        let open = Airspace::open(
            topology.clone(),
            1,
            jiff::Timestamp::UNIX_EPOCH,
            jiff::SignedDuration::from_mins(60),
        );
        let mut searcher = Searcher::new(&topology);
        let nothing = RequestClosures::new(&topology);
        let closed = Closed::new(&topology, open.closed(), &nothing);
        let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
        let destination = connected[connected.len() / 2];
        let intact = searcher.tree(&topology, destination);
        // Nothing is closed for this request, and the tree is a copy without numbers.
        let none = std::iter::empty::<SegmentIx>();
        let repaired = searcher.tree_taking_in(&intact, &closed, none);
        for &node in &connected {
            let start = [Start {
                node,
                offset_m: 0.0,
            }];
            let plain = searcher.shortest(&closed, &start, destination, Baseline::AStar, None);
            let plain_m = plain.expect("one part").length_m;
            let found = searcher.exact(&closed, &start, &repaired);
            let found_m = found.map(|arrival| arrival.length_m);
            let is_same =
                found_m.is_some_and(|found_m| (found_m - plain_m).abs() <= 1e-9 * plain_m);
            assert!(
                is_same,
                "seed {seed}: {found_m:?} from {node:?}, not {plain_m}"
            );
        }
    }
}
