//! The bounds and lives that the edge works with, already checked.

use jiff::SignedDuration;
use skyway_engine::delivery::DEFAULT_REFUGE_STAY_S;
use skyway_engine::flight::{Airframe, FailureType, FlightRules, Tariff, Wind};
use skyway_engine::itinerary::{Limits, Objective};
use skyway_service::config::EdgeConfig;
use std::sync::Arc;
use std::time::Duration;

/// How long a closure that a report publishes lasts, by failure type (those that publish anything).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClosureLives {
    /// Adverse weather.
    pub environmental: SignedDuration,
    /// An obstacle.
    pub navigational: SignedDuration,
    /// Restricted airspace.
    pub regulatory: SignedDuration,
    /// Pads that cannot be used.
    pub infrastructure: SignedDuration,
}

impl ClosureLives {
    /// The life of what a report of this type publishes; `None` where it publishes nothing.
    pub fn of(&self, failure: FailureType) -> Option<SignedDuration> {
        match failure {
            FailureType::Environmental => Some(self.environmental),
            FailureType::Navigational => Some(self.navigational),
            FailureType::Regulatory => Some(self.regulatory),
            FailureType::Infrastructure => Some(self.infrastructure),
            FailureType::Operational | FailureType::ServiceLevel => None,
        }
    }
}

/// What flies, and by which rules.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightSettings {
    /// What flies where a request names no airframe.
    pub airframe: Arc<Airframe>,
    /// What else may be named.
    pub airframes: Vec<Arc<Airframe>>,
    /// Margins and overheads; how plans keep apart is as in [`Settings`].
    pub rules: FlightRules,
    /// What a delivery costs.
    pub tariff: Tariff,
    /// What is made least by default.
    pub objective: Objective,
    /// How long an alternate's pad has to be free, in seconds.
    pub refuge_stay_s: f64,
    /// Ids of the nodes that swap batteries instead of charging them; those that the network does not have count for nothing.
    pub swap_stations: Vec<String>,
    /// The wind where and when the weather states none.
    pub base_wind: Wind,
    /// A drone that is so much earlier or later than its plan, in seconds, is off plan.
    pub late_tolerance_s: f64,
    /// And one whose battery is lower than planned by this fraction.
    pub battery_tolerance: f64,
    /// How many checks a search does in a second here: what bounds searches in time.
    pub checks_per_s: f64,
}

impl FlightSettings {
    /// The defaults, with an airframe.
    pub fn of(airframe: Airframe) -> Self {
        Self {
            airframe: Arc::new(airframe),
            airframes: Vec::new(),
            rules: FlightRules::default(),
            tariff: Tariff::default(),
            objective: Objective::Distance,
            refuge_stay_s: DEFAULT_REFUGE_STAY_S,
            swap_stations: Vec::new(),
            base_wind: Wind::CALM,
            late_tolerance_s: 60.0,
            battery_tolerance: 0.1,
            checks_per_s: Limits::CHECKS_PER_S,
        }
    }

    /// The airframe of a name; the bundled ones have short names too.
    pub fn airframe(&self, name: &str) -> Option<&Arc<Airframe>> {
        let name = match name {
            "phantom3" => &Airframe::phantom3().name,
            "m100" => &Airframe::m100().name,
            own => own,
        };
        let mut all = std::iter::once(&self.airframe).chain(&self.airframes);
        all.find(|airframe| airframe.name == name)
    }
}

