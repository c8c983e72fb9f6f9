//! The numbers in the text of the paper, each held against every sensible reading of its sentence.
//!
//! The paper does not say whether its Dijkstra stops at the target, which problem it solves, over which distance an
//! overhead is taken, or how cases are averaged. `readings` lists what it can mean, `skipping` what it can mean by the
//! search space of a stage; here stands what it says.

mod judgement;
mod readings;
mod skipping;

use super::cells::{Cell, Cells};
use super::method::Approach;
use super::record::{Better, Claim, Reading, Unit};
use super::statistics::Resampler;
use judgement::judge;
use readings::{Candidate, Shape};

/// A number of the paper, and what it is a number of.
#[derive(Clone, Debug)]
pub struct ClaimPlan {
    id: &'static str,
    section: &'static str,
    text: &'static str,
    paper: f64,
    unit: Unit,
    better: Better,
    quantity: Quantity,
    on_sydney: bool,
}

/// What a number of the paper measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    /// How much less time than the baseline, in per cent.
    Faster(Approach),
    /// How many times the baseline's time.
    TimesTheTime(Approach),
    /// How much longer than the baseline's, in per cent.
    Longer(Approach),
    /// Which share of the network is searched, in per cent.
    Share(Approach),
    /// In which share of the cases skipping stages is effective, in per cent.
    EffectiveCases,
    /// How many times the search space where skipping is ineffective.
    IneffectiveSpace,
    /// How much smaller the search space is where it is effective, in per cent.
    EffectiveSpace,
}

const RADIUS: &str = "Radius-based";
const BOTH: &str = "Cell density-based and two-phased";
const TWO_PHASED: &str = "Two-phased";
const SKIPPING: &str = "Stage skipping";
const SYDNEY: &str = "Sydney CBD";

