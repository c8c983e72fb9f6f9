//! This engine beside its peers: the same networks and the same queries, every distance checked.
//!
//! This half draws networks and queries, measures what is written in Rust (this engine, its own baselines and
//! petgraph) and writes everything to `target/peers`. `run.py` reads it there, asks the peers that come with Python
//! the same, and `table.py` makes the tables of both. `scripts/measure peers` does all of it.
//!
//! Three kinds of queries. *Local*: from one end of the failed segment to the other, without it. *Global*: from there
//! to the destination. *Zone*: from a source to a destination with all nodes in a polygon closed for this query only,
//! finding them included. `SKYWAY_PEERS_QUICK=1` asks little of the smallest network; `SKYWAY_PEERS_NETWORK=heidelberg`
//! measures one network alone.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a bench asks the clock, files and its environment"
)]
#![expect(clippy::print_stderr, reason = "a long run says where it is")]

mod export;
mod failures;
mod networks;
#[path = "../engine/oracle.rs"]
mod oracle;
mod passages;
mod queries;
mod times;

use networks::Subject;
use queries::Queries;
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};
use times::{Effort, Times};

/// Where the halves meet.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/peers");

/// What is to be done: on which networks, with how many queries, for how long.
struct Plan {
    subjects: Vec<Subject>,
    failures: usize,
    passages: usize,
    effort: Effort,
    /// False in a test, which only shows that everything works.
    writes_files: bool,
}

impl Plan {
    fn chosen() -> Self {
        // `cargo test --benches` runs this too: a small network shows that everything works.
        let is_test = std::env::args().any(|argument| argument == "--test")
            || !std::env::args().any(|argument| argument == "--bench");
        let is_quick = std::env::var("SKYWAY_PEERS_QUICK").is_ok_and(|value| value == "1");
        if is_test || is_quick {
            let nodes = if is_test { 300 } else { 1_000 };
            return Self {
                subjects: vec![Subject::generated(nodes, 20)],
                failures: 20,
                passages: 10,
                effort: Effort {
                    max_passes: 2,
                    budget: Duration::from_millis(50),
                },
                writes_files: !is_test,
            };
        }
        let only = std::env::var("SKYWAY_PEERS_NETWORK").ok();
        let is_wanted =
            |subject: &Subject| only.as_ref().is_none_or(|only| *only == subject.name());
        Self {
            subjects: Subject::all().into_iter().filter(is_wanted).collect(),
            failures: 1_000,
            passages: 200,
            effort: Effort {
                max_passes: 25,
                budget: Duration::from_millis(800),
            },
            writes_files: true,
        }
    }
}

fn main() -> io::Result<()> {
    let plan = Plan::chosen();
    let folder = Path::new(FOLDER);
    if plan.writes_files {
        if folder.is_dir() {
            std::fs::remove_dir_all(folder)?;
        }
        std::fs::create_dir_all(folder)?;
    }
    let mut names = Vec::new();
    for subject in &plan.subjects {
        names.push(subject.name());
        measure(subject, &plan, &folder.join(subject.name()))?;
    }
    match plan.writes_files {
        true => std::fs::write(folder.join("networks.txt"), names.join("\n") + "\n"),
        false => Ok(()),
    }
}

fn measure(subject: &Subject, plan: &Plan, folder: &Path) -> io::Result<()> {
    let begun = Instant::now();
    let topology = subject.load();
    // The large networks take as long to check as to measure.
    let is_large = topology.node_count() > 20_000;
    let queries = Queries::draw(
        topology,
        subject.destinations,
        plan.failures / if is_large { 3 } else { 1 },
        plan.passages / if is_large { 2 } else { 1 },
    );
    let mut times = Times::default();
    failures::measure(&queries, plan.effort, &mut times);
    passages::measure(&queries, plan.effort, &mut times);
    if plan.writes_files {
        std::fs::create_dir_all(folder)?;
        export::write(subject, &queries, &times, folder)?;
    }
    eprintln!(
        "{}: {} nodes, {} segments, {} failures, {} zones, {:.0} s",
        subject.name(),
        queries.topology.node_count(),
        queries.topology.segment_count(),
        queries.failures.len(),
        queries.passages.len(),
        begun.elapsed().as_secs_f64()
    );
    Ok(())
}
