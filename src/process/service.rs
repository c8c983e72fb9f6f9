//! A running edge: its state, its two listeners, and how it ends.
//!
//! Everything is bound before anything is served, so that a port that is taken stops the start. The main
//! listener serves drones and operators, REST and gRPC alike; the admin listener metrics and status.

use super::listening::{Addresses, ServiceError, bind, request_metrics};
use super::live_keys::LiveKeys;
use super::live_tokens::authentication;
use super::planted::plant_bug;
use super::store_lock::StoreLock;
use super::store_thread::StoreThread;
use crate::api::grpc::{self, Health};
use crate::api::metrics::RequestMetrics;
use crate::api::operations::{Daemon, Listener};
use crate::api::page;
use crate::api::rest;
use crate::api::server::{
    Authentication, Drain, Drained, GateConfig, QueueWait, ServerConfig, Services, Slots, serve,
};
use crate::clock::Clock;
use crate::config::{
    AirframeError, ClockMover, Configuration, EdgeConfig, Tokens, read_airframe, read_authorities,
    read_bearer,
};
use crate::edge::sync::{Following, HttpAddress, HttpClient, SyncSettings};
use crate::edge::{Edge, FEED_BYTES_MAX, FlightSettings, OpenError, Opening, Settings, SqliteFile};
use crate::flight::{Airframe, FlightRules, Tariff, Wind, keeps_clear_of_crossings};
use crate::itinerary::{Limits, Yardstick};
use crate::network::Topology;
use bytes::Bytes;
use prometheus_client::registry::Registry;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinHandle;
use tokio_util::task::AbortOnDropHandle;

/// When to probe again where the system had no sockets for it.
const PROBE_AGAIN: Duration = Duration::from_secs(1);

/// What an edge is started with.
#[derive(Debug)]
pub struct Start {
    /// The configuration.
    pub config: EdgeConfig,
    /// Who may call; none where everyone on loopback may.
    pub tokens: Option<Tokens>,
    /// The network.
    pub topology: Arc<Topology>,
    /// The text it was read from.
    pub geojson: Bytes,
}

/// An edge that is served.
#[derive(Debug)]
pub struct Service {
    edge: Arc<Edge>,
    addresses: Addresses,
    drain: Drain,
    following: Option<Following>,
    _lock: Option<StoreLock>,
    _store_thread: Option<StoreThread>,
    _probing: AbortOnDropHandle<()>,
    main: JoinHandle<io::Result<Drained>>,
    admin: JoinHandle<io::Result<Drained>>,
}

impl Service {
    /// Binds both listeners, starts the edge, and serves it.
    ///
    /// # Errors
    /// When an address is taken, or the system refuses what the edge needs.
    pub async fn start(start: Start) -> Result<Self, ServiceError> {
        let Start {
            config,
            tokens,
            topology,
            geojson,
        } = start;
        plant_bug()?;
        let main = bind(config.listen, "listen").await?;
        let admin = bind(config.admin_listen, "admin-listen").await?;
        let addresses = Addresses {
            listen: main.local_addr()?,
            admin: admin.local_addr()?,
        };
        let clock = config.exposure().start_clock();
        let settings = Settings::of(&config, flight(&config)?);
        let opening = Opening::new(topology, geojson, epoch(), settings, clock);
        let lock = config.store.as_deref().map(StoreLock::take);
        let lock = lock.transpose().map_err(OpenError::from)?;
        let keys = LiveKeys::open(&config)?;
        let opening = opening.fresh_id(random_id()?).signing_with(keys.first());
        let (edge, store_thread) = open(opening, config.store.as_deref()).await?;
        keys.follow(&edge);
        let queue_wait = Arc::new(QueueWait::new(config.limits.queue_wait));
        let (registry, metrics) = own_metrics(&edge, &config, &queue_wait);
        let following = follow(&edge, &config)?;
        let drain = Drain::new();
        let authentication = authentication(tokens, config.tokens_file.as_deref());
        let health = Health::starting().await;
        let limits = grpc::Limits {
            message_bytes_max: config.limits.body.bytes(),
        };
        let (rest, _) = rest::router(edge.clone(), drain.clone());
        let services = Services::from(rest.merge(page::edge::router()))
            .with_rest(rest::handlers(edge.clone(), drain.clone()))
            .with_grpc(grpc::handlers(&edge, limits, &health)?);
        let admin_router = rest::admin_router(edge.clone(), Arc::new(registry), drain.clone());
        let gate = |listener| gate(&config, listener, authentication.clone(), &queue_wait);
        let server = server(&config);
        let main = serve(
            main,
            services,
            gate(Listener::Main),
            server.clone(),
            metrics.clone(),
            drain.clone(),
        );
        let admin = serve(
            admin,
            admin_router,
            gate(Listener::Admin),
            server,
            metrics,
            drain.clone(),
        );
        let main = tokio::spawn(main);
        health.set_ready(edge.is_ready()).await;
        tokio::spawn(health.follow(edge.clone(), drain.clone()));
        Ok(Self {
            edge,
            addresses,
            drain,
            following,
            _lock: lock,
            _store_thread: store_thread,
            _probing: AbortOnDropHandle::new(tokio::spawn(probe(queue_wait))),
            main,
            admin: tokio::spawn(admin),
        })
    }

