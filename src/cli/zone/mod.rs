//! `skyway zone`: zones in the formats of the field, into an edge and out of it.

mod check;
mod edge_arguments;
mod export;
mod import;

use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Subcommand;

/// What is done with zones, for the help.
pub(super) const EXAMPLES: &str = "\
Examples:
  skyway zone import national.json --check             what is in a feed, without an edge
  skyway zone import national.json --feed national     into the edge on this machine
  skyway zone export --format ed318 -o zones.json      what this edge enforces and shows";

/// The commands of `skyway zone`.
#[derive(Debug, Subcommand)]
pub(super) enum Zone {
    /// Import a feed of zones: ED-269, ED-318, KML, a plan of QGroundControl, or GeoJSON
    Import(import::Import),
    /// Export the zones of an edge
    Export(export::Export),
}

impl Zone {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self {
            Self::Import(command) => command.run(output),
            Self::Export(command) => command.run(output),
        }
    }
}
