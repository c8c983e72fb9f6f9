//! The plots of a run: the counterparts of the paper's figures, then those of our own.
//!
//! `plans` is the list; `curves` makes the plots over a variable, `bars` those with a name to each place. Every plot
//! shows `exact`. Generated networks are those joined at random, on which every variable of Table 1 binds;
//! failures are uniform on the path.

mod bars;
mod curves;
mod plans;

use super::cells::{Cell, Cells, FailureRow, on_paths};
use super::design::{CellPlan, Pool, Sweep};
use super::method::{Approach, Method, Span};
use super::record::{Axis, Figure, PaperMark, Point};
use super::rows::Row;
use super::statistics::{Average, Estimate, Resampler, quantile};
use super::text::counted;
use crate::network::Joining;

pub use plans::figure_plans;

/// One plot and what it needs.
#[derive(Clone, Debug)]
pub struct FigurePlan {
    slug: &'static str,
    /// The number of its counterpart in the paper.
    paper: Option<u32>,
    title: &'static str,
    over: Over,
    content: Content,
    /// What the paper says: of which series, where on an axis of names, and which number.
    says: &'static [(&'static str, Option<usize>, f64)],
}

/// What a plot goes over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Over {
    /// A variable of Table 1.
    Sweep(Sweep),
    /// Generators, and Sydney CBD.
    Generators,
    /// Methods, on the network that comes from a file.
    Methods,
    /// What skipping changes, where it was effective or where it was not.
    Skipping {
        /// Which cases.
        effective: bool,
    },
}

