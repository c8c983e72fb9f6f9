//! The gRPC dialect: what drones and simulators need, over the same use cases as REST; health and reflection.
//!
//! A service takes the caller from what the gate left in the request, turns the message into the shapes of
//! [`crate::wire`], calls the use case and turns its answer back. It decides nothing itself; refusals are told
//! by `api::problem` alone.

mod airspace;
mod clock;
mod convert;
mod convert_event;
mod convert_flight;
mod convert_mail;
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
mod session;

#[cfg(test)]
mod sample;
#[cfg(test)]
mod tests;

pub use convert::{FromProto, IntoProto, Unreadable};
pub use health::Health;

use crate::api::operations::{self, Operation};
use crate::api::server::{Answering, GrpcHandler};
use crate::edge::Edge;
use proto::airspace_server::AirspaceServer;
use proto::clock_server::ClockServer;
use proto::drones_server::DronesServer;
use proto::network_server::NetworkServer;
use proto::plans_server::PlansServer;
use proto::recomposition_server::RecompositionServer;
use std::convert::Infallible;
use std::sync::Arc;
use tonic::body::Body;
use tonic::server::NamedService;

/// What `proto/` compiles to: messages and servers.
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

/// All services: each turns messages into the shapes of the wire, calls a use case, and turns its answer back.
#[derive(Debug)]
struct Service {
    edge: Arc<Edge>,
}

/// The handlers of all operations that the dialect has.
///
/// # Errors
/// When reflection cannot read the descriptors that were compiled in: a defect of the build.
pub fn handlers(
    edge: &Arc<Edge>,
    limits: Limits,
    health: &Health,
) -> Result<Vec<(Operation, GrpcHandler)>, tonic_reflection::server::Error> {
    let service = Arc::new(Service { edge: edge.clone() });
    // Answers are as large as what they tell: bounded by pages, and by the network.
    macro_rules! server {
        ($server:ident) => {
            handlers_of(
                $server::from_arc(service.clone())
                    .max_decoding_message_size(limits.message_bytes_max)
                    .max_encoding_message_size(usize::MAX),
            )
        };
    }
    // Both versions of reflection: older clients ask for `v1alpha`.
    let reflection = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(DESCRIPTORS)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    let mut handlers = Vec::new();
    handlers.extend(server!(RecompositionServer));
    handlers.extend(server!(PlansServer));
    handlers.extend(server!(AirspaceServer));
    handlers.extend(server!(NetworkServer));
    handlers.extend(server!(DronesServer));
    handlers.extend(server!(ClockServer));
    handlers.extend(handlers_of(health.service()));
    handlers.extend(handlers_of(reflection().build_v1()?));
    handlers.extend(handlers_of(reflection().build_v1alpha()?));
    Ok(handlers)
}

/// The operations whose path begins with the name of a service, with the service as their handler.
fn handlers_of<S>(service: S) -> impl Iterator<Item = (Operation, GrpcHandler)>
where
    S: tower::Service<
            http::Request<Body>,
            Response = http::Response<Body>,
            Error = Infallible,
            Future = Answering,
        > + NamedService
        + Clone
        + Send
        + Sync
        + 'static,
{
    let handler: GrpcHandler = Arc::new(move |request| service.clone().call(request));
    let rows = operations::TABLE.iter().filter(|row| {
        let service = row.grpc.and_then(|path| path.split('/').nth(1));
        service == Some(S::NAME)
    });
    rows.map(move |row| (row.operation, handler.clone()))
}
