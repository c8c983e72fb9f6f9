//! What is measured of a fleet, and the goals that it is held against.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A figure of a workload.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Measure {
    Missing,
    RefusedPercent,
    Departed,
    FillingP50Ms,
    FillingP99Ms,
    FillingMaxMs,
    ComposeP50Ms,
    ComposeP99Ms,
    ComposeMaxMs,
    ComposeGrowth,
    BareP50Ms,
    BareP99Ms,
    BareMaxMs,
    BystanderP99Ms,
    BystanderEmptyP99Ms,
    BystanderRatio,
    BystanderUnseen,
    BystanderUnanswered,
    ZonesUnanswered,
    Met,
    ToldMs,
    ToldWorstMs,
    ToldSmallMs,
    Untold,
    AnsweredMs,
    RecomposeP50Ms,
    RecomposeP99Ms,
    StormS,
    StormQuietP99Ms,
    StormP99Ms,
    StormBeyondMs,
    StormErrors,
    StormToldS,
    Kills,
    EventsGone,
    RestartMs,
    Lost,
    ZonesMissing,
}

impl Measure {
    const fn words(self) -> &'static str {
        match self {
            Self::Missing => "plans that were not accepted in the time there was",
            Self::RefusedPercent => "requests refused while filling",
            Self::Departed => "plans whose drones had departed when the first zone came",
            Self::FillingP50Ms => "POST /v1/plans while filling: p50",
            Self::FillingP99Ms => "POST /v1/plans while filling: p99",
            Self::FillingMaxMs => "POST /v1/plans while filling: slowest",
            Self::ComposeP50Ms => "POST /v1/plans, full, stored: p50",
            Self::ComposeP99Ms => "POST /v1/plans, full, stored: p99",
            Self::ComposeMaxMs => "POST /v1/plans, full, stored: slowest",
            Self::ComposeGrowth => "POST /v1/plans: p50 when full beside that at the first mark",
            Self::BareP50Ms => "POST /v1/plans, full, --no-store: p50",
            Self::BareP99Ms => "POST /v1/plans, full, --no-store: p99",
            Self::BareMaxMs => "POST /v1/plans, full, --no-store: slowest",
            Self::BystanderP99Ms => "zone in force for a bystander: p99",
            Self::BystanderEmptyP99Ms => "the same at an empty edge: p99",
            Self::BystanderRatio => "zone in force for a bystander, beside an empty edge",
            Self::BystanderUnseen => "zones that no bystander saw in force",
            Self::BystanderUnanswered => "reports of bystanders without an answer",
            Self::ZonesUnanswered => "zones whose POST had no answer in the edge's own time",
            Self::Met => "plans met by a large zone, median",
            Self::ToldMs => "a large zone: the last is told, median of the zones",
            Self::ToldWorstMs => "a large zone: the last is told, slowest zone",
            Self::ToldSmallMs => "a small zone: the last is told, slowest zone",
            Self::Untold => "plans met and not told",
            Self::AnsweredMs => "a large zone: answer to its POST, median",
            Self::RecomposeP50Ms => "recomposition of one drone, full: p50",
            Self::RecomposeP99Ms => "recomposition of one drone, full: p99",
            Self::StormS => "storm: from the first zone to the last answer",
            Self::StormQuietP99Ms => "recompositions before the storm: p99",
            Self::StormP99Ms => "recompositions in the storm: p99",
            Self::StormBeyondMs => "recompositions in the storm: p99 beyond that before",
            Self::StormErrors => "storm: zones refused, and reports without an answer",
            Self::StormToldS => "storm: from its end until the last is told",
            Self::Kills => "kills of the edge in the storm",
            Self::EventsGone => "kills after which events were gone, so that the lists were read",
            Self::RestartMs => "from a kill until the edge is ready again: slowest",
            Self::Lost => "acknowledged zones, plans and versions that were gone after a kill",
            Self::ZonesMissing => "zones of the storm that the edge did not take",
        }
    }

    const fn unit(self) -> &'static str {
        match self {
            Self::RefusedPercent => " %",
            Self::StormS | Self::StormToldS => " s",
            Self::ComposeGrowth | Self::BystanderRatio => " times",
            Self::Missing
            | Self::Untold
            | Self::Departed
            | Self::Met
            | Self::BystanderUnseen
            | Self::BystanderUnanswered
            | Self::ZonesUnanswered
            | Self::StormErrors
            | Self::Kills
            | Self::EventsGone
            | Self::Lost
            | Self::ZonesMissing => "",
            _ => " ms",
        }
    }

    /// A value with its unit; counts have no digits behind the point.
    fn told(self, value: f64) -> String {
        let digits = if self.unit().is_empty() { 0 } else { 2 };
        format!("{value:.digits$}{}", self.unit())
    }
}

