//! `skyway edge`: the daemon that answers drones and operators.

use super::config_sources::misconfigured;
use super::edge_flags::EdgeFlags;
use super::files;
use super::network_source;
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::{Admission, Configuration, EdgeConfig, EffectiveConfig, Origin};
use crate::network::Topology;
use crate::process::listening::Addresses;
use crate::process::service::{Service, Start};
use crate::process::supervisor::Supervisor;
use crate::process::traces::TracesConfig;
use crate::process::{logs, memory, signals};
use bytes::Bytes;
use clap::Args;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  skyway edge                                       Sydney on 127.0.0.1:8080, for this machine only
  skyway edge --store /var/lib/skyway/edge.db
  skyway edge --no-store --network corridor --listen 127.0.0.1:0 --ports-file ports.json
  skyway edge --config edge.toml                    see skyway config sample
  skyway edge --clock-start 2026-11-21T06:00:00Z --clock-rate 60

What the edge knows it keeps in a file, which is made where there is none: started again it goes on where it ended.
The same port serves REST and gRPC. SIGTERM and Ctrl-C end it: it says that it is not ready, finishes what is
under way, and exits with 0.

Exit codes: 0 when it was told to end, 78 when the configuration keeps it from starting, 1 for other failures.";

/// Arguments of `skyway edge`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Edge {
    #[command(flatten)]
    flags: EdgeFlags,
}

impl Edge {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let effective = self.flags.effective()?;
        let admission = admit(&effective, output)?;
        let start = prepare(&effective, admission, output)?;
        let EdgeConfig { log, traces, .. } = &effective.config;
        let traces = TracesConfig::of("skyway-edge", traces.endpoint.as_ref(), traces.share);
        let logs = logs::start(&log.filter, log.format, traces.as_ref()).map_err(Stop::failed)?;
        memory::without_huge_pages();
        let served = runtime()?.block_on(serve(start, output));
        logs.end();
        served.map(|()| Verdict::Done)
    }
}

/// The runtime of a daemon: as many threads as the machine has cores.
pub(super) fn runtime() -> Result<tokio::runtime::Runtime, Stop> {
    let mut builder = tokio::runtime::Builder::new_multi_thread();
    let runtime = builder.enable_all().thread_name("skyway").build();
    runtime.map_err(|error| Stop::failed(format!("cannot start the runtime: {error}")))
}

/// Checks that a daemon may start, and tells what people should know of it.
pub(super) fn admit<C: Configuration>(
    effective: &EffectiveConfig<C>,
    output: &Output,
) -> Result<Admission, Stop> {
    let admission = effective.admit().map_err(|faults| misconfigured(&faults))?;
    for warning in &admission.warnings {
        output.warn(&warning.to_string());
    }
    Ok(admission)
}

/// Loads the network of an edge that may start.
pub(super) fn prepare(
    effective: &EffectiveConfig<EdgeConfig>,
    admission: Admission,
    output: &Output,
) -> Result<Start, Stop> {
    let name = &effective.config.network;
    // An edge that follows a registry has the network from there, and is not ready without it.
    let is_awaited =
        effective.config.registry.url.is_some() && effective.origin("network") == Origin::Default;
    let (loaded, text) = match is_awaited {
        true => (Topology::nothing(), String::new()),
        false => network_source::load_with_text(name, output)?,
    };
    Ok(Start {
        config: effective.config.clone(),
        tokens: admission.tokens,
        topology: Arc::new(loaded),
        geojson: Bytes::from(text),
    })
}

async fn serve(start: Start, output: &Output) -> Result<(), Stop> {
    let ports_file = start.config.ports_file.clone();
    // From here on a signal ends the edge in order, also while it is starting.
    let termination = signals::termination().map_err(Stop::failed)?;
    let service = Service::start(start).await.map_err(Stop::failed)?;
    let addresses = service.addresses();
    if let Some(file) = &ports_file {
        write_ports(file, addresses, output)?;
    }
    output.note(&format!(
        "edge: http://{}, admin: http://{}",
        addresses.listen, addresses.admin
    ));
    tracing::info!(listen = %addresses.listen, admin = %addresses.admin, "the edge serves");
    let supervisor = Supervisor::serving(&format!("serving on {}", addresses.listen));
    let signal = termination.await;
    supervisor.ending();
    tracing::info!(signal, "the edge is ending");
    let drained = service.stop().await.map_err(Stop::failed)?;
    tracing::info!(forced_connections = drained.forced, "the edge has ended");
    Ok(())
}

/// Writes where the edge listens, for those who let it choose its ports.
pub(super) fn write_ports(file: &Path, addresses: Addresses, output: &Output) -> Result<(), Stop> {
    let ports = json!({
        "listen": addresses.listen.port(),
        "admin_listen": addresses.admin.port(),
    });
    files::write_text(file, &format!("{ports}\n"), output)
}
