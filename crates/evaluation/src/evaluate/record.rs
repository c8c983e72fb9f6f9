//! What a run of the evaluation found: provenance, figures, claims and notes.
//!
//! It is what `run.json` holds and all that the report is made from. Every number is finite; what was
//! not measured is left out, never written as a placeholder.

use serde::{Deserialize, Serialize};

/// A whole run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Where the figures come from.
    pub provenance: Provenance,
    /// One entry per plot, those of the paper first and in its order.
    pub figures: Vec<Figure>,
    /// One entry per number in the text of the paper, in its order.
    pub claims: Vec<Claim>,
    /// What is told beside: rows that a heuristic wins, the break-even of the table, and so on.
    pub notes: Vec<Note>,
}

/// Where the figures of a run come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The version of the package.
    pub version: String,
    /// The commit it was built from, or `unknown`.
    pub commit: String,
    /// The compiler, as it names itself.
    pub compiler: String,
    /// The profile it was built with.
    pub profile: String,
    /// Whether the build checks its assertions, which costs time: its times are no result.
    pub checks_assertions: bool,
    /// The processor and how many of its cores the run could use.
    pub machine: String,
    /// When the run began, in RFC 3339.
    pub started: String,
    /// The seed of everything that was drawn.
    pub seed: u64,
    /// Whether this was the short run.
    pub quick: bool,
    /// The command, with its arguments.
    pub command: String,
    /// What the run was told or took by default: name and value.
    pub parameters: Vec<(String, String)>,
    /// The networks it ran on, one per cell.
    pub networks: Vec<NetworkFacts>,
}

/// One cell of the evaluation: a network with the failures drawn on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkFacts {
    /// The name of the cell, such as `n1000-k10-map10000-reach0.30`.
    pub name: String,
    /// Nodes of the network.
    pub nodes: usize,
    /// Segments of the network.
    pub segments: usize,
    /// Nodes of its largest component, from which source and destination are drawn.
    pub component_nodes: usize,
    /// Failures drawn.
    pub failures: usize,
    /// Of those, the failures after which no way leads to the destination any more.
    pub without_detour: usize,
    /// Distances of `exact` and of the baselines found equal to those of an independent search.
    pub distances_checked: usize,
    /// The median length of the failed segments, in metres.
    pub median_failed_segment_m: f64,
}

/// One plot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The stem of its files, such as `time-by-size`.
    pub slug: String,
    /// Its counterpart in the paper, such as `Fig. 8`; none for a figure of ours.
    pub paper: Option<String>,
    /// A short heading.
    pub title: String,
    /// What is plotted, with counts.
    pub caption: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is plotted, in the order of the legend.
    pub series: Vec<Series>,
    /// A horizontal line to compare with.
    pub reference: Option<Reference>,
}

/// A horizontal line to compare with, such as the baseline at 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Where it lies on the vertical axis.
    pub y: f64,
    /// What it is.
    pub label: String,
}

/// An axis of a plot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// What it measures, with its unit.
    pub label: String,
    /// How its values are laid out.
    pub scale: Scale,
}

/// How the values of an axis are laid out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// By their difference.
    Linear,
    /// By their ratio; all values are above 0.
    Log,
    /// By place: `Point::x` is an index into these names.
    Categories(Vec<String>),
}

/// What belongs together in a plot: one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// The name of the method, the same over all figures.
    pub name: String,
    /// Its points, by growing `x`.
    pub points: Vec<Point>,
}

/// One point of a series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Where it stands; an index on an axis of categories.
    pub x: f64,
    /// The median or mean.
    pub y: f64,
    /// The lower end of its 95 % bootstrap interval.
    pub low: f64,
    /// The upper end of its 95 % bootstrap interval.
    pub high: f64,
    /// How many failures it is taken over.
    pub cases: usize,
}

/// A number in the text of the paper, and what came of it here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// A short name, such as `radius-time`.
    pub id: String,
    /// The part of the paper's evaluation it stands in.
    pub section: String,
    /// What the paper says, in short.
    pub text: String,
    /// The number it says.
    pub paper: f64,
    /// In which unit.
    pub unit: Unit,
    /// Which direction is the good one.
    pub better: Better,
    /// Every sensible reading of the sentence, with its value here.
    pub readings: Vec<Reading>,
    /// The reading that comes closest, as an index into `readings`.
    pub closest: Option<usize>,
    /// Whether the claim holds.
    pub holds: Verdict,
    /// The same as a sentence, with figures.
    pub verdict: String,
    /// What `exact` does to the same quantity.
    pub exact: Option<Reading>,
}

/// The unit of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Parts of a hundred: 9.0 is 9 %.
    Percent,
    /// A ratio: 2.13 is 2.13 times as much.
    Times,
    /// A number of things.
    Count,
}

/// Which direction of a value is the good one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    /// Less is better.
    Lower,
    /// More is better.
    Higher,
    /// It is only a fact.
    Neither,
}

/// Whether a claim holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Under some reading the value is within a tenth of the paper's, or the interval of enough cases covers
    /// it.
    Reproduced,
    /// No reading comes near, but some point in the same direction.
    DirectionOnly,
    /// No reading points in the paper's direction.
    NotReproduced,
    /// This run did not compute what the claim needs.
    NotMeasured,
}

/// One reading of a claim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// What it takes the sentence to mean, such as `early exit, A -> destination, medians`.
    pub name: String,
    /// Its value, in the unit of the claim.
    pub value: f64,
    /// The lower end of its 95 % bootstrap interval.
    pub low: f64,
    /// The upper end of its 95 % bootstrap interval.
    pub high: f64,
    /// How many failures it is taken over.
    pub cases: usize,
}

/// Something told beside the figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Note {
    /// Its heading.
    pub title: String,
    /// Sentences made from the figures.
    pub text: String,
    /// The figures themselves.
    pub table: Option<Table>,
}

/// A table of text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Table {
    /// The heads of its columns.
    pub header: Vec<String>,
    /// Its rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
}
