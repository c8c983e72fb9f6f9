//! `skyway demo`: a registry and two edges on this machine, and a small fleet that flies in accelerated time, some of it to
//! order.

mod central;
mod keys;

use super::clock;
use super::config_sources::misconfigured;
use super::edge::{admit, prepare, runtime, write_ports};
use super::network_source;
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::config::{
    Configuration, EdgeConfig, EffectiveConfig, Flag, RegistryConfig, Sources, resolve,
};
use crate::demo::{ClientError, Fleet, Trade, deal, fly};
use crate::process::service::Service;
use crate::process::{logs, signals};
use central::{Central, NETWORK};
use clap::Args;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::pin::pin;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::mpsc::{Sender, channel};
use tokio_util::sync::CancellationToken;

/// So long a drone has to send nothing before it is silent, in seconds of the machine.
const SILENT_AFTER_S: f64 = 5.0;

const EXAMPLES: &str = "\
Examples:
  skyway demo                                        drones over Sydney at http://127.0.0.1:8080/,
                                                     deliveries to order at http://127.0.0.1:8180/
  skyway demo --drones 40 --rate 10 --seed 7
  skyway demo --listen 127.0.0.1:0 --admin-listen 127.0.0.1:0 --ports-file ports.json --for 30

The same seed gives the same deliveries, failures and zones; when a drone meets them depends on the machine.
Enter takes the registry away, and brings it back. Ctrl-C ends it, with exit code 0.";

/// How many drones the provider has.
const COURIERS: usize = 4;
/// Lines that wait to be told.
const LINES: usize = 16;

/// How long an edge may take to have the network from the registry.
const READY_WITHIN: Duration = Duration::from_secs(10);

/// Arguments of `skyway demo`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Demo {
    /// How many drones, beside the four of the provider
    #[arg(long, value_name = "COUNT", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=500))]
    drones: u32,
    /// What determines deliveries, orders, failures and zones
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
    /// Where the second edge is reached [default: 127.0.0.1:8081, or a free port where the first has one]
    #[arg(long, value_name = "ADDRESS:PORT")]
    second_listen: Option<String>,
    /// Where the registry is reached [default: 127.0.0.1:8180, or a free port where the edge has one]
    #[arg(long, value_name = "ADDRESS:PORT")]
    registry_listen: Option<String>,
    /// A file to write the ports to that the first edge has taken
    #[arg(long, value_name = "FILE")]
    ports_file: Option<PathBuf>,
    /// End by itself after this many seconds
    #[arg(long = "for", value_name = "SECONDS")]
    for_s: Option<u64>,
    /// Which log lines: a level, and MODULE=LEVEL for a module, with commas
    #[arg(long, value_name = "FILTER", default_value = "warn")]
    log: String,
}

/// An edge of a demo.
#[derive(Clone, Copy, Debug)]
enum Which {
    /// The fleet flies at this one.
    First,
    Second,
}

/// The registry and the edges of a demo.
struct World {
    central: Central,
    first: Service,
    second: Service,
}

