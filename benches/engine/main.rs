//! The engine against its objectives, beside the searches it is compared with, in one run.
//!
//! Every measured answer is first checked against petgraph's Dijkstra on a graph of its own. Then two
//! kinds of figures: percentiles over queries, which the objectives are stated in, printed as a table;
//! and Criterion's estimates of the same calls. `SKYWAY_BENCH_NODES=5000` measures one size alone;
//! `SKYWAY_BENCH_TABLE_ONLY=1` leaves Criterion out.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a bench asks the clock and its environment"
)]
#![expect(clippy::print_stdout, reason = "the table is what a bench is for")]

mod airspace;
mod checked;
mod oracle;
mod percentiles;
mod queries;
mod workload;

use criterion::{Criterion, criterion_group, criterion_main};
use workload::Workload;

/// Small enough for the paper, and forty times as large.
const SIZES: [(usize, usize); 2] = [(5_000, 1_000), (200_000, 100)];

fn engine(criterion: &mut Criterion) {
    let only: Option<usize> = std::env::var("SKYWAY_BENCH_NODES")
        .ok()
        .and_then(|nodes| nodes.parse().ok());
    let table_only = std::env::var("SKYWAY_BENCH_TABLE_ONLY").is_ok();
    // `cargo test --benches` runs this too: a small network shows that everything works.
    let is_test = std::env::args().any(|argument| argument == "--test")
        || !std::env::args().any(|argument| argument == "--bench");
    let sizes: Vec<(usize, usize)> = match is_test {
        true => vec![(500, 20)],
        false => SIZES
            .into_iter()
            .filter(|&(nodes, _)| only.is_none_or(|only| only == nodes))
            .collect(),
    };
    for (nodes, destinations) in sizes {
        let workload = Workload::new(nodes, destinations);
        workload.describe();
        queries::measure(&workload);
        checked::measure(&workload);
        airspace::measure(&workload);
        if !table_only {
            queries::criterion(&workload, criterion);
            airspace::criterion(&workload, criterion);
        }
    }
}

criterion_group!(benches, engine);
criterion_main!(benches);
