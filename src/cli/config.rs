//! `skyway config`: what an edge would be configured with, and what is wrong with that.

use super::edge_flags::{EdgeFlags, misconfigured};
use super::network_source;
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::{EffectiveConfig, sample};
use clap::{Args, Subcommand};

const EXAMPLES: &str = "\
Examples:
  skyway config check --config edge.toml          every fault, or ok
  skyway config show --origin --config edge.toml  what holds, and who said so
  skyway config sample > edge.toml                every setting with its meaning

A flag wins over the environment, that over the file, that over the default. The variable of
limits.body is SKYWAY_EDGE_LIMITS_BODY.

Exit codes: 0 when all is well, 78 for a configuration that is not valid, 2 for arguments that
make no sense.";

/// The commands of `skyway config`.
#[derive(Debug, Subcommand)]
#[command(after_help = EXAMPLES)]
pub(super) enum Config {
    /// Say everything that would keep an edge from starting; exit code 78 when there is anything
    Check(Check),
    /// Write the configuration that an edge would have
    Show(Show),
    /// Write a sample of the configuration file, with every setting, its meaning and its default
    Sample,
}

/// Arguments of `skyway config check`.
#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    flags: EdgeFlags,
}

/// Arguments of `skyway config show`.
#[derive(Debug, Args)]
pub(super) struct Show {
    #[command(flatten)]
    flags: EdgeFlags,
    /// Tell for each value who said so: a flag, the environment, a line of the file, the default
    #[arg(long)]
    origin: bool,
    /// Write JSON instead of TOML
    #[arg(long)]
    json: bool,
}

impl Config {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self {
            Self::Check(check) => check.run(output),
            Self::Show(show) => show.run(output),
            Self::Sample => output.raw(sample().as_bytes()).map(|()| Verdict::Done),
        }
    }
}

impl Check {
    fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let effective = self.flags.effective()?;
        let admission = effective.admit();
        let mut faults = match &admission {
            Ok(_) => Vec::new(),
            Err(faults) => misconfigured(faults).messages(),
        };
        faults.extend(network_faults(&effective, output)?);
        if !faults.is_empty() {
            return Err(Stop::Misconfigured(faults));
        }
        for warning in admission.iter().flat_map(|admission| &admission.warnings) {
            output.warn(&warning.to_string());
        }
        output.line("ok")?;
        Ok(Verdict::Done)
    }
}

/// What is wrong with the network, each with who named it.
fn network_faults(effective: &EffectiveConfig, output: &Output) -> Result<Vec<String>, Stop> {
    let origin = effective.origin("network");
    match network_source::load(&effective.config.network, None, output) {
        Ok(_) => Ok(Vec::new()),
        Err(Stop::OutputClosed) => Err(Stop::OutputClosed),
        Err(stop) => {
            let messages = stop.messages().into_iter();
            Ok(messages.map(|fault| format!("{origin}: {fault}")).collect())
        }
    }
}

impl Show {
    fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let effective = self.flags.effective()?;
        match self.json {
            true => output.json(&effective.to_json(self.origin))?,
            false => output.raw(effective.to_toml(self.origin).as_bytes())?,
        }
        Ok(Verdict::Done)
    }
}