impl Demo {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let folder = tempfile::tempdir().map_err(Stop::failed)?;
        let started = clock::now().to_string();
        let registry = self.registry(&started, folder.path())?;
        // What is wrong with the edges is found before anything is started, and what is to be told of them told once.
        let address = registry.config.listen;
        let edge = self.edge(Which::First, &started, folder.path(), address, &self.listen)?;
        admit(&edge, output)?;
        let log = &registry.config.log;
        let logs = logs::start(&log.filter, log.format, None).map_err(Stop::failed)?;
        let served =
            runtime()?.block_on(self.serve(registry.config, &started, folder.path(), output));
        logs.end();
        served.map(|()| Verdict::Done)
    }

    fn registry(
        &self,
        started: &str,
        folder: &Path,
    ) -> Result<EffectiveConfig<RegistryConfig>, Stop> {
        let listen = self.beside(self.registry_listen.as_deref(), "127.0.0.1:8180");
        let store = folder.join("registry.db").display().to_string();
        self.resolved(
            started,
            &[
                ("--registry-listen", "listen", &listen),
                ("the demo", "admin_listen", "127.0.0.1:0"),
                ("the demo", "store", &store),
                ("the demo", "deliveries.webhooks_anywhere", "true"),
            ],
        )
    }

    /// The configuration of an edge that follows the registry: these flags and defaults, so that a demo is the same
    /// everywhere.
    fn edge(
        &self,
        which: Which,
        started: &str,
        folder: &Path,
        registry: SocketAddr,
        listen: &str,
    ) -> Result<EffectiveConfig<EdgeConfig>, Stop> {
        let (flag, admin, store) = match which {
            Which::First => ("--listen", self.admin_listen.as_str(), "first.db"),
            Which::Second => ("--second-listen", "127.0.0.1:0", "second.db"),
        };
        // Deliveries are ordered at the first: the provider's drones fly there.
        let advertised = match which {
            Which::First => format!("http://{listen}"),
            Which::Second => String::new(),
        };
        let store = folder.join(store).display().to_string();
        let url = format!("http://{registry}");
        self.resolved(
            started,
            &[
                (flag, "listen", listen),
                ("--admin-listen", "admin_listen", admin),
                ("the demo", "store", &store),
                ("the demo", "registry.url", &url),
                ("the demo", "registry.network", NETWORK),
                ("the demo", "registry.advertise", &advertised),
                ("the demo", "drones.silent_after", &self.silent_after()),
            ],
        )
    }

    /// When a drone counts as silent: not before it has missed many positions, which come by the machine's clock.
    fn silent_after(&self) -> String {
        let rate: f64 = self.rate.parse().unwrap_or(1.0);
        let missed_s = SILENT_AFTER_S * rate;
        format!("{}s", missed_s.clamp(15.0, 3600.0).ceil())
    }

    fn resolved<C: Configuration>(
        &self,
        started: &str,
        own: &[(&str, &str, &str)],
    ) -> Result<EffectiveConfig<C>, Stop> {
        let shared = [
            ("--rate", "clock.rate", self.rate.as_str()),
            ("--log", "log.filter", self.log.as_str()),
            // Stated, so that the clock counts as simulated also at rate 1.
            ("the start of the demo", "clock.start", started),
        ];
        let flags = shared.iter().chain(own).map(|(flag, name, value)| Flag {
            flag: (*flag).to_owned(),
            name: (*name).to_owned(),
            value: (*value).to_owned(),
        });
        let sources = Sources {
            flags: flags.collect(),
            ..Sources::default()
        };
        resolve(&sources).map_err(|faults| misconfigured(&faults))
    }

    /// An address that was given; else the usual one, or any where the edge has any.
    fn beside(&self, given: Option<&str>, usual: &str) -> String {
        let has_any_port = self.listen.ends_with(":0");
        match given {
            Some(given) => given.to_owned(),
            None if has_any_port => "127.0.0.1:0".to_owned(),
            None => usual.to_owned(),
        }
    }

    async fn world(
        &self,
        registry: RegistryConfig,
        started: &str,
        folder: &Path,
        output: &Output,
    ) -> Result<World, Stop> {
        let (_, geojson) = network_source::load_with_text(NETWORK, output)?;
        let central = Central::start(registry, &geojson).await?;
        let start = async |which, listen: &str| {
            let effective = self.edge(which, started, folder, central.address(), listen)?;
            let admission = effective.admit().map_err(|faults| misconfigured(&faults))?;
            let start = prepare(&effective, admission, output)?;
            Service::start(start).await.map_err(Stop::failed)
        };
        let second_listen = self.beside(self.second_listen.as_deref(), "127.0.0.1:8081");
        let first = start(Which::First, &with_a_port(&self.listen).await?).await?;
        let second = start(Which::Second, &second_listen).await?;
        for service in [&first, &second] {
            let ready = tokio::time::timeout(READY_WITHIN, service.edge().ready());
            ready.await.map_err(|_| {
                Stop::failed(format!(
                    "an edge had no network from the registry at {} within {READY_WITHIN:?}",
                    central.address()
                ))
            })?;
        }
        Ok(World {
            central,
            first,
            second,
        })
    }

    async fn serve(
        &self,
        registry: RegistryConfig,
        started: &str,
        folder: &Path,
        output: &Output,
    ) -> Result<(), Stop> {
        // From here on a signal ends the demo in order, also while it is starting.
        let mut termination = pin!(signals::termination().map_err(Stop::failed)?);
        let rate = registry.clock.rate;
        let mut world = self.world(registry, started, folder, output).await?;
        let addresses = world.first.addresses();
        if let Some(file) = &self.ports_file {
            write_ports(file, addresses, output)?;
        }
        output.note(&self.invitation(&world, rate));
        let stop = CancellationToken::new();
        let clock = world.first.edge().clock().clone();
        let (tells, mut told) = channel(LINES);
        let crew = self.crew(&world, tells, stop.clone());
        let mut crew = tokio::spawn(crew);
        let mut lines = keys::lines()?;
        let mut over = pin!(self.time_is_over());
        let ended_early = loop {
            tokio::select! {
                _signal = &mut termination => break None,
                () = &mut over => break None,
                ended = &mut crew => break Some(ended),
                Some(line) = told.recv() => output.note(&line),
                Some(()) = lines.recv() => {
                    tell_toggled(world.central.toggle(clock.now()).await?, output);
                }
            }
        };
        stop.cancel();
        let ended = match ended_early {
            Some(ended) => ended,
            None => crew.await,
        };
        world.first.stop().await.map_err(Stop::failed)?;
        world.second.stop().await.map_err(Stop::failed)?;
        world.central.end().await?;
        ended.map_err(Stop::failed)?.map_err(Stop::failed)
    }

    /// Everyone who flies, operates or deals, until they are told to stop.
    fn crew(
        &self,
        world: &World,
        tells: Sender<String>,
        stop: CancellationToken,
    ) -> impl Future<Output = Result<(), ClientError>> + use<> {
        let registry = (
            format!("http://{}", world.central.address()),
            NETWORK.to_owned(),
        );
        let fleet = Fleet {
            drones: self.drones,
            seed: self.seed,
            registry: registry.clone(),
        };
        let trade = Trade {
            drones: COURIERS,
            seed: self.seed,
            registry,
        };
        let url = format!("http://{}", world.first.addresses().listen);
        let clock = world.first.edge().clock().clone();
        async move {
            let flying = fly(&fleet, &url, clock.clone(), stop.clone());
            let dealing = deal(&trade, &url, clock, tells, stop);
            tokio::try_join!(flying, dealing).map(|_| ())
        }
    }

    async fn time_is_over(&self) {
        match self.for_s {
            Some(seconds) => tokio::time::sleep(Duration::from_secs(seconds)).await,
            None => std::future::pending().await,
        }
    }

    /// Where to look, and three commands to try.
    fn invitation(&self, world: &World, rate: f64) -> String {
        let addresses = world.first.addresses();
        let url = format!("http://{}", addresses.listen);
        format!(
            "\
{drones} drones fly over Sydney, {rate} times as fast as in life, with seed {seed}; {COURIERS} more wait for orders.

  {url}/       the live picture of an edge
  http://{central}/       the shop window of the registry: order a delivery, and follow it
  {url}/docs   the API of the edge; http://{central}/docs has the registry's
  http://{admin}/metrics
  http://{second}/       another edge over the same city; both follow the registry

Report a failure, without any effect on the fleet:
  curl -s {url}/v1/failures --json '{{\"service\":{{\"from\":\"379\",\"to\":\"406\"}},\"destination\":\"450\",\"dry_run\":true}}'

Close a circle in the middle of the city; it closes at the other edge too, and the page can lift it again:
  curl -s {url}/v1/zones --json '{{\"type\":\"Feature\",\"geometry\":{{\"type\":\"Point\",\"coordinates\":[151.2086,-33.8660]}},\"properties\":{{\"radius_m\":120,\"reason\":\"try\"}}}}'

Watch what happens:
  curl -sN {url}/v1/events

Enter takes the registry away: drones are answered as before, and answers say how old what they know is
(registry_age_s, freshness). Enter again brings it back. Ctrl-C ends the demo.
",
            drones = self.drones,
            seed = self.seed,
            admin = addresses.admin,
            second = world.second.addresses().listen,
            central = world.central.address(),
        )
    }
}

/// An address with the port that it will have: a free one instead of 0, as others are told it beforehand.
async fn with_a_port(listen: &str) -> Result<String, Stop> {
    if !listen.ends_with(":0") {
        return Ok(listen.to_owned());
    }
    let bound = TcpListener::bind(listen).await.map_err(Stop::failed)?;
    let address = bound.local_addr().map_err(Stop::failed)?;
    Ok(address.to_string())
}

fn tell_toggled(is_running: bool, output: &Output) {
    output.note(match is_running {
        true => "the registry is back",
        false => "the registry is gone; Enter brings it back",
    });
}
