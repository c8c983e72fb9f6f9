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
    /// The one set of conventions that meets most of them.
    pub conventions: Option<Conventions>,
    /// One entry per sentence without a number.
    pub sentences: Vec<Sentence>,
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

/// One cell of the evaluation: networks with the same variables, and the failures drawn on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkFacts {
    /// The name of the cell, such as `random-n1000-k10-reach0.30`.
    pub name: String,
    /// How many networks.
    pub networks: usize,
    /// Nodes of a network as it is generated, or comes from a file.
    pub nodes: usize,
    /// Segments of all of them.
    pub segments: usize,
    /// Nodes of the largest components, from which source and destination are drawn, of all of them.
    pub component_nodes: usize,
    /// Failures drawn.
    pub failures: usize,
    /// Of those, the failures after which no way leads to the destination any more.
    pub without_detour: usize,
    /// Distances of `exact` and of the baselines found equal to those of an independent search.
    pub distances_checked: usize,
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
    /// What the paper's text says of it.
    pub marks: Vec<PaperMark>,
}

/// A number of the paper in a plot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperMark {
    /// The series that it is said of.
    pub series: String,
    /// Where it stands on an axis of categories; none where it is said of the whole series.
    pub x: Option<f64>,
    /// The number, on the vertical axis.
    pub y: f64,
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
    /// The first and the third quartile of the values it is taken over.
    pub spread: [f64; 2],
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
    /// How many readings of the sentence were measured.
    pub readings: usize,
    /// Under how many of them the number is met.
    pub met: usize,
    /// The least and the greatest value of all readings.
    pub range: Option<[f64; 2]>,
    /// The value under the joint conventions.
    pub joint: Option<Reading>,
    /// The reading that comes closest.
    pub closest: Option<Reading>,
    /// What `exact` does to the same quantity under the joint conventions.
    pub exact: Option<Reading>,
    /// Whether the claim holds.
    pub holds: Verdict,
    /// The same as a sentence, with figures.
    pub verdict: String,
    /// Why it is missed, where it is.
    pub cause: Option<Cause>,
}

/// One set of conventions for the whole paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conventions {
    /// What is left open, and what is taken for it.
    pub choices: Vec<(String, String)>,
    /// How many sets were tried.
    pub sets: usize,
    /// How many claims the best set meets.
    pub met: usize,
    /// Of how many that were measured.
    pub measured: usize,
}

/// What decides a claim that is missed: the one change of the joint conventions that comes closest to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Generator, language, library, failures, wording, or the paper against itself.
    pub kind: String,
    /// What is changed, and for what.
    pub change: String,
    /// The value after it.
    pub value: f64,
    /// Whether the claim is met then.
    pub is_met: bool,
}

/// A sentence of the paper without a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sentence {
    /// A short name.
    pub id: String,
    /// What the paper says, in short.
    pub text: String,
    /// How it was put to the test.
    pub test: String,
    /// Whether it holds.
    pub holds: Verdict,
    /// On how many networks, by where they come from.
    pub counts: Vec<Count>,
}

/// On how many networks a sentence holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// Where the networks come from.
    pub networks: String,
    /// Networks on which it holds.
    pub holds: usize,
    /// Networks on which the opposite holds; on the others there is no difference.
    pub fails: usize,
    /// All networks.
    pub of: usize,
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

/// Whether a claim or a sentence holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Met under the joint conventions, and not under one reading alone; a sentence on most networks.
    Reproduced,
    /// Met under some reading of its own, but not under the joint conventions, or under one reading alone.
    InIsolation,
    /// Met under no reading; under the joint conventions on the paper's side.
    DirectionOnly,
    /// A sentence: true on some networks and false on others.
    Depends,
    /// Under the joint conventions on the other side; a sentence on few networks.
    Contradicted,
    /// Met under no reading, and a share of the whole or a difference that has no side.
    NotReproduced,
    /// This run did not compute what the claim needs.
    NotMeasured,
}

/// One reading of a claim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// What it takes the sentence to mean, as the options that it takes.
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