/// A number of the paper: its name, where it stands, what the paper says, the number, what it measures.
type Stated = (&'static str, &'static str, &'static str, f64, Quantity);

/// The numbers of the paper, in its order.
const STATED: &[Stated] = &[
    (
        "radius-time",
        RADIUS,
        "radius-based is 9 % faster than the baseline",
        9.0,
        Quantity::Faster(Approach::Radius),
    ),
    (
        "radius-distance",
        RADIUS,
        "radius-based flies 14 % more",
        14.0,
        Quantity::Longer(Approach::Radius),
    ),
    (
        "cell-density-time",
        BOTH,
        "cell density-based is 79 % faster",
        79.0,
        Quantity::Faster(Approach::CellDensity),
    ),
    (
        "two-phased-polygons-time",
        BOTH,
        "two-phased with polygons is 60 % faster",
        60.0,
        Quantity::Faster(Approach::TwoPhasedPolygons),
    ),
    (
        "two-phased-time",
        BOTH,
        "two-phased without polygons is 93 % faster",
        93.0,
        Quantity::Faster(Approach::TwoPhased),
    ),
    (
        "cell-density-distance",
        BOTH,
        "cell density-based flies 11.21 % more",
        11.21,
        Quantity::Longer(Approach::CellDensity),
    ),
    (
        "two-phased-distance",
        BOTH,
        "two-phased flies 9.81 % more",
        9.81,
        Quantity::Longer(Approach::TwoPhased),
    ),
    (
        "cell-density-share",
        BOTH,
        "cell density-based searches 20 % of the nodes and edges",
        20.0,
        Quantity::Share(Approach::CellDensity),
    ),
    (
        "two-phased-share",
        BOTH,
        "two-phased searches 4 % of the nodes and edges",
        4.0,
        Quantity::Share(Approach::TwoPhased),
    ),
    (
        "astar-time",
        TWO_PHASED,
        "A* takes 6.5 % less time than the baseline",
        6.5,
        Quantity::Faster(Approach::AStar),
    ),
    (
        "two-phased-time-again",
        TWO_PHASED,
        "two-phased takes 16 % less time than the baseline",
        16.0,
        Quantity::Faster(Approach::TwoPhased),
    ),
    (
        "bellman-ford-time",
        TWO_PHASED,
        "Bellman-Ford takes nearly five times the baseline's time",
        5.0,
        Quantity::TimesTheTime(Approach::BellmanFord),
    ),
    (
        "two-phased-distance-again",
        TWO_PHASED,
        "two-phased flies 1.2 % more than the other algorithms",
        1.2,
        Quantity::Longer(Approach::TwoPhased),
    ),
    (
        "skipping-effective",
        SKIPPING,
        "skipping stages is effective in 53 of 69 cases (76.8 %)",
        100.0 * 53.0 / 69.0,
        Quantity::EffectiveCases,
    ),
    (
        "skipping-ineffective-space",
        SKIPPING,
        "ineffective skipping takes 2.13 times the search space",
        2.13,
        Quantity::IneffectiveSpace,
    ),
    (
        "skipping-effective-space",
        SKIPPING,
        "effective skipping takes 32 % less search space than ineffective",
        32.0,
        Quantity::EffectiveSpace,
    ),
    (
        "sydney-polygons-time",
        SYDNEY,
        "two-phased with polygons takes twice the baseline's time",
        2.0,
        Quantity::TimesTheTime(Approach::TwoPhasedPolygons),
    ),
    (
        "sydney-cell-density-time",
        SYDNEY,
        "cell density-based takes 56 % less time",
        56.0,
        Quantity::Faster(Approach::CellDensity),
    ),
    (
        "sydney-two-phased-time",
        SYDNEY,
        "two-phased without polygons takes 74 % less time",
        74.0,
        Quantity::Faster(Approach::TwoPhased),
    ),
    (
        "sydney-cell-density-distance",
        SYDNEY,
        "cell density-based flies 14 % more",
        14.0,
        Quantity::Longer(Approach::CellDensity),
    ),
    (
        "sydney-two-phased-distance",
        SYDNEY,
        "two-phased flies 11 % more",
        11.0,
        Quantity::Longer(Approach::TwoPhased),
    ),
];

/// The numbers of the paper, in its order.
pub fn claim_plans() -> Vec<ClaimPlan> {
    let plan = |&(id, section, text, paper, quantity): &Stated| ClaimPlan {
        id,
        section,
        text,
        paper,
        unit: quantity.unit(),
        better: quantity.better(),
        quantity,
        on_sydney: section == SYDNEY,
    };
    STATED.iter().map(plan).collect()
}

impl Quantity {
    fn unit(self) -> Unit {
        match self {
            Self::TimesTheTime(_) | Self::IneffectiveSpace => Unit::Times,
            _ => Unit::Percent,
        }
    }

    fn better(self) -> Better {
        match self {
            Self::Faster(_) | Self::EffectiveCases | Self::EffectiveSpace => Better::Higher,
            Self::TimesTheTime(_) | Self::Longer(_) | Self::Share(_) | Self::IneffectiveSpace => {
                Better::Lower
            }
        }
    }

    /// The value at which there is no difference, from which a direction is told.
    fn neutral(self) -> f64 {
        match self {
            Self::Faster(_) | Self::Longer(_) | Self::EffectiveSpace => 0.0,
            Self::TimesTheTime(_) | Self::IneffectiveSpace => 1.0,
            Self::EffectiveCases => 50.0,
            Self::Share(_) => 100.0,
        }
    }
}

impl ClaimPlan {
    /// Its name.
    pub fn id(&self) -> &str {
        self.id
    }

    /// Computes every reading of the claim on the cells of a run. The seed is that of the intervals.
    pub fn evaluate(&self, cells: &Cells, seed: u64) -> Claim {
        let pool = cells.of_sydney(self.on_sydney);
        let (readings, exact): (Vec<Reading>, Vec<Option<Reading>>) =
            self.readings(cells, &pool, seed).into_iter().unzip();
        let judged = judge(self.paper, self.unit, self.quantity.neutral(), &readings);
        Claim {
            id: self.id.to_owned(),
            section: self.section.to_owned(),
            text: self.text.to_owned(),
            paper: self.paper,
            unit: self.unit,
            better: self.better,
            exact: judged
                .closest
                .and_then(|closest| exact.into_iter().nth(closest).flatten()),
            readings,
            closest: judged.closest,
            holds: judged.holds,
            verdict: judged.verdict,
        }
    }

    /// Every reading, each with what `exact` does to the same quantity.
    fn readings(
        &self,
        cells: &Cells,
        pool: &[&Cell],
        seed: u64,
    ) -> Vec<(Reading, Option<Reading>)> {
        let estimate = |candidates: Vec<Candidate>, shape: Shape| {
            let candidates = candidates.into_iter();
            candidates
                .filter_map(|candidate| candidate.estimate(self.id, shape, pool, seed))
                .collect()
        };
        match self.quantity {
            Quantity::Faster(approach) => {
                estimate(readings::of_time(approach), Shape::PercentBelow)
            }
            Quantity::TimesTheTime(approach) => estimate(readings::of_time(approach), Shape::Times),
            Quantity::Longer(approach) => {
                estimate(readings::of_distance(approach), Shape::PercentAbove)
            }
            Quantity::Share(approach) => estimate(readings::of_share(approach), Shape::Percent),
            Quantity::EffectiveCases => {
                let everywhere: Vec<&Cell> = cells.0.iter().collect();
                alone(skipping::effective_cases(&everywhere, seed))
            }
            Quantity::IneffectiveSpace => {
                let everywhere: Vec<&Cell> = cells.0.iter().collect();
                let resampler = Resampler::new(seed, self.id);
                alone(skipping::ineffective_space(&everywhere, resampler))
            }
            Quantity::EffectiveSpace => {
                let everywhere: Vec<&Cell> = cells.0.iter().collect();
                let resampler = Resampler::new(seed, self.id);
                alone(skipping::effective_space(&everywhere, resampler))
            }
        }
    }
}

/// Readings of what `exact` has no counterpart to: it has no stages.
fn alone(readings: Vec<Reading>) -> Vec<(Reading, Option<Reading>)> {
    readings
        .into_iter()
        .map(|reading| (reading, None))
        .collect()
}
