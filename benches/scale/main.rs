//! One engine on networks from 1,000 to 1,000,000 nodes: what grows with the network and what does not.
//!
//! Networks and queries are those of the bench `engine`. How long loading takes and what stays in memory is
//! measured in a process of its own, which this one starts: `--load FILE...`. `SKYWAY_SCALE_NODES=100000` leaves
//! larger networks out. The growth is drawn to `docs/pictures/scale.svg` by a run over all sizes, else below `target`.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a bench asks the clock, files, processes and its environment"
)]
#![expect(clippy::print_stdout, reason = "the table is what a bench is for")]
#![expect(clippy::print_stderr, reason = "a long run says where it is")]

mod loading;
mod measures;
#[path = "../engine/oracle.rs"]
#[expect(dead_code, reason = "one of the oracle's two searches is enough here")]
mod oracle;
#[path = "../engine/percentiles.rs"]
#[expect(dead_code, reason = "the bench `engine` prints rows of its own")]
mod percentiles;
mod picture;
#[path = "../engine/workload.rs"]
#[expect(dead_code, reason = "the bench `engine` prints heads of its own")]
mod workload;

use measures::Figures;
use std::io;
use std::path::{Path, PathBuf};

/// Nodes, and destinations with a table in memory.
const SIZES: [(usize, usize); 4] = [(1_000, 100), (10_000, 100), (100_000, 100), (1_000_000, 25)];

/// Where networks are written to be loaded again.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/scale");
const PICTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/pictures/scale.svg");

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(place) = arguments.iter().position(|argument| argument == "--load") {
        return loading::load_and_tell(&arguments[place + 1..]);
    }
    // `cargo test --benches` runs this too: a small network shows that everything works.
    let is_test = !arguments.iter().any(|argument| argument == "--bench");
    let most_nodes: usize = std::env::var("SKYWAY_SCALE_NODES")
        .ok()
        .and_then(|nodes| nodes.parse().ok())
        .unwrap_or(usize::MAX);
    let sizes: Vec<(usize, usize)> = match is_test {
        true => vec![(500, 20)],
        false => SIZES
            .into_iter()
            .filter(|&(nodes, _)| nodes <= most_nodes)
            .collect(),
    };
    std::fs::create_dir_all(FOLDER)?;
    let mut all = Vec::new();
    for &(nodes, destinations) in &sizes {
        eprintln!("{nodes} nodes");
        all.push(Figures::measure(nodes, destinations, Path::new(FOLDER))?);
    }
    print(&all);
    let picture = match sizes.len() {
        0 | 1 => return Ok(()),
        count if count == SIZES.len() => PathBuf::from(PICTURE),
        _ => Path::new(FOLDER).join("scale.svg"),
    };
    std::fs::write(picture, picture::growth(&all))
}

fn print(all: &[Figures]) {
    if cfg!(debug_assertions) {
        println!("**Built with debug assertions: these figures are no measurement.**\n");
    }
    let heads: Vec<String> = all.iter().map(|one| measures::grouped(one.nodes)).collect();
    println!("| nodes | {} |", heads.join(" | "));
    println!("|---{}|", "|---:".repeat(all.len()));
    for (row, name) in measures::ROWS.iter().enumerate() {
        let cells: Vec<&str> = all.iter().map(|one| one.cells[row].as_str()).collect();
        println!("| {name} | {} |", cells.join(" | "));
    }
    println!(
        "\n![Growth with the number of nodes](../pictures/scale.svg)\n\nK = {}, 10 km map, seed 1.",
        measures::MAX_NEIGHBOURS
    );
}
