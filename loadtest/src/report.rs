//! What a run came to, as it is written to `report.json`.

use crate::load::Ran;
use crate::measures::{Tally, Times};
use crate::ranks;
use crate::watch::Watch;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// With fewer values not even the least and the greatest are far enough apart for an interval of 95 %.
const INTERVAL_LEAST: usize = 6;

/// A run of scenarios.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Report {
    /// When it began, RFC 3339.
    pub(crate) begun_at: String,
    /// What was measured, as far as the caller told: a commit.
    pub(crate) commit: String,
    /// Processor and system.
    pub(crate) machine: String,
    /// The binary of the edge.
    pub(crate) server: String,
    /// Servers on one core, the load on another.
    pub(crate) pinned: bool,
    /// Too short for its times to say anything.
    pub(crate) quick: bool,
    pub(crate) scenarios: Vec<ScenarioReport>,
}

/// A scenario in one dialect.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ScenarioReport {
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) dialect: String,
    pub(crate) seed: u64,
    /// How requests follow each other.
    pub(crate) arrivals: String,
    /// The edge's, and with a baseline the echo's, in the order they were made.
    pub(crate) runs: Vec<RunReport>,
    pub(crate) judgements: Vec<Judgement>,
}

/// A repetition of all phases against one server.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct RunReport {
    pub(crate) repetition: usize,
    /// `edge` or `echo`.
    pub(crate) server: String,
    /// Requests per second that were answered when more were offered.
    pub(crate) capacity_per_s: Option<f64>,
    /// The last step of the ramp that was kept up with.
    pub(crate) ramp_per_s: Option<f64>,
    pub(crate) phases: Vec<PhaseReport>,
}

impl RunReport {
    pub(crate) fn phase(&self, name: &str) -> Option<&PhaseReport> {
        self.phases.iter().find(|phase| phase.name == name)
    }
}

/// A phase of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PhaseReport {
    pub(crate) name: String,
    /// Requests per second that were meant to be sent.
    pub(crate) offered_per_s: f64,
    pub(crate) measured_s: f64,
    /// Which part of the time the server worked.
    pub(crate) server_share: Option<f64>,
    /// Which part of the time the load worked, where it has a core of its own.
    pub(crate) load_share: Option<f64>,
    /// How much the machine's other processes worked from its warm-up to its end, as a part of one
    /// core: no one's load, and the more of it the less the times say.
    #[serde(default)]
    pub(crate) elsewhere_share: Option<f64>,
    /// How much later than meant the load sent, p99: where it is near the latencies, it is the load that is measured.
    pub(crate) late_p99_ms: f64,
    /// How long the edge took to take over what its registry had.
    pub(crate) followed_s: Option<f64>,
    pub(crate) all: Figures,
    pub(crate) operations: BTreeMap<String, Figures>,
    pub(crate) interval_s: f64,
    pub(crate) intervals: Vec<IntervalReport>,
}

/// What became of requests.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Figures {
    /// All that were meant to be sent; the following six add up to it.
    pub(crate) scheduled: u64,
    pub(crate) answered: u64,
    pub(crate) shed: u64,
    pub(crate) refused: u64,
    pub(crate) broken: u64,
    pub(crate) timed_out: u64,
    pub(crate) unsent: u64,
    /// Answers that came while it was measured, per second.
    pub(crate) goodput_per_s: f64,
    /// From the intended send time to the answer, those that timed out included with the time that was waited.
    pub(crate) p50_ms: f64,
    pub(crate) p90_ms: f64,
    pub(crate) p99_ms: f64,
    pub(crate) p999_ms: f64,
    pub(crate) max_ms: f64,
    /// From when a request had a connection: what a closed loop would have told.
    pub(crate) p99_from_sent_ms: f64,
    /// Until a request was shed.
    pub(crate) shed_p99_ms: f64,
    /// Neither answered nor shed.
    pub(crate) error_share: f64,
    pub(crate) shed_share: f64,
    /// Of answers that were read; none where none was.
    pub(crate) rerouted_share: Option<f64>,
    pub(crate) published_share: Option<f64>,
    pub(crate) fresh_share: Option<f64>,
    /// The largest that was read.
    pub(crate) registry_age_s: f64,
    /// Statuses other than success.
    pub(crate) problems: BTreeMap<String, u64>,
    /// Parts of all, and the milliseconds that they are within.
    pub(crate) curve: Vec<[f64; 2]>,
}

/// A short part of a phase.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct IntervalReport {
    pub(crate) answered_per_s: f64,
    pub(crate) shed_per_s: f64,
    pub(crate) failed_per_s: f64,
    pub(crate) p50_ms: f64,
    pub(crate) p99_ms: f64,
    pub(crate) max_ms: f64,
}

/// An objective, and what was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Judgement {
    /// In words.
    pub(crate) objective: String,
    pub(crate) unit: String,
    /// One for each repetition; none where nothing was there to be measured.
    pub(crate) values: Vec<Option<f64>>,
    pub(crate) summary: Option<Summary>,
    /// True where the median keeps to it; never where a value lacks.
    pub(crate) met: bool,
}

