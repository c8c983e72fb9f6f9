//! The settings of an edge.

use super::airframes::read_airframe;
use super::authorities::read_authorities;
use super::fault::ConfigFault;
use super::resolve::EffectiveConfig;
use super::settings::{
    Configuration, DAY, Exposure, HOUR, MINUTE, SECOND, Setting, checked, loopback, settings,
};
use super::tokens::read_bearer;
use super::value::{ClockMover, HttpUrl, LogFilter, LogFormat, Names, Size, Value};
use crate::flight::{FigureRange, FlightRules};
use crate::itinerary::Objective;
use jiff::Timestamp;
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;
use tracing_subscriber::filter::LevelFilter;

settings! {
    /// The configuration of an edge. `Default` is what holds where nothing is set.
    EdgeConfig;
    {
        /// Where drones and operators reach the edge, REST and gRPC alike. Port 0 takes a free one.
        listen: SocketAddr = loopback(8080);
        /// Where metrics and status are read: loopback, or a private address that is named.
        admin_listen: SocketAddr = loopback(9090);
        /// A file to write the ports to that were taken, as JSON; empty for none.
        ports_file: Option<PathBuf> = None;
        /// The network: sydney, corridor, or a file. Where a registry is followed and no network is named, the
        /// edge has the registry's, and is not ready before it has read it.
        network: String = "sydney".to_owned();
        /// The file in which the edge keeps what it knows: zones, closures, plans, decisions. It is made where
        /// there is none; empty for none, and then the edge forgets everything when it ends.
        store: Option<PathBuf> = Some(PathBuf::from("edge.db"));
        /// Serve other machines without encryption. Off loopback the edge starts only with this, as
        /// encryption is the work of a proxy in front of it.
        allow_plaintext: bool = false;
        /// The file with the digests of the tokens, which only its owner may read; empty for none. Off
        /// loopback the edge starts only with tokens. `skyway token` makes them.
        tokens_file: Option<PathBuf> = None;
        /// The file with the keys that packs are signed with, which only its owner may read; it is made where there is
        /// none. Empty for one beside the store, with .keys after its name; without a store for a key that ends with
        /// the edge. `skyway pack` makes new ones.
        pack_keys_file: Option<PathBuf> = None;
    }
    /// How much at once. What is beyond is refused at once, failure reports last of all.
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
        /// Failure reports being answered.
        in_flight_failures: usize = 512, 1..=100_000;
        /// Writes of zones and closures being answered.
        in_flight_zone_writes: usize = 32, 1..=100_000;
        /// Reads being answered.
        in_flight_reads: usize = 256, 1..=100_000;
        /// Other requests being answered.
        in_flight_other: usize = 64, 1..=100_000;
        /// How long requests wait for a worker where that stands: beyond it enough are refused that
        /// it stays there, reads first, failure reports last. 0s switches this off.
        queue_wait: Duration = Duration::from_millis(5), Duration::ZERO..=MINUTE;
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
        /// How long a write may take to reach the disk before the store counts as failing.
        commit: Duration = 2 * SECOND, Duration::from_millis(10)..=MINUTE;
        /// Streams of events.
        event_streams: usize = 256, 0..=100_000;
        /// Sessions of drones, and streams of their mail.
        sessions: usize = 10_000, 0..=1_000_000;
        /// Streams of health, which need no token.
        health_streams: usize = 64, 0..=100_000;
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
        /// So long before it begins a zone closes already for drones without computed times: as long as they fly, so
        /// that none meets it on its way. Zones and closures say from when (`closes_from`).
        horizon: Duration = 10 * MINUTE, MINUTE..=DAY;
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
        /// Such closures of one drone or fleet at once, by the subject of its token, whatever it calls its drones.
        alive_per_subject: usize = 10, 0..=100_000;
        /// The part of all segments, and of all nodes with pads, that reports may close; further ones wait for an operator.
        closed_fraction_max: f64 = 0.01, 0.0..=1.0;
    }
    /// Plans of deliveries.
    plans: Plans {
        /// Active plans at once.
        active_max: usize = 20_000, 1..=1_000_000;
        /// The highest priority that drones and fleets may ask for, of those from 0 to 100; operators may ask for any.
        priority_max: u8 = 50, 0..=100;
        /// The drones and fleets that may ask for any nonetheless: the subjects of their tokens, with commas between them.
        urgent: Names = Names::default();
        /// The time between two drones at one place below which their plans conflict.
        headway: Duration = 30 * SECOND, seconds(FlightRules::HEADWAY_S);
        /// The time between two drones that pass a node or land there, with the flight model; 0s lets them pass
        /// together.
        node_headway: Duration = 5 * SECOND, seconds(FlightRules::NODE_HEADWAY_S);
        /// Where segments come nearer to each other than this, in metres, and no higher than 10 m above each other,
        /// drones are not at the same time, with the flight model; 0 lets them.
        crossing_m: f64 = 20.0, numbers(FlightRules::CROSSING_M);
        /// How long a drone has to acknowledge a new version of its plan.
        acknowledge_within: Duration = MINUTE, SECOND..=HOUR;
        /// So long after its arrival, or the last sign of its drone, a plan that has not ended is lost.
        lost_after: Duration = HOUR, MINUTE..=DAY;
    }
    /// Plans that a drone can really fly: with its battery, in the wind, charging on pads that are free.
    flight: Flight {
        /// The airframe of a drone that names no other: phantom3, m100, or a JSON file as in data/airframes.
        /// With none plans are the shortest open ways, and the battery is not checked. Empty for phantom3,
        /// or none over a store that was written when that was the default.
        airframe: Option<String> = None;
        /// Further airframes that requests may name, with commas between them: phantom3, m100, or files. Requests
        /// call the one of a file by the name that the file has.
        airframes: Names = Names::default();
        /// What is made least where a request does not say: distance, time or energy.
        objective: Objective = Objective::Distance;
        /// What has to be left in the battery at every node.
        reserve_fraction: f64 = 0.2, numbers(FlightRules::RESERVE);
        /// What has to be left where a drone in flight can only reach an alternate.
        floor_fraction: f64 = 0.08, numbers(FlightRules::RESERVE);
        /// Handling at every recharging stop.
        stop: Duration = MINUTE, seconds(FlightRules::STOP_S);
        /// Swapping batteries at a swap station.
        swap: Duration = 3 * MINUTE, seconds(FlightRules::SWAP_S);
        /// The nodes that swap batteries instead of charging them: their ids, with commas between them.
        swap_stations: Names = Names::default();
        /// By how much the windows of zones are widened on both sides.
        time_margin: Duration = MINUTE, seconds(FlightRules::TIME_MARGIN_S);
        /// And by which part of the time since the plan began.
        time_margin_growth: f64 = 0.05, numbers(FlightRules::TIME_MARGIN_GROWTH);
        /// The climb to the crossing altitude where altitudes are not known, in metres.
        unknown_climb_m: f64 = 30.0, numbers(FlightRules::UNKNOWN_CLIMB_M);
        /// For how long a pad of an alternate has to be free for a drone that is diverted to it.
        refuge_stay: Duration = 30 * MINUTE, Duration::ZERO..=DAY;
        /// The wind where and when the weather states none, in metres per second.
        wind_speed_mps: f64 = 0.0, 0.0..=120.0;
        /// Where that wind comes from, in degrees from north, clockwise.
        wind_from_deg: f64 = 0.0, 0.0..=360.0;
        /// What a delivery costs for each kilogram and kilometre, in US dollars.
        price_usd_per_kg_km: f64 = 0.005, 0.0..=1_000.0;
        /// A drone that is so much earlier or later than its plan gets a new one.
        late_tolerance: Duration = MINUTE, SECOND..=DAY;
        /// So does one whose battery is lower than planned by this part of it.
        battery_tolerance_fraction: f64 = 0.1, 0.0..=1.0;
    }
    /// Recompositions that are kept to be looked up and computed again. The oldest go first.
    records: Records {
        /// The most entries.
        count: usize = 10_000, 0..=10_000_000;
        /// And no more memory than this.
        bytes: Size = Size::of_mib(64), Size::of_bytes(0)..=Size::of_mib(16_384);
    }
    /// The same on the disk, for `skyway replay` and after a restart. The oldest go first.
    decisions: Decisions {
        /// No more of the file than this.
        bytes: Size = Size::of_mib(256), Size::of_mib(1)..=Size::of_mib(1_048_576);
        /// For so long.
        age: Duration = 30 * DAY, HOUR..=3_650 * DAY;
    }
    /// Events that are kept for those who resume a stream.
    events: Events {
        /// The most that are kept; the oldest go first.
        count: usize = 10_000, 1..=10_000_000;
        /// And no more memory than this.
        bytes: Size = Size::of_mib(64), Size::of_kib(64)..=Size::of_mib(16_384);
    }
    /// Last known positions.
    drones: Drones {
        /// The most drones of which it is kept; of those that fly no plan the ones heard least recently go first.
        count: usize = 50_000, 1..=10_000_000;
        /// A drone on its way of which nothing was heard for so long is silent: it is asked where it is, and its session
        /// may be taken over by another one.
        silent_after: Duration = 15 * SECOND, SECOND..=HOUR;
    }
    /// Answers that are kept for requests sent again with the same idempotency key.
    idempotency: Idempotency {
        /// The most that are kept; the oldest of the subject that has the most go first.
        count: usize = 20_000, 1..=10_000_000;
        /// And no more memory than this, for failure reports and for writes each.
        bytes: Size = Size::of_mib(64), Size::of_kib(64)..=Size::of_mib(16_384);
        /// For so long.
        age: Duration = DAY, MINUTE..=7 * DAY;
    }
    /// Shortest-path trees that are kept for the next search.
    trees: Trees {
        /// No more memory than this.
        bytes: Size = Size::of_mib(256), Size::of_mib(1)..=Size::of_mib(65_536);
    }
    /// The registry that the edge follows and tells its changes to. Without one it is its own authority.
    registry: RegistryLink {
        /// Where it is reached, such as `http://127.0.0.1:8180` or `https://registry.example`; empty for none. On
        /// another machine it is reached by https, for which there is a proxy in front of it.
        url: Option<String> = None;
        /// The id of the network at the registry.
        network: String = "sydney".to_owned();
        /// The certificates of the authorities that the registry's certificate has to be from, PEM; empty for those of
        /// the system.
        ca_file: Option<PathBuf> = None;
        /// What this edge is called there, which is the subject of its token where it has one; empty for a name
        /// made at random.
        edge_id: Option<String> = None;
        /// Where the registry reaches this edge, such as `https://edge-1.example`, to order deliveries; empty where it
        /// does not.
        advertise: Option<String> = None;
        /// The file with the token of the role edge, which only its owner may read; empty for none.
        token_file: Option<PathBuf> = None;
        /// Reach a registry on another machine by http. Token and airspace then cross the network in the clear.
        allow_plaintext: bool = false;
        /// How long a question for news waits at the registry, a fifth more or less.
        poll_wait: Duration = 10 * SECOND, Duration::from_millis(100)..=5 * MINUTE;
        /// The longest wait between questions after failures.
        retry_within: Duration = MINUTE, Duration::from_millis(100)..=HOUR;
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
    /// Traces of requests, in the form of OpenTelemetry.
    traces: Traces {
        /// Where a collector takes OTLP over HTTP, such as http://127.0.0.1:4318/v1/traces; empty for none. What it
        /// does not take in time is dropped.
        endpoint: Option<HttpUrl> = None;
        /// The part of the requests that is traced where the client does not decide.
        share: f64 = 1.0, 0.0..=1.0;
    }
    /// A clock for simulators, on loopback only. Every answer then says what clock it is.
    clock: ClockConfig {
        /// What moves it: machine; or external, so that it stands still until a client moves it (POST
        /// /v1/clock:advance). The edge then has a store of its own, which a restart continues, and follows
        /// no registry.
        kind: ClockMover = ClockMover::Machine;
        /// What it shows at the start; empty for the machine's time.
        start: Option<Timestamp> = None;
        /// How many times faster than the machine's it runs.
        rate: f64 = 1.0, 0.001..=10_000.0;
    }
}

