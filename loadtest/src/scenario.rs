//! Scenario files: what is sent, how fast, to which servers, and what it is held against.
//!
//! They are read strictly: a key that is not known is an error that names the file, the line and the key.

use crate::objective::Objective;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What is left of a scenario that is only to be seen to work.
const QUICK_S: f64 = 0.4;
const QUICK_PER_S: f64 = 300.0;
const QUICK_PLANS: usize = 40;
const QUICK_ZONES: usize = 200;

/// Why a scenario cannot be run as it is written.
#[derive(Debug, Error)]
pub(crate) enum Unusable {
    /// The file cannot be read.
    #[error("{}: {error}", path.display())]
    Unreadable {
        path: PathBuf,
        error: std::io::Error,
    },
    /// It is not a scenario: a key that is not known, one that lacks, or a value of the wrong kind.
    #[error("{}: {error}", path.display())]
    Malformed {
        path: PathBuf,
        error: Box<toml::de::Error>,
    },
    /// A value that contradicts another one.
    #[error("{}: {key}: {what}", path.display())]
    Contradictory {
        path: PathBuf,
        key: String,
        what: String,
    },
}

/// How drones and operators speak to the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Dialect {
    Rest,
    Grpc,
}

impl Dialect {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Grpc => "grpc",
        }
    }

    pub(crate) const fn title(self) -> &'static str {
        match self {
            Self::Rest => "REST",
            Self::Grpc => "gRPC",
        }
    }
}

/// How requests follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Arrivals {
    /// With the same time between any two.
    Constant,
    /// Independently of each other: times between them are exponential.
    Poisson,
}

impl Arrivals {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Poisson => "Poisson",
        }
    }
}

/// What a request is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Operation {
    /// Failure reports: one, or a batch; dry runs unless they are to publish.
    Recompose,
    /// Delivery requests; beyond `live` plans the oldest is cancelled in turn.
    Compose,
    /// Zones; beyond `live` of them the oldest is lifted in turn.
    Zone,
    /// Positions of drones.
    Telemetry,
    /// Nodes, plans, zones and closures in turn.
    Read,
    /// The list of what was answered, four hundred entries: costly to tell.
    History,
}

/// One kind of request, and how large its part of all of them is.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Share {
    pub(crate) operation: Operation,
    /// Relative to the others.
    pub(crate) weight: f64,
    /// Reports, or positions, in a request.
    #[serde(default = "one")]
    pub(crate) batch: usize,
    /// How many plans, zones, or closures of published reports are kept.
    #[serde(default)]
    pub(crate) live: usize,
    /// Reports that close what they name for everyone; `live` closures stand, the oldest is lifted in turn.
    #[serde(default)]
    pub(crate) publish: bool,
}

/// The edge, and whether it follows a registry.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Servers {
    pub(crate) network: String,
    /// Keep everything in a file, as an edge does by default.
    pub(crate) store: bool,
    pub(crate) registry: bool,
    /// What differs from the production configuration, as `name=value`.
    pub(crate) settings: Vec<String>,
}

impl Default for Servers {
    fn default() -> Self {
        Self {
            network: "sydney".to_owned(),
            store: true,
            registry: false,
            settings: Vec::new(),
        }
    }
}

/// The plans that are flown, and the failures on them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Fleet {
    /// Composed by the edge before anything is measured.
    pub(crate) plans: usize,
    /// Different failures on their legs.
    pub(crate) reports: usize,
    /// So slow that no plan ends while it is measured.
    pub(crate) airspeed_mps: f64,
}

impl Default for Fleet {
    fn default() -> Self {
        Self {
            plans: 400,
            reports: 1000,
            airspeed_mps: 0.5,
        }
    }
}

/// The side that asks.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Client {
    pub(crate) dialects: Vec<Dialect>,
    pub(crate) arrivals: Arrivals,
    /// Over HTTP/1.1, each with one request under way.
    pub(crate) rest_connections: usize,
    /// Over HTTP/2, each with many.
    pub(crate) grpc_connections: usize,
    /// What cannot be sent within this bound is an error called `unsent`.
    pub(crate) in_flight: usize,
    /// From the intended send time.
    pub(crate) timeout_s: f64,
}

impl Default for Client {
    fn default() -> Self {
        Self {
            dialects: vec![Dialect::Rest, Dialect::Grpc],
            arrivals: Arrivals::Poisson,
            rest_connections: 128,
            grpc_connections: 4,
            in_flight: 2048,
            timeout_s: 5.0,
        }
    }
}

