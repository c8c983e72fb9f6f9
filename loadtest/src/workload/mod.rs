//! Workloads of fleets: how many plans are accepted over which network, flown how, what then
//! closes, and the goals.
//!
//! Read as strictly as scenarios are.

mod bystander;
mod command;
mod edges;
mod filling;
mod goals;
mod kills;
mod listener;
mod play;
mod record;
mod storm;
mod world;

pub(crate) use command::{FleetArguments, run_fleets};
pub(crate) use world::World;

use crate::scenario::{Unusable, named, text_of};
use goals::{Goal, Measure};
use serde::Deserialize;
use std::path::Path;

/// What is left of a workload that is only to be seen to work.
const QUICK_PLANS: usize = 30;
const QUICK_LARGE: usize = 1;
const QUICK_SMALL: usize = 2;
const QUICK_STORM: usize = 20;
const QUICK_KILLS: usize = 3;
const QUICK_SAMPLES: usize = 5;

/// The network that is flown over.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Ground {
    /// One that the program brings with it.
    Bundled(String),
    /// One that `skyway network generate` makes of these, the rest by its defaults
    /// otherwise.
    Generated {
        nodes: usize,
        map_size_m: u32,
        seed: u64,
    },
}

/// The zones that come once the fleet is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Zones {
    /// One after the other, each over half of the plans.
    pub(crate) large: usize,
    /// One after the other, each over a leg of a plan.
    pub(crate) small: usize,
    /// Within a second, each over a leg of a plan.
    pub(crate) storm: usize,
    /// So often the edge is killed in the storm, and starts again on its store. Then nothing else is measured.
    #[serde(default)]
    pub(crate) kills: usize,
}

/// A workload as its file tells it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Workload {
    /// The name of the file.
    #[serde(skip)]
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) seed: u64,
    pub(crate) network: Ground,
    /// The airframe that all plans are flown with; none: by distance.
    #[serde(default)]
    pub(crate) airframe: Option<String>,
    /// So slow that no plan ends while it is measured, where no airframe says how fast.
    #[serde(default)]
    pub(crate) airspeed_mps: Option<f64>,
    /// To be accepted.
    pub(crate) plans: usize,
    /// Departures are uniform in this time from the start; 0: all at once.
    pub(crate) departures_s: f64,
    /// How many times faster than the machine's the edge's clock runs, so that many drones are in
    /// the air once all plans are accepted.
    #[serde(default = "one")]
    pub(crate) clock_rate: f64,
    /// Filling ends after this time, whatever is accepted by then.
    pub(crate) fill_within_s: f64,
    /// The first mark: what a plan takes is measured with so many accepted, too.
    #[serde(default)]
    pub(crate) mark: Option<usize>,
    /// Plans composed and cancelled again, and recompositions, at the full fleet.
    pub(crate) samples: usize,
    pub(crate) zones: Zones,
    /// Whether the record has the pack of each plan, as it is once all are accepted.
    #[serde(default)]
    pub(crate) packs: bool,
    pub(crate) goals: Vec<Goal>,
    /// Whether it is only to be seen to work.
    #[serde(skip)]
    pub(crate) is_quick: bool,
}

fn one() -> f64 {
    1.0
}

impl Workload {
    /// Reads a file.
    ///
    /// # Errors
    /// Where it cannot be read, has a key that is not known, or contradicts itself.
    pub(crate) fn read(path: &Path) -> Result<Self, Unusable> {
        Self::parse(path, &text_of(path)?)
    }

    pub(crate) fn parse(path: &Path, text: &str) -> Result<Self, Unusable> {
        let (mut workload, name) = named::<Self>(path, text)?;
        workload.name = name;
        match workload.contradiction() {
            None => Ok(workload),
            Some((key, what)) => Err(Unusable::Contradictory {
                path: path.to_owned(),
                key: key.to_owned(),
                what: what.to_owned(),
            }),
        }
    }

    fn contradiction(&self) -> Option<(&'static str, &'static str)> {
        if self.plans == 0 || self.samples == 0 {
            return Some(("plans, samples", "at least 1"));
        }
        if !(self.departures_s >= 0.0 && self.fill_within_s > 0.0) {
            return Some(("departures_s, fill_within_s", "0 or more, and more than 0"));
        }
        if self.airframe.is_some() == self.airspeed_mps.is_some() {
            return Some((
                "airframe, airspeed_mps",
                "name one of both: an airframe has its own speed",
            ));
        }
        if self
            .mark
            .is_some_and(|mark| mark == 0 || mark >= self.plans)
        {
            return Some(("mark", "from 1 to fewer than plans"));
        }
        if !(self.clock_rate > 0.0 && self.clock_rate.is_finite()) {
            return Some(("clock_rate", "more than 0"));
        }
        if self.zones.kills > 0 && self.zones.storm == 0 {
            return Some(("zones", "kills come in a storm, which has no zones"));
        }
        if self.zones.kills > 0 && self.clock_rate != 1.0 {
            return Some((
                "clock_rate",
                "1 with kills: a clock that runs faster begins anew with each start",
            ));
        }
        let has_growth = |goal: &Goal| goal.measure == Measure::ComposeGrowth;
        if self.mark.is_none() && self.goals.iter().any(has_growth) {
            return Some(("goals", "compose_growth needs a mark to be measured beside"));
        }
        None
    }

    /// The same in a moment: whether everything works, not how fast.
    pub(crate) fn quickened(mut self) -> Self {
        self.plans = self.plans.min(QUICK_PLANS);
        self.mark = self.mark.map(|mark| mark.min(QUICK_PLANS / 2));
        self.samples = self.samples.min(QUICK_SAMPLES);
        self.zones.large = self.zones.large.min(QUICK_LARGE);
        self.zones.small = self.zones.small.min(QUICK_SMALL);
        self.zones.storm = self.zones.storm.min(QUICK_STORM);
        self.zones.kills = self.zones.kills.min(QUICK_KILLS);
        self.is_quick = true;
        self
    }
}
