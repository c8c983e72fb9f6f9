//! `skyway config`: what a daemon would be configured with, and what is wrong with that.

use super::config_sources::{Looked, misconfigured};
use super::edge::runtime;
use super::edge_flags::EdgeFlags;
use super::files;
use super::network_source;
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::{Configuration, EdgeConfig, EffectiveConfig, Origin, RegistryConfig, sample};
use crate::edge::SqliteFile;
use crate::registry::{SqliteStore, check_store_name, is_database};
use clap::{Args, Subcommand};
use std::path::Path;

const EXAMPLES: &str = "\
Examples:
  skyway config check --config edge.toml          every fault, or ok
  skyway config show --origin --config edge.toml  what holds, and who said so
  skyway config sample > edge.toml                every setting with its meaning
  skyway config sample --registry > registry.toml the same for a registry

A flag wins over the environment, that over the file, that over the default. The variable of
limits.body is SKYWAY_EDGE_LIMITS_BODY, that of a registry SKYWAY_REGISTRY_LIMITS_BODY.

Exit codes: 0 when all is well, 78 for a configuration that is not valid, 2 for arguments that
make no sense.";

const CHECK_EXAMPLES: &str = "\
Examples:
  skyway config check --config edge.toml
  skyway config check --set limits.body=2MiB --network corridor
  skyway config check --registry --config registry.toml

Exit codes: 0 when all is well, 78 for a configuration that is not valid, 2 for arguments that
make no sense.";

const SHOW_EXAMPLES: &str = "\
Examples:
  skyway config show --origin --config edge.toml   what holds, and who said so
  skyway config show --json

Exit codes: 0 when it is shown, 78 for a configuration that is not valid, 2 for arguments that
make no sense.";

const SAMPLE_EXAMPLES: &str = "\
Examples:
  skyway config sample > edge.toml
  skyway config sample --registry > registry.toml";

/// The commands of `skyway config`.
#[derive(Debug, Subcommand)]
#[command(after_help = EXAMPLES)]
pub(super) enum Config {
    /// Say everything that would keep a daemon from starting; exit code 78 when there is anything
    Check(Check),
    /// Write the configuration that a daemon would have
    Show(Show),
    /// Write a sample of the configuration file, with every setting, its meaning and its default
    Sample(Sample),
}

/// Whose configuration.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct Whose {
    /// Of a registry instead of an edge; --listen, --admin-listen, --set and the like are then the registry's
    #[arg(long)]
    registry: bool,
}

/// Arguments of `skyway config sample`.
#[derive(Debug, Args)]
#[command(after_help = SAMPLE_EXAMPLES)]
pub(super) struct Sample {
    #[command(flatten)]
    whose: Whose,
}

/// Arguments of `skyway config check`.
#[derive(Debug, Args)]
#[command(after_help = CHECK_EXAMPLES)]
pub(super) struct Check {
    #[command(flatten)]
    whose: Whose,
    #[command(flatten)]
    flags: EdgeFlags,
}

/// Arguments of `skyway config show`.
#[derive(Debug, Args)]
#[command(after_help = SHOW_EXAMPLES)]
pub(super) struct Show {
    #[command(flatten)]
    whose: Whose,
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
            Self::Sample(sample) => sample.run(output),
        }
    }
}

impl Sample {
    fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let text = match self.whose.registry {
            true => sample::<RegistryConfig>(),
            false => sample::<EdgeConfig>(),
        };
        output.raw(text.as_bytes()).map(|()| Verdict::Done)
    }
}

