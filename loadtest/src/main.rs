//! `skyway-loadtest`: open-loop load for an edge, scenario by scenario, held to objectives.
//!
//! Requests are sent when they are due, and their times count from then (`load`). Servers run as processes on the
//! machine's first core, the load on its second. What is sent, how fast, and what it is held against is data:
//! `scenarios/*.toml`. `README.md` has examples.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a load test asks the clock, reads and writes files, and starts servers"
)]

mod arrivals;
// The bench beside an echo has the same echo and the same cores.
#[path = "../../benches/service/cores.rs"]
mod cores;
mod deliveries;
#[path = "../../benches/service/echo.rs"]
mod echo;
mod elsewhere;
mod fleet;
mod line;
mod load;
mod measures;
mod mix;
mod objective;
mod page;
mod plot;
#[path = "../../benches/service/ranks.rs"]
mod ranks;
mod report;
mod requests;
mod rows;
mod run;
mod scenario;
mod servers;
mod stage;
mod table;
#[cfg(test)]
mod tests;
mod transport;
mod watch;
mod workload;

use clap::{Args, Parser, Subcommand};
use deliveries::{DeliveriesArguments, run_deliveries};
use line::{LineArguments, run_line};
use report::Report;
use run::{RunOptions, Target, eprintln_line};
use scenario::Scenario;
use std::error::Error;
use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tokio::signal::unix::{SignalKind, signal};
use tokio::task::LocalSet;
use workload::{FleetArguments, run_fleets};

/// What may go wrong is told once, and ends the run.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn Error>>;

const FAILED: u8 = 1;
const USAGE: u8 = 2;
const MISSED: u8 = 5;
const INTERRUPTED: u8 = 130;

const EXAMPLES: &str = "\
Examples:
  skyway-loadtest run --server target/dist/skyway                     the standard set; about half an hour
  skyway-loadtest run --server target/dist/skyway recompositions      one scenario
  skyway-loadtest run --server target/release/skyway --quick          whether everything works, in seconds
  skyway-loadtest fleet --server target/dist/skyway sydney            a fleet over Sydney, with the flight model
  skyway-loadtest line --server target/dist/skyway                    10,000 sessions of drones
  skyway-loadtest deliveries --server target/dist/skyway burst        a burst of orders at a registry
  skyway-loadtest table target/load/report.json                       the tables as Markdown

Exit codes: 0 when every objective is met, 5 when one is missed, 2 for wrong arguments and scenarios, 1 for other failures.";

/// Open-loop load for a Skyway edge, held to objectives.
#[derive(Debug, Parser)]
#[command(version, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run scenarios and write report.json and report.html
    Run(RunArguments),
    /// Name the scenarios
    List(ListArguments),
    /// Fill an edge with plans, close half of its airspace, and hold what drones are told against goals
    Fleet(FleetArguments),
    /// Put drones on the line, and hold what that takes and how soon they are told against goals
    Line(LineArguments),
    /// Order deliveries at a registry, and hold what becomes of them, and how soon, against goals
    Deliveries(DeliveriesArguments),
    /// Print the tables of a report as Markdown
    Table {
        /// A report.json
        report: PathBuf,
    },
    /// Serve the echo that the edge is measured beside
    #[command(hide = true)]
    Echo {
        dialect: String,
        answers: PathBuf,
        ports_file: PathBuf,
    },
}

#[derive(Debug, Args)]
struct ListArguments {
    /// The folder of the scenarios
    #[arg(long, value_name = "FOLDER", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios"))]
    scenarios: PathBuf,
}

#[derive(Debug, Args)]
struct RunArguments {
    /// Names of scenarios, or files; all but the long ones where none is named
    #[arg(value_name = "SCENARIO")]
    named: Vec<String>,
    #[command(flatten)]
    list: ListArguments,
    /// The skyway binary to measure; figures want one of the profile `dist`
    #[arg(long, value_name = "FILE", required_unless_present = "address")]
    server: Option<PathBuf>,
    /// An edge that runs already, in place of one of our own
    #[arg(long, value_name = "ADDRESS:PORT", conflicts_with = "server")]
    address: Option<SocketAddr>,
    /// Where report.json and report.html are written
    #[arg(long, value_name = "FOLDER", default_value = "target/load")]
    out: PathBuf,
    /// How often everything is measured, in place of what the scenarios say
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u16).range(1..))]
    repetitions: Option<u16>,
    /// A fraction of a second of everything: whether it works. Objectives are told and not enforced
    #[arg(long)]
    quick: bool,
    /// Also the long scenarios
    #[arg(long)]
    long: bool,
    /// What the report says was measured
    #[arg(long, value_name = "TEXT", default_value = "unknown")]
    commit: String,
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Run(arguments) => run_scenarios(&arguments),
        Command::Fleet(arguments) => run_fleets(&arguments),
        Command::Line(arguments) => run_line(&arguments),
        Command::Deliveries(arguments) => run_deliveries(&arguments),
        Command::List(arguments) => list(&arguments),
        Command::Table { report } => print_table(&report),
        Command::Echo {
            dialect,
            answers,
            ports_file,
        } => echo::serve(&dialect, &answers, &ports_file).map(|()| ExitCode::SUCCESS),
    };
    outcome.unwrap_or_else(|error| {
        eprintln_line(&format!("error: {error}"));
        let is_usage = error.is::<scenario::Unusable>() || error.is::<Unsuitable>();
        ExitCode::from(if is_usage { USAGE } else { FAILED })
    })
}

/// What was asked for does not go together.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Unsuitable(String);

