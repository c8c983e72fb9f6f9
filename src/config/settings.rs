//! The one table of settings: name, meaning, default and bounds of each.
//!
//! The struct that the edge reads, the keys of the file, the names in the environment, `config show` and the
//! sample file all come from it.

use super::value::{Kind, LogFilter, LogFormat, Size, Value};
use jiff::Timestamp;
use std::net::{Ipv4Addr, SocketAddr};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;
use tracing_subscriber::filter::LevelFilter;

/// One row of the table.
#[derive(Debug)]
pub struct Setting {
    /// The table of the file it stands in; empty for the top of the file.
    pub section: &'static str,
    /// Its key there.
    pub key: &'static str,
    /// What it means, line by line.
    pub doc: &'static [&'static str],
    /// How TOML writes it.
    pub kind: Kind,
    /// What is expected, with an example.
    pub(super) expected: &'static str,
    /// The least and the most it may be, as text.
    pub(super) bounds: fn() -> Option<(String, String)>,
    /// Reads a value from text into the configuration.
    pub(super) assign: fn(&mut EdgeConfig, &str) -> Result<(), Misfit>,
    /// The value in the configuration, as text that `assign` understands.
    pub(super) text: fn(&EdgeConfig) -> String,
}

/// Why a text is no value of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Misfit {
    /// It is something else.
    Unreadable,
    /// It is outside the bounds.
    OutOfBounds,
}

impl Setting {
    /// The full name: `limits.connections`.
    pub fn name(&self) -> String {
        match self.section {
            "" => self.key.to_owned(),
            section => format!("{section}.{}", self.key),
        }
    }

    /// The name in the environment: `SKYWAY_EDGE_LIMITS_CONNECTIONS`.
    pub fn variable(&self) -> String {
        let name = self.name().replace('.', "_").to_uppercase();
        format!("{}{name}", super::ENVIRONMENT_PREFIX)
    }
}

/// Takes a value unless it is outside its bounds.
fn checked<T: Value>(
    text: &str,
    bounds: Option<RangeInclusive<T>>,
    is_within: impl Fn(&RangeInclusive<T>, &T) -> bool,
) -> Result<T, Misfit> {
    let value = T::read(text).ok_or(Misfit::Unreadable)?;
    match bounds {
        Some(bounds) if !is_within(&bounds, &value) => Err(Misfit::OutOfBounds),
        _ => Ok(value),
    }
}

