//! Health as gRPC has it: serving, or not, for the edge as a whole and for each of its services.

use super::proto::airspace_server::SERVICE_NAME as AIRSPACE;
use super::proto::clock_server::SERVICE_NAME as CLOCK;
use super::proto::drones_server::SERVICE_NAME as DRONES;
use super::proto::network_server::SERVICE_NAME as NETWORK;
use super::proto::plans_server::SERVICE_NAME as PLANS;
use super::proto::recomposition_server::SERVICE_NAME as RECOMPOSITION;
use crate::api::server::Drain;
use crate::edge::Edge;
use std::sync::Arc;
use tonic_health::ServingStatus;
use tonic_health::pb::health_server::HealthServer;
use tonic_health::server::{HealthReporter, HealthService};

/// The empty name is the edge as a whole.
const SERVICES: [&str; 7] = ["", AIRSPACE, CLOCK, DRONES, NETWORK, PLANS, RECOMPOSITION];

/// What `grpc.health.v1.Health` tells. Clones speak of the same health.
#[derive(Clone, Debug)]
pub struct Health {
    reporter: HealthReporter,
}

impl Health {
    /// Not serving, until it is said to be ready.
    pub async fn starting() -> Self {
        let health = Self {
            reporter: HealthReporter::new(),
        };
        health.set_ready(false).await;
        health
    }

    /// Says to all who ask and watch whether this edge takes requests.
    pub async fn set_ready(&self, is_ready: bool) {
        let status = match is_ready {
            true => ServingStatus::Serving,
            false => ServingStatus::NotServing,
        };
        for service in SERVICES {
            self.reporter.set_service_status(service, status).await;
        }
    }

    /// Says when the edge has a network to answer on, and that it is ending.
    pub async fn follow(self, edge: Arc<Edge>, drain: Drain) {
        tokio::select! {
            () = edge.ready() => self.set_ready(true).await,
            () = drain.begun() => {}
        }
        drain.begun().await;
        self.set_ready(false).await;
    }

    pub(super) fn service(&self) -> HealthServer<HealthService> {
        HealthServer::new(HealthService::from_health_reporter(self.reporter.clone()))
    }
}
