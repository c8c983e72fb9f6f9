//! Tests of the oracle itself: cases small enough to be computed by hand, with the computation, a
//! file for each strategy and one for the whole recomposition, and properties of generated
//! networks.

mod cells;
mod properties;
mod radius;
mod recomposition;
mod two_phased;

use std::collections::BTreeSet;

use super::*;

/// A network of nodes `(id, x, y)` and segments between ids, with straight lengths.
fn network(nodes: &[(&str, f64, f64)], segments: &[(&str, &str)]) -> OracleNetwork {
    let nodes: Vec<OracleNode> = nodes
        .iter()
        .map(|&(id, x, y)| OracleNode {
            id: id.to_owned(),
            x,
            y,
            pads: 0,
        })
        .collect();
    let ends = OracleNetwork::new(nodes.clone(), Vec::new());
    let segments = segments
        .iter()
        .map(|&(a, b)| {
            let (a, b) = (at(&ends, a), at(&ends, b));
            OracleSegment {
                a,
                b,
                length_m: ends.straight_m(a, b),
            }
        })
        .collect();
    OracleNetwork::new(nodes, segments)
}

fn at(network: &OracleNetwork, id: &str) -> usize {
    network
        .nodes
        .iter()
        .position(|node| node.id == id)
        .expect("the test names a node of its network")
}

fn all(network: &OracleNetwork, ids: &[&str]) -> BTreeSet<usize> {
    ids.iter().map(|id| at(network, id)).collect()
}

fn path(network: &OracleNetwork, ids: &[&str]) -> Option<Vec<usize>> {
    Some(ids.iter().map(|id| at(network, id)).collect())
}

/// The world in which the segment A-B and the nodes named are closed.
fn world<'a>(network: &'a OracleNetwork, closed_nodes: &[&str]) -> World<'a> {
    let mut world = World::open(network);
    world.closed_nodes = all(network, closed_nodes);
    world
        .closed_segments
        .extend(network.segments_between(at(network, "A"), at(network, "B")));
    world
}

fn assert_length(actual: Option<f64>, expected_m: f64) {
    let actual_m = actual.expect("there is a path");
    assert!(
        (actual_m - expected_m).abs() < 1e-3,
        "{actual_m} m instead of {expected_m} m"
    );
}

#[test]
fn ids_are_ordered_by_number_or_by_bytes() {
    let numbers = network(&[("10", 0.0, 0.0), ("9", 1.0, 0.0), ("-2", 2.0, 0.0)], &[]);
    assert_eq!(numbers.rank, [2, 1, 0]);
    let names = network(&[("10", 0.0, 0.0), ("9", 1.0, 0.0), ("a", 2.0, 0.0)], &[]);
    assert_eq!(names.rank, [0, 1, 2]);
}
