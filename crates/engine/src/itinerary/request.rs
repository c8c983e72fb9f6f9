//! What is asked of a search over position, time and battery, and what it answers.

use super::active_traffic::ActiveTraffic;
use super::separation::Separation;
use crate::airspace::Bits;
use crate::flight::{
    Charging, FlightLegs, FlightPlan, FlightRules, FlightStart, SharedCrossings, TrafficLeg,
    Vertical,
};
use crate::network::{NodeIx, SegmentIx, Topology};
use serde::{Deserialize, Serialize};

/// What a plan makes least. Ties go to the earliest arrival.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Metres flown.
    Distance,
    /// The arrival itself.
    Time,
    /// Energy drawn.
    Energy,
}

impl Objective {
    /// All objectives.
    pub const ALL: [Self; 3] = [Self::Distance, Self::Time, Self::Energy];

    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::Time => "time",
            Self::Energy => "energy",
        }
    }
}

/// A request: from one of some starts to a destination.
#[derive(Clone, Debug)]
pub struct FlightRequest<'a> {
    /// Where the plan may begin; at most [`MAX_STARTS`](super::MAX_STARTS) are looked at.
    pub starts: &'a [FlightStart],
    /// Where it leads.
    pub destination: NodeIx,
    /// What is made least.
    pub objective: Objective,
    /// When the plan began, in seconds: windows widen with the time since then.
    pub began_s: f64,
    /// The latest landing at the destination, in seconds.
    pub deadline_s: f64,
    /// The battery at every node is at least this: the reserve, or the floor.
    pub reserve: f64,
    /// Segments closed for this request alone.
    pub closed_segments: &'a [SegmentIx],
    /// How much may be spent.
    pub limits: Limits<'a>,
}

impl FlightRequest<'_> {
    /// A reserve that no battery falls below: for who has to land whatever is left.
    pub const NO_RESERVE: f64 = -1_000.0;
}

/// A label takes at least so many checks, with the flights over the legs from its node.
const CHECKS_PER_LABEL: usize = 40;
/// No search is bounded by fewer labels.
const LEAST_LABELS: usize = 256;

/// What bounds a search; past a bound the best plan so far is the answer.
#[derive(Clone, Copy)]
pub struct Limits<'a> {
    /// Labels taken from the queue, in all steps together.
    pub labels: usize,
    /// Comparisons of two labels, of labels with openings, and what flights over legs take in such comparisons.
    pub checks: usize,
    /// Asked now and then; true ends the search. What knows the time stands above the pure half.
    pub is_over: Option<&'a dyn Fn() -> bool>,
}

impl Limits<'_> {
    /// For who can wait for a proof: seconds at the worst.
    pub const THOROUGH: Self = Self {
        labels: 200_000,
        checks: 20_000_000,
        is_over: None,
    };

    /// Checks that a search does in a second, at least, on a core of a server of 2020. A
    /// [`Yardstick`](super::Yardstick) tells how many another one does.
    pub const CHECKS_PER_S: f64 = 40e6;

    /// Bounds that a search reaches after about so many seconds on a core that does so many checks in a second.
    ///
    /// Checks bound the time: whatever takes any is counted in them. Labels bound the memory.
    pub fn within(seconds: f64, checks_per_s: f64) -> Self {
        let checks = (seconds * checks_per_s) as usize;
        Self {
            labels: (checks / CHECKS_PER_LABEL).max(LEAST_LABELS),
            checks: checks.max(LEAST_LABELS * CHECKS_PER_LABEL),
            is_over: None,
        }
    }

    /// Bounds for a request that a client waits for.
    pub fn of_request(objective: Objective, checks_per_s: f64) -> Self {
        let seconds = match objective {
            Objective::Distance | Objective::Energy => 0.02,
            Objective::Time => 0.05,
        };
        Self::within(seconds, checks_per_s)
    }

    /// Bounds for one of many plans that are made anew together.
    pub fn of_replanning(checks_per_s: f64) -> Self {
        Self::within(0.002, checks_per_s)
    }

    /// One part in so many, for each of several searches; enough to find a plan where little is in the way.
    #[must_use]
    pub fn share(self, parts: usize) -> Self {
        let parts = parts.max(1);
        let least = Self::within(0.0, 0.0);
        Self {
            labels: (self.labels / parts).max(least.labels.min(self.labels)),
            checks: (self.checks / parts).max(least.checks.min(self.checks)),
            is_over: self.is_over,
        }
    }
}

/// As [`Limits::of_request`] by time, without having measured.
impl Default for Limits<'_> {
    fn default() -> Self {
        Self::of_request(Objective::Time, Self::CHECKS_PER_S)
    }
}

impl std::fmt::Debug for Limits<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut fields = formatter.debug_struct("Limits");
        let fields = fields.field("labels", &self.labels);
        fields.field("checks", &self.checks).finish_non_exhaustive()
    }
}

/// What plans are compared by: the weight of the objective, then the landing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// Metres, or multiples of a full battery; 0 where time is the objective.
    pub weight: f64,
    /// Landing at the destination, in seconds.
    pub arrives_s: f64,
}

