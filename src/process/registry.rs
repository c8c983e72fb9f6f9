//! A running registry: its store, its two listeners, and how it ends.

use super::listening::{Addresses, ServiceError, bind, request_metrics};
use super::live_tokens::authentication;
use super::planted::plant_bug;
use crate::api::operations::{Daemon, Listener};
use crate::api::page;
use crate::api::registry as rest;
use crate::api::server::{
    Authentication, Drain, Drained, GateConfig, QueueWait, ServerConfig, Slots, serve,
};
use crate::config::{Configuration, RegistryConfig, Tokens, read_bearer};
use crate::dispatch::{self, Dispatch};
use crate::registry::{HighWater, OpenError, Opening, Registry, Settings, is_database, open_store};
use prometheus_client::registry::Registry as Metrics;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

/// What a registry is started with.
#[derive(Debug)]
pub struct RegistryStart {
    /// The configuration.
    pub config: RegistryConfig,
    /// Who may call; none where everyone on loopback may.
    pub tokens: Option<Tokens>,
    /// Whether the store was restored from a backup, as someone says who knows.
    pub new_epoch: bool,
}

/// A registry that is served.
#[derive(Debug)]
pub struct RegistryService {
    registry: Arc<Registry>,
    addresses: Addresses,
    drain: Drain,
    upkeep: CancellationToken,
    running: JoinHandle<()>,
    main: JoinHandle<io::Result<Drained>>,
    admin: JoinHandle<io::Result<Drained>>,
}

impl RegistryService {
    /// Binds both listeners, opens the store, and serves it.
    ///
    /// # Errors
    /// When an address is taken, the store cannot be opened, or the system refuses what the registry needs.
    pub async fn start(start: RegistryStart) -> Result<Self, ServiceError> {
        let RegistryStart {
            config,
            tokens,
            new_epoch,
        } = start;
        plant_bug()?;
        let main = bind(config.listen, "listen").await?;
        let admin = bind(config.admin_listen, "admin-listen").await?;
        let addresses = Addresses {
            listen: main.local_addr()?,
            admin: admin.local_addr()?,
        };
        let store = open_store(&config.store).await.map_err(OpenError::from)?;
        let registry = Registry::open(Opening {
            store,
            settings: Settings::of(&config),
            clock: config.exposure().start_clock(),
            high_water: high_water(&config),
            new_epoch,
        });
        let registry = registry.await?;
        let dispatch = dispatch(&registry, &config)?;
        let mut metrics = Metrics::with_prefix("skyway_registry");
        let collector = config.traces.endpoint.as_ref();
        let request_metrics = request_metrics(&mut metrics, Daemon::Registry, collector);
        registry.register_metrics(&mut metrics);
        let drain = Drain::new();
        let (router, _) = rest::router(dispatch.clone(), drain.clone());
        let admin_router = rest::admin_router(dispatch.clone(), Arc::new(metrics), drain.clone());
        let authentication = authentication(tokens, config.tokens_file.as_deref());
        let gate = |listener| gate(&config, listener, authentication.clone());
        let server = server(&config);
        let main = serve(
            main,
            router.merge(page::shop::router()),
            gate(Listener::Main),
            server.clone(),
            request_metrics.clone(),
            drain.clone(),
        );
        let admin = serve(
            admin,
            admin_router,
            gate(Listener::Admin),
            server,
            request_metrics,
            drain.clone(),
        );
        let upkeep = CancellationToken::new();
        Ok(Self {
            running: tokio::spawn(run(dispatch, registry.clone(), upkeep.clone())),
            registry,
            addresses,
            drain,
            upkeep,
            main: tokio::spawn(main),
            admin: tokio::spawn(admin),
        })
    }

    /// Where it listens.
    pub fn addresses(&self) -> Addresses {
        self.addresses
    }

    /// The registry behind it.
    pub fn registry(&self) -> &Arc<Registry> {
        &self.registry
    }

    /// Ends it: it says that it is not ready, ends the waiting, finishes what is under way within bounds, and
    /// closes the store.
    ///
    /// # Errors
    /// When a listener failed before.
    pub async fn stop(self) -> Result<Drained, ServiceError> {
        self.drain.begin();
        let drained = self.main.await??;
        let admin = self.admin.await??;
        self.upkeep.cancel();
        self.running.await?;
        Ok(Drained {
            forced: drained.forced + admin.forced,
        })
    }
}

/// Does the upkeep of both; what dispatches ends before the store is closed.
async fn run(dispatch: Arc<Dispatch>, registry: Arc<Registry>, stop: CancellationToken) {
    let stop_registry = CancellationToken::new();
    let registry = registry.run(stop_registry.clone());
    let dispatch = async {
        dispatch.run(stop).await;
        stop_registry.cancel();
    };
    tokio::join!(registry, dispatch);
}

/// What deliveries are dispatched with.
fn dispatch(
    registry: &Arc<Registry>,
    config: &RegistryConfig,
) -> Result<Arc<Dispatch>, ServiceError> {
    let deliveries = &config.deliveries;
    let edge_token = deliveries.edge_token_file.as_deref().map(read_bearer);
    let settings = dispatch::Settings {
        edge_token: edge_token.transpose().map_err(io::Error::other)?,
        edge_origins: deliveries.edge_origins.iter().map(str::to_owned).collect(),
        webhooks_anywhere: deliveries.webhooks_anywhere,
        open_max: u64::try_from(deliveries.open_max).unwrap_or(u64::MAX),
    };
    Ok(Dispatch::new(
        registry.clone(),
        registry.documents(),
        settings,
    ))
}

/// What remembers how far the store had come: the file that is named, or one beside the store.
fn high_water(config: &RegistryConfig) -> Option<HighWater> {
    let named = config.high_water_file.clone();
    let beside = || PathBuf::from(format!("{}.high-water", config.store));
    let path = named.or_else(|| (!is_database(&config.store)).then(beside));
    path.map(HighWater::at)
}

fn gate(config: &RegistryConfig, listener: Listener, authentication: Authentication) -> GateConfig {
    let limits = &config.limits;
    let slots = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    GateConfig {
        daemon: Daemon::Registry,
        listener,
        authentication,
        slots: Slots {
            failures: 0,
            zone_writes: slots(limits.in_flight_zone_writes),
            reads: slots(limits.in_flight_reads),
            other: slots(limits.in_flight_other),
            follows: slots(limits.follows),
            streams: slots(limits.tracks),
            sessions: 0,
            watches: 0,
        },
        // Its requests wait for the database, which their places bound.
        queue_wait: Arc::new(QueueWait::unbounded()),
        body_bytes_max: limits.body.bytes(),
        file_bytes_max: limits.network.bytes(),
        deadline: limits.request_deadline,
        follow_wait: config.changes.wait_max,
    }
}

fn server(config: &RegistryConfig) -> ServerConfig {
    let limits = &config.limits;
    // A connection with an edge that waits for changes is in use, and as long as it may wait.
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
