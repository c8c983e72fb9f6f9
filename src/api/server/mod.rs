//! The server under both dialects: it accepts connections, bounds what they may take, and drains.
//!
//! `accept` owns the loop and the drain, `connection` the deadlines of one connection, and `gate` what
//! happens to a request before and after its handler, which `services` finds. `queue_wait` tells how long requests wait
//! before they get so far, and `shares` whom to refuse then. `places` counts connections by address and subject, `callers` requests
//! by subject.

mod accept;
mod admission;
mod authentication;
mod bodies;
mod callers;
mod connection;
mod date;
mod drain;
mod gate_config;
mod hosts;
mod places;
mod queue_wait;
mod refuse;
mod request;
mod services;
mod shares;
mod spans;
mod watch;

pub use accept::{Drained, serve};
pub use authentication::{Authentication, FindCaller, KnownTokens};
pub use drain::Drain;
pub use gate_config::{GateConfig, Slots};
pub use queue_wait::QueueWait;
pub(crate) use refuse::unread;
pub use request::{RequestContext, RequestId};
pub use services::{Answering, GrpcHandler, RestAnswering, RestHandler, Services};

use std::time::Duration;

/// What connections may take.
#[derive(Clone, Debug)]
pub struct ServerConfig {
    /// How many connections may be open; beyond that, only probes are answered on new ones.
    pub connections_max: usize,
    /// How many of them one address may hold that has not yet shown a token.
    pub connections_per_address: usize,
    /// How many one subject may hold, once its token was shown.
    pub connections_per_subject: usize,
    /// How many more may be open for probes alone; beyond that, new ones are closed at once.
    pub connections_for_probes: usize,
    /// How many streams one HTTP/2 connection may have open.
    pub streams_per_connection: u32,
    /// How large the head of a request may be, in bytes; at least 8,192.
    pub header_bytes_max: u32,
    /// How long a new connection may take to say which protocol it speaks.
    pub preface_deadline: Duration,
    /// How long the head of an HTTP/1.1 request may take, from its first byte.
    pub header_deadline: Duration,
    /// How long a connection may be open without a request.
    pub idle_deadline: Duration,
    /// How long a client may read nothing of an answer that waits for it.
    pub write_deadline: Duration,
    /// After how long a quiet HTTP/2 connection is pinged.
    pub ping_interval: Duration,
    /// How long the answer to a ping may take.
    pub ping_timeout: Duration,
    /// How long to keep serving after a drain has begun, so that load balancers notice.
    pub drain_delay: Duration,
    /// How long requests in flight may take to finish during a drain.
    pub drain_timeout: Duration,
}

impl Default for ServerConfig {
    fn default() -> Self {
        Self {
            connections_max: 10_000,
            connections_per_address: 2_500,
            connections_per_subject: 2_500,
            connections_for_probes: 32,
            streams_per_connection: 128,
            header_bytes_max: 16 * 1024,
            preface_deadline: Duration::from_secs(3),
            header_deadline: Duration::from_secs(5),
            idle_deadline: Duration::from_secs(120),
            write_deadline: Duration::from_secs(30),
            ping_interval: Duration::from_secs(10),
            ping_timeout: Duration::from_secs(5),
            drain_delay: Duration::ZERO,
            drain_timeout: Duration::from_secs(10),
        }
    }
}
