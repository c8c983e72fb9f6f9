//! The gRPC dialect: services over the same use cases as REST, health and reflection.
//!
//! A service takes the caller from what the gate left in the request, turns the message into the shapes of
//! [`crate::wire`], calls the use case and turns its answer back. It decides nothing itself; refusals are told
//! by `api::problem` alone.

mod airspace;
mod codec;
mod convert;
mod convert_airspace;
mod convert_plan;
mod convert_recomposition;
mod convert_report;
mod convert_zone;
mod drones;
mod health;
mod mirror;
mod network;
mod plans;
mod recomposition;
mod requests;

#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;

pub use convert::{FromProto, IntoProto, NodeIds, Unreadable};
pub use health::Health;

use crate::api::operations;
use crate::edge::Edge;
use proto::airspace_server::AirspaceServer;
use proto::drones_server::DronesServer;
use proto::network_server::NetworkServer;
use proto::plans_server::PlansServer;
use proto::recomposition_server::RecompositionServer;
use std::convert::Infallible;
use std::sync::Arc;
use tonic::body::Body;
use tonic::server::NamedService;
use tower::{Service, ServiceExt};

/// What `proto/` compiles to: messages, servers, and clients that are generic over what carries them.
#[allow(
    missing_docs,
    unreachable_pub,
    clippy::all,
    reason = "generated; the proto files are documented"
)]
pub mod proto {
    pub use skyway::v1::*;

    /// The time of Google's well-known types.
    pub use google::protobuf::Timestamp;

    mod google {
        pub mod protobuf {
            include!(concat!(env!("OUT_DIR"), "/google.protobuf.rs"));
        }
    }

    mod skyway {
        pub mod v1 {
            include!(concat!(env!("OUT_DIR"), "/skyway.v1.rs"));
        }
    }
}

/// The descriptors of all services and messages, a `google.protobuf.FileDescriptorSet`.
pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/skyway_descriptors.bin"));

/// The bounds of the dialect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The largest message that is read, in bytes; a larger one is refused as `body_too_large`, unread.
    pub message_bytes_max: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            message_bytes_max: 1 << 20,
        }
    }
}

/// The services as routes, without a fallback, to be merged with those of REST.
///
/// # Errors
/// When reflection cannot read the descriptors that were compiled in: a defect of the build.
pub fn router(
    edge: &Arc<Edge>,
    limits: Limits,
    health: &Health,
) -> Result<axum::Router, tonic_reflection::server::Error> {
    let largest = limits.message_bytes_max;
    // Answers are as large as what they tell: bounded by pages, and by the network.
    let recomposition = RecompositionServer::new(recomposition::Service::new(edge.clone()))
        .max_decoding_message_size(largest)
        .max_encoding_message_size(usize::MAX);
    let plans = PlansServer::new(plans::Service::new(edge.clone()))
        .max_decoding_message_size(largest)
        .max_encoding_message_size(usize::MAX);
    let airspace = AirspaceServer::new(airspace::Service::new(edge.clone()))
        .max_decoding_message_size(largest)
        .max_encoding_message_size(usize::MAX);
    let network = NetworkServer::new(network::Service::new(edge.clone()))
        .max_decoding_message_size(largest)
        .max_encoding_message_size(usize::MAX);
    let drones = DronesServer::new(drones::Service::new(edge.clone()))
        .max_decoding_message_size(largest)
        .max_encoding_message_size(usize::MAX);
    let routes = axum::Router::new();
    let routes = with_service(routes, recomposition);
    let routes = with_service(routes, plans);
    let routes = with_service(routes, airspace);
    let routes = with_service(routes, network);
    let routes = with_service(routes, drones);
    let routes = with_service(routes, health.service());
    with_reflection(routes)
}

/// Both versions: older clients ask for `v1alpha`.
fn with_reflection(routes: axum::Router) -> Result<axum::Router, tonic_reflection::server::Error> {
    let builder = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(DESCRIPTORS)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    let routes = with_service(routes, builder().build_v1()?);
    Ok(with_service(routes, builder().build_v1alpha()?))
}

// `tonic::service::Routes` brings a fallback of its own, and two routers with one cannot be merged.
fn with_service<S>(routes: axum::Router, service: S) -> axum::Router
where
    S: Service<
            http::Request<axum::body::Body>,
            Response = http::Response<Body>,
            Error = Infallible,
        > + NamedService
        + Clone
        + Send
        + Sync
        + 'static,
    S::Future: Send + 'static,
{
    let service = service.map_response(codec::in_our_words);
    let paths = operations::TABLE.iter().filter_map(|row| row.grpc);
    // A route for each method: one for all of a service would have its name read and kept for every call.
    let own = paths.filter(|path| path.trim_start_matches('/').split('/').next() == Some(S::NAME));
    own.fold(routes, |routes, path| {
        routes.route_service(path, service.clone())
    })
}
