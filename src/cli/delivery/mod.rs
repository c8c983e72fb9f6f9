//! `skyway delivery`: deliveries ordered, followed and called off at a registry.

mod cancel;
mod order;
mod track;

use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Subcommand;

/// What is done with deliveries, for the help.
pub(super) const EXAMPLES: &str = "\
Examples:
  skyway delivery order --network sydney --from 1 --to 450 --payload-kg 0.8 --quote
  skyway delivery track d-7f3a                             until it is delivered";

/// The commands of `skyway delivery`.
#[derive(Debug, Subcommand)]
pub(super) enum Delivery {
    /// Order a delivery
    Order(order::Order),
    /// Follow a delivery until it ends
    Track(track::Track),
    /// Call a delivery off before its drone departs
    Cancel(cancel::Cancel),
}

impl Delivery {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self {
            Self::Order(command) => command.run(output),
            Self::Track(command) => command.run(output),
            Self::Cancel(command) => command.run(output),
        }
    }
}