/// How the capacity is found that phases are told in parts of: this many requests are under way all the time.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Capacity {
    /// Fewer than the server admits, so that nothing is shed.
    pub(crate) in_flight: usize,
    pub(crate) warm_up_s: f64,
    pub(crate) measured_s: f64,
}

/// What happens as a phase begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub(crate) enum Event {
    /// The registry ends without a word.
    RegistryOutage,
    /// It is there again.
    RegistryBack,
    /// Before the phase, cut off from the edge, the registry gets this many zones; then the edge sees them all at once.
    /// The phase ends as soon as the edge has taken them over.
    ZoneStorm {
        zones: usize,
        /// One of this many is in force now; the others begin tomorrow.
        in_force_one_of: usize,
    },
}

/// A stretch of time with one rate.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Phase {
    pub(crate) name: String,
    /// Requests per second; or `of_capacity`.
    #[serde(default)]
    pub(crate) rate_per_s: Option<f64>,
    /// Requests per second as a part of the capacity that was found.
    #[serde(default)]
    pub(crate) of_capacity: Option<f64>,
    /// Sent, and left out of every figure.
    #[serde(default)]
    pub(crate) warm_up_s: f64,
    pub(crate) measured_s: f64,
    #[serde(default)]
    pub(crate) event: Option<Event>,
}

/// Steps of a rate that grows until the server no longer keeps up.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Ramp {
    pub(crate) from_per_s: f64,
    pub(crate) to_per_s: f64,
    /// The factor from each step to the next.
    pub(crate) factor: f64,
    pub(crate) step_s: f64,
    /// A step is kept up where p99 is at most this,
    pub(crate) p99_ms: f64,
    /// and this part of what was offered is answered.
    pub(crate) answered_share: f64,
}

/// A scenario as its file tells it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Scenario {
    /// The name of the file.
    #[serde(skip)]
    pub(crate) name: String,
    pub(crate) title: String,
    /// Only with `--long`, or where it is named.
    #[serde(default)]
    pub(crate) long: bool,
    pub(crate) seed: u64,
    /// How often everything is measured, each time with servers of its own.
    pub(crate) repetitions: usize,
    /// Also measure the echo, in turns with the edge.
    #[serde(default)]
    pub(crate) echo: bool,
    #[serde(default)]
    pub(crate) servers: Servers,
    #[serde(default)]
    pub(crate) fleet: Fleet,
    #[serde(default)]
    pub(crate) client: Client,
    pub(crate) mix: Vec<Share>,
    #[serde(default)]
    pub(crate) capacity: Option<Capacity>,
    #[serde(default)]
    pub(crate) ramp: Option<Ramp>,
    #[serde(default)]
    pub(crate) phases: Vec<Phase>,
    #[serde(default)]
    pub(crate) objectives: Vec<Objective>,
}

fn one() -> usize {
    1
}

/// The text of a file.
pub(crate) fn text_of(path: &Path) -> Result<String, Unusable> {
    std::fs::read_to_string(path).map_err(|error| Unusable::Unreadable {
        path: path.to_owned(),
        error,
    })
}

/// What a file says, and the name that it has from the file.
pub(crate) fn named<T: DeserializeOwned>(path: &Path, text: &str) -> Result<(T, String), Unusable> {
    let read = toml::from_str(text).map_err(|error| Unusable::Malformed {
        path: path.to_owned(),
        error: Box::new(error),
    })?;
    let stem = path.file_stem().unwrap_or_default();
    Ok((read, stem.to_string_lossy().into_owned()))
}

impl Scenario {
    /// Reads a file.
    ///
    /// # Errors
    /// Where it cannot be read, has a key that is not known, or contradicts itself.
    pub(crate) fn read(path: &Path) -> Result<Self, Unusable> {
        Self::parse(path, &text_of(path)?)
    }

    pub(crate) fn parse(path: &Path, text: &str) -> Result<Self, Unusable> {
        let (mut scenario, name) = named::<Self>(path, text)?;
        scenario.name = name;
        match scenario.contradiction() {
            None => Ok(scenario),
            Some((key, what)) => Err(Unusable::Contradictory {
                path: path.to_owned(),
                key,
                what,
            }),
        }
    }

