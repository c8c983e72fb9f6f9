//! An edge in this process, without a store, with 0, 1,000 and 10,000 active plans: what a composition, a recomposition, the
//! waves after a zone and a national feed of zones take.
//!
//! One network has 5,000 nodes on 40 km, and plans depart within 200 minutes; the other is Sydney, and a thousand depart within
//! ten. Drones are flown by the model. Plans are put by composing, one after the other; then five minutes pass, and after that
//! the clock stands still. `SKYWAY_BENCH_PLANS=1000` measures one size alone, and `SKYWAY_BENCH_NETWORK=sydney` one network; `cargo test
//! --benches` runs a few plans to show that everything works.

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
use jiff::SignedDuration;
use std::error::Error;
use std::time::{Duration, Instant};
use world::World;

/// What may go wrong is told once, and ends the run.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Nodes of the generated network.
    nodes: usize,
    /// Active plans over it, and over Sydney.
    plans: &'static [usize],
    over_sydney: usize,
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
    over_sydney: 1_000,
    samples: 500,
    large: 5,
    small: 50,
    feed: 5_000,
    imports: 5,
};
const QUICK: Extent = Extent {
    nodes: 200,
    plans: &[0, 8],
    over_sydney: 8,
    samples: 3,
    large: 1,
    small: 1,
    feed: 20,
    imports: 2,
};
/// Putting plans ends after this time; the table says how many there are.
const FILL_WITHIN: Duration = Duration::from_secs(900);

/// What is asked of it after compositions is asked so much later, when drones are in the air.
const LATER: SignedDuration = SignedDuration::from_mins(5);
/// Plans on the generated network and over Sydney depart within these times.
const DEPARTURES_S: f64 = 12_000.0;
const SYDNEY_DEPARTURES_S: f64 = 600.0;

fn main() -> Result<()> {
    let plans = std::env::var("SKYWAY_BENCH_PLANS").ok();
    let plans: Option<usize> = plans.and_then(|plans| plans.parse().ok());
    let network = std::env::var("SKYWAY_BENCH_NETWORK").ok();
    let is_wanted = |name: &str, count: usize| {
        let is_network = network.as_ref().is_none_or(|network| network == name);
        is_network && plans.is_none_or(|plans| plans == count)
    };
    let is_bench = std::env::args().any(|argument| argument == "--bench");
    let extent = if is_bench { FULL } else { QUICK };
    let runtime = tokio::runtime::Runtime::new()?;
    for &count in extent.plans {
        if is_wanted("generated", count) {
            let fleet = Fleet::over(World::generated(extent.nodes)?, DEPARTURES_S)?;
            runtime.block_on(measure(fleet, "the generated network", extent, count))?;
        }
    }
    if is_wanted("sydney", extent.over_sydney) {
        let fleet = Fleet::over(World::sydney()?, SYDNEY_DEPARTURES_S)?;
        runtime.block_on(measure(fleet, "Sydney", extent, extent.over_sydney))?;
    }
    Ok(())
}

async fn measure(mut fleet: Fleet, network: &str, extent: Extent, plans: usize) -> Result<()> {
    let begun = Instant::now();
    while fleet.plan_count() < plans && begun.elapsed() < FILL_WITHIN {
        fleet.put().await?;
    }
    let took_s = begun.elapsed().as_secs_f64();
    fleet.settle().await?;
    println!(
        "\n### {} active plans of {plans}, {network}\n\nPut in {took_s:.0} s, {} requests refused.\n",
        fleet.plan_count(),
        fleet.refused(),
    );
    println!("| | count | p50 ms | p99 ms | slowest ms |\n|---|---:|---:|---:|---:|");
    let compositions = fleet.compositions(extent.samples);
    compositions.await?.print("composition");
    fleet.fly_for(LATER).await?;
    let without_a_plan = fleet.recompositions(extent.samples);
    without_a_plan.await?.print("recomposition without a plan");
    if plans > 0 {
        let of_plans = fleet.recompositions_of_plans(extent.samples);
        of_plans.await?.print("recomposition of a plan");
    }
    fleet.waves("small", extent.small).await?.print();
    if plans > 0 {
        fleet.waves("large", extent.large).await?.print();
    }
    let name = format!("feed of {} zones in force", extent.feed);
    let imports = fleet.imports(extent.feed, extent.imports);
    imports.await?.print(&name);
    Ok(())
}