impl Check {
    fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        if self.whose.registry {
            let looked = self.flags.look::<RegistryConfig>()?;
            let advice = "this configures an edge: check it without --registry";
            let advice = self.advice::<EdgeConfig>(&looked.faults, advice)?;
            let store = &looked.effective.config.store;
            let of_store = store_faults(store, &looked.effective.origin("store"))?;
            return told(&looked, of_store, advice, output);
        }
        let looked = self.flags.look::<EdgeConfig>()?;
        let advice = "this configures a registry: check it with --registry";
        let advice = self.advice::<RegistryConfig>(&looked.faults, advice)?;
        let effective = &looked.effective;
        let mut more = network_faults(effective, output)?;
        if let Some(store) = &effective.config.store {
            more.extend(file_faults(store, &effective.origin("store"), |store| {
                runtime()?.block_on(async {
                    let checked = SqliteFile::check(store).await;
                    Ok(checked.err().map(|fault| fault.to_string()))
                })
            })?);
        }
        told(&looked, more, advice, output)
    }

    /// What to do about a configuration that is without any fault for the other daemon.
    fn advice<C: Configuration>(
        &self,
        faults: &[String],
        advice: &str,
    ) -> Result<Option<String>, Stop> {
        let is_others = !faults.is_empty() && self.flags.look::<C>()?.faults.is_empty();
        Ok(is_others.then(|| advice.to_owned()))
    }
}

/// Tells what would keep a daemon from starting, or that nothing would.
fn told<C: Configuration>(
    looked: &Looked<C>,
    more: Vec<String>,
    advice: Option<String>,
    output: &Output,
) -> Result<Verdict, Stop> {
    let mut faults = looked.faults.clone();
    let mut warnings = Vec::new();
    match looked.effective.admit() {
        // What else a file says that is no TOML is unknown.
        _ if !looked.is_read => {}
        Ok(admission) => warnings = admission.warnings,
        Err(found) => faults.extend(misconfigured(&found).messages()),
    }
    faults.extend(more);
    if !faults.is_empty() {
        faults.extend(advice);
        return Err(Stop::Misconfigured(faults));
    }
    for warning in &warnings {
        output.warn(&warning.to_string());
    }
    output.line("ok")?;
    Ok(Verdict::Done)
}

/// What is wrong with the network, each with who named it.
fn network_faults(
    effective: &EffectiveConfig<EdgeConfig>,
    output: &Output,
) -> Result<Vec<String>, Stop> {
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

/// What is wrong with the store of a registry, with who named it. A database is not asked.
fn store_faults(name: &str, origin: &Origin) -> Result<Vec<String>, Stop> {
    if let Err(error) = check_store_name(name) {
        return Ok(vec![format!("{origin}: {error}")]);
    }
    if is_database(name) {
        return Ok(Vec::new());
    }
    file_faults(Path::new(name), origin, |store| {
        runtime()?.block_on(async {
            let checked = SqliteStore::check(store).await;
            Ok(checked.err().map(|error| error.to_string()))
        })
    })
}

/// What is wrong with a store in a file. One that is not there is not made; one that is there is opened to read it.
fn file_faults(
    file: &Path,
    origin: &Origin,
    open: impl FnOnce(&Path) -> Result<Option<String>, Stop>,
) -> Result<Vec<String>, Stop> {
    let name = file.display();
    let folder = file.parent().filter(|folder| *folder != Path::new(""));
    let problem = match folder {
        _ if files::is_folder(file) => Some(format!("{name} is a folder; name a file")),
        Some(folder) if !files::is_folder(folder) => {
            let folder = folder.display();
            Some(format!(
                "there is no folder {folder}; make it, or name another"
            ))
        }
        _ if files::is_there(file) => open(file)?,
        _ => None,
    };
    let problem = problem.into_iter();
    Ok(problem
        .map(|problem| format!("{origin}: {problem}"))
        .collect())
}

impl Show {
    fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self.whose.registry {
            true => self.tell(&self.flags.effective_of::<RegistryConfig>(&[])?, output),
            false => self.tell(&self.flags.effective()?, output),
        }
    }

    fn tell<C: Configuration>(
        &self,
        effective: &EffectiveConfig<C>,
        output: &Output,
    ) -> Result<Verdict, Stop> {
        match self.json {
            true => output.json(&effective.to_json(self.origin))?,
            false => output.raw(effective.to_toml(self.origin).as_bytes())?,
        }
        Ok(Verdict::Done)
    }
}
