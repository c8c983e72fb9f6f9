//! What the daemons have in common where they meet the network: addresses, tokens, and why one does not start.

use crate::api::metrics::RequestMetrics;
use crate::api::operations::Daemon;
use crate::config::{AirframeError, HttpUrl, PackKeysError};
use crate::edge;
use crate::registry::OpenError;
use prometheus_client::registry::Registry;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use thiserror::Error;
use tokio::net::TcpListener;

/// Why a daemon does not start, or ends.
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
    #[error("the system refuses what the daemon needs: {0}")]
    System(#[from] io::Error),
    /// The descriptors of the gRPC services cannot be read: a defect of the build.
    #[error("the gRPC services cannot be described: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
    /// The store of a registry cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The keys of packs are of no use.
    #[error(transparent)]
    PackKeys(#[from] PackKeysError),
    /// A name of the configuration stands for no airframe.
    #[error(transparent)]
    Airframe(#[from] AirframeError),
    /// The edge does not begin.
    #[error(transparent)]
    Edge(#[from] edge::OpenError),
    /// A listener's task failed.
    #[error("a listener failed: {0}")]
    Listener(#[from] tokio::task::JoinError),
}

/// Where a daemon listens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Addresses {
    /// For those whom it serves.
    pub listen: SocketAddr,
    /// For metrics and status.
    pub admin: SocketAddr,
}

/// The metrics of requests, with exemplars where requests are traced.
pub(super) fn request_metrics(
    registry: &mut Registry,
    daemon: Daemon,
    collector: Option<&HttpUrl>,
) -> Arc<RequestMetrics> {
    let metrics = match collector {
        Some(_) => RequestMetrics::traced(registry),
        None => RequestMetrics::new(registry),
    };
    metrics.begin_at_zero(daemon);
    Arc::new(metrics)
}

/// Binds an address; `flag` is the flag that sets it.
pub(super) async fn bind(
    address: SocketAddr,
    flag: &'static str,
) -> Result<TcpListener, ServiceError> {
    let bound = TcpListener::bind(address).await;
    bound.map_err(|error| ServiceError::Bind {
        address,
        flag,
        error,
    })
}