/// What has to be so on a busy machine, too.
const WHATEVER_THE_TIME: [Measure; 5] = [
    Measure::Missing,
    Measure::BystanderUnseen,
    Measure::Untold,
    Measure::Lost,
    Measure::ZonesMissing,
];

/// A figure is to be at most this.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Goal {
    pub(crate) measure: Measure,
    pub(crate) at_most: f64,
}

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Figures(BTreeMap<Measure, f64>);

impl Figures {
    pub(crate) fn put(&mut self, measure: Measure, value: f64) {
        self.0.insert(measure, value);
    }

    pub(crate) fn of(&self, measure: Measure) -> Option<f64> {
        self.0.get(&measure).copied()
    }

    /// A goal whose figure is not there was not reached.
    fn meets(&self, goal: &Goal) -> bool {
        self.of(goal.measure)
            .is_some_and(|value| value <= goal.at_most)
    }

    /// What was missed, in words; of a quick run what is no matter of time.
    pub(crate) fn missed(&self, goals: &[Goal], is_quick: bool) -> Vec<String> {
        let counts = |goal: &&Goal| !is_quick || WHATEVER_THE_TIME.contains(&goal.measure);
        let goals = goals.iter().filter(counts);
        let missed = goals.filter(|goal| !self.meets(goal));
        missed.map(|goal| goal.measure.words().to_owned()).collect()
    }

    /// Goals first, in their order, then what else was measured.
    pub(crate) fn table(&self, goals: &[Goal]) -> String {
        let mut text = String::from("| | goal | measured | |\n|---|---:|---:|---|\n");
        for goal in goals {
            let measure = goal.measure;
            let met = if self.meets(goal) {
                "met"
            } else {
                "**missed**"
            };
            let value = self.of(measure);
            let value =
                value.map_or_else(|| "not measured".to_owned(), |value| measure.told(value));
            // Writing to text does not fail.
            let _ = writeln!(
                text,
                "| {} | at most {} | {value} | {met} |",
                measure.words(),
                measure.told(goal.at_most)
            );
        }
        for (measure, value) in &self.0 {
            if goals.iter().all(|goal| goal.measure != *measure) {
                let _ = writeln!(
                    text,
                    "| {} | | {} | |",
                    measure.words(),
                    measure.told(*value)
                );
            }
        }
        text
    }
}

/// Times, of which percentiles are told.
#[derive(Clone, Debug, Default)]
pub(crate) struct Spread(Vec<f64>);

impl Spread {
    pub(crate) fn add(&mut self, time: std::time::Duration) {
        self.0.push(time.as_secs_f64() * 1e3);
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.0.extend_from_slice(&other.0);
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The least time that this part of all is within, in milliseconds; 0 where there is none.
    pub(crate) fn at_ms(&self, part: f64) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let rank = (part * sorted.len() as f64).ceil() as usize;
        sorted
            .get(rank.saturating_sub(1))
            .copied()
            .unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_goal_is_met_missed_or_not_measured() {
        let goal = |measure, at_most| Goal { measure, at_most };
        let goals = [
            goal(Measure::ToldMs, 100.0),
            goal(Measure::Untold, 0.0),
            goal(Measure::BystanderRatio, 2.0),
        ];
        let mut figures = Figures::default();
        figures.put(Measure::ToldMs, 100.0);
        figures.put(Measure::Untold, 1.0);
        figures.put(Measure::StormS, 1.5);
        assert_eq!(figures.missed(&goals, false).len(), 2);
        assert_eq!(figures.missed(&goals, true).len(), 1);
        let table = figures.table(&goals);
        assert!(
            table.contains("at most 100.00 ms | 100.00 ms | met |"),
            "{table}"
        );
        assert!(table.contains("at most 0 | 1 | **missed** |"), "{table}");
        assert!(
            table.contains("at most 2.00 times | not measured | **missed** |"),
            "{table}"
        );
        assert!(table.contains("| | 1.50 s | |"), "{table}");
    }

    #[test]
    fn percentiles_are_times_that_were_measured() {
        let mut spread = Spread::default();
        for ms in (1..=200).rev() {
            spread.add(Duration::from_millis(ms));
        }
        let told = [0.5, 0.99, 1.0].map(|part| spread.at_ms(part).round());
        assert_eq!(told, [100.0, 198.0, 200.0]);
        assert_eq!(Spread::default().at_ms(0.5), 0.0);
    }
}
