//! The command line: the only part that reads arguments, files, streams and the clock.
//!
//! One file per command. What they share: `network_source` and `airspace_source` say what a command
//! works on, `failure` and `method` what is asked, `names` finds ids, `files` and `clock` are the doors
//! to the outside, `output` and `stop` say how a command speaks and ends.

mod airspace_source;
mod answer_table;
mod building_source;
mod clock;
mod compare;
mod completions;
mod compose;
#[cfg(feature = "edge")]
mod config;
#[cfg(feature = "edge")]
mod config_sources;
#[cfg(feature = "edge")]
mod delivery;
#[cfg(feature = "edge")]
mod demo;
#[cfg(feature = "edge")]
mod edge;
#[cfg(feature = "edge")]
mod edge_flags;
mod evaluate;
mod failure;
mod files;
mod flight;
#[cfg(feature = "edge")]
mod geopackage;
mod man;
mod method;
mod names;
mod network;
mod network_source;
mod output;
mod pack;
mod picture;
mod plan;
#[cfg(feature = "edge")]
mod registry;
#[cfg(feature = "edge")]
mod registry_arguments;
#[cfg(feature = "edge")]
mod remote;
#[cfg(feature = "edge")]
mod replay;
mod requests;
mod reroute;
#[cfg(feature = "edge")]
mod service;
mod stop;
#[cfg(feature = "edge")]
mod token;
mod verify;
#[cfg(feature = "edge")]
mod zone;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use output::{Color, Output};
use std::ffi::OsString;
use stop::{Stop, Verdict};

const EXAMPLES: &str = "\
Examples:
  skyway compare --service 379,406 --destination 450          every strategy on one failure
  skyway reroute --service 379,406 --destination 450 --json   the answer to a failure report
  skyway compose --source 1 --destination 450                 a plan with its contingencies
  skyway network info                                         what the network is like

Exit codes: 0 for any outcome, 1 for a failure, 2 for arguments that make no sense,
78 for a configuration that is not valid.";

/// The end of every help that has no codes of its own.
const EXIT_CODES: &str =
    "Exit codes: 0 when it is done, 1 for a failure, 2 for arguments that make no sense.";

/// Exact, sub-millisecond recomposition of drone delivery routes on a skyway network
///
/// A drone reports that the leg ahead has failed; skyway answers with a new path to its destination. By default that
/// is the true optimum; the strategies of the paper and the usual baselines can be asked for instead.
#[derive(Debug, Parser)]
#[command(name = "skyway", version, max_term_width = 100, after_help = EXAMPLES)]
struct Arguments {
    #[command(flatten)]
    manner: OutputOptions,
    #[command(subcommand)]
    command: Command,
}

