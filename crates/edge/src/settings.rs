//! The bounds and lives that the edge works with, already checked.

use crate::plans::entry::PRIORITY;
use jiff::SignedDuration;
use skyway_engine::airspace::DEFAULT_MARGIN_M;
use skyway_engine::delivery::DEFAULT_REFUGE_STAY_S;
use skyway_engine::flight::{Airframe, FailureType, FlightRules, Tariff, Wind};
use skyway_engine::itinerary::{Limits, Objective};
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

impl Default for Settings {
    fn default() -> Self {
        Self {
            horizon: SignedDuration::from_mins(10),
            margin_m: DEFAULT_MARGIN_M,
            lives: ClosureLives {
                environmental: SignedDuration::from_mins(30),
                navigational: SignedDuration::from_mins(15),
                regulatory: SignedDuration::from_mins(60),
                infrastructure: SignedDuration::from_mins(30),
            },
            alive_per_drone: 3,
            alive_per_subject: 10,
            closed_fraction_max: 0.01,
            zones_max: 20_000,
            closures_max: 20_000,
            plans_max: 20_000,
            priority_max: PRIORITY,
            urgent: Vec::new(),
            headway_s: 30.0,
            node_headway_s: FlightRules::default().node_headway_s,
            crossing_m: FlightRules::default().crossing_m,
            acknowledge_within: SignedDuration::from_secs(60),
            lost_after: SignedDuration::from_hours(1),
            records_max: 10_000,
            records_bytes_max: 64 << 20,
            decisions_bytes_max: 256 << 20,
            decisions_age: SignedDuration::from_hours(30 * 24),
            events_max: 10_000,
            events_bytes_max: 64 << 20,
            event_streams_max: 256,
            silent_after: SignedDuration::from_secs(15),
            drones_max: 50_000,
            idempotency_max: 20_000,
            idempotency_bytes_max: 64 << 20,
            idempotency_age: SignedDuration::from_hours(24),
            batch_max: 1_000,
            trees_bytes: 256 << 20,
            follows_registry: false,
            stale_after: SignedDuration::from_secs(30),
            degraded_after: SignedDuration::from_mins(5),
            commit_within: Duration::from_secs(2),
            flight: None,
            names_airframe: true,
        }
    }
}
