//! The settings of a registry.

use super::fault::ConfigFault;
use super::resolve::EffectiveConfig;
use super::settings::{
    Configuration, DAY, Exposure, HOUR, MINUTE, SECOND, Setting, checked, loopback, settings,
};
use super::tokens::read_bearer;
use super::value::{HttpUrl, LogFilter, LogFormat, Names, Size, Value, is_origin};
use jiff::Timestamp;
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;
use tracing_subscriber::filter::LevelFilter;

settings! {
    /// The configuration of a registry. `Default` is what holds where nothing is set.
    RegistryConfig;
    {
        /// Where edges and operators reach the registry. Port 0 takes a free one.
        listen: SocketAddr = loopback(8180);
        /// Where metrics and status are read: loopback, or a private address that is named.
        admin_listen: SocketAddr = loopback(9190);
        /// A file to write the ports to that were taken, as JSON; empty for none.
        ports_file: Option<PathBuf> = None;
        /// Where everything is kept: a file, which SQLite makes where there is none, or postgres://USER@HOST/DATABASE.
        store: String = "registry.db".to_owned();
        /// A file that remembers how far the store had come, so that a store restored from a backup is known
        /// for one and begins a new epoch; empty for one beside the store's file, and none for PostgreSQL.
        high_water_file: Option<PathBuf> = None;
        /// Serve other machines without encryption. Off loopback the registry starts only with this, as
        /// encryption is the work of a proxy in front of it.
        allow_plaintext: bool = false;
        /// The file with the digests of the tokens, which only its owner may read; empty for none. Off
        /// loopback the registry starts only with tokens. `skyway token` makes them.
        tokens_file: Option<PathBuf> = None;
    }
    /// How much at once. What is beyond is refused at once.
    limits: Limits {
        /// Connections.
        connections: usize = 10_000, 1..=1_000_000;
        /// Of these, connections of one address that have not shown a token yet. Where there are no tokens, or a
        /// proxy keeps many connections open ahead of requests, all of one address count here.
        connections_per_address: usize = 2_500, 1..=1_000_000;
        /// Of these, connections of one subject, as its token says.
        connections_per_subject: usize = 2_500, 1..=1_000_000;
        /// Further ones on which only probes are answered (/livez, /readyz, health), when all others are taken.
        connections_for_probes: usize = 32, 0..=10_000;
        /// Streams in a connection of HTTP/2.
        streams_per_connection: usize = 128, 1..=10_000;
        /// Edges that wait for changes.
        follows: usize = 4_096, 1..=100_000;
        /// Customers that watch where a parcel is.
        tracks: usize = 1_024, 0..=100_000;
        /// Writes of zones, closures and weather being answered.
        in_flight_zone_writes: usize = 64, 1..=100_000;
        /// Reads being answered.
        in_flight_reads: usize = 256, 1..=100_000;
        /// Other requests being answered, writes of networks among them.
        in_flight_other: usize = 16, 1..=100_000;
        /// The body of a request.
        body: Size = Size::of_mib(1), Size::of_kib(1)..=Size::of_mib(64);
        /// The body of a request that brings a network.
        network: Size = Size::of_mib(64), Size::of_kib(1)..=Size::of_mib(512);
        /// The headers of a request together.
        header: Size = Size::of_kib(16), Size::of_kib(8)..=Size::of_mib(1);
        /// From a request to the start of its answer; a request for changes may wait for them longer.
        request_deadline: Duration = 30 * SECOND, Duration::from_millis(10)..=10 * MINUTE;
        /// From a new connection to its first request line or HTTP/2 preface.
        preface_deadline: Duration = 3 * SECOND, Duration::from_millis(10)..=MINUTE;
        /// From the first byte of a request to the end of its headers.
        header_deadline: Duration = 5 * SECOND, Duration::from_millis(10)..=MINUTE;
    }
    /// How the registry ends when it is told to.
    drain: Drain {
        /// From the moment it says that it is not ready to the moment it takes no more connections.
        delay: Duration = Duration::ZERO, Duration::ZERO..=10 * MINUTE;
        /// How long it then waits for answers under way.
        timeout: Duration = 10 * SECOND, Duration::ZERO..=HOUR;
    }
    /// Networks and what lies over each of them.
    airspace: Airspace {
        /// Networks.
        networks_max: usize = 100, 1..=100_000;
        /// How far beside a segment a zone still hits it where it does not say, in metres.
        margin_m: f64 = 10.0, 0.0..=1_000.0;
        /// Zones over one network.
        zones_max: usize = 20_000, 1..=1_000_000;
        /// Closures on one network.
        closures_max: usize = 20_000, 1..=1_000_000;
    }
    /// The log of changes that edges follow.
    changes: Changes {
        /// Changes in a page where the edge does not say; a page always ends with a whole revision.
        page: usize = 500, 1..=10_000;
        /// Bytes after which a page ends with the revision it is in.
        page_bytes: Size = Size::of_mib(4), Size::of_kib(1)..=Size::of_mib(256);
        /// How long an edge may wait for changes.
        wait_max: Duration = MINUTE, SECOND..=10 * MINUTE;
        /// Revisions that are kept for edges that were away; an older cursor takes the snapshot.
        keep: usize = 10_000, 1..=100_000_000;
        /// How often old revisions and answers are dropped.
        compact_every: Duration = MINUTE, SECOND..=DAY;
    }
    /// Answers that are kept for requests sent again with the same idempotency key.
    idempotency: Idempotency {
        /// No more than this; the oldest of the subjects that have the most go first.
        bytes: Size = Size::of_mib(64), Size::of_kib(64)..=Size::of_mib(16_384);
        /// For so long.
        age: Duration = DAY, MINUTE..=30 * DAY;
    }
    /// Deliveries.
    deliveries: Deliveries {
        /// The file with the token that edges are asked with, which only its owner may read; its role there is
        /// operator. Empty for none, where edges ask for none.
        edge_token_file: Option<PathBuf> = None;
        /// The addresses of edges that it may be sent to: scheme, host and port, with commas between them. Edges tell their
        /// own address: one that is not named here is asked for no flight while there is a token.
        edge_origins: Names = Names::default();
        /// Orders of one customer that are not over, and as many quotes that can be accepted.
        open_max: usize = 20_000, 1..=1_000_000;
        /// Call webhooks without encryption and at private addresses, too: for a demo, or a network of one's own.
        webhooks_anywhere: bool = false;
    }
    /// Log lines, on standard error.
    log: Log {
        /// Which: a level (off, error, warn, info, debug, trace), and MODULE=LEVEL for a module, with commas.
        filter: LogFilter = LogFilter::level(LevelFilter::INFO);
        /// How: text or json.
        format: LogFormat = LogFormat::Text;
    }
    /// Traces of requests, in the form of OpenTelemetry.
    traces: Traces {
        /// Where a collector takes OTLP over HTTP, such as http://127.0.0.1:4318/v1/traces; empty for none. What it
        /// does not take in time is dropped.
        endpoint: Option<HttpUrl> = None;
        /// The part of the requests that is traced where the client does not decide.
        share: f64 = 1.0, 0.0..=1.0;
    }
    /// A clock for simulators, on loopback only.
    clock: ClockConfig {
        /// What it shows at the start; empty for the machine's time.
        start: Option<Timestamp> = None;
        /// How many times faster than the machine's it runs.
        rate: f64 = 1.0, 0.001..=10_000.0;
    }
}

