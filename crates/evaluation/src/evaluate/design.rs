//! The networks of a run: sweeps through the variables of the paper's Table 1, and Sydney CBD.
//!
//! Not their full product, which would tell little more for its hours: from one middle network each variable is changed
//! on its own. That network has a reach of 0.3 of the map, the upper end of the table, because there the number of
//! neighbours alone decides which nodes are joined at every size; with a short reach a network of 100 nodes falls
//! apart. The reach has a sweep of its own, on networks that it does not tear apart.

use crate::network::{Generated, Joining, bundled};

/// Failures drawn per cell.
const FAILURES: usize = 1_000;
const QUICK_FAILURES: usize = 30;
/// The variables of the middle network.
const NODES: usize = 1_000;
const QUICK_NODES: usize = 500;
const MAP_SIZE_M: f64 = 10_000.0;
const MAX_NEIGHBOURS: usize = 10;
const REACH: f64 = 0.3;
/// The name of the cell of Sydney CBD.
const SYDNEY: &str = "sydney-cbd";

/// Where the network of a cell comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Network {
    /// Generated with the variables of Table 1.
    Generated(Generated),
    /// The text of a file in the native format, segments with their lengths.
    Text(String),
}

/// A cell of the evaluation: a network, and how many failures are drawn on it.
#[derive(Clone, Debug, PartialEq)]
pub struct CellPlan {
    /// The stem of its files.
    pub name: String,
    /// Its network.
    pub network: Network,
    /// How many failures are drawn.
    pub failures: usize,
    /// Which variables of Table 1 have their middle value: nodes, neighbours, reach, map.
    usual: [bool; 4],
}

/// All cells of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The cells, in the order they are computed.
    pub cells: Vec<CellPlan>,
}

/// A way through the design: the cells in which all variables but one have their middle value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sweep {
    /// Over the number of nodes.
    Nodes,
    /// Over the largest number of neighbours.
    Neighbours,
    /// Over the reach.
    Reach,
    /// Over the side of the map.
    Map,
    /// The network that comes from a file: Sydney CBD, or somebody's own.
    Real,
    /// Every cell.
    Everything,
}

impl Design {
    /// The cells of the paper's experiments, with this many failures each; the short run has fewer of both.
    pub fn of_paper(seed: u64, quick: bool, failures: Option<usize>) -> Self {
        let usual_failures = if quick { QUICK_FAILURES } else { FAILURES };
        let failures = failures.unwrap_or(usual_failures);
        let middle = Generated {
            nodes: if quick { QUICK_NODES } else { NODES },
            max_neighbours: MAX_NEIGHBOURS,
            map_size_m: MAP_SIZE_M,
            reach_fraction: REACH,
            joining: Joining::Nearest,
            seed,
        };
        let (nodes, neighbours, reaches, maps): (&[usize], &[usize], &[f64], &[f64]) = match quick {
            true => (&[100, 500], &[5], &[0.1], &[1_000.0]),
            false => (
                &[100, 250, 500, 1_000, 2_500, 5_000],
                &[5, 15, 20],
                &[0.05, 0.1, 0.2],
                &[1_000.0, 5_000.0],
            ),
        };
        let mut networks: Vec<Generated> = Vec::new();
        networks.extend(nodes.iter().map(|&nodes| Generated { nodes, ..middle }));
        networks.extend(neighbours.iter().map(|&max_neighbours| Generated {
            max_neighbours,
            ..middle
        }));
        networks.extend(reaches.iter().map(|&reach_fraction| Generated {
            reach_fraction,
            ..middle
        }));
        networks.extend(maps.iter().map(|&map_size_m| Generated {
            map_size_m,
            ..middle
        }));
        let mut cells: Vec<CellPlan> = networks
            .into_iter()
            .map(|network| CellPlan {
                name: name_of(&network),
                usual: [
                    network.nodes == middle.nodes,
                    network.max_neighbours == middle.max_neighbours,
                    network.reach_fraction == middle.reach_fraction,
                    network.map_size_m == middle.map_size_m,
                ],
                network: Network::Generated(network),
                failures,
            })
            .collect();
        cells.push(CellPlan {
            name: SYDNEY.to_owned(),
            network: Network::Text(bundled::SYDNEY_CBD.to_owned()),
            failures,
            usual: [false; 4],
        });
        Self { cells }
    }

    /// The one cell of somebody's own network.
    pub fn of_network(name: String, text: String, quick: bool, failures: Option<usize>) -> Self {
        let usual_failures = if quick { QUICK_FAILURES } else { FAILURES };
        Self {
            cells: vec![CellPlan {
                name,
                network: Network::Text(text),
                failures: failures.unwrap_or(usual_failures),
                usual: [false; 4],
            }],
        }
    }
}

impl CellPlan {
    /// True for a cell on the way of a sweep.
    pub(super) fn is_on(&self, sweep: Sweep) -> bool {
        let free = match sweep {
            Sweep::Everything => return true,
            Sweep::Real => return matches!(self.network, Network::Text(_)),
            Sweep::Nodes => 0,
            Sweep::Neighbours => 1,
            Sweep::Reach => 2,
            Sweep::Map => 3,
        };
        self.usual
            .iter()
            .enumerate()
            .all(|(variable, &is_usual)| is_usual || variable == free)
    }

    /// True for Sydney CBD, of which the paper says numbers of its own.
    pub(super) fn is_sydney(&self) -> bool {
        self.name == SYDNEY
    }

    /// The variable of a sweep, where the cell has it.
    pub(super) fn variable(&self, sweep: Sweep) -> Option<f64> {
        let Network::Generated(network) = &self.network else {
            return None;
        };
        match sweep {
            Sweep::Nodes => Some(network.nodes as f64),
            Sweep::Neighbours => Some(network.max_neighbours as f64),
            Sweep::Reach => Some(network.reach_fraction),
            Sweep::Map => Some(network.map_size_m),
            Sweep::Real | Sweep::Everything => None,
        }
    }
}

fn name_of(network: &Generated) -> String {
    let Generated {
        nodes,
        max_neighbours,
        map_size_m,
        reach_fraction,
        ..
    } = network;
    format!("n{nodes}-k{max_neighbours}-map{map_size_m}-reach{reach_fraction:.2}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_names_of_their_own_and_every_sweep_has_several() {
        for quick in [false, true] {
            let design = Design::of_paper(1, quick, None);
            let mut names: Vec<&str> = design.cells.iter().map(|cell| &*cell.name).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), design.cells.len());
            for sweep in [Sweep::Nodes, Sweep::Neighbours, Sweep::Reach, Sweep::Map] {
                let on = design.cells.iter().filter(|cell| cell.is_on(sweep));
                assert!(on.count() >= 2, "{sweep:?}");
            }
        }
    }
}