impl Configuration for EdgeConfig {
    const ENVIRONMENT_PREFIX: &'static str = "SKYWAY_EDGE_";
    const INTRODUCTION: &'static str = "\
# The configuration of a Skyway edge: every setting, with its default commented out.
#
# A flag wins over the environment, the environment over this file. The variable of limits.body is
# SKYWAY_EDGE_LIMITS_BODY, its flag --set limits.body=1MiB. Paths are relative to the working directory.
# `skyway config check --config FILE` finds every fault; `skyway config show --origin` tells who said what.
# `skyway config sample` writes this file.
";
    const SETTINGS: &'static [Setting<Self>] = SETTINGS;
    const SECTIONS: &'static [(&'static str, &'static [&'static str])] = SECTIONS;

    fn exposure(&self) -> Exposure<'_> {
        Exposure {
            listen: self.listen,
            admin_listen: self.admin_listen,
            tokens_file: self.tokens_file.as_deref(),
            allow_plaintext: self.allow_plaintext,
            is_clock_external: self.clock.kind == ClockMover::External,
            clock_start: self.clock.start,
            clock_rate: self.clock.rate,
        }
    }

    fn own_faults(effective: &EffectiveConfig<Self>) -> Vec<ConfigFault> {
        let mut faults = Vec::new();
        let freshness = &effective.config.freshness;
        if freshness.degraded_after <= freshness.stale_after {
            let origin = effective.origin("freshness.degraded_after");
            faults.push(ConfigFault::Freshness { origin });
        }
        faults.extend(flight_faults(effective));
        faults.extend(registry_faults(effective));
        faults.extend(clock_faults(effective));
        faults
    }
}

