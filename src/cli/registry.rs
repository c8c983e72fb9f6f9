//! `skyway registry`: the daemon that edges follow.

use super::config_sources;
use super::edge::{admit, runtime, write_ports};
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::{EffectiveConfig, RegistryConfig};
use crate::process::registry::{RegistryService, RegistryStart};
use crate::process::supervisor::Supervisor;
use crate::process::traces::TracesConfig;
use crate::process::{logs, memory, signals};
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway registry                                          registry.db on 127.0.0.1:8180, for this machine only
  skyway registry --store /var/lib/skyway/registry.db
  skyway registry --store postgres://skyway@localhost/skyway
  skyway registry --store restored.db --new-epoch          after a backup was restored
  curl -T network.geojson -H 'content-type: application/geo+json' http://127.0.0.1:8180/v1/networks/sydney

A file is made where there is none. SIGTERM and Ctrl-C end it: it says that it is not ready, finishes what is under
way, and exits with 0.

Exit codes: 0 when it was told to end, 78 when the configuration keeps it from starting, 1 for other failures.";

/// Arguments of `skyway registry`. Every value is checked where all sources come together, so these are texts.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, next_help_heading = "Configuration")]
pub(super) struct Registry {
    /// The configuration file, TOML; `skyway config sample --registry` writes one
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where everything is kept: a file, or a PostgreSQL database [default: registry.db]
    #[arg(long, value_name = "FILE|postgres://...")]
    store: Option<String>,
    /// Begin a new epoch: the store was restored from a backup, and edges have to take the snapshot
    #[arg(long)]
    new_epoch: bool,
    /// Where edges and operators reach the registry [default: 127.0.0.1:8180]
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<String>,
    /// Where metrics and status are read [default: 127.0.0.1:9190]
    #[arg(long, value_name = "ADDRESS:PORT")]
    admin_listen: Option<String>,
    /// The file with the digests of the tokens, which only its owner may read
    #[arg(long, value_name = "FILE")]
    tokens_file: Option<String>,
    /// A file to write the ports to that were taken
    #[arg(long, value_name = "FILE")]
    ports_file: Option<String>,
    /// Which log lines: a level, and MODULE=LEVEL for a module, with commas [default: info]
    #[arg(long, value_name = "FILTER")]
    log: Option<String>,
    /// How log lines are written: text or json [default: text]
    #[arg(long, value_name = "FORMAT")]
    log_format: Option<String>,
    /// Any setting by its name, as in changes.keep=50000; may be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
}

impl Registry {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let effective = self.effective()?;
        let admission = admit(&effective, output)?;
        let RegistryConfig { log, traces, .. } = &effective.config;
        let traces = TracesConfig::of("skyway-registry", traces.endpoint.as_ref(), traces.share);
        let logs = logs::start(&log.filter, log.format, traces.as_ref()).map_err(Stop::failed)?;
        let start = RegistryStart {
            config: effective.config,
            tokens: admission.tokens,
            new_epoch: self.new_epoch,
        };
        memory::without_huge_pages();
        let served = runtime()?.block_on(serve(start, output));
        logs.end();
        served.map(|()| Verdict::Done)
    }

    fn effective(&self) -> Result<EffectiveConfig<RegistryConfig>, Stop> {
        let named = [
            ("--store", "store", &self.store),
            ("--listen", "listen", &self.listen),
            ("--admin-listen", "admin_listen", &self.admin_listen),
            ("--tokens-file", "tokens_file", &self.tokens_file),
            ("--ports-file", "ports_file", &self.ports_file),
            ("--log", "log.filter", &self.log),
            ("--log-format", "log.format", &self.log_format),
        ];
        config_sources::effective(self.config.as_deref(), &named, &self.set)
    }
}

async fn serve(start: RegistryStart, output: &Output) -> Result<(), Stop> {
    let ports_file = start.config.ports_file.clone();
    // From here on a signal ends the registry in order, also while it is starting.
    let termination = signals::termination().map_err(Stop::failed)?;
    let service = RegistryService::start(start).await.map_err(Stop::failed)?;
    let addresses = service.addresses();
    if let Some(file) = &ports_file {
        write_ports(file, addresses, output)?;
    }
    output.note(&format!(
        "registry: http://{}, admin: http://{}",
        addresses.listen, addresses.admin
    ));
    tracing::info!(listen = %addresses.listen, admin = %addresses.admin, "the registry serves");
    let supervisor = Supervisor::serving(&format!("serving on {}", addresses.listen));
    let signal = termination.await;
    supervisor.ending();
    tracing::info!(signal, "the registry is ending");
    let drained = service.stop().await.map_err(Stop::failed)?;
    tracing::info!(
        forced_connections = drained.forced,
        "the registry has ended"
    );
    Ok(())
}
