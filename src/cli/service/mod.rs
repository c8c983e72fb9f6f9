//! `skyway service`: what providers offer at a registry.

mod publish;

use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Subcommand;

/// What is done with services, for the help.
pub(super) const EXAMPLES: &str = "\
Examples:
  skyway service publish parcels.toml                                   at the registry on this machine
  skyway service publish parcels.json --registry https://registry.example --token-file acme.token";

/// The commands of `skyway service`.
#[derive(Debug, Subcommand)]
pub(super) enum Service {
    /// Publish a service, new or in place of the version before
    Publish(publish::Publish),
}

impl Service {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self {
            Self::Publish(command) => command.run(output),
        }
    }
}
