//! What a scenario is held against, and whether it was reached.
//!
//! A measure is taken in every repetition; the objective is met where the median keeps to its bound. Its interval,
//! the least and the greatest are told beside it.

use crate::report::{Figures, Judgement, PhaseReport, RunReport, Summary};
use crate::scenario::Scenario;
use serde::Deserialize;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Measure {
    P50Ms,
    P99Ms,
    P999Ms,
    /// Neither answered nor shed, of all that was to be sent.
    ErrorShare,
    ShedShare,
    /// Of answers to failure reports.
    ReroutedShare,
    /// Of reports that were to publish.
    PublishedShare,
    /// Of answers to failure reports: those that call the edge's knowledge fresh.
    FreshShare,
    /// The oldest knowledge of the registry that an answer told.
    RegistryAgeS,
    /// Until the edge had taken over what its registry brought.
    FollowedS,
    /// Answers per second over the capacity that was found before.
    GoodputOfCapacity,
    /// How much more of `operation` was shed than of what was shed least.
    ShedBeyondLeast,
    /// p99 beyond that of the phase `than`.
    P99BeyondPhaseMs,
    /// p99 beyond that of the echo in the same repetition.
    P99BeyondEchoMs,
    /// The capacity over that of the echo in the same repetition.
    CapacityOfEcho,
    /// Requests per second of the last step of the ramp that was kept up with.
    RampPerS,
}

impl Measure {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::P50Ms => "p50_ms",
            Self::P99Ms => "p99_ms",
            Self::P999Ms => "p999_ms",
            Self::ErrorShare => "error_share",
            Self::ShedShare => "shed_share",
            Self::ReroutedShare => "rerouted_share",
            Self::PublishedShare => "published_share",
            Self::FreshShare => "fresh_share",
            Self::RegistryAgeS => "registry_age_s",
            Self::FollowedS => "followed_s",
            Self::GoodputOfCapacity => "goodput_of_capacity",
            Self::ShedBeyondLeast => "shed_beyond_least",
            Self::P99BeyondPhaseMs => "p99_beyond_phase_ms",
            Self::P99BeyondEchoMs => "p99_beyond_echo_ms",
            Self::CapacityOfEcho => "capacity_of_echo",
            Self::RampPerS => "ramp_per_s",
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::P50Ms => "p50",
            Self::P99Ms => "p99",
            Self::P999Ms => "p99.9",
            Self::ErrorShare => "errors",
            Self::ShedShare => "shed",
            Self::ReroutedShare => "rerouted",
            Self::PublishedShare => "published",
            Self::FreshShare => "called fresh",
            Self::RegistryAgeS => "age of the registry's state",
            Self::FollowedS => "taken over",
            Self::GoodputOfCapacity => "answered, of the capacity",
            Self::ShedBeyondLeast => "shed beyond what is shed least",
            Self::P99BeyondPhaseMs => "p99 beyond",
            Self::P99BeyondEchoMs => "p99 beyond the echo's",
            Self::CapacityOfEcho => "capacity, of the echo's",
            Self::RampPerS => "kept up with",
        }
    }

    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::P50Ms
            | Self::P99Ms
            | Self::P999Ms
            | Self::P99BeyondPhaseMs
            | Self::P99BeyondEchoMs => "ms",
            Self::RegistryAgeS | Self::FollowedS => "s",
            Self::RampPerS => "/s",
            _ => "%",
        }
    }

    /// Of a whole run and not of a phase.
    const fn is_of_run(self) -> bool {
        matches!(self, Self::CapacityOfEcho | Self::RampPerS)
    }
}

/// A bound of a measure.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Objective {
    pub(crate) measure: Measure,
    /// Where it is measured.
    #[serde(default)]
    pub(crate) phase: Option<String>,
    /// The requests of this name; all where none is named.
    #[serde(default)]
    pub(crate) operation: Option<String>,
    /// The phase that another one is compared with.
    #[serde(default)]
    pub(crate) than: Option<String>,
    #[serde(default)]
    pub(crate) at_most: Option<f64>,
    #[serde(default)]
    pub(crate) at_least: Option<f64>,
}