    fn contradiction(&self) -> Option<(String, String)> {
        let told = |key: &str, what: &str| Some((key.to_owned(), what.to_owned()));
        if self.repetitions == 0 {
            return told("repetitions", "at least 1");
        }
        if self.client.dialects.is_empty() {
            return told("client.dialects", "at least one of 'rest' and 'grpc'");
        }
        if self.mix.is_empty() {
            return told("mix", "nothing is sent; name an operation");
        }
        if self.phases.is_empty() && self.ramp.is_none() {
            return told("phases", "nothing is measured; add a phase or a ramp");
        }
        if self.ramp.as_ref().is_some_and(|ramp| ramp.factor <= 1.0) {
            return told("ramp.factor", "more than 1, else the ramp never ends");
        }
        let flies = |share: &Share| {
            !matches!(
                share.operation,
                Operation::Read | Operation::Zone | Operation::History
            )
        };
        if (self.fleet.plans == 0 || self.fleet.reports == 0) && self.mix.iter().any(flies) {
            return told("fleet", "this mix needs plans and reports");
        }
        self.mix
            .iter()
            .find_map(Share::contradiction)
            .or_else(|| self.phase_contradiction())
            .or_else(|| self.echo_contradiction())
            .or_else(|| self.objective_contradiction())
    }

    fn phase_contradiction(&self) -> Option<(String, String)> {
        let mut names = BTreeSet::new();
        for phase in &self.phases {
            let key = format!("phases '{}'", phase.name);
            if !names.insert(&phase.name) {
                return Some((key, "there are two of this name".to_owned()));
            }
            let what = match (phase.rate_per_s, phase.of_capacity) {
                (Some(rate), None) if rate > 0.0 => None,
                (None, Some(part)) if part > 0.0 && self.capacity.is_some() => None,
                (None, Some(_)) => Some("of_capacity needs a [capacity] to be a part of"),
                _ => Some("name a positive rate_per_s or of_capacity, and not both"),
            };
            if let Some(what) = what {
                return Some((key, what.to_owned()));
            }
            if phase.event.is_some() && !self.servers.registry {
                return Some((key, "this event needs servers.registry = true".to_owned()));
            }
        }
        None
    }

    fn echo_contradiction(&self) -> Option<(String, String)> {
        let is_single = |share: &Share| share.operation == Operation::Recompose && share.batch == 1;
        if !self.echo
            || self
                .mix
                .iter()
                .all(|share| is_single(share) && !share.publish)
        {
            return None;
        }
        let what = "the echo answers single failure reports that publish nothing";
        Some(("echo".to_owned(), what.to_owned()))
    }

    fn objective_contradiction(&self) -> Option<(String, String)> {
        let contradiction = |objective: &Objective| {
            let what = objective.contradiction(self)?;
            Some((format!("objectives '{}'", objective.measure.name()), what))
        };
        self.objectives.iter().find_map(contradiction)
    }

    /// The same in a few tenths of a second: whether everything works, not how fast.
    pub(crate) fn quickened(mut self) -> Self {
        self.repetitions = 1;
        self.fleet.plans = self.fleet.plans.min(QUICK_PLANS);
        self.fleet.reports = self.fleet.reports.min(QUICK_PLANS);
        if let Some(capacity) = &mut self.capacity {
            capacity.warm_up_s = 0.0;
            capacity.measured_s = QUICK_S;
        }
        if let Some(ramp) = &mut self.ramp {
            ramp.step_s = QUICK_S;
            ramp.to_per_s = ramp.from_per_s * ramp.factor;
        }
        for phase in &mut self.phases {
            phase.warm_up_s = 0.0;
            phase.measured_s = phase.measured_s.min(QUICK_S);
            phase.rate_per_s = phase.rate_per_s.map(|rate| rate.min(QUICK_PER_S));
            if let Some(Event::ZoneStorm { zones, .. }) = &mut phase.event {
                *zones = (*zones).min(QUICK_ZONES);
            }
        }
        self
    }

    pub(crate) fn phase(&self, name: &str) -> Option<&Phase> {
        self.phases.iter().find(|phase| phase.name == name)
    }
}

impl Share {
    fn contradiction(&self) -> Option<(String, String)> {
        let told = |what: &str| Some((format!("mix '{:?}'", self.operation), what.to_owned()));
        let takes_batch = matches!(self.operation, Operation::Recompose | Operation::Telemetry);
        let keeps = self.publish || matches!(self.operation, Operation::Compose | Operation::Zone);
        if !(self.weight.is_finite() && self.weight > 0.0) {
            return told("weight has to be positive");
        }
        if self.batch == 0 || (self.batch > 1 && !takes_batch) {
            return told("batch is for 'recompose' and 'telemetry', and at least 1");
        }
        if self.publish && (self.operation != Operation::Recompose || self.batch > 1) {
            return told("publish is for 'recompose', one report at a time");
        }
        if keeps != (self.live > 0) {
            return told(
                "live is how many are kept: of 'compose', of 'zone', and of 'recompose' with publish",
            );
        }
        None
    }
}