/// Landings this much apart, in seconds, count as simultaneous.
pub(super) const TIME_TOLERANCE_S: f64 = 1e-6;

impl Value {
    /// No plan at all.
    pub const NONE: Self = Self {
        weight: f64::INFINITY,
        arrives_s: f64::INFINITY,
    };

    /// Better than every plan.
    pub(super) const LEAST: Self = Self {
        weight: f64::NEG_INFINITY,
        arrives_s: f64::NEG_INFINITY,
    };

    /// True where this is better by more than rounding.
    #[inline]
    pub fn beats(self, other: Self) -> bool {
        self.weight < other.weight
            || (self.weight == other.weight && self.arrives_s < other.arrives_s - TIME_TOLERANCE_S)
    }
}

/// Why an answer is not proved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unproved {
    /// The bound on labels was reached.
    #[serde(rename = "label_limit")]
    Labels,
    /// The bound on comparisons was reached.
    #[serde(rename = "check_limit")]
    Checks,
    /// [`Limits::is_over`] said so.
    #[serde(rename = "time_limit")]
    Time,
    /// The plan stops on its way and was composed part by part; nobody has shown that no joint plan is better.
    Parts,
}

impl Unproved {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Labels => "label_limit",
            Self::Checks => "check_limit",
            Self::Time => "time_limit",
            Self::Parts => "parts",
        }
    }
}

/// The step that ended the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The destination's tree, walked down from a start.
    Walk,
    /// The relaxation in which hovering is free: its plan is a real one, or shows that there is none.
    Hovering,
    /// The search for which earlier is better: nothing that it dropped could be better, or its plan meets the bound.
    Earlier,
    /// The search with exact dominance.
    Exact,
}

/// What a search cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Effort {
    /// Labels taken from the queue.
    pub labels: usize,
    /// Checks, as [`Limits::checks`] counts them.
    pub checks: usize,
    /// Ways walked down the destination's tree.
    pub walks: usize,
}

impl Effort {
    /// That of two searches.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            labels: self.labels + other.labels,
            checks: self.checks + other.checks,
            walks: self.walks + other.walks,
        }
    }
}

/// The answer to a request.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightAnswer {
    /// The best plan found; `None` where there is none, or none was found within the limits.
    pub plan: Option<FlightPlan>,
    /// Its value.
    pub value: Value,
    /// True where no plan is better, or where it is certain that there is none.
    pub proved: bool,
    /// No plan is better than this.
    pub lower_bound: Value,
    /// Why it is not proved.
    pub reason: Option<Unproved>,
    /// The step that gave the answer.
    pub step: Step,
    /// What it cost.
    pub effort: Effort,
}

/// What a search flies in: costs, obstacles, pads. Indices are of one topology.
#[derive(Clone, Copy, Debug)]
pub struct FlightWorld<'a> {
    /// The network.
    pub topology: &'a Topology,
    /// What legs take.
    pub legs: &'a FlightLegs,
    /// What is closed when, and where other plans fly.
    pub obstacles: &'a super::Obstacles,
    /// Which pads are free when.
    pub pads: &'a super::PadTimes,
    /// Where drones change altitude.
    pub vertical: &'a Vertical,
    /// Where segments come near each other.
    pub crossings: &'a SharedCrossings,
    /// Margins and overheads.
    pub rules: &'a FlightRules,
    /// How the battery charges.
    pub charging: Charging,
}

impl<'a> FlightWorld<'a> {
    /// Whether there are others to keep apart from.
    #[inline]
    pub fn keeps_apart(&self) -> bool {
        self.rules.headway_s > 0.0 && self.obstacles.others().is_in_the_air()
    }

    /// Where a plan meets others that do not count yet, lets them count on all of its way; false where it does not.
    pub(super) fn activate_met(&self, active: &mut ActiveTraffic, plan: &FlightPlan) -> bool {
        let others = self.obstacles.others();
        self.keeps_apart() && self.separation().activate_met(others, active, plan)
    }

    /// The legs of others that a drone comes too near to from an instant on, each once.
    pub fn met_by(&self, plan: &FlightPlan, since_s: f64) -> Vec<TrafficLeg> {
        match self.keeps_apart() {
            true => self
                .separation()
                .met_by(plan, since_s, self.obstacles.others(), &|_| true),
            false => Vec::new(),
        }
    }

    /// By what plans keep apart here.
    pub fn separation(&self) -> Separation<'a> {
        let Self {
            topology,
            vertical,
            rules,
            ..
        } = *self;
        Separation {
            topology,
            crossings: self.crossings.of(topology, vertical, rules.crossing_m),
            rules,
        }
    }
}

/// Closes segments in a set, to be opened again by [`reopen`].
pub(super) fn close(set: &mut Bits, segments: &[SegmentIx]) {
    for segment in segments {
        set.insert(segment.0);
    }
}

/// Opens what [`close`] closed.
pub(super) fn reopen(set: &mut Bits, segments: &[SegmentIx]) {
    for segment in segments {
        set.remove(segment.0);
    }
}
