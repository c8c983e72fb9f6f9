//! Deliveries: what providers offer, what customers order, which drone flies it, and who is told.
//!
//! It keeps everything in the registry's store of documents, so that several processes may serve one store. A failure
//! report never passes through here: edges answer those, and tell afterwards what became of a flight.

mod assigning;
mod batch;
mod calling_off;
mod changes;
mod choosing;
mod deliveries;
mod directory;
mod edge_http;
mod edges;
mod enrolled;
mod fleet;
mod holding;
mod messages;
mod news;
mod offers;
mod orders;
mod pace;
mod positions;
mod quotes;
mod quoting;
mod reached;
mod records;
mod reliability;
mod reserving;
mod revoked_keys;
mod statistics;
mod tracks;
mod unheard;
mod views;
mod wanted;
mod ways;
mod webhooks;

pub use directory::{Entry, Listed, Place, Tagged};
pub use edges::{
    CalledOff, ComposedFlight, EdgeAddress, EdgeAnswer, EdgeClient, EdgeError, FlightRequest,
};
pub use positions::PositionsAsked;
pub use webhooks::TaggedWebhook;

use edge_http::HttpEdges;
use enrolled::Enrolled;
use quoting::QuotePlaces;
use reliability::Measured;
use skyway_registry::Registry;
use skyway_registry::documents::Documents;
use skyway_service::clock::Clock;
use std::sync::Arc;
use tokio::sync::Notify;
use tokio_util::sync::CancellationToken;
use ways::KnownWays;

/// What deliveries are dispatched with.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The token that edges are asked with.
    pub edge_token: Option<String>,
    /// Where edges are that it may be sent to.
    pub edge_origins: Vec<String>,
    /// Whether webhooks may be called without encryption and at private addresses.
    pub webhooks_anywhere: bool,
    /// At most this many orders of one customer that are not over, and as many quotes that can be accepted.
    pub open_max: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            edge_token: None,
            edge_origins: Vec::new(),
            webhooks_anywhere: false,
            open_max: u64::MAX,
        }
    }
}

/// Everything behind the use cases of deliveries.
#[derive(Debug)]
pub struct Dispatch {
    registry: Arc<Registry>,
    documents: Arc<dyn Documents>,
    clock: Clock,
    settings: Settings,
    edges: Arc<dyn EdgeClient>,
    ways: KnownWays,
    measured: Measured,
    enrolled: Enrolled,
    quoting: QuotePlaces,
    /// There may be something to assign.
    orders: Notify,
    /// There may be something to send.
    messages: Notify,
}

impl Dispatch {
    /// Dispatches deliveries over the networks of a registry.
    pub fn new(
        registry: Arc<Registry>,
        documents: Arc<dyn Documents>,
        settings: Settings,
    ) -> Arc<Self> {
        let edges = HttpEdges::new(settings.edge_token.clone(), &settings.edge_origins);
        Self::with_edges(registry, documents, settings, Arc::new(edges))
    }

    /// The same with another client of edges.
    pub fn with_edges(
        registry: Arc<Registry>,
        documents: Arc<dyn Documents>,
        settings: Settings,
        edges: Arc<dyn EdgeClient>,
    ) -> Arc<Self> {
        Arc::new(Self {
            clock: registry.clock().clone(),
            registry,
            documents,
            settings,
            edges,
            ways: KnownWays::default(),
            measured: Measured::default(),
            enrolled: Enrolled::default(),
            quoting: QuotePlaces::default(),
            orders: Notify::new(),
            messages: Notify::new(),
        })
    }

    /// The registry whose networks it dispatches over.
    pub fn registry(&self) -> &Arc<Registry> {
        &self.registry
    }

    /// Assigns drones and sends messages until it is stopped.
    pub async fn run(self: Arc<Self>, stop: CancellationToken) {
        let work = async {
            tokio::join!(
                self.assign_orders(),
                self.send_messages(),
                self.drop_what_is_old()
            );
        };
        tokio::select! {
            () = work => {}
            () = stop.cancelled() => {}
        }
    }
}
