//! `skyway-loadtest line`: sessions of drones, held to the goals of docs/line.md.

pub(crate) mod client;
mod push;
mod telemetry;

use crate::rows::{Header, write_rows};
use crate::scenario::Servers;
use crate::servers::{Installed, Server};
use crate::{Result, Unsuitable, cores, until_interrupted};
use clap::Args;
use std::fs;
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
    let header = Header {
        commit: &arguments.commit,
        servers: "edge",
        is_pinned,
        is_quick: arguments.quick,
    };
    write_rows(&header, &rows)
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