/// Values of repetitions.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Summary {
    pub(crate) median: f64,
    pub(crate) least: f64,
    pub(crate) greatest: f64,
    /// From where to where the median of what they are drawn from lies in 95 of 100 cases; none where they are too few.
    #[serde(default)]
    pub(crate) interval: Option<(f64, f64)>,
}

impl Summary {
    /// None where there is no value.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let upper = *sorted.get(middle)?;
        let median = match sorted.len().is_multiple_of(2) {
            true => f64::midpoint(sorted[middle - 1], upper),
            false => upper,
        };
        let (low, high) = ranks::of_median(sorted.len());
        let is_enough = sorted.len() >= INTERVAL_LEAST;
        Some(Self {
            median,
            least: *sorted.first()?,
            greatest: *sorted.last()?,
            interval: is_enough.then(|| (sorted[low], sorted[high])),
        })
    }
}

impl Judgement {
    /// The median, its interval, and from where to where the values go.
    pub(crate) fn measured(&self) -> String {
        let Some(summary) = self.summary else {
            return "not measured".to_owned();
        };
        let shown = |value: f64| match self.unit.as_str() {
            "%" => format!("{:.2} %", value * 100.0),
            "/s" => format!("{value:.0}/s"),
            unit => format!("{value:.2} {unit}"),
        };
        let span = |(low, high)| format!("{} to {}", shown(low), shown(high));
        let all = span((summary.least, summary.greatest));
        let interval = summary.interval.map(span);
        match (self.values.iter().flatten().count(), interval) {
            (1, _) => shown(summary.median),
            (count, None) => format!("{} (of {count}, from {all})", shown(summary.median)),
            (count, Some(interval)) => {
                let median = shown(summary.median);
                format!("{median} (of {count}, 95 %: {interval}; from {all})")
            }
        }
    }
}

impl Report {
    /// Objectives that were missed, each with its scenario.
    pub(crate) fn missed(&self) -> Vec<String> {
        let missed = |scenario: &ScenarioReport| -> Vec<String> {
            let judgements = scenario.judgements.iter();
            let missed = judgements.filter(|judgement| !judgement.met);
            missed
                .map(|judgement| {
                    let (name, dialect) = (&scenario.name, &scenario.dialect);
                    let measured = judgement.measured();
                    format!("{name}, {dialect}: {}; {measured}", judgement.objective)
                })
                .collect()
        };
        self.scenarios.iter().flat_map(missed).collect()
    }
}

impl PhaseReport {
    pub(crate) fn new(name: &str, ran: &Ran, watch: &Watch) -> Self {
        let recorder = &ran.recorder;
        let measured_s = ran.measured.as_secs_f64();
        let interval_s = recorder.interval.as_secs_f64();
        let figures = |tally: &Tally| Figures::of(tally, measured_s);
        let operations = recorder.tallies.iter();
        let all = recorder.all();
        Self {
            name: name.to_owned(),
            offered_per_s: all.scheduled() as f64 / measured_s.max(1e-9),
            measured_s,
            server_share: watch.server_share,
            elsewhere_share: watch.elsewhere_share,
            load_share: ran.load_share,
            late_p99_ms: recorder.late.at_ms(0.99),
            followed_s: None,
            all: figures(&all),
            operations: operations
                .map(|(name, tally)| ((*name).to_owned(), figures(tally)))
                .collect(),
            interval_s,
            intervals: recorder
                .intervals
                .iter()
                .map(|interval| IntervalReport {
                    answered_per_s: interval.answered as f64 / interval_s,
                    shed_per_s: interval.shed as f64 / interval_s,
                    failed_per_s: interval.failed as f64 / interval_s,
                    p50_ms: interval.times.at_ms(0.5),
                    p99_ms: interval.times.at_ms(0.99),
                    max_ms: interval.times.at_ms(1.0),
                })
                .collect(),
        }
    }
}

impl Figures {
    pub(crate) fn of(tally: &Tally, measured_s: f64) -> Self {
        let scheduled = tally.scheduled();
        let share_of = |count: u64, all: u64| count as f64 / all.max(1) as f64;
        let share_read = |count: u64, all: u64| (all > 0).then(|| share_of(count, all));
        let at = |times: &Times, part| times.at_ms(part);
        Self {
            scheduled,
            answered: tally.answered,
            shed: tally.shed,
            refused: tally.refused,
            broken: tally.broken,
            timed_out: tally.timed_out,
            unsent: tally.unsent,
            goodput_per_s: tally.came as f64 / measured_s.max(1e-9),
            p50_ms: at(&tally.from_intended, 0.5),
            p90_ms: at(&tally.from_intended, 0.9),
            p99_ms: at(&tally.from_intended, 0.99),
            p999_ms: at(&tally.from_intended, 0.999),
            max_ms: at(&tally.from_intended, 1.0),
            p99_from_sent_ms: at(&tally.from_sent, 0.99),
            shed_p99_ms: at(&tally.until_shed, 0.99),
            error_share: share_of(tally.failed(), scheduled),
            shed_share: share_of(tally.shed, scheduled),
            rerouted_share: share_read(tally.rerouted, tally.answers_read),
            published_share: share_read(tally.published, tally.to_publish),
            fresh_share: share_read(tally.fresh, tally.freshness_read),
            registry_age_s: tally.registry_age_s,
            problems: tally.problems.clone(),
            curve: tally.from_intended.curve(),
        }
    }
}
