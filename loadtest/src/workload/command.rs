//! `skyway-loadtest fleet`.

use super::Workload;
use super::play::{PlayOptions, play};
use crate::run::eprintln_line;
use crate::{MISSED, Result, Unsuitable, cores, machine, until_interrupted};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What is played where nothing is named, in this order, and in a quick run: those with kills measure nothing.
const WORKLOADS: [&str; 5] = ["sydney_200", "sydney", "wide_1000", "wide", "distance"];
const QUICK_WORKLOADS: [&str; 3] = ["sydney", "distance", "sydney_killed"];

#[derive(Debug, Args)]
pub(crate) struct FleetArguments {
    /// Names of workloads, or files; all where none is named
    #[arg(value_name = "WORKLOAD")]
    named: Vec<String>,
    /// The folder of the workloads
    #[arg(long, value_name = "FOLDER", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/workloads"))]
    workloads: PathBuf,
    /// The skyway binary to measure; figures want one of the profile `dist`
    #[arg(long, value_name = "FILE")]
    server: PathBuf,
    /// Write what happened to this file, as NDJSON for judges; with several workloads each to its
    /// own, with its name before the ending
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// A few plans and zones of some workloads: whether it works. Goals of time are told and not
    /// enforced
    #[arg(long)]
    quick: bool,
    /// What the tables say was measured
    #[arg(long, value_name = "TEXT", default_value = "unknown")]
    commit: String,
}

/// Plays workloads and prints a table of each; exits with 5 where a goal is missed.
pub(crate) fn run_fleets(arguments: &FleetArguments) -> Result<ExitCode> {
    if !arguments.server.is_file() {
        let what = format!("{}: no such program", arguments.server.display());
        return Err(Unsuitable(what).into());
    }
    let mut workloads = Vec::new();
    let named: Vec<&str> = match (arguments.named.is_empty(), arguments.quick) {
        (false, _) => arguments.named.iter().map(String::as_str).collect(),
        (true, false) => WORKLOADS.to_vec(),
        (true, true) => QUICK_WORKLOADS.to_vec(),
    };
    for name in named {
        let path = match Path::new(name).extension() {
            Some(_) => PathBuf::from(name),
            None => arguments.workloads.join(format!("{name}.toml")),
        };
        let workload = Workload::read(&path)?;
        workloads.push(if arguments.quick {
            workload.quickened()
        } else {
            workload
        });
    }
    let is_pinned = cores::take_second();
    until_interrupted(play_all(arguments, &workloads, is_pinned))
}

async fn play_all(
    arguments: &FleetArguments,
    workloads: &[Workload],
    is_pinned: bool,
) -> Result<ExitCode> {
    let mut missed = Vec::new();
    for workload in workloads {
        let options = PlayOptions {
            program: arguments.server.clone(),
            is_pinned,
            record: record_of(arguments, workload, workloads.len()),
            commit: arguments.commit.clone(),
        };
        let figures = play(workload, &options).await;
        let figures = figures.map_err(|error| format!("{}: {error}", workload.name))?;
        let table = figures.table(&workload.goals);
        let mut stdout = std::io::stdout().lock();
        writeln!(stdout, "### {}: {}\n", workload.name, workload.title)?;
        writeln!(
            stdout,
            "{}\n\n{table}",
            circumstances(arguments, workload, is_pinned)
        )?;
        for goal in figures.missed(&workload.goals, arguments.quick) {
            missed.push(format!("{}: {goal}", workload.name));
        }
    }
    for goal in &missed {
        eprintln_line(&format!("missed: {goal}"));
    }
    Ok(ExitCode::from(if missed.is_empty() { 0 } else { MISSED }))
}

/// The file of a workload's record: with its name where there are several.
fn record_of(arguments: &FleetArguments, workload: &Workload, count: usize) -> Option<PathBuf> {
    let record = arguments.record.as_ref()?;
    if count == 1 {
        return Some(record.clone());
    }
    let ending = record.extension().unwrap_or_default().to_string_lossy();
    Some(record.with_extension(format!("{}.{ending}", workload.name)))
}

fn circumstances(arguments: &FleetArguments, workload: &Workload, is_pinned: bool) -> String {
    let apart = if is_pinned {
        "edge and load on cores of their own"
    } else {
        "edge and load share all cores"
    };
    let quick = if arguments.quick {
        ". A quick run: its times say nothing"
    } else {
        ""
    };
    format!(
        "Commit `{}`, seed {}, {}, {apart}{quick}.",
        arguments.commit,
        workload.seed,
        machine()
    )
}