    /// Where it listens.
    pub fn addresses(&self) -> Addresses {
        self.addresses
    }

    /// The edge behind it.
    pub fn edge(&self) -> &Arc<Edge> {
        &self.edge
    }

    /// Ends it: it says that it is not ready, finishes what is under way within bounds, and closes.
    ///
    /// # Errors
    /// When a listener failed before.
    pub async fn stop(self) -> Result<Drained, ServiceError> {
        self.drain.begin();
        let drained = self.main.await??;
        let admin = self.admin.await??;
        if let Some(following) = self.following {
            following.stop().await;
        }
        self.edge.end().await;
        Ok(Drained {
            forced: drained.forced + admin.forced,
        })
    }
}

/// Every start has a later epoch, also under a simulated clock.
fn epoch() -> u64 {
    let epoch = crate::clock::Clock::real().now().as_millisecond();
    u64::try_from(epoch).unwrap_or_default()
}

async fn probe(queue_wait: Arc<QueueWait>) {
    while let Err(error) = queue_wait.probe().await {
        tracing::warn!(%error, "how long requests wait is not known, and none is shed for that");
        tokio::time::sleep(PROBE_AGAIN).await;
    }
}

/// What an edge counts of itself, and of its requests.
fn own_metrics(
    edge: &Arc<Edge>,
    config: &EdgeConfig,
    queue_wait: &QueueWait,
) -> (Registry, Arc<RequestMetrics>) {
    let mut registry = Registry::with_prefix("skyway");
    let collector = config.traces.endpoint.as_ref();
    let metrics = request_metrics(&mut registry, Daemon::Edge, collector);
    edge.register_metrics(&mut registry);
    queue_wait.register(&mut registry);
    (registry, metrics)
}

/// Follows the registry that is configured, if any is.
fn follow(edge: &Arc<Edge>, config: &EdgeConfig) -> Result<Option<Following>, ServiceError> {
    let registry = &config.registry;
    let Some(url) = registry.url.clone() else {
        return Ok(None);
    };
    let edge_id = registry.edge_id.clone();
    let edge_id = edge_id.unwrap_or_else(|| format!("edge-{}", edge.id()));
    let token = registry.token_file.as_deref().map(read_bearer);
    let authorities = registry.ca_file.as_deref().map(read_authorities);
    let authorities = authorities.transpose().map_err(io::Error::other)?;
    let client = HttpClient::new(&HttpAddress {
        url,
        network: registry.network.clone(),
        edge_id: edge_id.clone(),
        token: token.transpose().map_err(io::Error::other)?,
        authorities: authorities.unwrap_or_default(),
    });
    let settings = SyncSettings {
        network: registry.network.clone(),
        edge_id,
        advertise: registry.advertise.clone(),
        poll_wait: registry.poll_wait,
        retry_within: registry.retry_within,
        seed: getrandom::u64().map_err(io::Error::other)?,
    };
    let client = client.map_err(io::Error::other)?;
    Ok(Some(edge.follow_registry(client, settings)))
}

/// Opens an edge over its file, which has a thread of its own; without one it forgets everything when it ends.
async fn open(
    opening: Opening,
    store: Option<&Path>,
) -> Result<(Arc<Edge>, Option<StoreThread>), ServiceError> {
    let Some(path) = store.map(Path::to_owned) else {
        return Ok((opening.without_store()?, None));
    };
    let thread = StoreThread::start()?;
    let opened = thread
        .handle()
        .spawn(async move { SqliteFile::open(&path).await });
    let file = opened.await?.map_err(OpenError::from)?;
    let opening = opening.storing_on(thread.handle().clone());
    Ok((Edge::open(opening, Box::new(file)).await?, Some(thread)))
}

/// 128 random bits in hexadecimal.
fn random_id() -> Result<String, ServiceError> {
    let mut random = [0_u8; 16];
    getrandom::fill(&mut random).map_err(io::Error::other)?;
    Ok(hex::encode(random))
}

