//! The bundled networks: what is in `data` is what the builders make, to the byte.
//!
//! `SKYWAY_BLESS=1 cargo test --release --test engine bundled` writes the files again.

use geo::{Distance, Geodesic};
use petgraph::algo::dijkstra;
use petgraph::graph::{NodeIndex, UnGraph};
use skyway::buildings::LineOfSight;
use skyway::formats::{read_buildings, read_network, write_network};
use skyway::geo::{Altitude, Point};
use skyway::network::{CORRIDOR_SEED, NetworkDraft, Topology, bundled, san_marcos_san_antonio};
use std::path::Path;

const BUILDINGS: &str = include_str!("../../data/sydney/buildings.geojson");

/// Compares with a file under `data`, or writes it where that was asked for.
#[expect(
    clippy::disallowed_methods,
    reason = "a test reads the environment and writes the file it guards"
)]
fn check_file(name: &str, bundled: &str, built: &str) {
    if std::env::var_os("SKYWAY_BLESS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("data")
            .join(name);
        std::fs::write(&path, built).expect("data is writable");
        return;
    }
    let differing = bundled
        .lines()
        .zip(built.lines())
        .find(|(old, new)| old != new);
    if let Some((old, new)) = differing {
        panic!(
            "data/{name} is not what is built; SKYWAY_BLESS=1 writes it\nin the file: {old}\nbuilt:       {new}"
        );
    }
    assert!(
        bundled == built,
        "data/{name} is longer or shorter than what is built; SKYWAY_BLESS=1 writes it"
    );
}

fn sydney() -> NetworkDraft {
    let buildings = read_buildings(BUILDINGS).expect("the bundled buildings are valid");
    let rules = LineOfSight {
        extract: Some(bundled::SYDNEY_CBD_EXTRACT.to_owned()),
        ..LineOfSight::default()
    };
    let skyline = rules
        .build(&buildings, &|_, _, _| false, &mut |_, _| {})
        .expect("a skyway");
    NetworkDraft {
        name: bundled::SYDNEY_CBD_NAME.to_owned(),
        attribution: bundled::SYDNEY_CBD_ATTRIBUTION.to_owned(),
        ..skyline.network
    }
}

fn graph(draft: &NetworkDraft) -> UnGraph<(), f64> {
    let place = |id: &str| {
        let number: u32 = id.parse().expect("bundled ids are numbers from 1");
        NodeIndex::from(number - 1)
    };
    let edges = draft.segments.iter().map(|segment| {
        let length_m = segment
            .length_m
            .expect("bundled segments state their length");
        (place(&segment.from), place(&segment.to), length_m)
    });
    UnGraph::from_edges(edges)
}

/// Nodes and segments of the largest component.
fn largest_component(draft: &NetworkDraft) -> (usize, usize) {
    let graph = graph(draft);
    let components = petgraph::algo::kosaraju_scc(&graph);
    let largest = components
        .into_iter()
        .max_by_key(Vec::len)
        .expect("there are nodes");
    let members: std::collections::BTreeSet<_> = largest.into_iter().collect();
    let is_member = |edge: &petgraph::graph::Edge<f64>| members.contains(&edge.source());
    (
        members.len(),
        graph
            .raw_edges()
            .iter()
            .filter(|edge| is_member(edge))
            .count(),
    )
}

#[test]
fn sydney_is_what_its_buildings_give() {
    check_file(
        "sydney-cbd.geojson",
        bundled::SYDNEY_CBD,
        &write_network(&sydney()),
    );
}

#[test]
fn the_corridor_is_what_its_seed_gives() {
    let built = write_network(&san_marcos_san_antonio(CORRIDOR_SEED));
    check_file(
        "corridor-san-marcos-san-antonio.geojson",
        bundled::CORRIDOR,
        &built,
    );
}

#[test]
fn bundled_networks_load_and_name_their_source() {
    for (text, source) in [
        (bundled::SYDNEY_CBD, "© OpenStreetMap contributors"),
        (bundled::CORRIDOR, "Synthetic"),
    ] {
        let draft = read_network(text).expect("a bundled network is valid");
        assert!(draft.attribution.contains(source), "{}", draft.attribution);
        let topology = Topology::build(draft, [0; 32]).expect("a bundled network can be flown");
        assert!(topology.has_integer_ids());
        // A search whose bound is the straight line needs no scaling.
        assert!(
            topology.straight_line_scale() >= 1.0,
            "{}",
            topology.straight_line_scale()
        );
    }
}

#[test]
fn sydney_is_large_enough_and_below_the_ceiling() {
    let draft = read_network(bundled::SYDNEY_CBD).expect("valid");
    let (nodes, segments) = largest_component(&draft);
    assert!(
        nodes >= 300 && segments >= 2_500,
        "{nodes} nodes, {segments} segments"
    );
    for segment in &draft.segments {
        let (lower, upper) = (
            segment.band.lower.expect("stated"),
            segment.band.upper.expect("stated"),
        );
        let is_between = |altitude: Altitude| (15.0..=120.0).contains(&altitude.value_m);
        assert!(
            is_between(lower) && is_between(upper),
            "segment {}-{}",
            segment.from,
            segment.to
        );
    }
    // South of this there is a strip without data.
    assert!(draft.nodes.iter().all(|node| node.position[1] > -33.8730));
}

#[test]
fn the_corridor_is_94_km_along_the_network_and_74_km_straight() {
    let draft = read_network(bundled::CORRIDOR).expect("valid");
    let (first, last) = (&draft.nodes[0], &draft.nodes[draft.nodes.len() - 1]);
    assert_eq!(first.name.as_deref(), Some("San Marcos depot"));
    assert_eq!(last.name.as_deref(), Some("San Antonio depot"));

    let graph = graph(&draft);
    let lengths = dijkstra(&graph, NodeIndex::new(0), None, |edge| *edge.weight());
    assert_eq!(
        lengths.len(),
        draft.nodes.len(),
        "every node can be reached"
    );
    let along_m = lengths[&NodeIndex::new(draft.nodes.len() - 1)];
    assert!((93_500.0..94_500.0).contains(&along_m), "{along_m} m");

    let [start, end] =
        [first, last].map(|node| geo::Point::new(node.position[0], node.position[1]));
    let straight_m = Geodesic.distance(start, end);
    assert!((73_500.0..74_500.0).contains(&straight_m), "{straight_m} m");

    let degree = |node| graph.edges(node).count();
    assert!(
        graph
            .node_indices()
            .map(degree)
            .all(|degree| (1..=8).contains(&degree))
    );
}

#[test]
fn no_two_bundled_rooftops_coincide() {
    for text in [bundled::SYDNEY_CBD, bundled::CORRIDOR] {
        let topology = Topology::build(read_network(text).expect("valid"), [0; 32]).expect("valid");
        let positions: &[Point] = topology.positions();
        for (index, &position) in positions.iter().enumerate() {
            let nearest_m = positions[index + 1..]
                .iter()
                .map(|&other| position.distance_m(other))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest_m > 1.0, "two rooftops {nearest_m} m apart");
        }
    }
}
