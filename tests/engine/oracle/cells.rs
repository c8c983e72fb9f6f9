//! Algorithm 2, cell density-based: squares about A, B and their neighbours, wider where nodes are
//! few.

use std::collections::{BTreeMap, BTreeSet};

use super::local::{LocalAnswer, Trial};
use super::network::{E_M, OracleNetwork, World};

/// More cells than this are refused.
const MAX_CELLS: f64 = 1e6;

/// Columns and rows of the grid of cells of a given side in metres; `None` where the side is
/// refused.
pub(crate) fn cell_grid(network: &OracleNetwork, cell_m: f64) -> Option<(usize, usize)> {
    if !cell_m.is_finite() || cell_m <= 0.0 {
        return None;
    }
    let (min_x, min_y, max_x, max_y) = network.bounding_box();
    let columns = ((max_x - min_x) / cell_m).ceil().max(1.0);
    let rows = ((max_y - min_y) / cell_m).ceil().max(1.0);
    if columns * rows > MAX_CELLS {
        return None;
    }
    Some((columns as usize, rows as usize))
}

/// Grows the squares by one cell per round until a path is found or all nodes are inside.
///
/// `cell_m` defaults to a sixteenth of the network size and must be one that [`cell_grid`] accepts.
///
/// In `slices` every node counts as lying at the lower corner of its cell, so that whole cells are taken.
pub(crate) fn cell_density(
    world: &World,
    a: usize,
    b: usize,
    cell_m: Option<f64>,
    slices: bool,
) -> LocalAnswer {
    let network = world.network;
    let cell_m = cell_m.unwrap_or(network.size_m() / 16.0);
    let classes = density_classes(network, cell_m);
    let centres = neighbouring_nodes(world, a, b);
    let everything = world.counted_nodes(a, b);
    let (columns, rows) = cell_grid(network, cell_m).expect("an accepted cell size");
    let (min_x, min_y, _, _) = network.bounding_box();
    let along = |x: f64, least: f64, count: usize| match slices {
        true => ((x - least) / cell_m).floor().min(count as f64 - 1.0) * cell_m,
        false => x,
    };
    let place = |node: usize| {
        let node = &network.nodes[node];
        (along(node.x, min_x, columns), along(node.y, min_y, rows))
    };

    let mut trial = Trial::new(world, a, b);
    let mut reach_m = cell_m;
    loop {
        let squares = trial.area(|node| {
            centres.iter().any(|&centre| {
                let half_side_m = classes[centre] * reach_m;
                let ((x, y), (centre_x, centre_y)) = (place(node), place(centre));
                let (dx, dy) = ((x - centre_x).abs(), (y - centre_y).abs());
                dx <= half_side_m + E_M && dy <= half_side_m + E_M
            })
        });
        let covers_everything = squares == everything;
        if trial.search("cells", squares) || covers_everything {
            break;
        }
        reach_m += cell_m;
    }
    trial.finish()
}

/// Per node the factor of its cell: 1 in a dense cell, 2 in an average one, 3 in a sparse one.
pub(super) fn density_classes(network: &OracleNetwork, cell_m: f64) -> Vec<f64> {
    let (columns, rows) =
        cell_grid(network, cell_m).expect("the caller gives a cell size that is accepted");
    let (min_x, min_y, _, _) = network.bounding_box();
    let index = |offset_m: f64, count: usize| ((offset_m / cell_m).floor() as usize).min(count - 1);
    let cell_of: Vec<(usize, usize)> = network
        .nodes
        .iter()
        .map(|node| (index(node.x - min_x, columns), index(node.y - min_y, rows)))
        .collect();

    let mut counts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for cell in &cell_of {
        *counts.entry(*cell).or_insert(0) += 1;
    }
    let most = counts.values().copied().max().unwrap_or(0);
    let some_cell_is_empty = counts.len() < columns * rows;
    let fewest = if some_cell_is_empty {
        0
    } else {
        counts.values().copied().min().unwrap_or(0)
    };
    let co = most - fewest;

    let factor = |count: usize| {
        if 3 * count <= co {
            3.0
        } else if 3 * count <= 2 * co {
            2.0
        } else {
            1.0
        }
    };
    cell_of.iter().map(|cell| factor(counts[cell])).collect()
}

/// A, B and their neighbours in the topology, across closed segments too, without the closed nodes.
fn neighbouring_nodes(world: &World, a: usize, b: usize) -> BTreeSet<usize> {
    let mut found = BTreeSet::from([a, b]);
    for end in [a, b] {
        let neighbours = world
            .network
            .neighbours(end)
            .into_iter()
            .map(|(node, _)| node);
        found.extend(neighbours.filter(|&node| world.node_is_open(node)));
    }
    found
}
