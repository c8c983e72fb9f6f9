//! `skyway demo`: an edge on this machine, and a small fleet that flies in accelerated time.

use super::clock;
use super::config_sources::misconfigured;
use super::edge::{prepare, runtime, write_ports};
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::{EffectiveConfig, Flag, Sources, resolve};
use crate::demo::{Fleet, fly};
use crate::process::listening::Addresses;
use crate::process::service::{Service, Start};
use crate::process::{logs, signals};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

const EXAMPLES: &str = "\
Examples:
  skyway demo                                        twelve drones over Sydney; look at http://127.0.0.1:8080/
  skyway demo --drones 40 --rate 10 --seed 7
  skyway demo --listen 127.0.0.1:0 --admin-listen 127.0.0.1:0 --ports-file ports.json --for 30

The same seed gives the same deliveries, failures and zones; when a drone meets them depends on the machine.
Ctrl-C ends it, with exit code 0.";

/// Arguments of `skyway demo`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Demo {
    /// How many drones
    #[arg(long, value_name = "COUNT", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=500))]
    drones: u32,
    /// What determines deliveries, failures and zones
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// How many times faster than the machine's the edge's clock runs
    #[arg(long, value_name = "FACTOR", default_value = "5")]
    rate: String,
    /// Where the edge is reached; loopback only
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8080")]
    listen: String,
    /// Where metrics and status are read; loopback only
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:9090")]
    admin_listen: String,
    /// A file to write the ports to that were taken
    #[arg(long, value_name = "FILE")]
    ports_file: Option<PathBuf>,
    /// End by itself after so many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    for_s: Option<u64>,
    /// Which log lines: a level, and MODULE=LEVEL for a module, with commas
    #[arg(long, value_name = "FILTER", default_value = "warn")]
    log: String,
}

impl Demo {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let effective = self.effective()?;
        let start = prepare(&effective, output)?;
        let log = &effective.config.log;
        logs::start(&log.filter, log.format).map_err(Stop::failed)?;
        runtime()?.block_on(self.serve(start, output))?;
        Ok(Verdict::Done)
    }

    /// The configuration of the edge: these flags and defaults, so that a demo is the same everywhere.
    fn effective(&self) -> Result<EffectiveConfig, Stop> {
        let started = clock::now().to_string();
        let said = [
            ("--listen", "listen", self.listen.as_str()),
            ("--admin-listen", "admin_listen", &self.admin_listen),
            ("--rate", "clock.rate", &self.rate),
            ("--log", "log.filter", &self.log),
            // Stated, so that the clock counts as simulated also at rate 1.
            ("the start of the demo", "clock.start", &started),
            // Every demo begins anew.
            ("the demo", "store", ""),
        ];
        let flags = said.map(|(flag, name, value)| Flag {
            flag: flag.to_owned(),
            name: name.to_owned(),
            value: value.to_owned(),
        });
        let sources = Sources {
            flags: flags.to_vec(),
            ..Sources::default()
        };
        resolve(&sources).map_err(|faults| misconfigured(&faults))
    }

    async fn serve(&self, start: Start, output: &Output) -> Result<(), Stop> {
        // From here on a signal ends the demo in order, also while it is starting.
        let termination = signals::termination().map_err(Stop::failed)?;
        let rate = start.config.clock.rate;
        let service = Service::start(start).await.map_err(Stop::failed)?;
        let addresses = service.addresses();
        if let Some(file) = &self.ports_file {
            write_ports(file, addresses, output)?;
        }
        output.note(&self.invitation(addresses, rate));
        let stop = CancellationToken::new();
        let fleet = Fleet {
            drones: self.drones,
            seed: self.seed,
        };
        let base_url = format!("http://{}", addresses.listen);
        let clock = service.edge().clock().clone();
        let mut flying = tokio::spawn({
            let stop = stop.clone();
            async move { fly(&fleet, &base_url, clock, stop).await }
        });
        let ended_early = tokio::select! {
            _signal = termination => None,
            () = self.time_is_over() => None,
            ended = &mut flying => Some(ended),
        };
        stop.cancel();
        let ended = match ended_early {
            Some(ended) => ended,
            None => flying.await,
        };
        service.stop().await.map_err(Stop::failed)?;
        ended.map_err(Stop::failed)?.map_err(Stop::failed)
    }

    async fn time_is_over(&self) {
        match self.for_s {
            Some(seconds) => tokio::time::sleep(Duration::from_secs(seconds)).await,
            None => std::future::pending().await,
        }
    }

    /// Where to look, and three commands to try.
    fn invitation(&self, addresses: Addresses, rate: f64) -> String {
        let url = format!("http://{}", addresses.listen);
        format!(
            "\
{drones} drones fly over Sydney, {rate} times as fast as in life, with seed {seed}.

  {url}/       the live picture
  {url}/docs   the API
  http://{admin}/metrics

Report a failure, without any effect on the fleet:
  curl -s {url}/v1/failures --json '{{\"service\":{{\"from\":379,\"to\":406}},\"destination\":450,\"dry_run\":true}}'

Close a circle in the middle of the city; the page can lift it again:
  curl -s {url}/v1/zones --json '{{\"type\":\"Feature\",\"geometry\":{{\"type\":\"Point\",\"coordinates\":[151.2086,-33.8660]}},\"properties\":{{\"radius_m\":120,\"reason\":\"try\"}}}}'

Watch what happens:
  curl -sN {url}/v1/events

Ctrl-C ends the demo.
",
            drones = self.drones,
            seed = self.seed,
            admin = addresses.admin,
        )
    }
}
