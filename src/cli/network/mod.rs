//! `skyway network`: makes, inspects, converts and draws networks.

mod build;
mod convert;
mod criticality;
mod draw;
mod generate;
mod info;

use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Subcommand;

/// What is done with networks, for the help.
pub(super) const EXAMPLES: &str = "\
Examples:
  skyway network info --network corridor                       what a network is like
  skyway network build buildings.geojson -o town.geojson       from building footprints
  skyway network generate --nodes 200 -o random.geojson        after the paper's Table 1
  skyway network convert --network city.json -o city.geojson   from another format
  skyway network criticality --network corridor                what each failure costs
  skyway network draw --network corridor -o corridor.svg";

/// The commands of `skyway network`.
#[derive(Debug, Subcommand)]
pub(super) enum Network {
    /// Build a network from building footprints: rooftops joined by clear lines of sight
    Build(build::Build),
    /// Generate a random network with the variables of the paper's Table 1
    Generate(generate::Generate),
    /// Tell what a network is like
    Info(info::Info),
    /// Convert a network to another format
    Convert(convert::Convert),
    /// Tell what each segment, node and pad costs the deliveries if it fails
    Criticality(criticality::Criticalities),
    /// Draw a network, and a failure on it if one is named
    Draw(draw::Draw),
}

impl Network {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self {
            Self::Build(command) => command.run(output),
            Self::Generate(command) => command.run(output),
            Self::Info(command) => command.run(output),
            Self::Convert(command) => command.run(output),
            Self::Criticality(command) => command.run(output),
            Self::Draw(command) => command.run(output),
        }
    }
}
