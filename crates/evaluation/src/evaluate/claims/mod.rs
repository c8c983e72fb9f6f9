//! The numbers in the text of the paper, judged under one set of conventions for all of them, and its sentences.
//!
//! The paper does not say how its networks are made, whether its Dijkstra stops at the target, which problem it
//! solves, over which distance an overhead is taken, or how cases are averaged. `conventions` lists what it leaves
//! open, `readings` what a sentence means under a choice, `joint` finds the choice that meets most numbers; here
//! stands what the paper says. `sentences` has what it says without numbers.

mod conventions;
mod joint;
mod readings;
mod sentences;

use super::cells::Cells;
use super::method::Approach;
use super::record::{Better, Unit};
use conventions::{Axis, Choice, choices};

pub use joint::{Judged, judge};

/// A number of the paper, and what it is a number of.
#[derive(Clone, Debug)]
pub struct ClaimPlan {
    id: &'static str,
    section: &'static str,
    text: &'static str,
    paper: f64,
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

    /// The approach that it is about.
    fn approach(self) -> Option<Approach> {
        match self {
            Self::Faster(approach)
            | Self::TimesTheTime(approach)
            | Self::Longer(approach)
            | Self::Share(approach) => Some(approach),
            Self::EffectiveCases | Self::IneffectiveSpace | Self::EffectiveSpace => None,
        }
    }

    /// The value at which there is no difference; none for a share, which has no side.
    fn neutral(self) -> Option<f64> {
        match self {
            Self::Faster(_) | Self::Longer(_) | Self::EffectiveSpace => Some(0.0),
            Self::TimesTheTime(_) | Self::IneffectiveSpace => Some(1.0),
            Self::EffectiveCases => Some(50.0),
            Self::Share(_) => None,
        }
    }

    /// The number that a ratio is told as.
    fn value(self, ratio: f64, choice: Choice) -> f64 {
        match self {
            Self::TimesTheTime(_) | Self::IneffectiveSpace => ratio,
            Self::Share(_) | Self::EffectiveCases => 1e2 * ratio,
            Self::Longer(_) => 1e2 * (ratio - 1.0),
            Self::Faster(_) if choice.of(Axis::Faster) == 1 => 1e2 * (1.0 / ratio - 1.0),
            Self::Faster(_) | Self::EffectiveSpace => 1e2 * (1.0 - ratio),
        }
    }

    /// The ratio that the paper's number is, time told as less time.
    fn ratio(self, value: f64) -> f64 {
        match self {
            Self::TimesTheTime(_) | Self::IneffectiveSpace => value,
            Self::Share(_) | Self::EffectiveCases => value / 1e2,
            Self::Longer(_) => 1.0 + value / 1e2,
            Self::Faster(_) | Self::EffectiveSpace => 1.0 - value / 1e2,
        }
    }
}

/// A claim with all its readings.
#[derive(Clone, Debug)]
pub struct Survey {
    plan: ClaimPlan,
    axes: Vec<Axis>,
    /// By the number of the choice on its axes.
    ratios: Vec<Option<f64>>,
}

impl ClaimPlan {
    /// Measures every reading of the claim on the cells of a run.
    pub fn survey(&self, cells: &Cells) -> Survey {
        let axes = self.quantity.axes(self.on_sydney);
        let ratio = |number: usize| {
            let choice = Choice::numbered(number, &axes);
            let sample = self.quantity.sample(cells, self.on_sydney, choice, false)?;
            sample.ratio()
        };
        let ratios = (0..choices(&axes)).map(ratio).collect();
        Survey {
            plan: self.clone(),
            axes,
            ratios,
        }
    }
}

impl Survey {
    fn value(&self, choice: Choice) -> Option<f64> {
        let ratio = self.ratios[choice.number(&self.axes)]?;
        Some(self.plan.quantity.value(ratio, choice))
    }

    /// How far a value is from the paper's, as a share of it.
    fn distance(&self, value: f64) -> f64 {
        (value - self.plan.paper).abs() / self.plan.paper.abs()
    }
}
