//! A running edge: its state, its two listeners, and how it ends.
//!
//! Everything is bound before anything is served, so that a port that is taken stops the start. The main
//! listener serves drones and operators, REST and gRPC alike; the admin listener metrics and status.

use crate::api::grpc::{self, Health};
use crate::api::metrics::RequestMetrics;
use crate::api::operations::Listener;
use crate::api::page;
use crate::api::rest;
use crate::api::server::{
    Authentication, Drain, Drained, FindCaller, GateConfig, ServerConfig, Slots, serve,
};
use crate::config::{EdgeConfig, Tokens};
use crate::edge::{ClosureLives, Edge, Settings};
use crate::network::Topology;
use bytes::Bytes;
use jiff::SignedDuration;
use prometheus_client::registry::Registry;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

/// Why an edge does not start, or ends.
#[derive(Debug, Error)]
pub enum ServiceError {
    /// An address cannot be bound.
    #[error("cannot listen on {address}: {error}; choose another address with --{flag}")]
    Bind {
        /// The address.
        address: SocketAddr,
        /// The flag that sets it.
        flag: &'static str,
        /// Why not.
        error: io::Error,
    },
    /// The system gives no threads, sockets or random bits.
    #[error("the system refuses what the edge needs: {0}")]
    System(#[from] io::Error),
    /// The descriptors of the gRPC services cannot be read: a defect of the build.
    #[error("the gRPC services cannot be described: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
    /// A listener's task failed.
    #[error("a listener failed: {0}")]
    Listener(#[from] tokio::task::JoinError),
}

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

/// Where an edge listens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Addresses {
    /// For drones and operators.
    pub listen: SocketAddr,
    /// For metrics and status.
    pub admin: SocketAddr,
}

/// An edge that is served.
#[derive(Debug)]
pub struct Service {
    edge: Arc<Edge>,
    addresses: Addresses,
    drain: Drain,
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
        let main = bind(config.listen, "listen").await?;
        let admin = bind(config.admin_listen, "admin-listen").await?;
        let addresses = Addresses {
            listen: main.local_addr()?,
            admin: admin.local_addr()?,
        };
        let clock = config.start_clock();
        // Every start has a later epoch, also under a simulated clock.
        let epoch = crate::clock::Clock::real().now().as_millisecond();
        let epoch = u64::try_from(epoch).unwrap_or_default();
        let edge = Edge::start(topology, geojson, epoch, settings(&config), clock)?;
        let mut registry = Registry::with_prefix("skyway");
        let metrics = Arc::new(RequestMetrics::new(&mut registry));
        edge.register_metrics(&mut registry);
        let drain = Drain::new();
        let authentication = authentication(tokens);
        let health = Health::starting().await;
        let limits = grpc::Limits {
            message_bytes_max: config.limits.body.bytes(),
        };
        let (rest, _) = rest::router(edge.clone(), drain.clone());
        let main_router = rest
            .merge(page::router())
            .merge(grpc::router(&edge, limits, &health)?);
        let admin_router = rest::admin_router(edge.clone(), Arc::new(registry), drain.clone());
        let gate = |listener| gate(&config, listener, authentication.clone());
        let server = server(&config);
        let main = serve(
            main,
            main_router,
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
        tokio::spawn(tell_drain(health, drain.clone()));
        Ok(Self {
            edge,
            addresses,
            drain,
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
        Ok(Drained {
            forced: drained.forced + admin.forced,
        })
    }
}

/// Says to those who watch the health of the edge that it is ending.
async fn tell_drain(health: Health, drain: Drain) {
    drain.begun().await;
    health.set_ready(false).await;
}

async fn bind(address: SocketAddr, flag: &'static str) -> Result<TcpListener, ServiceError> {
    let bound = TcpListener::bind(address).await;
    bound.map_err(|error| ServiceError::Bind {
        address,
        flag,
        error,
    })
}

fn authentication(tokens: Option<Tokens>) -> Authentication {
    match tokens {
        None => Authentication::Loopback,
        Some(tokens) => {
            let find: FindCaller = Arc::new(move |bearer| tokens.find(bearer));
            Authentication::Tokens(find)
        }
    }
}

fn gate(config: &EdgeConfig, listener: Listener, authentication: Authentication) -> GateConfig {
    let limits = &config.limits;
    let slots = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    GateConfig {
        listener,
        authentication,
        slots: Slots {
            failures: slots(limits.in_flight_failures),
            zone_writes: slots(limits.in_flight_zone_writes),
            reads: slots(limits.in_flight_reads),
            other: slots(limits.in_flight_other),
            streams: slots(limits.event_streams),
        },
        body_bytes_max: limits.body.bytes(),
        deadline: limits.request_deadline,
    }
}

fn server(config: &EdgeConfig) -> ServerConfig {
    let limits = &config.limits;
    ServerConfig {
        connections_max: limits.connections,
        streams_per_connection: u32::try_from(limits.streams_per_connection).unwrap_or(u32::MAX),
        header_bytes_max: u32::try_from(limits.header.bytes()).unwrap_or(u32::MAX),
        preface_deadline: limits.preface_deadline,
        header_deadline: limits.header_deadline,
        drain_delay: config.drain.delay,
        drain_timeout: config.drain.timeout,
        ..ServerConfig::default()
    }
}

/// What the edge works with, out of the configuration.
fn settings(config: &EdgeConfig) -> Settings {
    // Bounds on durations are checked when the configuration is read.
    let span =
        |duration: Duration| SignedDuration::try_from(duration).unwrap_or(SignedDuration::MAX);
    let reports = &config.reports;
    Settings {
        horizon: span(config.airspace.horizon),
        margin_m: config.airspace.margin_m,
        lives: ClosureLives {
            environmental: span(reports.life_environmental),
            navigational: span(reports.life_navigational),
            regulatory: span(reports.life_regulatory),
            infrastructure: span(reports.life_infrastructure),
        },
        alive_per_drone: reports.alive_per_drone,
        closed_fraction_max: reports.closed_fraction_max,
        zones_max: config.airspace.zones_max,
        closures_max: config.airspace.closures_max,
        plans_max: config.plans.active_max,
        headway_s: config.plans.headway.as_secs_f64(),
        acknowledge_within: span(config.plans.acknowledge_within),
        records_max: config.records.count,
        records_bytes_max: config.records.bytes.bytes(),
        events_max: config.events.count,
        event_streams_max: config.limits.event_streams,
        drones_max: config.drones.count,
        idempotency_max: config.idempotency.count,
        idempotency_age: span(config.idempotency.age),
        batch_max: config.limits.batch,
        trees_bytes: config.trees.bytes.bytes(),
    }
}