impl Objective {
    pub(crate) fn contradiction(&self, scenario: &Scenario) -> Option<String> {
        if self.at_most.is_some() == self.at_least.is_some() {
            return Some("name one of at_most and at_least".to_owned());
        }
        for name in [&self.phase, &self.than].into_iter().flatten() {
            if scenario.phase(name).is_none() {
                return Some(format!("there is no phase '{name}'"));
            }
        }
        let is_of_echo = matches!(
            self.measure,
            Measure::CapacityOfEcho | Measure::P99BeyondEchoMs
        );
        let needs_capacity = matches!(
            self.measure,
            Measure::CapacityOfEcho | Measure::GoodputOfCapacity
        );
        let lacks = match self.measure {
            measure if self.phase.is_none() && !measure.is_of_run() => "a phase",
            Measure::P99BeyondPhaseMs if self.than.is_none() => "a phase to compare with: than",
            Measure::ShedBeyondLeast if self.operation.is_none() => "an operation",
            Measure::RampPerS if scenario.ramp.is_none() => "a [ramp]",
            _ if is_of_echo && !scenario.echo => "echo = true",
            _ if needs_capacity && scenario.capacity.is_none() => "a [capacity]",
            _ => return None,
        };
        Some(format!("it needs {lacks}"))
    }

    fn words(&self) -> String {
        let mut words = self.measure.words().to_owned();
        if let Some(than) = &self.than {
            words.push_str(&format!(" that of '{than}'"));
        }
        if let Some(operation) = &self.operation {
            words = format!("{operation}: {words}");
        }
        if let Some(phase) = &self.phase {
            words = format!("{phase}: {words}");
        }
        let unit = self.measure.unit();
        let shown = |bound: f64| match unit {
            "%" => format!("{} %", bound * 100.0),
            _ => format!("{bound} {unit}"),
        };
        match (self.at_most, self.at_least) {
            (Some(bound), _) => format!("{words}, at most {}", shown(bound)),
            (_, Some(bound)) => format!("{words}, at least {}", shown(bound)),
            _ => words,
        }
    }

    /// Holds the runs of a scenario against it.
    pub(crate) fn judge(&self, runs: &[RunReport]) -> Judgement {
        let edges = runs.iter().filter(|run| run.server == "edge");
        let values: Vec<Option<f64>> = edges
            .map(|run| {
                let mut echoes = runs.iter().filter(|other| other.server == "echo");
                let echo = echoes.find(|echo| echo.repetition == run.repetition);
                self.value(run, echo).filter(|value| value.is_finite())
            })
            .collect();
        let summary = Summary::of(values.iter().flatten().copied());
        let is_kept = summary.is_some_and(|summary| {
            self.at_most.is_none_or(|bound| summary.median <= bound)
                && self.at_least.is_none_or(|bound| summary.median >= bound)
        });
        Judgement {
            objective: self.words(),
            unit: self.measure.unit().to_owned(),
            met: is_kept && values.iter().all(Option::is_some),
            values,
            summary,
        }
    }

    /// None where it was not measured: an operation that was never answered, a share of nothing.
    fn value(&self, run: &RunReport, echo: Option<&RunReport>) -> Option<f64> {
        match self.measure {
            Measure::CapacityOfEcho => return Some(run.capacity_per_s? / echo?.capacity_per_s?),
            Measure::RampPerS => return run.ramp_per_s,
            _ => {}
        }
        let name = self.phase.as_deref()?;
        let phase = run.phase(name)?;
        let figures = self.figures(phase)?;
        let answered = |value: f64| (figures.answered > 0).then_some(value);
        let p99_of = |other: Option<&PhaseReport>| {
            let other = self.figures(other?)?;
            (other.answered > 0).then_some(other.p99_ms)
        };
        match self.measure {
            Measure::P50Ms => answered(figures.p50_ms),
            Measure::P99Ms => answered(figures.p99_ms),
            Measure::P999Ms => answered(figures.p999_ms),
            Measure::ErrorShare => Some(figures.error_share),
            Measure::ShedShare => Some(figures.shed_share),
            Measure::ReroutedShare => figures.rerouted_share,
            Measure::PublishedShare => figures.published_share,
            Measure::FreshShare => figures.fresh_share,
            Measure::RegistryAgeS => Some(figures.registry_age_s),
            Measure::FollowedS => phase.followed_s,
            Measure::GoodputOfCapacity => Some(figures.goodput_per_s / run.capacity_per_s?),
            Measure::ShedBeyondLeast => {
                let shares = phase.operations.values().map(|other| other.shed_share);
                Some(figures.shed_share - shares.min_by(f64::total_cmp)?)
            }
            Measure::P99BeyondPhaseMs => {
                Some(answered(figures.p99_ms)? - p99_of(run.phase(self.than.as_deref()?))?)
            }
            Measure::P99BeyondEchoMs => {
                Some(answered(figures.p99_ms)? - p99_of(echo?.phase(name))?)
            }
            Measure::CapacityOfEcho | Measure::RampPerS => None,
        }
    }

    fn figures<'a>(&self, phase: &'a PhaseReport) -> Option<&'a Figures> {
        match &self.operation {
            None => Some(&phase.all),
            Some(operation) => phase.operations.get(operation),
        }
    }
}
