//! The networks of a run: every cell of the paper's Table 1 under every generator, ten networks
//! to a cell, and Sydney CBD.
//!
//! The size of the map is no variable here: all lengths, areas and cells scale with it, so that the same
//! network on a larger map has the same answers. A test shows it.

use crate::network::{Generated, Joining, bundled};

/// Side of every generated map.
const MAP_SIZE_M: f64 = 10_000.0;
/// The name of the cell of Sydney CBD.
const SYDNEY: &str = "sydney-cbd";
/// Failures on Sydney CBD for each on a generated network: it is one network, and they are many.
const ON_SYDNEY: usize = 60;
/// A longer reach than this is not short.
const SHORT_REACH: f64 = 0.1;

/// What a run takes of Table 1, and how much of it.
struct Extent {
    nodes: &'static [usize],
    neighbours: &'static [usize],
    reaches: &'static [f64],
    networks: u64,
    failures: usize,
}

const FULL: Extent = Extent {
    nodes: &[100, 500, 1_000, 2_500, 5_000],
    neighbours: &[5, 10, 20],
    reaches: &[0.05, 0.1, 0.2, 0.3],
    networks: 10,
    failures: 4,
};

const QUICK: Extent = Extent {
    nodes: &[100, 300],
    neighbours: &[5, 10],
    reaches: &[0.1],
    networks: 2,
    failures: 2,
};

const JOININGS: [Joining; 3] = [Joining::Nearest, Joining::Random, Joining::Delaunay];

/// Where a network comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Network {
    /// Generated with the variables of Table 1.
    Generated(Generated),
    /// The text of a file in the native format, segments with their lengths.
    Text(String),
}

/// A cell of the evaluation: networks with the same variables, and how many failures are drawn on each.
#[derive(Clone, Debug, PartialEq)]
pub struct CellPlan {
    /// The stem of its files.
    pub name: String,
    /// Its networks, which differ in their seeds alone.
    pub networks: Vec<Network>,
    /// How many failures are drawn on each network, in each way of drawing.
    pub failures: usize,
}

/// All cells of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The cells, in the order they are computed.
    pub cells: Vec<CellPlan>,
}

/// Networks that belong together: what a sentence of the paper can be about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pool {
    /// All cells of a generator.
    Joined(Joining),
    /// Joined at random, with a reach of a tenth of the map at most.
    ShortReach,
    /// Joined at random, the number of neighbours growing with the number of nodes.
    Together,
    /// The network that comes from a file: Sydney CBD, or somebody's own.
    Real,
    /// Every cell.
    Everything,
}

/// A variable of Table 1 that a plot goes along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sweep {
    /// The number of nodes.
    Nodes,
    /// The largest number of neighbours.
    Neighbours,
    /// The reach.
    Reach,
}

impl Design {
    /// The cells of the paper's experiments, with this many failures in each way of drawing on each network;
    /// the short run has fewer of all.
    pub fn of_paper(seed: u64, quick: bool, failures: Option<usize>) -> Self {
        let extent = if quick { QUICK } else { FULL };
        let failures = failures.unwrap_or(extent.failures);
        let mut cells = Vec::new();
        for joining in JOININGS {
            for &nodes in extent.nodes {
                for &max_neighbours in extent.neighbours {
                    for &reach_fraction in extent.reaches {
                        let network = |number: u64| Generated {
                            nodes,
                            max_neighbours,
                            map_size_m: MAP_SIZE_M,
                            reach_fraction,
                            joining,
                            // Runs of neighbouring seeds share no network.
                            seed: seed.wrapping_mul(extent.networks).wrapping_add(number),
                        };
                        cells.push(CellPlan {
                            name: format!(
                                "{}-n{nodes}-k{max_neighbours}-reach{reach_fraction:.2}",
                                name_of(joining)
                            ),
                            networks: (0..extent.networks)
                                .map(|number| Network::Generated(network(number)))
                                .collect(),
                            failures,
                        });
                    }
                }
            }
        }
        cells.push(CellPlan {
            name: SYDNEY.to_owned(),
            networks: vec![Network::Text(bundled::SYDNEY_CBD.to_owned())],
            failures: ON_SYDNEY * failures,
        });
        Self { cells }
    }

    /// The one cell of somebody's own network.
    pub fn of_network(name: String, text: String, quick: bool, failures: Option<usize>) -> Self {
        let usual = ON_SYDNEY * if quick { QUICK } else { FULL }.failures;
        Self {
            cells: vec![CellPlan {
                name,
                networks: vec![Network::Text(text)],
                failures: failures.unwrap_or(usual),
            }],
        }
    }
}

impl CellPlan {
    /// The variables of a generated cell.
    pub(super) fn variables(&self) -> Option<&Generated> {
        match self.networks.first() {
            Some(Network::Generated(network)) => Some(network),
            _ => None,
        }
    }

    /// How many nodes its networks are generated with.
    pub fn generated_nodes(&self) -> Option<usize> {
        self.variables().map(|network| network.nodes)
    }

    /// True for a cell of a pool.
    pub(super) fn is_in(&self, pool: Pool) -> bool {
        let generated = self.variables();
        let is_joined = |joining| generated.is_some_and(|network| network.joining == joining);
        match pool {
            Pool::Everything => true,
            Pool::Real => generated.is_none(),
            Pool::Joined(joining) => is_joined(joining),
            Pool::ShortReach => {
                is_joined(Joining::Random)
                    && generated.is_some_and(|network| network.reach_fraction <= SHORT_REACH)
            }
            Pool::Together => {
                let with_size = |network: &Generated| match network.nodes {
                    ..=100 => network.max_neighbours == 5,
                    101..=1_000 => network.max_neighbours == 10,
                    _ => network.max_neighbours == 20,
                };
                is_joined(Joining::Random) && generated.is_some_and(with_size)
            }
        }
    }

    /// True for Sydney CBD, of which the paper says numbers of its own.
    pub(super) fn is_sydney(&self) -> bool {
        self.name == SYDNEY
    }

    /// The variable of a sweep, where the cell has it.
    pub(super) fn variable(&self, sweep: Sweep) -> Option<f64> {
        let network = self.variables()?;
        Some(match sweep {
            Sweep::Nodes => network.nodes as f64,
            Sweep::Neighbours => network.max_neighbours as f64,
            Sweep::Reach => network.reach_fraction,
        })
    }

    /// What the summary calls the cell together with all of its generator and size.
    pub(super) fn summary_name(&self) -> String {
        match self.variables() {
            Some(network) => format!("{}-n{}", name_of(network.joining), network.nodes),
            None => self.name.clone(),
        }
    }
}

/// The name of a generator.
pub(super) fn name_of(joining: Joining) -> &'static str {
    match joining {
        Joining::Nearest => "nearest",
        Joining::Random => "random",
        Joining::Delaunay => "delaunay",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_names_of_their_own_and_every_pool_has_one() {
        for quick in [false, true] {
            let design = Design::of_paper(1, quick, None);
            let mut names: Vec<&str> = design.cells.iter().map(|cell| &*cell.name).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), design.cells.len());
            let joined = JOININGS.map(Pool::Joined);
            let others = [Pool::ShortReach, Pool::Together, Pool::Real];
            for pool in joined.into_iter().chain(others) {
                assert!(design.cells.iter().any(|cell| cell.is_in(pool)), "{pool:?}");
            }
        }
        let full = Design::of_paper(1, false, None);
        assert!(
            full.cells[..180]
                .iter()
                .all(|cell| cell.networks.len() == 10)
        );
        assert_eq!(full.cells.len(), 181);
    }
}
