//! `skyway network generate`: a random network with the variables of the paper's Table 1.

use crate::cli::files;
use crate::cli::output::Output;
use crate::cli::stop::{Stop, Verdict};
use crate::formats::write_network;
use crate::network::{Generated, Joining};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway network generate -o random.geojson
  skyway network generate --nodes 200 --max-neighbours 5 --map-size 1000 --reach 0.3 --seed 7 -o small.geojson
  skyway network generate --nodes 200 | skyway network info --network -";

/// Arguments of `skyway network generate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Generate {
    /// How many nodes; 100 to 5000 in the paper
    #[arg(long, value_name = "COUNT", default_value_t = 5000)]
    nodes: usize,
    /// Most segments at a node; 5 to 20 in the paper
    #[arg(long, value_name = "COUNT", default_value_t = 10)]
    max_neighbours: usize,
    /// Side of the square map, in metres; 1000 to 10000 in the paper
    #[arg(long, value_name = "METRES", default_value_t = 10_000.0)]
    map_size: f64,
    /// Longest segment, as a fraction of the map size; 0.05 to 0.3 in the paper
    #[arg(long, value_name = "FRACTION", default_value_t = 0.1)]
    reach: f64,
    /// Which nodes within reach are joined
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    joining: HowJoined,
    /// The same seed gives the same network
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// Where to write it (GeoJSON; .gz compresses), or - for standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

/// Which nodes within reach are joined.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum HowJoined {
    /// Each with its nearest
    #[default]
    Nearest,
    /// Any, drawn at random
    Random,
    /// Edges of a Delaunay triangulation, shortest first
    Delaunay,
}

impl Generate {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let variables = Generated {
            nodes: self.nodes,
            max_neighbours: self.max_neighbours,
            map_size_m: self.map_size,
            reach_fraction: self.reach,
            joining: match self.joining {
                HowJoined::Nearest => Joining::Nearest,
                HowJoined::Random => Joining::Random,
                HowJoined::Delaunay => Joining::Delaunay,
            },
            seed: self.seed,
        };
        let network = variables
            .network()
            .map_err(|error| Stop::Usage(error.to_string()))?;
        files::write_text(&self.output, &write_network(&network), output)?;
        output.note(&format!(
            "generated {} nodes and {} segments",
            network.nodes.len(),
            network.segments.len()
        ));
        Ok(Verdict::Done)
    }
}