/// What does not go with a clock that clients move.
fn clock_faults(effective: &EffectiveConfig<EdgeConfig>) -> Vec<ConfigFault> {
    let config = &effective.config;
    let mut faults = Vec::new();
    if config.clock.kind != ClockMover::External {
        return faults;
    }
    if config.registry.url.is_some() {
        let origin = effective.origin("registry.url");
        faults.push(ConfigFault::RegistryOfAnotherClock { origin });
    }
    if config.clock.rate != 1.0 {
        let origin = effective.origin("clock.rate");
        faults.push(ConfigFault::RateOfExternalClock { origin });
    }
    faults
}

impl Flight {
    /// The word for no airframe.
    const NONE: &'static str = "none";
    /// The airframe where nothing is said.
    const DEFAULT: &'static str = "phantom3";

    /// The airframe of a drone that names no other; `None` where plans are by distance.
    pub fn default_airframe(&self) -> Option<&str> {
        let named = self.airframe.as_deref().unwrap_or(Self::DEFAULT);
        Some(named).filter(|name| *name != Self::NONE)
    }
}

/// What is wrong with what is to fly.
fn flight_faults(effective: &EffectiveConfig<EdgeConfig>) -> Vec<ConfigFault> {
    let flight = &effective.config.flight;
    let mut faults = Vec::new();
    let default = flight.default_airframe();
    let named = default.map(|name| ("flight.airframe", name));
    let further = flight
        .airframes
        .iter()
        .map(|name| ("flight.airframes", name));
    let mut names = Vec::new();
    for (setting, name) in named.into_iter().chain(further) {
        let origin = effective.origin(setting);
        match read_airframe(name) {
            Ok(airframe) if names.contains(&airframe.name) => {
                let name = airframe.name;
                faults.push(ConfigFault::AirframeTwice { origin, name });
            }
            Ok(airframe) => names.push(airframe.name),
            Err(error) => faults.push(ConfigFault::Airframe {
                origin,
                setting,
                error,
            }),
        }
    }
    if default.is_none() && flight.airframes.iter().next().is_some() {
        let origin = effective.origin("flight.airframes");
        faults.push(ConfigFault::NoDefaultAirframe { origin });
    }
    if flight.floor_fraction > flight.reserve_fraction {
        let origin = effective.origin("flight.floor_fraction");
        faults.push(ConfigFault::Floor { origin });
    }
    faults
}