/// What the edge works with.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How far ahead a window counts as closing already.
    pub horizon: SignedDuration,
    /// By how much a zone is widened where it does not say, in metres.
    pub margin_m: f64,
    /// Lives of closures from reports.
    pub lives: ClosureLives,
    /// At most this many closures of one drone's reports at a time.
    pub alive_per_drone: usize,
    /// At most this many closures of the reports of one drone or fleet, by its token, at a time.
    pub alive_per_subject: usize,
    /// At most this share of the segments, and of the nodes with pads, is closed by reports.
    pub closed_fraction_max: f64,
    /// At most this many zones.
    pub zones_max: usize,
    /// At most this many closures that no zone causes.
    pub closures_max: usize,
    /// At most this many plans that are not over.
    pub plans_max: usize,
    /// The highest priority that drones and fleets may ask for.
    pub priority_max: u8,
    /// The subjects of their tokens that may ask for any nonetheless.
    pub urgent: Vec<String>,
    /// Two plans on one segment in the same direction conflict within this time, in seconds.
    pub headway_s: f64,
    /// Flown plans pass a node or land there at least this far apart, in seconds; 0 lets them pass together.
    pub node_headway_s: f64,
    /// Flown plans are not at the same time where segments come nearer to each other than this, in metres; 0 lets
    /// them.
    pub crossing_m: f64,
    /// How long a recomposed version waits for its acknowledgement.
    pub acknowledge_within: SignedDuration,
    /// So long after its arrival, or the last sign of its drone, a plan that has not ended is lost.
    pub lost_after: SignedDuration,
    /// At most this many answers are kept.
    pub records_max: usize,
    /// At most about this many bytes of answers and of the worlds they were computed on are kept.
    pub records_bytes_max: usize,
    /// At most this many bytes of decisions are kept on the disk.
    pub decisions_bytes_max: u64,
    /// How long they are kept there.
    pub decisions_age: SignedDuration,
    /// At most this many events are kept.
    pub events_max: usize,
    /// At most about this many bytes of events are kept.
    pub events_bytes_max: usize,
    /// At most this many event streams are open.
    pub event_streams_max: usize,
    /// A drone on its way of which nothing was heard for so long is silent.
    pub silent_after: SignedDuration,
    /// At most this many drones are remembered.
    pub drones_max: usize,
    /// At most this many answers are kept for repeated requests.
    pub idempotency_max: usize,
    /// And at most about this many bytes of them, with the worlds they were computed on, twice: for reports and for writes.
    pub idempotency_bytes_max: usize,
    /// How long they are kept.
    pub idempotency_age: SignedDuration,
    /// At most this many reports or positions in one batch.
    pub batch_max: usize,
    /// Bytes that the tables of destinations may take.
    pub trees_bytes: usize,
    /// Whether what is changed here is told to a registry.
    pub follows_registry: bool,
    /// Not known to be current for so long: answers are stale.
    pub stale_after: SignedDuration,
    /// Not known to be current for so long: answers are degraded.
    pub degraded_after: SignedDuration,
    /// A write to the disk that takes longer counts as failing: the caller is told so.
    pub commit_within: Duration,
    /// What flies, where times and energy are computed; without it times are nominal and energy is not checked.
    pub flight: Option<FlightSettings>,
    /// Whether that was named and is no default: over a store of before there was one, only what is named counts.
    pub names_airframe: bool,
}

impl Settings {
    /// Out of a configuration, with what flies.
    pub fn of(config: &EdgeConfig, flight: Option<FlightSettings>) -> Self {
        // Bounds on durations are checked when the configuration is read.
        let span =
            |duration: Duration| SignedDuration::try_from(duration).unwrap_or(SignedDuration::MAX);
        let reports = &config.reports;
        Self {
            commit_within: config.limits.commit,
            flight,
            names_airframe: config.flight.airframe.is_some(),
            decisions_bytes_max: config.decisions.bytes.bytes() as u64,
            decisions_age: span(config.decisions.age),
            horizon: span(config.airspace.horizon),
            margin_m: config.airspace.margin_m,
            lives: ClosureLives {
                environmental: span(reports.life_environmental),
                navigational: span(reports.life_navigational),
                regulatory: span(reports.life_regulatory),
                infrastructure: span(reports.life_infrastructure),
            },
            alive_per_drone: reports.alive_per_drone,
            alive_per_subject: reports.alive_per_subject,
            closed_fraction_max: reports.closed_fraction_max,
            zones_max: config.airspace.zones_max,
            closures_max: config.airspace.closures_max,
            plans_max: config.plans.active_max,
            priority_max: config.plans.priority_max,
            urgent: config.plans.urgent.iter().map(str::to_owned).collect(),
            headway_s: config.plans.headway.as_secs_f64(),
            node_headway_s: config.plans.node_headway.as_secs_f64(),
            crossing_m: config.plans.crossing_m,
            acknowledge_within: span(config.plans.acknowledge_within),
            lost_after: span(config.plans.lost_after),
            records_max: config.records.count,
            records_bytes_max: config.records.bytes.bytes(),
            events_max: config.events.count,
            events_bytes_max: config.events.bytes.bytes(),
            event_streams_max: config.limits.event_streams,
            silent_after: span(config.drones.silent_after),
            drones_max: config.drones.count,
            idempotency_max: config.idempotency.count,
            idempotency_bytes_max: config.idempotency.bytes.bytes(),
            idempotency_age: span(config.idempotency.age),
            batch_max: config.limits.batch,
            trees_bytes: config.trees.bytes.bytes(),
            follows_registry: config.registry.url.is_some(),
            stale_after: span(config.freshness.stale_after),
            degraded_after: span(config.freshness.degraded_after),
        }
    }
}

/// Where nothing is configured and nothing is said of what flies.
impl Default for Settings {
    fn default() -> Self {
        Self {
            names_airframe: true,
            ..Self::of(&EdgeConfig::default(), None)
        }
    }
}