/// Makes the structs and the table from one list. A row is `key: type = default, least..=most;`.
macro_rules! settings {
    (
        { $( $(#[doc = $doc:literal])+ $key:ident : $type:ty = $default:expr $(, $bounds:expr)? ; )* }
        $(
            $(#[doc = $section_doc:literal])+
            $section:ident : $struct:ident {
                $( $(#[doc = $inner_doc:literal])+ $inner:ident : $inner_type:ty = $inner_default:expr $(, $inner_bounds:expr)? ; )*
            }
        )*
    ) => {
        /// The configuration of an edge. `Default` is what holds where nobody says otherwise.
        #[derive(Clone, Debug, PartialEq)]
        pub struct EdgeConfig {
            $( $(#[doc = $doc])+ pub $key: $type, )*
            $( $(#[doc = $section_doc])+ pub $section: $struct, )*
        }

        impl Default for EdgeConfig {
            fn default() -> Self {
                Self {
                    $( $key: $default, )*
                    $( $section: $struct::default(), )*
                }
            }
        }

        $(
            $(#[doc = $section_doc])+
            #[derive(Clone, Debug, PartialEq)]
            pub struct $struct {
                $( $(#[doc = $inner_doc])+ pub $inner: $inner_type, )*
            }

            impl Default for $struct {
                fn default() -> Self {
                    Self { $( $inner: $inner_default, )* }
                }
            }
        )*

        /// What each section of the file is about, in the order of the file.
        pub(super) const SECTIONS: &[(&str, &[&str])] = &[
            $( (stringify!($section), &[$($section_doc),+]), )*
        ];

        /// All settings, in the order of the file.
        pub const SETTINGS: &[Setting] = &[
            $( settings!(@row "", $key, [$($doc),+], $type, [$($bounds)?], config => config.$key), )*
            $( $(
                settings!(@row stringify!($section), $inner, [$($inner_doc),+], $inner_type,
                    [$($inner_bounds)?], config => config.$section.$inner),
            )* )*
        ];
    };
    (@row $section:expr, $key:ident, [$($doc:literal),+], $type:ty, [$($bounds:expr)?], $config:ident => $place:expr) => {
        Setting {
            section: $section,
            key: stringify!($key),
            doc: &[$($doc),+],
            kind: <$type as Value>::KIND,
            expected: <$type as Value>::EXPECTED,
            bounds: || settings!(@bounds $type $(, $bounds)?),
            assign: |$config, text| {
                $place = settings!(@read text, $type $(, $bounds)?)?;
                Ok(())
            },
            text: |$config| $place.write(),
        }
    };
    (@bounds $type:ty) => { None };
    (@bounds $type:ty, $bounds:expr) => {{
        let bounds: RangeInclusive<$type> = $bounds;
        Some((bounds.start().write(), bounds.end().write()))
    }};
    (@read $text:ident, $type:ty) => { checked::<$type>($text, None, |_, _| true) };
    (@read $text:ident, $type:ty, $bounds:expr) => {
        checked::<$type>($text, Some($bounds), |bounds, value| bounds.contains(value))
    };
}

const fn loopback(port: u16) -> SocketAddr {
    SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

const SECOND: Duration = Duration::from_secs(1);
const MINUTE: Duration = Duration::from_mins(1);
const HOUR: Duration = Duration::from_hours(1);
const DAY: Duration = Duration::from_hours(24);

settings! {
    {
        /// Where drones and operators reach the edge, REST and gRPC alike. Port 0 takes a free one.
        listen: SocketAddr = loopback(8080);
        /// Where metrics and status are read: loopback, or a private address that is named.
        admin_listen: SocketAddr = loopback(9090);
        /// A file to write the ports to that were taken, as JSON; empty for none.
        ports_file: Option<PathBuf> = None;
        /// The network: sydney, corridor, or a file.
        network: String = "sydney".to_owned();
        /// Serve other machines without encryption. Off loopback the edge starts only with this, as
        /// encryption is the work of a proxy in front of it.
        allow_plaintext: bool = false;
        /// The file with the digests of the tokens, which only its owner may read; empty for none. Off
        /// loopback the edge starts only with tokens. `skyway token` makes them.
        tokens_file: Option<PathBuf> = None;
    }
    /// How much at once. What is beyond is refused at once, failure reports last of all.
    limits: Limits {
        /// Connections.
        connections: usize = 10_000, 1..=1_000_000;
        /// Streams in a connection of HTTP/2.
        streams_per_connection: usize = 128, 1..=10_000;
        /// Failure reports being answered.
        in_flight_failures: usize = 512, 1..=100_000;
        /// Writes of zones and closures being answered.
        in_flight_zone_writes: usize = 32, 1..=100_000;
        /// Reads being answered.
        in_flight_reads: usize = 256, 1..=100_000;
        /// Other requests being answered.
        in_flight_other: usize = 64, 1..=100_000;
        /// The body of a request.
        body: Size = Size::of_mib(1), Size::of_kib(1)..=Size::of_mib(64);
        /// The headers of a request together.
        header: Size = Size::of_kib(16), Size::of_kib(8)..=Size::of_mib(1);
        /// Reports, or positions, in one request.
        batch: usize = 1_000, 1..=100_000;
        /// From a request to the start of its answer.
        request_deadline: Duration = 10 * SECOND, Duration::from_millis(10)..=10 * MINUTE;
        /// From a new connection to its first request line or HTTP/2 preface.
        preface_deadline: Duration = 3 * SECOND, Duration::from_millis(10)..=MINUTE;
        /// From the first byte of a request to the end of its headers.
        header_deadline: Duration = 5 * SECOND, Duration::from_millis(10)..=MINUTE;
        /// Streams of events.
        event_streams: usize = 256, 0..=100_000;
    }
    /// How the edge ends when it is told to.
    drain: Drain {
        /// From the moment it says that it is not ready to the moment it takes no more connections.
        delay: Duration = Duration::ZERO, Duration::ZERO..=10 * MINUTE;
        /// How long it then waits for answers under way.
        timeout: Duration = 10 * SECOND, Duration::ZERO..=HOUR;
    }
    /// Zones and closures.
    airspace: Airspace {
        /// How far ahead windows of zones are looked at for drones in flight.
        horizon: Duration = HOUR, MINUTE..=DAY;
        /// How far beside a segment a zone still hits it, in metres.
        margin_m: f64 = 10.0, 0.0..=1_000.0;
        /// Zones at once.
        zones_max: usize = 20_000, 1..=1_000_000;
        /// Closures at once.
        closures_max: usize = 20_000, 1..=1_000_000;
    }
    /// Closures that failure reports bring about.
    reports: Reports {
        /// How long a closure for an environmental failure lasts.
        life_environmental: Duration = 30 * MINUTE, SECOND..=DAY;
        /// How long a closure for a navigational failure lasts.
        life_navigational: Duration = 15 * MINUTE, SECOND..=DAY;
        /// How long a closure for a regulatory failure lasts.
        life_regulatory: Duration = HOUR, SECOND..=DAY;
        /// How long a closure for an infrastructure failure lasts.
        life_infrastructure: Duration = 30 * MINUTE, SECOND..=DAY;
        /// Such closures of one drone at once; further ones wait for an operator.
        alive_per_drone: usize = 3, 0..=1_000;
        /// The part of all segments that reports may close; further ones wait for an operator.
        closed_fraction_max: f64 = 0.01, 0.0..=1.0;
    }
    /// Plans of deliveries.
    plans: Plans {
        /// Active plans at once.
        active_max: usize = 20_000, 1..=1_000_000;
        /// The time between two drones at one place below which their plans conflict.
        headway: Duration = 30 * SECOND, Duration::ZERO..=HOUR;
        /// How long a drone has to acknowledge a new version of its plan.
        acknowledge_within: Duration = MINUTE, SECOND..=HOUR;
    }
    /// Recompositions that are kept to be looked up and computed again. The oldest go first.
    records: Records {
        /// So many.
        count: usize = 10_000, 0..=10_000_000;
        /// And no more memory than this.
        bytes: Size = Size::of_mib(64), Size::of_bytes(0)..=Size::of_mib(16_384);
    }
    /// Events that are kept for those who resume a stream.
    events: Events {
        /// So many; the oldest go first.
        count: usize = 10_000, 1..=10_000_000;
    }
    /// Last known positions.
    drones: Drones {
        /// Of so many drones; those heard least recently go first.
        count: usize = 50_000, 1..=10_000_000;
    }
    /// Answers that are kept for requests sent again with the same idempotency key.
    idempotency: Idempotency {
        /// So many; the oldest go first.
        count: usize = 20_000, 1..=10_000_000;
        /// For so long.
        age: Duration = DAY, MINUTE..=7 * DAY;
    }
    /// Shortest-path trees that are kept for the next search.
    trees: Trees {
        /// No more memory than this.
        bytes: Size = Size::of_mib(256), Size::of_mib(1)..=Size::of_mib(65_536);
    }
    /// What answers say of the registry when it has been away.
    freshness: Freshness {
        /// Away for so long: stale.
        stale_after: Duration = 30 * SECOND, SECOND..=DAY;
        /// Away for so long: degraded.
        degraded_after: Duration = 5 * MINUTE, SECOND..=7 * DAY;
    }
    /// Log lines, on standard error.
    log: Log {
        /// Which: a level (off, error, warn, info, debug, trace), and MODULE=LEVEL for a module, with commas.
        filter: LogFilter = LogFilter::level(LevelFilter::INFO);
        /// How: text or json.
        format: LogFormat = LogFormat::Text;
    }
    /// A clock for simulators, on loopback only. Every answer then says that it is simulated.
    clock: ClockConfig {
        /// What it shows at the start; empty for the machine's time.
        start: Option<Timestamp> = None;
        /// How many times faster than the machine's it runs.
        rate: f64 = 1.0, 0.001..=10_000.0;
    }
}