/// What is wrong with how the registry is to be reached.
fn registry_faults(effective: &EffectiveConfig<EdgeConfig>) -> Vec<ConfigFault> {
    let registry = &effective.config.registry;
    let Some(url) = &registry.url else {
        return Vec::new();
    };
    let mut faults = Vec::new();
    let origin = effective.origin("registry.url");
    match host_of(url) {
        None => faults.push(ConfigFault::RegistryUrl {
            origin,
            setting: "registry.url",
            url: url.clone(),
        }),
        Some((Transport::Plain, host)) if !is_this_machine(host) && !registry.allow_plaintext => {
            faults.push(ConfigFault::RegistryPlainText {
                origin,
                host: host.to_owned(),
            });
        }
        Some(_) => {}
    }
    let advertised = registry.advertise.iter();
    let not_one = advertised.filter(|url| host_of(url).is_none());
    faults.extend(not_one.map(|url| ConfigFault::RegistryUrl {
        origin: effective.origin("registry.advertise"),
        setting: "registry.advertise",
        url: url.clone(),
    }));
    let authorities = registry.ca_file.as_deref().map(read_authorities);
    if let Some(Err(error)) = authorities {
        let origin = effective.origin("registry.ca_file");
        faults.push(ConfigFault::RegistryAuthorities { origin, error });
    }
    let token = registry.token_file.as_deref().map(read_bearer);
    if let Some(Err(error)) = token {
        let origin = effective.origin("registry.token_file");
        faults.push(ConfigFault::RegistryToken { origin, error });
    }
    // An edge that only waits for news must not seem stale meanwhile.
    let longest = registry.poll_wait.mul_f64(1.2);
    if longest >= effective.config.freshness.stale_after {
        let origin = effective.origin("registry.poll_wait");
        faults.push(ConfigFault::PollWait { origin });
    }
    faults
}