fn list(arguments: &ListArguments) -> Result<ExitCode> {
    let mut stdout = std::io::stdout().lock();
    for scenario in all_scenarios(&arguments.scenarios)? {
        let long = if scenario.long { " (long)" } else { "" };
        writeln!(stdout, "{:<24} {}{long}", scenario.name, scenario.title)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn all_scenarios(folder: &Path) -> Result<Vec<Scenario>> {
    let entries = std::fs::read_dir(folder)
        .map_err(|error| Unsuitable(format!("{}: {error}", folder.display())))?;
    let mut files = Vec::new();
    for entry in entries {
        let path = entry?.path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            files.push(path);
        }
    }
    files.sort();
    let mut scenarios = Vec::with_capacity(files.len());
    for path in files {
        scenarios.push(Scenario::read(&path)?);
    }
    Ok(scenarios)
}

fn chosen(arguments: &RunArguments) -> Result<Vec<Scenario>> {
    let mut scenarios = Vec::new();
    if arguments.named.is_empty() {
        scenarios = all_scenarios(&arguments.list.scenarios)?;
        scenarios.retain(|scenario| arguments.long || !scenario.long);
    }
    for name in &arguments.named {
        let path = match Path::new(name).extension() {
            Some(_) => PathBuf::from(name),
            None => arguments.list.scenarios.join(format!("{name}.toml")),
        };
        scenarios.push(Scenario::read(&path)?);
    }
    for scenario in &mut scenarios {
        if let Some(repetitions) = arguments.repetitions {
            scenario.repetitions = repetitions.into();
        }
        let needs_servers = scenario.echo || scenario.servers.registry;
        if arguments.address.is_some() && needs_servers {
            let what =
                "starts an echo or a registry beside the edge, and so the edge: use --server";
            return Err(Unsuitable(format!("{}: {what}", scenario.name)).into());
        }
    }
    if arguments.quick {
        scenarios = scenarios.into_iter().map(Scenario::quickened).collect();
    }
    Ok(scenarios)
}

fn run_scenarios(arguments: &RunArguments) -> Result<ExitCode> {
    let scenarios = chosen(arguments)?;
    let target = match (&arguments.server, arguments.address) {
        (Some(program), _) if program.is_file() => Target::Program(program.clone()),
        (Some(program), _) => {
            return Err(Unsuitable(format!("{}: no such program", program.display())).into());
        }
        (None, Some(address)) => Target::Address(address),
        (None, None) => return Err(Unsuitable("name --server or --address".into()).into()),
    };
    let manner = RunOptions {
        is_pinned: cores::take_second(),
        is_quick: arguments.quick,
        target,
    };
    until_interrupted(run_all(arguments, &scenarios, &manner))
}

/// Runs something to its end, or until this program is told to end.
fn until_interrupted(running: impl Future<Output = Result<ExitCode>>) -> Result<ExitCode> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let local = LocalSet::new();
    local.block_on(&runtime, async {
        let mut terminate = signal(SignalKind::terminate())?;
        tokio::select! {
            outcome = running => outcome,
            // What is dropped here ends the servers.
            _ = tokio::signal::ctrl_c() => interrupted(),
            _ = terminate.recv() => interrupted(),
        }
    })
}

fn interrupted() -> Result<ExitCode> {
    eprintln_line(
        "interrupted: the servers are ended; scenarios that were done before are written",
    );
    Ok(ExitCode::from(INTERRUPTED))
}

async fn run_all(
    arguments: &RunArguments,
    scenarios: &[Scenario],
    manner: &RunOptions,
) -> Result<ExitCode> {
    let mut report = Report {
        begun_at: jiff::Timestamp::now().to_string(),
        commit: arguments.commit.clone(),
        machine: machine(),
        server: match &manner.target {
            Target::Program(program) => program.display().to_string(),
            Target::Address(address) => address.to_string(),
        },
        pinned: manner.is_pinned,
        quick: manner.is_quick,
        scenarios: Vec::new(),
    };
    let mut faults = Vec::new();
    for scenario in scenarios {
        for &dialect in &scenario.client.dialects {
            let done = run::scenario(scenario, dialect, manner).await;
            let done = done.map_err(|error| format!("{}: {error}", scenario.name))?;
            faults.extend(run::faults_of_shape(scenario, &done));
            report.scenarios.push(done);
            // Each as soon as it is there: a later one that fails does not cost it.
            write(arguments, &report)?;
        }
    }
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(table::objectives(&report).as_bytes())?;
    let pages = arguments.out.join("report.html");
    writeln!(stdout, "\nwritten: {}", pages.display())?;
    if manner.is_quick {
        return match faults.is_empty() {
            true => Ok(ExitCode::SUCCESS),
            false => Err(faults.join("\n").into()),
        };
    }
    let missed = report.missed();
    for objective in &missed {
        eprintln_line(&format!("missed: {objective}"));
    }
    Ok(ExitCode::from(if missed.is_empty() { 0 } else { MISSED }))
}

fn write(arguments: &RunArguments, report: &Report) -> Result<()> {
    std::fs::create_dir_all(&arguments.out)?;
    let json = serde_json::to_string_pretty(report)?;
    std::fs::write(arguments.out.join("report.json"), json)?;
    let page = page::page(report);
    std::fs::write(arguments.out.join("report.html"), page)?;
    Ok(())
}

fn print_table(path: &Path) -> Result<ExitCode> {
    let told = |error: &dyn Error| Unsuitable(format!("{}: {error}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| told(&error))?;
    let report: Report = serde_json::from_str(&text).map_err(|error| told(&error))?;
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(table::objectives(&report).as_bytes())?;
    stdout.write_all(table::figures(&report).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name"));
    let model = model.and_then(|rest| rest.split(':').nth(1));
    let system = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let cores = cpu.matches("processor\t").count();
    format!(
        "{}, {cores} cores, Linux {}",
        model.map_or(std::env::consts::ARCH, str::trim),
        system.trim()
    )
}
