//! The flags that configure an edge, and where else its configuration comes from.

use super::files;
use super::stop::Stop;
use crate::config::{ConfigFault, ENVIRONMENT_PREFIX, EffectiveConfig, Flag, Sources, resolve};
use clap::Args;
use std::ffi::OsString;
use std::fmt::Display;
use std::path::PathBuf;

/// How an edge is configured. Every value is checked where all sources come together, so these are texts.
#[derive(Debug, Args)]
#[command(next_help_heading = "Configuration")]
pub(super) struct EdgeFlags {
    /// The configuration file, TOML; `skyway config sample` writes one
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where drones and operators reach the edge [default: 127.0.0.1:8080]
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<String>,
    /// Where metrics and status are read [default: 127.0.0.1:9090]
    #[arg(long, value_name = "ADDRESS:PORT")]
    admin_listen: Option<String>,
    /// The network: sydney, corridor, or a file [default: sydney]
    #[arg(long, short, value_name = "NAME|FILE")]
    network: Option<String>,
    /// The file with the digests of the tokens, which only its owner may read
    #[arg(long, value_name = "FILE")]
    tokens_file: Option<String>,
    /// A file to write the ports to that were taken
    #[arg(long, value_name = "FILE")]
    ports_file: Option<String>,
    /// What a simulated clock shows at the start (RFC 3339); loopback only
    #[arg(long, value_name = "TIME")]
    clock_start: Option<String>,
    /// How many times faster than the machine's the clock runs; loopback only
    #[arg(long, value_name = "FACTOR")]
    clock_rate: Option<String>,
    /// Which log lines: a level, and MODULE=LEVEL for a module, with commas [default: info]
    #[arg(long, value_name = "FILTER")]
    log: Option<String>,
    /// How log lines are written: text or json [default: text]
    #[arg(long, value_name = "FORMAT")]
    log_format: Option<String>,
    /// Any setting by its name, as in limits.body=2MiB; may be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
}

impl EdgeFlags {
    /// The configuration of these flags, the environment and the file.
    ///
    /// # Errors
    /// Everything wrong in any of them.
    pub(super) fn effective(&self) -> Result<EffectiveConfig, Stop> {
        let sources = Sources {
            file: self.file()?,
            environment: environment()?,
            flags: self.flags()?,
        };
        resolve(&sources).map_err(|faults| misconfigured(&faults))
    }

    fn file(&self) -> Result<Option<(String, String)>, Stop> {
        let Some(path) = &self.config else {
            return Ok(None);
        };
        let text = files::read_text(path).map_err(|stop| Stop::Misconfigured(stop.messages()))?;
        Ok(Some((path.display().to_string(), text)))
    }

    fn flags(&self) -> Result<Vec<Flag>, Stop> {
        let named = [
            ("--listen", "listen", &self.listen),
            ("--admin-listen", "admin_listen", &self.admin_listen),
            ("--network", "network", &self.network),
            ("--tokens-file", "tokens_file", &self.tokens_file),
            ("--ports-file", "ports_file", &self.ports_file),
            ("--clock-start", "clock.start", &self.clock_start),
            ("--clock-rate", "clock.rate", &self.clock_rate),
            ("--log", "log.filter", &self.log),
            ("--log-format", "log.format", &self.log_format),
        ];
        let given = named.into_iter().filter_map(|(flag, name, value)| {
            let value = value.clone()?;
            Some(Flag {
                flag: flag.to_owned(),
                name: name.to_owned(),
                value,
            })
        });
        let mut flags: Vec<Flag> = given.collect();
        for pair in &self.set {
            let Some((name, value)) = pair.split_once('=') else {
                return Err(Stop::Misconfigured(vec![format!(
                    "flag --set {pair}: write NAME=VALUE, as in limits.body=2MiB"
                )]));
            };
            flags.push(Flag {
                flag: format!("--set {name}"),
                name: name.to_owned(),
                value: value.to_owned(),
            });
        }
        Ok(flags)
    }
}

/// Everything wrong with a configuration, as the end of a command.
pub(super) fn misconfigured(faults: &[ConfigFault]) -> Stop {
    Stop::Misconfigured(faults.iter().map(ToString::to_string).collect())
}

/// The variables that configure an edge, by name.
#[expect(
    clippy::disallowed_methods,
    reason = "the door to the environment: settings of the edge"
)]
fn environment() -> Result<Vec<(String, String)>, Stop> {
    ours(std::env::vars_os())
}

fn ours(
    variables: impl Iterator<Item = (OsString, OsString)>,
) -> Result<Vec<(String, String)>, Stop> {
    let mut ours = Vec::new();
    let mut faults = Vec::new();
    for (name, value) in variables {
        let name = name.to_string_lossy();
        if !name.starts_with(ENVIRONMENT_PREFIX) {
            continue;
        }
        match value.into_string() {
            Ok(value) => ours.push((name.into_owned(), value)),
            Err(_) => faults.push(not_text(&name)),
        }
    }
    // The environment has no order of its own; faults are told in one that stays.
    ours.sort();
    match faults.is_empty() {
        true => Ok(ours),
        false => Err(Stop::Misconfigured(faults)),
    }
}

fn not_text(variable: &dyn Display) -> String {
    format!("env {variable}: the value is not UTF-8 text")
}