impl Configuration for RegistryConfig {
    const ENVIRONMENT_PREFIX: &'static str = "SKYWAY_REGISTRY_";
    const INTRODUCTION: &'static str = "\
# The configuration of a Skyway registry: every setting, with its default commented out.
#
# A flag wins over the environment, the environment over this file. The variable of limits.body is
# SKYWAY_REGISTRY_LIMITS_BODY, its flag --set limits.body=1MiB. Paths are relative to the working directory.
# `skyway config check --registry --config FILE` finds every fault; `skyway config show --registry --origin` tells
# who said what. `skyway config sample --registry` writes this file.
";
    const SETTINGS: &'static [Setting<Self>] = SETTINGS;
    const SECTIONS: &'static [(&'static str, &'static [&'static str])] = SECTIONS;

    fn exposure(&self) -> Exposure<'_> {
        Exposure {
            listen: self.listen,
            admin_listen: self.admin_listen,
            tokens_file: self.tokens_file.as_deref(),
            allow_plaintext: self.allow_plaintext,
            is_clock_external: false,
            clock_start: self.clock.start,
            clock_rate: self.clock.rate,
        }
    }

    fn own_faults(effective: &EffectiveConfig<Self>) -> Vec<ConfigFault> {
        let deliveries = &effective.config.deliveries;
        let (token, origins) = ("deliveries.edge_token_file", "deliveries.edge_origins");
        let wrong = deliveries.edge_origins.iter().filter(|it| !is_origin(it));
        let mut faults: Vec<_> = wrong
            .map(|text| ConfigFault::Unreadable {
                origin: effective.origin(origins),
                name: origins.to_owned(),
                text: text.to_owned(),
                expected: "the address of an edge, such as https://edge-1.example:8443",
            })
            .collect();
        let Some(file) = deliveries.edge_token_file.as_deref() else {
            return faults;
        };
        let origin = effective.origin(token);
        match read_bearer(file) {
            Err(error) => faults.push(ConfigFault::EdgeToken { origin, error }),
            Ok(_) if deliveries.edge_origins.iter().next().is_none() => {
                faults.push(ConfigFault::NoEdgeOrigins { origin });
            }
            Ok(_) => {}
        }
        faults
    }
}
