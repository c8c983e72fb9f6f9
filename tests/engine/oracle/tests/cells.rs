//! The cell density-based strategy by hand.

use super::super::cells::density_classes;
use super::*;

#[test]
fn cells_make_squares_by_density() {
    // C = 100 on 1000 x 1000: 10 x 10 cells. Cell (2, 2) holds A and a1..a5 = 6 nodes, cell (5, 2)
    // B, b1 and b2 = 3, cell (4, 6) M alone; empty cells make CO = 6. 3 x 6 > 12: dense; 6 < 3 x 3
    // <= 12: average; 3 x 1 <= 6: sparse. Squares: A [150, 350] x [150, 350]; B [350, 750] x [50,
    // 450]; M [150, 750] x [350, 950]. p1 and p3, p5 lie on corners, p7 in M's square, q1, q2, q3
    // one metre out.
    let network = network(
        &[
            ("A", 250.0, 250.0),
            ("B", 550.0, 250.0),
            ("M", 450.0, 650.0),
            ("a1", 210.0, 210.0),
            ("a2", 220.0, 210.0),
            ("a3", 230.0, 210.0),
            ("a4", 240.0, 210.0),
            ("a5", 260.0, 210.0),
            ("b1", 510.0, 210.0),
            ("b2", 520.0, 210.0),
            ("p1", 150.0, 150.0),
            ("p3", 750.0, 50.0),
            ("p5", 150.0, 950.0),
            ("p7", 300.0, 360.0),
            ("q1", 149.0, 200.0),
            ("q2", 751.0, 100.0),
            ("q3", 700.0, 951.0),
            ("o", 0.0, 0.0),
            ("z", 1000.0, 1000.0),
        ],
        &[("A", "B"), ("A", "M"), ("M", "B")],
    );
    let answer = cell_density(&world(&network, &[]), 0, 1, Some(100.0), false);
    // sqrt(200^2 + 400^2) + sqrt(100^2 + 400^2) = 447.214 + 412.311.
    assert_length(answer.length_m, 859.524);
    assert_eq!((answer.stage, answer.searches), ("cells", 1));
    let inside = all(
        &network,
        &[
            "A", "B", "M", "a1", "a2", "a3", "a4", "a5", "b1", "b2", "p1", "p3", "p5", "p7",
        ],
    );
    assert_eq!(answer.area, inside);
    // A closed p1 leaves the area but keeps its place in its cell, as a1 does.
    let answer = cell_density(&world(&network, &["p1", "a1"]), 0, 1, Some(100.0), false);
    assert_eq!(answer.area, &inside - &all(&network, &["p1", "a1"]));
    // M closed: no neighbour, no square about it, no path; the last area is all of the 18 nodes
    // left.
    let answer = cell_density(&world(&network, &["M"]), 0, 1, Some(100.0), false);
    assert_eq!(answer.stages[0].nodes.len(), 11);
    assert_eq!((answer.path, answer.area.len()), (None, 18));
}

/// A way around over M, P and Q. C = 100 on 100 x 400: 1 x 4 cells with A, B; M, Q; none; P (at 400
/// / 100 = 4, the last cell is 3): CO = 2, so 3 x 2 > 4 is dense and 3 x 1 <= 4 is average.
fn far_around(segments: &[(&str, &str)]) -> OracleNetwork {
    let nodes = [
        ("A", 0.0, 0.0),
        ("B", 100.0, 0.0),
        ("M", 0.0, 100.0),
        ("Q", 100.0, 100.0),
        ("P", 50.0, 400.0),
    ];
    network(&nodes, segments)
}

#[test]
fn cells_grow_by_their_side() {
    // Squares of A, B, M, Q, all dense, M's and Q's reach up to y = 200, 300, 400: P is inside in
    // round 3. Length 100 + 2 sqrt(50^2 + 300^2) + 100 = 808.276.
    let network = far_around(&[("A", "B"), ("A", "M"), ("M", "P"), ("P", "Q"), ("Q", "B")]);
    let answer = cell_density(&world(&network, &[]), 0, 1, Some(100.0), false);
    assert_length(answer.length_m, 808.276);
    assert_eq!(
        (answer.searches, answer.area.len(), answer.area_segments),
        (3, 5, 4)
    );
    // By default C = 400 / 16 = 25: the reach is 25, 50, ... over 4 x 16 cells. Each node is
    // alone in its cell, CO = 1, 3 x 1 > 2 is dense: a reach of 300 in round 12.
    assert_eq!(cell_grid(&network, 25.0), Some((4, 16)));
    assert_eq!(
        cell_density(&world(&network, &[]), 0, 1, None, false).searches,
        12
    );
}

