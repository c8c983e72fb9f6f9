//! An edge in this process, without a store, with 0, 1,000 and 10,000 active plans: what a composition, a recomposition, the
//! waves after a zone and a national feed of zones take.
//!
//! The network has 5,000 nodes on 40 km; drones are flown by the model. Plans are put by composing, one after the other, with
//! departures over 200 minutes, and the clock stands still, so that none departs. `SKYWAY_BENCH_PLANS=1000` measures one size
//! alone; `cargo test --benches` runs a few plans to show that everything works.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a bench asks the clock and its environment"
)]
#![expect(clippy::print_stdout, reason = "the table is what a bench is for")]

mod fleet;
#[path = "../engine/percentiles.rs"]
#[expect(dead_code, reason = "rows have other columns here than there")]
mod percentiles;
mod world;

use fleet::Fleet;
use std::error::Error;
use std::time::{Duration, Instant};
use world::World;

/// What may go wrong is told once, and ends the run.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    nodes: usize,
    /// Active plans.
    plans: &'static [usize],
    /// Compositions and recompositions of each size.
    samples: usize,
    /// Zones over half of the plans, and over a leg of one.
    large: usize,
    small: usize,
    /// Zones of a feed, and how often it is imported.
    feed: usize,
    imports: usize,
}

const FULL: Extent = Extent {
    nodes: 5_000,
    plans: &[0, 1_000, 10_000],
    samples: 500,
    large: 5,
    small: 50,
    feed: 5_000,
    imports: 5,
};
const QUICK: Extent = Extent {
    nodes: 200,
    plans: &[0, 8],
    samples: 3,
    large: 1,
    small: 1,
    feed: 20,
    imports: 2,
};
/// Putting plans ends after this time; the table says how many there are.
const FILL_WITHIN: Duration = Duration::from_secs(900);

fn main() -> Result<()> {
    let only = std::env::var("SKYWAY_BENCH_PLANS").ok();
    let only: Option<usize> = only.and_then(|plans| plans.parse().ok());
    let is_bench = std::env::args().any(|argument| argument == "--bench");
    let extent = if is_bench { FULL } else { QUICK };
    let runtime = tokio::runtime::Runtime::new()?;
    for &plans in extent.plans {
        if only.is_none_or(|only| only == plans) {
            runtime.block_on(measure(extent, plans))?;
        }
    }
    Ok(())
}

async fn measure(extent: Extent, plans: usize) -> Result<()> {
    let mut fleet = Fleet::over(World::new(extent.nodes)?)?;
    let begun = Instant::now();
    while fleet.plans().len() < plans && begun.elapsed() < FILL_WITHIN {
        fleet.put().await?;
    }
    let took_s = begun.elapsed().as_secs_f64();
    fleet.settle().await?;
    println!(
        "\n### {} active plans of {plans}, {} nodes\n\nPut in {took_s:.0} s, {} requests refused.\n",
        fleet.plans().len(),
        extent.nodes,
        fleet.refused(),
    );
    println!("| | count | p50 ms | p99 ms | slowest ms |\n|---|---:|---:|---:|---:|");
    fleet
        .compositions(extent.samples)
        .await?
        .print("composition");
    fleet
        .recompositions(extent.samples)
        .await?
        .print("recomposition");
    fleet.waves("small", extent.small).await?.print();
    if plans > 0 {
        fleet.waves("large", extent.large).await?.print();
    }
    let name = format!("feed of {} zones in force", extent.feed);
    let imports = fleet.imports(extent.feed, extent.imports);
    imports.await?.print(&name);
    Ok(())
}
