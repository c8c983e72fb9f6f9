//! `skyway-loadtest line`: sessions of drones, held to the goals of docs/line.md.

mod client;
mod push;
mod telemetry;

use crate::run::eprintln_line;
use crate::scenario::Servers;
use crate::servers::{Installed, Server};
use crate::{MISSED, Result, Unsuitable, cores, machine, until_interrupted};
use clap::Args;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// As many sessions as there are goals for, and those of a quick run.
const SESSIONS: usize = 10_000;
const QUICK_SESSIONS: usize = 200;
/// How long telemetry is sent, in seconds.
const TELEMETRY_S: u32 = 20;
const QUICK_TELEMETRY_S: u32 = 2;

#[derive(Debug, Args)]
pub(crate) struct LineArguments {
    /// The skyway binary to measure; figures want one of the profile `dist`
    #[arg(long, value_name = "FILE")]
    server: PathBuf,
    /// A few sessions for a moment: whether it works. Goals are told and not enforced
    #[arg(long)]
    quick: bool,
    /// What the table says was measured
    #[arg(long, value_name = "TEXT", default_value = "unknown")]
    commit: String,
}

/// How much is measured.
#[derive(Clone, Copy)]
struct Size {
    sessions: usize,
    telemetry_s: u32,
}

/// A figure, and what it is held to.
struct Row {
    what: String,
    found: String,
    goal: String,
    is_met: bool,
}

impl Row {
    /// A figure that may be at most so large.
    fn at_most(what: impl Into<String>, (found, most): (f64, f64), unit: &str) -> Self {
        Self {
            what: what.into(),
            found: format!("{found:.1} {unit}"),
            goal: format!("at most {most} {unit}"),
            is_met: found <= most,
        }
    }

    fn at_least(what: impl Into<String>, (found, least): (f64, f64), unit: &str) -> Self {
        Self {
            what: what.into(),
            found: format!("{found:.1} {unit}"),
            goal: format!("at least {least} {unit}"),
            is_met: found >= least,
        }
    }
}

/// An edge with tokens, which ends when this is dropped.
struct Served {
    server: Server,
    token: String,
    _folder: tempfile::TempDir,
}

pub(crate) fn run_line(arguments: &LineArguments) -> Result<ExitCode> {
    if !arguments.server.is_file() {
        let what = format!("{}: no such program", arguments.server.display());
        return Err(Unsuitable(what).into());
    }
    let is_pinned = cores::take_second();
    until_interrupted(measure(arguments, is_pinned))
}

async fn measure(arguments: &LineArguments, is_pinned: bool) -> Result<ExitCode> {
    let size = match arguments.quick {
        true => Size {
            sessions: QUICK_SESSIONS,
            telemetry_s: QUICK_TELEMETRY_S,
        },
        false => Size {
            sessions: SESSIONS,
            telemetry_s: TELEMETRY_S,
        },
    };
    let mut rows = telemetry::measure(arguments, size).await?;
    rows.extend(push::measure(arguments, size).await?);
    let apart = if is_pinned {
        "cores of their own"
    } else {
        "all cores"
    };
    let quick = if arguments.quick {
        ". A quick run: its figures say nothing"
    } else {
        ""
    };
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "Commit `{}`, {}, edge and load on {apart}{quick}.\n\n| | found | goal | |\n|---|---:|---:|---|",
        arguments.commit,
        machine()
    )?;
    for Row {
        what,
        found,
        goal,
        is_met,
    } in &rows
    {
        let verdict = if *is_met { "met" } else { "missed" };
        writeln!(stdout, "| {what} | {found} | {goal} | {verdict} |")?;
    }
    let missed = rows.iter().filter(|row| !row.is_met).count();
    let is_held = !arguments.quick && missed > 0;
    if is_held {
        eprintln_line(&format!("{missed} goals are missed"));
    }
    Ok(ExitCode::from(if is_held { MISSED } else { 0 }))
}

/// An edge over Sydney with a token that may do everything, and room for as many sessions.
async fn served(arguments: &LineArguments, airframe: &str) -> Result<Served> {
    let folder = tempfile::tempdir()?;
    let made = Command::new(&arguments.server)
        .args(["token", "--role", "operator", "--subject", "*"])
        .output()?;
    let tokens = folder.path().join("tokens.toml");
    fs::write(&tokens, &made.stderr)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(&tokens, fs::Permissions::from_mode(0o600))?;
    }
    let installed = Installed {
        program: arguments.server.clone(),
        folder: folder.path().to_owned(),
    };
    let servers = Servers {
        settings: vec![
            format!("tokens_file={}", tokens.display()),
            format!("flight.airframe={airframe}"),
            "limits.connections=20000".to_owned(),
            "limits.connections_per_address=20000".to_owned(),
            "limits.connections_per_subject=20000".to_owned(),
            "limits.sessions=20000".to_owned(),
        ],
        ..Servers::default()
    };
    Ok(Served {
        server: installed.edge(&servers, None).await?,
        token: String::from_utf8(made.stdout)?.trim().to_owned(),
        _folder: folder,
    })
}

impl Served {
    async fn connect(&self) -> Result<client::Connection> {
        client::Connection::open(self.server.address, &self.token).await
    }

    /// Memory that the edge holds, in KiB.
    fn resident_kib(&self) -> Result<f64> {
        let status = fs::read_to_string(format!("/proc/{}/status", self.server.pid()))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
        kib.ok_or_else(|| "the memory of the edge cannot be read".into())
    }

    /// How long it has had a core, in seconds.
    fn worked_s(&self) -> Result<f64> {
        Ok(cores::processor_time(&self.server.pid().to_string())?.as_secs_f64())
    }
}
