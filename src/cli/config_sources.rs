//! Where the configuration of a daemon comes from: its file, its variables, its flags.

use super::files;
use super::stop::Stop;
use crate::config::{
    ConfigFault, Configuration, EffectiveConfig, Flag, Sources, resolve_leniently,
};
use std::ffi::OsString;
use std::fmt::Display;
use std::path::Path;

/// A flag of its own for a setting: how it is written, which setting it says, and what, where it is given.
pub(super) type Named<'a> = (&'static str, &'static str, &'a Option<String>);

/// The configuration of a file, the environment, flags of their own, and `--set NAME=VALUE`.
///
/// # Errors
/// Everything wrong in any of them.
pub(super) fn effective<C: Configuration>(
    file: Option<&Path>,
    named: &[Named<'_>],
    set: &[String],
) -> Result<EffectiveConfig<C>, Stop> {
    let Looked {
        effective, faults, ..
    } = look(file, named, set)?;
    match faults.is_empty() {
        true => Ok(effective),
        false => Err(Stop::Misconfigured(faults)),
    }
}

/// A configuration as far as it can be understood.
pub(super) struct Looked<C> {
    pub(super) effective: EffectiveConfig<C>,
    /// Everything wrong in what was said.
    pub(super) faults: Vec<String>,
    /// Whether all of it was read: of a file that is no TOML nothing is known.
    pub(super) is_read: bool,
}

/// The same with all faults of all sources at once.
///
/// # Errors
/// When the file cannot be read.
pub(super) fn look<C: Configuration>(
    file: Option<&Path>,
    named: &[Named<'_>],
    set: &[String],
) -> Result<Looked<C>, Stop> {
    let mut told = Vec::new();
    let sources = Sources {
        file: read(file)?,
        environment: environment(C::ENVIRONMENT_PREFIX, &mut told),
        flags: flags(named, set, &mut told),
    };
    let (effective, faults) = resolve_leniently(&sources);
    let is_read = !faults
        .iter()
        .any(|fault| matches!(fault, ConfigFault::Syntax { .. }));
    let faults = faults.iter().map(ToString::to_string);
    Ok(Looked {
        effective,
        faults: faults.chain(told).collect(),
        is_read,
    })
}

fn read(file: Option<&Path>) -> Result<Option<(String, String)>, Stop> {
    let Some(path) = file else {
        return Ok(None);
    };
    let text = files::read_text(path).map_err(|stop| Stop::Misconfigured(stop.messages()))?;
    Ok(Some((path.display().to_string(), text)))
}

fn flags(named: &[Named<'_>], set: &[String], faults: &mut Vec<String>) -> Vec<Flag> {
    let given = named.iter().filter_map(|(flag, name, value)| {
        let value = (*value).clone()?;
        Some(Flag {
            flag: (*flag).to_owned(),
            name: (*name).to_owned(),
            value,
        })
    });
    let mut flags: Vec<Flag> = given.collect();
    for pair in set {
        let Some((name, value)) = pair.split_once('=') else {
            faults.push(format!(
                "flag --set {pair}: write NAME=VALUE, as in limits.body=2MiB"
            ));
            continue;
        };
        flags.push(Flag {
            flag: format!("--set {name}"),
            name: name.to_owned(),
            value: value.to_owned(),
        });
    }
    flags
}

/// Everything wrong with a configuration, as the end of a command.
pub(super) fn misconfigured(faults: &[ConfigFault]) -> Stop {
    Stop::Misconfigured(faults.iter().map(ToString::to_string).collect())
}

/// The variables that configure a daemon, by name.
#[expect(
    clippy::disallowed_methods,
    reason = "the door to the environment: settings of the daemons"
)]
fn environment(prefix: &str, faults: &mut Vec<String>) -> Vec<(String, String)> {
    ours(prefix, std::env::vars_os(), faults)
}

fn ours(
    prefix: &str,
    variables: impl Iterator<Item = (OsString, OsString)>,
    faults: &mut Vec<String>,
) -> Vec<(String, String)> {
    let mut ours = Vec::new();
    for (name, value) in variables {
        let name = name.to_string_lossy();
        if !name.starts_with(prefix) {
            continue;
        }
        match value.into_string() {
            Ok(value) => ours.push((name.into_owned(), value)),
            Err(_) => faults.push(not_text(&name)),
        }
    }
    // The environment has no order of its own; faults are told in one that stays.
    ours.sort();
    ours
}

fn not_text(variable: &dyn Display) -> String {
    format!("env {variable}: the value is not UTF-8 text")
}