/// Whether what is sent is encrypted.
enum Transport {
    Encrypted,
    Plain,
}

/// The host of a URL of HTTP, and how it is reached.
fn host_of(url: &str) -> Option<(Transport, &str)> {
    let (transport, rest) = match url.strip_prefix("https://") {
        Some(rest) => (Transport::Encrypted, rest),
        None => (Transport::Plain, url.strip_prefix("http://")?),
    };
    let authority = rest.split(['/', '?', '#']).next()?;
    let host = match authority.strip_prefix('[') {
        Some(rest) => rest.split(']').next()?,
        None => authority.split(':').next()?,
    };
    let is_host = !host.is_empty() && !host.contains(['@', ' ']);
    is_host.then_some((transport, host))
}

/// Whether a host is this machine by its name or address, without asking anyone.
fn is_this_machine(host: &str) -> bool {
    let address = host.parse::<std::net::IpAddr>();
    host == "localhost" || address.is_ok_and(|address| address.to_canonical().is_loopback())
}

/// The bounds of a figure that both the configuration and documents state; all of them include their ends.
const fn numbers(range: FigureRange) -> RangeInclusive<f64> {
    range.least..=range.most
}

/// The same of a time in seconds.
fn seconds(range: FigureRange) -> RangeInclusive<Duration> {
    Duration::from_secs_f64(range.least)..=Duration::from_secs_f64(range.most)
}
