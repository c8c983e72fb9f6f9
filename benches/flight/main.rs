//! The search over position, time and battery on a fixed workload, beside plain label-setting.
//!
//! Beside it requests among the plans of others, on Sydney. Every answer of the fixed workload is
//! flown again by the checker before it counts. A run over both sizes also draws the flight model
//! to `docs/pictures/flight-model.svg`. `SKYWAY_BENCH_NODES=5000` measures one size alone; `cargo
//! test --benches` runs a small network to show that everything works.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a bench asks the clock and its environment"
)]
#![expect(clippy::print_stdout, reason = "the table is what a bench is for")]

mod checked;
#[path = "../engine/percentiles.rs"]
#[expect(dead_code, reason = "rows have more columns here than there")]
mod percentiles;
mod picture;
mod queries;
mod traffic;
mod workload;

use skyway::formats::load_network;
use skyway::itinerary::Objective;
use skyway::network::bundled::SYDNEY_CBD;
use std::sync::Arc;
use workload::Workload;

/// The size of the published figures, and ten times as many nodes.
const SIZES: [usize; 2] = [5_000, 50_000];
/// On networks above this distance alone is measured.
const ALL_OBJECTIVES_UP_TO: usize = 5_000;
/// How many plans are made, and within how many seconds they depart.
const FLEETS: [(usize, f64); 2] = [(1_000, 600.0), (1_000, 0.0)];
const PICTURE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/docs/pictures/flight-model.svg"
);

fn main() {
    let only: Option<usize> = std::env::var("SKYWAY_BENCH_NODES")
        .ok()
        .and_then(|nodes| nodes.parse().ok());
    let is_bench = std::env::args().any(|argument| argument == "--bench");
    let (sizes, requests): (Vec<usize>, usize) = match is_bench {
        true => (SIZES.to_vec(), 1_000),
        false => (vec![600], 20),
    };
    for nodes in sizes {
        if only.is_none_or(|only| only == nodes) {
            let objectives = match nodes <= ALL_OBJECTIVES_UP_TO {
                true => &Objective::ALL[..],
                false => &[Objective::Distance],
            };
            let workload = Workload::new(nodes, requests, objectives);
            workload.describe();
            queries::measure(&workload, objectives);
            checked::measure(&workload, Objective::Distance);
        }
    }
    let sydney = load_network(SYDNEY_CBD).expect("the bundled network");
    let sydney = Arc::new(sydney.topology);
    for (plans, within_s) in FLEETS {
        let plans = if is_bench { plans } else { 20 };
        for is_bounded in [false, true] {
            traffic::measure("Sydney", &sydney, (plans, within_s), is_bounded);
        }
    }
    let picture = picture::energy();
    if is_bench && only.is_none() {
        std::fs::write(PICTURE, picture).expect("the folder of pictures is there");
    }
}
