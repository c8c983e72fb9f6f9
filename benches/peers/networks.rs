//! The networks that are measured: generated after the paper's Table 1, and two road graphs.

use flate2::read::MultiGzDecoder;
use skyway::formats::load_csv_network;
use skyway::network::{Generated, Joining, Topology};
use std::fs::File;
use std::io::Read;
use std::sync::Arc;

/// The seed of networks and queries.
pub(crate) const SEED: u64 = 1;

/// Where a network comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    Generated { nodes: usize },
    Road { file: &'static str },
}

/// A network to measure, and how many destinations it has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Subject {
    source: Source,
    pub(crate) destinations: usize,
}

impl Subject {
    /// All of them, those that lead every table first.
    pub(crate) fn all() -> Vec<Self> {
        vec![
            Self::generated(5_000, 1_000),
            Self::generated(200_000, 100),
            Self::road("heidelberg"),
            Self::road("liechtenstein"),
            Self::generated(1_000, 200),
            Self::generated(50_000, 100),
        ]
    }

    /// K = 10 on a map of 10 km.
    pub(crate) fn generated(nodes: usize, destinations: usize) -> Self {
        Self {
            source: Source::Generated { nodes },
            destinations,
        }
    }

    fn road(file: &'static str) -> Self {
        Self {
            source: Source::Road { file },
            destinations: 100,
        }
    }

    /// The name of its folder, and of its column.
    pub(crate) fn name(&self) -> String {
        match self.source {
            Source::Generated { nodes } if nodes % 1_000 == 0 => format!("{}k", nodes / 1_000),
            Source::Generated { nodes } => nodes.to_string(),
            Source::Road { file } => file.to_owned(),
        }
    }

    /// Generates or reads it.
    pub(crate) fn load(&self) -> Arc<Topology> {
        let topology = match self.source {
            Source::Generated { nodes } => {
                let generated = Generated {
                    nodes,
                    max_neighbours: 10,
                    map_size_m: 10_000.0,
                    reach_fraction: 0.3,
                    joining: Joining::Nearest,
                    seed: SEED,
                };
                let draft = generated.network().expect("the parameters are Table 1's");
                Topology::build(draft, [0; 32]).expect("a generated network is valid")
            }
            Source::Road { file } => {
                let [nodes, edges] = ["nodes", "edges"].map(|table| unpacked(file, table));
                let loaded = load_csv_network(&nodes, &edges).expect("the data loads");
                loaded.topology
            }
        };
        Arc::new(topology)
    }
}

fn unpacked(file: &str, table: &str) -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    let path = format!("{root}/data/graphs/{file}_{table}.csv.gz");
    let packed = File::open(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut text = String::new();
    MultiGzDecoder::new(packed)
        .read_to_string(&mut text)
        .unwrap_or_else(|error| panic!("{path}: {error}"));
    text
}