#[test]
fn cells_end_without_a_path_when_all_nodes_are_inside() {
    let network = far_around(&[("A", "B"), ("A", "M"), ("M", "P"), ("Q", "B")]);
    let answer = cell_density(&world(&network, &[]), 0, 1, Some(100.0), false);
    assert_eq!(
        (
            answer.path,
            answer.stage,
            answer.searches,
            answer.area.len()
        ),
        (None, "cells", 3, 5)
    );
    // A neighbour across a closed segment keeps its square: still P is reached in round 3.
    let mut closed = world(&network, &[]);
    closed.closed_segments.extend([1, 3]);
    assert_eq!(cell_density(&closed, 0, 1, Some(100.0), false).searches, 3);
    // M and Q closed: the squares of A and B alone reach P in round 4, and N = 3.
    let answer = cell_density(&world(&network, &["M", "Q"]), 0, 1, Some(100.0), false);
    assert_eq!((answer.searches, answer.area.len()), (4, 3));
}

#[test]
fn cell_sizes_are_bounded() {
    // 100 x 400 m: 0.2 m makes 500 x 2000 = 10^6 cells, 0.1 m more.
    let network = far_around(&[]);
    assert_eq!(cell_grid(&network, 0.2), Some((500, 2000)));
    assert_eq!(cell_grid(&network, 0.1), None);
    assert_eq!(cell_grid(&network, 1e9), Some((1, 1)));
    assert_eq!(
        [0.0, -1.0, f64::NAN, f64::INFINITY].map(|side| cell_grid(&network, side)),
        [None; 4]
    );
}

/// Per cell along a line of cells 10 m wide a node's factor, with as many nodes as stated in each
/// cell.
fn factors(counts: &[usize]) -> Vec<f64> {
    let places = counts.iter().enumerate().flat_map(|(cell, &count)| {
        (0..count).map(move |index| (cell as f64) * 10.0 + index as f64)
    });
    let nodes = places
        .enumerate()
        .map(|(node, x)| OracleNode {
            id: node.to_string(),
            x,
            y: 0.0,
            pads: 0,
        })
        .collect();
    let network = OracleNetwork::new(nodes, Vec::new());
    let factors = density_classes(&network, 10.0);
    let mut first = 0;
    let mut per_cell = Vec::new();
    for &count in counts.iter().filter(|&&count| count > 0) {
        per_cell.push(factors[first]);
        first += count;
    }
    per_cell
}

#[test]
fn density_classes_have_their_bounds_inside_the_sparser_one() {
    // An empty cell: CO = 6 - 0. 3n <= 6 for 1 and 2, 3n <= 12 for 3 and 4.
    assert_eq!(
        factors(&[6, 0, 1, 2, 3, 4, 5]),
        [1.0, 3.0, 3.0, 2.0, 2.0, 1.0]
    );
    // No empty cell: CO = 8 - 2. 3 x 2 = 6 is sparse, 3 x 5 = 15 > 12 is dense.
    assert_eq!(factors(&[8, 2, 5]), [1.0, 3.0, 1.0]);
    // All the same: CO = 0, all dense.
    assert_eq!(factors(&[2, 2]), [1.0, 1.0]);
}

#[test]
fn the_upper_edge_belongs_to_the_last_cell() {
    // 0 to 20 m in cells of 10 m: 2 cells, and 20 / 10 = 2 becomes 1: counts 1 and 3, CO = 2. One
    // is average (3 > 2, 3 <= 4), three are dense. In a cell of its own, 20 would be average as
    // well.
    let nodes = [
        ("A", 0.0, 0.0),
        ("B", 12.0, 0.0),
        ("C", 14.0, 0.0),
        ("D", 20.0, 0.0),
    ];
    assert_eq!(
        density_classes(&network(&nodes, &[]), 10.0),
        [2.0, 1.0, 1.0, 1.0]
    );
}
