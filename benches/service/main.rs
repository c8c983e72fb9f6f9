//! Recompositions over the wire beside an echo, and a client of its own beside sockets that say nothing.
//!
//! Servers run as processes on the machine's first core, the load on its second, so that neither takes time from
//! the other. The edge is the binary as it is installed, with the configuration that holds where nothing says
//! otherwise. The echo is this very binary, called again: see `echo`. `SKYWAY_BENCH_PAIRS=20` changes how many
//! pairs are measured.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a bench asks the clock, and starts servers"
)]
#![expect(clippy::print_stdout, reason = "the tables are what a bench is for")]

mod cores;
mod echo;
mod grpc_load;
mod load;
mod pairs;
mod ranks;
mod rest_load;
mod servers;
mod slow_sockets;
mod workload;

use std::error::Error;
use std::path::Path;
use std::time::Duration;
use workload::Workload;

/// What may go wrong is told once, and ends the run.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Different failure reports.
    pub(crate) reports: usize,
    /// Edge and echo in turns, this many times.
    pub(crate) pairs: usize,
    /// Load before each measurement.
    pub(crate) warm_up: Duration,
    /// Each measurement.
    pub(crate) measured: Duration,
    /// Sockets that say nothing, and as many that say too little.
    pub(crate) slow_sockets: usize,
    /// How long they are there before anything is measured: longer than the deadline of a head.
    pub(crate) slow_before: Duration,
    /// How long the paced client is measured, without and with them.
    pub(crate) paced: Duration,
}

const FULL: Extent = Extent {
    reports: 1_000,
    // Many short pairs: what else a machine does lasts longer than one of them, and so is in both halves of it.
    pairs: 75,
    warm_up: Duration::from_millis(150),
    measured: Duration::from_millis(350),
    slow_sockets: 1_000,
    slow_before: Duration::from_secs(7),
    paced: Duration::from_secs(15),
};

/// Enough to see that everything works.
const TINY: Extent = Extent {
    reports: 50,
    pairs: 1,
    warm_up: Duration::from_millis(50),
    measured: Duration::from_millis(200),
    slow_sockets: 20,
    slow_before: Duration::from_millis(100),
    paced: Duration::from_millis(300),
};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, dialect, answers, ports_file] = arguments.as_slice()
        && flag == "--echo"
    {
        return echo::serve(dialect, Path::new(answers), Path::new(ports_file));
    }
    // `cargo test --benches` runs this too.
    let is_bench = arguments.iter().any(|argument| argument == "--bench");
    measure(if is_bench { full() } else { TINY })
}

fn full() -> Extent {
    let asked = std::env::var("SKYWAY_BENCH_PAIRS");
    let pairs = asked.ok().and_then(|pairs| pairs.parse().ok());
    Extent {
        pairs: pairs.unwrap_or(FULL.pairs),
        ..FULL
    }
}

fn measure(extent: Extent) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let workload = Workload::sydney(extent.reports)?;
    let is_pinned = cores::take_second();
    let edge = servers::start_edge(folder.path())?;
    let recorded = pairs::record(&edge, &workload, folder.path())?;
    workload.describe(is_pinned, &recorded);
    for dialect in [load::Dialect::Rest, load::Dialect::Grpc] {
        let echo = servers::start_echo(folder.path(), dialect, &recorded.file)?;
        pairs::measure(dialect, &edge, &echo, &workload, extent)?;
    }
    slow_sockets::measure(&edge, &workload, extent)
}
