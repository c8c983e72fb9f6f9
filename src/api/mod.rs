//! The daemons over the network: which operations there are, how problems are told, and the server under both dialects.

mod durations;
pub mod grpc;
pub mod metrics;
mod openapi;
mod openapi_conventions;
mod openapi_ids;
pub mod operations;
pub mod page;
pub mod problem;
pub mod registry;
pub mod rest;
pub mod server;
