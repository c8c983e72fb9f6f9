//! The plots of a run: the counterparts of the paper's figures, then those of our own.
//!
//! `plans` is the list; `curves` makes the plots over a sweep, `bars` those with a method or a cell to a place. Every plot
//! shows `exact`.

mod bars;
mod curves;
mod plans;

use super::cells::{Cell, Cells};
use super::design::{CellPlan, Sweep};
use super::method::{Approach, Method, Span};
use super::record::{Figure, Point};
use super::statistics::{Estimate, Resampler};
use super::text::counted;

pub(super) use curves::break_even;
pub use plans::figure_plans;

/// One plot and what it needs.
#[derive(Clone, Debug)]
pub struct FigurePlan {
    slug: &'static str,
    /// The number of its counterpart in the paper.
    paper: Option<u32>,
    title: &'static str,
    sweep: Sweep,
    content: Content,
}

/// What a plot shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    /// Times over the baseline's, along a sweep.
    RelativeTime(&'static [Method]),
    /// Route lengths over the shortest, along a sweep.
    Overhead(&'static [Method]),
    /// The share of the network's nodes that is searched, along a sweep.
    NodeShare(&'static [Method]),
    /// The same of its segments.
    SegmentShare(&'static [Method]),
    /// Search space and searches with skipping over those without, where it was effective or was not.
    Skipping {
        /// Which cases.
        effective: bool,
    },
    /// Times in microseconds, cell by cell.
    Times(&'static [Method]),
    /// Nodes settled, along a sweep.
    Settled(&'static [Method]),
    /// Queries per destination at which its table pays, along a sweep.
    BreakEven(&'static [Method]),
}

/// The baseline of every relative time: Dijkstra on the whole-route problem, stopped at the destination.
const BASELINE: Method = Method::baseline(Approach::Dijkstra { full_tree: false }, Span::Route);

impl FigurePlan {
    /// The stem of its files.
    pub fn slug(&self) -> &str {
        self.slug
    }

    /// The number of its counterpart in the paper.
    pub fn paper(&self) -> Option<u32> {
        self.paper
    }

    /// True for a cell that the plot needs.
    pub fn needs(&self, cell: &CellPlan) -> bool {
        cell.is_on(self.sweep)
    }

    /// Makes the plot from the cells of a run; `None` where they have nothing for it. The seed is that of the
    /// intervals.
    pub fn figure(&self, cells: &Cells, seed: u64) -> Option<Figure> {
        let cells = cells.on(self.sweep);
        let figure = match self.sweep {
            Sweep::Real => self.by_method(&cells, seed),
            _ => self.by_cell(&cells, seed),
        };
        figure.filter(|figure| figure.series.iter().any(|series| !series.points.is_empty()))
    }

    /// A plot without its content, of which each kind fills in its own.
    fn resampler(&self, series: &str, cell: &Cell, seed: u64) -> Resampler {
        let name = &cell.plan.name;
        Resampler::new(seed, &format!("figure {} {series} {name}", self.slug))
    }

    /// How the counterpart in the paper is named.
    fn counterpart(&self) -> Option<String> {
        self.paper.map(|number| format!("Fig. {number}"))
    }
}

/// A point with the interval of an estimate.
fn point(x: f64, estimate: Estimate) -> Point {
    Point {
        x,
        y: estimate.value,
        low: estimate.low,
        high: estimate.high,
        cases: estimate.cases,
    }
}

/// How many failures and networks a plot is made from, as a sentence.
fn basis(cells: &[&Cell]) -> String {
    let failures: usize = cells.iter().map(|cell| cell.figures.failures.len()).sum();
    let drawn: usize = cells.iter().map(|cell| cell.figures.facts.failures).sum();
    let networks = counted(cells.len(), "network", "networks");
    format!("{failures} failures with a detour, of {drawn} drawn, on {networks}")
}