/// What a plot shows of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    /// Times over those of Dijkstra, stopped at its goal, on the problem of a span.
    RelativeTime(&'static [Method], Span),
    /// Route lengths over the shortest.
    Overhead(&'static [Method]),
    /// The share of the network's nodes that is searched.
    NodeShare(&'static [Method]),
    /// The same of its segments.
    SegmentShare(&'static [Method]),
    /// Times in microseconds.
    Times(&'static [Method]),
    /// Nodes settled.
    Settled(&'static [Method]),
    /// Nothing of a method: what skipping changes.
    Skipping,
}

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
        self.pools().iter().any(|&(_, pool)| cell.is_in(pool))
    }

    /// The networks that it shows, with their names.
    fn pools(&self) -> Vec<(&'static str, Pool)> {
        let generators = [
            ("nearest", Pool::Joined(Joining::Nearest)),
            ("random", Pool::Joined(Joining::Random)),
            ("Delaunay", Pool::Joined(Joining::Delaunay)),
            ("from a file", Pool::Real),
        ];
        match self.over {
            Over::Sweep(_) => vec![generators[1]],
            Over::Generators => generators.to_vec(),
            Over::Methods => vec![generators[3]],
            Over::Skipping { .. } => vec![("every network", Pool::Everything)],
        }
    }

    /// Makes the plot from the cells of a run; `None` where they have nothing for it. The seed is that of the
    /// intervals.
    pub fn figure(&self, cells: &Cells, seed: u64) -> Option<Figure> {
        let pools = self.pools().into_iter();
        let pools: Vec<(&str, Vec<&Cell>)> =
            pools.map(|(name, pool)| (name, cells.of(pool))).collect();
        let figure = match self.over {
            Over::Sweep(sweep) => self.by_variable(&pools[0].1, sweep, seed),
            Over::Generators => self.by_pool(&pools, seed),
            Over::Methods => self.by_method(&pools[0].1, seed),
            Over::Skipping { effective } => self.skipping(&pools[0].1, effective, seed),
        };
        figure.filter(|figure| figure.series.iter().any(|series| !series.points.is_empty()))
    }

    /// A plot without its series.
    fn frame(&self, cells: &[&Cell], x: Axis) -> Figure {
        let (y, reference) = self.upright();
        let says = self.says.iter();
        Figure {
            slug: self.slug.to_owned(),
            paper: self.paper.map(|number| format!("Fig. {number}")),
            title: self.title.to_owned(),
            caption: self.caption(cells),
            x,
            y,
            series: Vec::new(),
            reference,
            marks: says
                .map(|&(series, place, y)| PaperMark {
                    series: series.to_owned(),
                    x: place.map(|place| place as f64),
                    y,
                })
                .collect(),
        }
    }

    /// The methods that the plot shows.
    fn methods(&self) -> &'static [Method] {
        match self.content {
            Content::RelativeTime(methods, _)
            | Content::Overhead(methods)
            | Content::NodeShare(methods)
            | Content::SegmentShare(methods)
            | Content::Times(methods)
            | Content::Settled(methods) => methods,
            Content::Skipping => &[],
        }
    }

    /// The name of a method in the plot; lengths of `exact` do not depend on its table.
    fn series_name(&self, method: Method) -> String {
        let is_exact = matches!(method.approach, Approach::Exact { .. });
        match self.content {
            Content::Overhead(_) if is_exact => "exact".to_owned(),
            _ => method.approach.name().to_owned(),
        }
    }

    /// The value of a method on some networks, at a place of the horizontal axis.
    fn point(&self, method: Method, cells: &[&Cell], x: f64, seed: u64) -> Option<Point> {
        let figure = |figure: &dyn Fn(&FailureRow, &Row) -> f64| {
            on_paths(cells, [method], |failure, [row]| figure(failure, row))
        };
        let of = |part: usize, whole: usize| 1e2 * part as f64 / whole as f64;
        let has_areas = method.approach.has_areas();
        let values = match self.content {
            Content::RelativeTime(_, span) => {
                let baseline = Method::baseline(Approach::Dijkstra { full_tree: false }, span);
                on_paths(cells, [method, baseline], |_, [own, other]| {
                    own.time_us / other.time_us
                })
            }
            Content::Overhead(_) => {
                figure(&|failure, row| 1e2 * (row.remaining_m / failure.optimum_m - 1.0))
            }
            // Without an area what is looked at are the nodes settled and the segments at them.
            Content::NodeShare(_) if !has_areas => {
                figure(&|failure, row| of(row.settled_nodes, failure.nodes))
            }
            Content::NodeShare(_) => figure(&|failure, row| of(row.area_nodes, failure.nodes)),
            Content::SegmentShare(_) if !has_areas => figure(&|failure, row| {
                of(row.searched_segments.unwrap_or_default(), failure.segments)
            }),
            Content::SegmentShare(_) => {
                figure(&|failure, row| of(row.area_segments, failure.segments))
            }
            Content::Times(_) => figure(&|_, row| row.time_us),
            Content::Settled(_) => figure(&|_, row| row.settled_nodes as f64),
            Content::Skipping => return None,
        };
        let purpose = format!("figure {} {} {x}", self.slug, method.id());
        let mut resampler = Resampler::new(seed, &purpose);
        let estimate = match self.content {
            Content::RelativeTime(..) | Content::Times(_) => resampler.of_median(&values),
            _ => resampler.of_mean(&values),
        };
        Some(point(x, estimate?, values.concat()))
    }
}

/// A point with the interval of an estimate and the quartiles of what it is taken over.
fn point(x: f64, estimate: Estimate, mut values: Vec<f64>) -> Point {
    Point {
        x,
        y: estimate.value,
        low: estimate.low,
        high: estimate.high,
        spread: [0.25, 0.75].map(|share| quantile(&mut values, share)),
        cases: estimate.cases,
    }
}

/// How many failures and networks a plot is made from, as a sentence.
fn basis(cells: &[&Cell]) -> String {
    let failures: usize = on_paths(cells, [Method::exact(true)], |_, _| ())
        .iter()
        .map(Vec::len)
        .sum();
    let networks = cells.iter().map(|cell| cell.figures.facts.networks).sum();
    let networks = counted(networks, "network", "networks");
    format!("{failures} failures with a detour on {networks}")
}