/// How a command speaks.
#[derive(Debug, Args)]
#[command(next_help_heading = "Global options")]
struct OutputOptions {
    /// When to use colours; auto: on a terminal, unless NO_COLOR is set
    #[arg(long, value_enum, value_name = "WHEN", default_value_t, global = true)]
    color: Color,
    /// Leave out the notes on standard error; warnings and errors stay
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Answer a failure report with a new path
    Reroute(reroute::Reroute),
    /// Compose a plan from a source to a destination, with what to do where a leg closes
    Compose(compose::Compose),
    /// Answer one failure report with every strategy, in one table
    Compare(compare::Compare),
    /// Repeat the paper's experiments with exact beside them, and write a report
    Evaluate(evaluate::Evaluate),
    /// Start an edge on this machine with a small fleet that flies in accelerated time
    #[cfg(feature = "edge")]
    Demo(demo::Demo),
    /// Serve drones and operators: REST and gRPC on one port
    #[cfg(feature = "edge")]
    Edge(edge::Edge),
    /// Serve the log of changes that edges follow
    #[cfg(feature = "edge")]
    Registry(registry::Registry),
    /// Compute an answer of an edge again, from what it kept of it
    #[cfg(feature = "edge")]
    Replay(replay::Replay),
    /// Show packs, which drones fly by when the line is gone, and make the keys that sign them
    #[command(subcommand, after_help = pack::EXAMPLES)]
    Pack(pack::Pack),
    /// Check a certificate, or a plan that is flown; exit code 0 when it holds, 1 when not
    Verify(verify::Verify),
    /// Make, inspect, convert and draw networks
    #[command(subcommand, after_help = network::EXAMPLES)]
    Network(network::Network),
    /// Import and export zones of ED-269, ED-318, QGroundControl and GeoJSON
    #[cfg(feature = "edge")]
    #[command(subcommand, after_help = zone::EXAMPLES)]
    Zone(zone::Zone),
    /// Publish what a provider offers at a registry
    #[cfg(feature = "edge")]
    #[command(subcommand, after_help = service::EXAMPLES)]
    Service(service::Service),
    /// Order, follow and call off deliveries at a registry
    #[cfg(feature = "edge")]
    #[command(subcommand, after_help = delivery::EXAMPLES)]
    Delivery(delivery::Delivery),
    /// Check and show the configuration of an edge or a registry
    #[cfg(feature = "edge")]
    #[command(subcommand)]
    Config(config::Config),
    /// Make a token for those who call an edge or a registry
    #[cfg(feature = "edge")]
    Token(token::Token),
    /// Write completions for a shell to standard output
    Completions(completions::Completions),
    /// Write the manual page, or all of them
    Man(man::Man),
}

/// Runs the command that the arguments of this process name, and tells with which code to exit.
#[expect(
    clippy::disallowed_methods,
    reason = "the door to the arguments of the process"
)]
pub fn main() -> u8 {
    main_with(std::env::args_os())
}

/// Runs the command that arguments name, of which the first is the program's own name, and tells with which code to exit.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let parsed = definition().try_get_matches_from(arguments);
    let parsed = parsed.and_then(|matches| Arguments::from_arg_matches(&matches));
    let arguments = match parsed {
        Ok(arguments) => arguments,
        Err(refusal) => return refuse(&refusal),
    };
    let output = Output::new(arguments.manner.color, arguments.manner.quiet);
    match run(&arguments.command, &output) {
        Ok(verdict) => verdict.exit_code(),
        Err(stop) => {
            for message in stop.messages() {
                output.error(&message);
            }
            stop.exit_code()
        }
    }
}

/// The definition of the command line, with the exit codes in every help.
fn definition() -> clap::Command {
    with_exit_codes(Arguments::command())
}

fn with_exit_codes(command: clap::Command) -> clap::Command {
    let command = command.mut_subcommands(with_exit_codes);
    let told = command.get_after_help().map(ToString::to_string);
    let text = match told {
        None => EXIT_CODES.to_owned(),
        Some(told) if told.contains("Exit codes:") => return command,
        Some(told) => format!("{told}\n\n{EXIT_CODES}"),
    };
    command.after_help(text)
}

/// Help and version are asked for and go to standard output; all else is an error of usage.
fn refuse(refusal: &clap::Error) -> u8 {
    // Without a reader there is no one to tell.
    let _ = refusal.print();
    u8::try_from(refusal.exit_code()).unwrap_or(u8::MAX)
}

fn run(command: &Command, output: &Output) -> Result<Verdict, Stop> {
    match command {
        Command::Reroute(command) => command.run(output),
        Command::Compose(command) => command.run(output),
        Command::Compare(command) => command.run(output),
        Command::Evaluate(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Demo(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Edge(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Registry(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Replay(command) => command.run(output),
        Command::Pack(command) => command.run(output),
        Command::Verify(command) => command.run(output),
        Command::Network(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Zone(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Service(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Delivery(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Config(command) => command.run(output),
        #[cfg(feature = "edge")]
        Command::Token(command) => command.run(output),
        Command::Completions(command) => command.run(output),
        Command::Man(command) => command.run(output),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_definition_of_the_command_line_is_consistent() {
        definition().debug_assert();
    }
}
