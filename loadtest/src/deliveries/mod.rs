//! `skyway-loadtest deliveries`: orders, flights, webhooks and positions of a registry with its edges, held to the goals of
//! docs/deliveries.md.

mod burst;
mod drones;
mod judged;
mod kills;
mod positions;
mod receiver;
mod town;
mod webhooks;

use crate::rows::{Header, Row, write_rows};
use crate::run::eprintln_line;
use crate::{Result, Unsuitable, until_interrupted};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// A burst of orders: how soon each has a drone
    Burst,
    /// Deliveries over two edges while registry and edges are killed: each ends in one status
    Kills,
    /// A customer's endpoint that fails half of the time: nothing is lost
    Webhooks,
    /// Positions that are stored on PostgreSQL, and read
    Positions,
}

#[derive(Debug, Args)]
pub(crate) struct DeliveriesArguments {
    /// What is measured; all of it where nothing is named
    #[arg(value_enum, value_name = "PART")]
    parts: Vec<Part>,
    /// The skyway binary to measure; figures want one of the profile `dist`
    #[arg(long, value_name = "FILE")]
    server: PathBuf,
    /// Empty databases of PostgreSQL for the registry, `{part}` standing for the part's name; SQLite where none is given
    #[arg(long, value_name = "URL")]
    postgres: Option<String>,
    /// A few of everything for a moment: whether it works. Goals are told and not enforced
    #[arg(long)]
    quick: bool,
    /// What the table says was measured
    #[arg(long, value_name = "TEXT", default_value = "unknown")]
    commit: String,
}

impl DeliveriesArguments {
    /// The setting of the registry's store in a part; none where it is a file.
    fn stores(&self, part: Part) -> Vec<String> {
        let name = part.to_possible_value();
        let name = name.as_ref().map_or("", |name| name.get_name());
        let url = self.postgres.as_ref();
        url.map(|url| format!("store={}", url.replace("{part}", name)))
            .into_iter()
            .collect()
    }
}

pub(crate) fn run_deliveries(arguments: &DeliveriesArguments) -> Result<ExitCode> {
    if !arguments.server.is_file() {
        let what = format!("{}: no such program", arguments.server.display());
        return Err(Unsuitable(what).into());
    }
    until_interrupted(measure(arguments))
}

async fn measure(arguments: &DeliveriesArguments) -> Result<ExitCode> {
    let all = Part::value_variants();
    let parts = match arguments.parts.is_empty() {
        true => all,
        false => &arguments.parts,
    };
    let mut rows: Vec<Row> = Vec::new();
    for part in parts {
        rows.extend(match part {
            Part::Burst => burst::measure(arguments).await?,
            Part::Kills => kills::measure(arguments).await?,
            Part::Webhooks => webhooks::measure(arguments).await?,
            Part::Positions => match arguments.stores(Part::Positions) {
                stores if stores.is_empty() => {
                    eprintln_line("positions are left out: name a database with --postgres");
                    Vec::new()
                }
                stores => positions::measure(arguments, stores).await?,
            },
        });
    }
    let header = Header {
        commit: &arguments.commit,
        servers: "registry, edges",
        // The registry and its edges are several, and their database is not ours to pin.
        is_pinned: false,
        is_quick: arguments.quick,
    };
    write_rows(&header, &rows)
}