fn gate(
    config: &EdgeConfig,
    listener: Listener,
    authentication: Authentication,
    queue_wait: &Arc<QueueWait>,
) -> GateConfig {
    let limits = &config.limits;
    let slots = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    GateConfig {
        daemon: Daemon::Edge,
        listener,
        authentication,
        slots: Slots {
            failures: slots(limits.in_flight_failures),
            zone_writes: slots(limits.in_flight_zone_writes),
            reads: slots(limits.in_flight_reads),
            other: slots(limits.in_flight_other),
            // No client follows an edge by asking again and again: it has streams of events.
            follows: 0,
            streams: slots(limits.event_streams),
            sessions: slots(limits.sessions),
            watches: slots(limits.health_streams),
        },
        queue_wait: Arc::clone(queue_wait),
        body_bytes_max: limits.body.bytes(),
        file_bytes_max: limits.body.bytes().max(FEED_BYTES_MAX),
        deadline: limits.request_deadline,
        follow_wait: Duration::ZERO,
    }
}

fn server(config: &EdgeConfig) -> ServerConfig {
    let limits = &config.limits;
    ServerConfig {
        connections_max: limits.connections,
        connections_per_address: limits.connections_per_address,
        connections_per_subject: limits.connections_per_subject,
        connections_for_probes: limits.connections_for_probes,
        streams_per_connection: u32::try_from(limits.streams_per_connection).unwrap_or(u32::MAX),
        header_bytes_max: u32::try_from(limits.header.bytes()).unwrap_or(u32::MAX),
        preface_deadline: limits.preface_deadline,
        header_deadline: limits.header_deadline,
        drain_delay: config.drain.delay,
        drain_timeout: config.drain.timeout,
        ..ServerConfig::default()
    }
}

/// What flies, out of the configuration; none where the flight model is off.
fn flight(config: &EdgeConfig) -> Result<Option<FlightSettings>, AirframeError> {
    let (clock, crossing_m) = (config.clock.kind, config.plans.crossing_m);
    let config = &config.flight;
    let Some(name) = config.default_airframe() else {
        return Ok(None);
    };
    let further = config.airframes.iter().map(read_airframe);
    let further: Vec<Arc<Airframe>> = further
        .map(|read| read.map(Arc::new))
        .collect::<Result<_, AirframeError>>()?;
    let airframe = Arc::new(read_airframe(name)?);
    let mut all = std::iter::once(&airframe).chain(&further);
    let slow = all.find(|airframe| crossing_m > 0.0 && !keeps_clear_of_crossings(airframe));
    if let Some(slow) = slow {
        let name = slow.name.clone();
        return Err(AirframeError::ClimbsTooSlowly { name });
    }
    Ok(Some(FlightSettings {
        airframe,
        airframes: further,
        rules: FlightRules {
            reserve: config.reserve_fraction,
            floor: config.floor_fraction,
            stop_s: config.stop.as_secs_f64(),
            swap_s: config.swap.as_secs_f64(),
            time_margin_s: config.time_margin.as_secs_f64(),
            time_margin_growth: config.time_margin_growth,
            unknown_climb_m: config.unknown_climb_m,
            ..FlightRules::default()
        },
        tariff: Tariff {
            price_usd: config.price_usd_per_kg_km,
            payload_kg: 1.0,
            distance_m: 1_000.0,
        },
        objective: config.objective,
        refuge_stay_s: config.refuge_stay.as_secs_f64(),
        swap_stations: config.swap_stations.iter().map(str::to_owned).collect(),
        base_wind: Wind::coming_from(config.wind_from_deg, config.wind_speed_mps),
        late_tolerance_s: config.late_tolerance.as_secs_f64(),
        battery_tolerance: config.battery_tolerance_fraction,
        // A run that a client steps is the same on every machine.
        checks_per_s: match clock {
            ClockMover::Machine => checks_per_s(),
            ClockMover::External => Limits::CHECKS_PER_S,
        },
    }))
}

/// How many checks a search does in a second on this machine, within a tenth and ten times of what is usual: one that is busy
/// at this moment must not be bound by that for good.
fn checks_per_s() -> f64 {
    let usual = Limits::CHECKS_PER_S;
    let Ok(yardstick) = Yardstick::new() else {
        return usual;
    };
    // The first one touches its memory.
    yardstick.run();
    let watch = Clock::real().stopwatch();
    let checks = yardstick.run();
    let measured = checks as f64 / watch.elapsed().as_secs_f64().max(f64::MIN_POSITIVE);
    measured.clamp(0.1 * usual, 10.0 * usual)
}
