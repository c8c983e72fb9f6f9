//! Plots over a sweep: one point per cell and method.

use super::super::cells::{Cell, FailureRow};
use super::super::design::Sweep;
use super::super::method::{Approach, Method};
use super::super::record::{Axis, Figure, Reference, Scale, Series};
use super::super::rows::Row;
use super::super::statistics::{Average, Estimate, Resampler, middle};
use super::{BASELINE, Content, FigurePlan, basis, point};

impl FigurePlan {
    /// A plot over the variable of its sweep, or over cells.
    pub(super) fn by_cell(&self, cells: &[&Cell], seed: u64) -> Option<Figure> {
        if let Content::Skipping { effective } = self.content {
            return self.skipping(cells, effective, seed);
        }
        let x = self.horizontal(cells);
        let series = self.methods().iter().map(|&method| Series {
            name: self.series_name(method),
            points: cells
                .iter()
                .enumerate()
                .filter_map(|(place, cell)| {
                    let at = cell.plan.variable(self.sweep).unwrap_or(place as f64);
                    let mut resampler = self.resampler(&method.id(), cell, seed);
                    Some(point(at, self.estimate(method, cell, &mut resampler)?))
                })
                .collect(),
        });
        Some(Figure {
            slug: self.slug.to_owned(),
            paper: self.counterpart(),
            title: self.title.to_owned(),
            caption: self.caption(cells),
            x,
            y: self.vertical(),
            series: series.collect(),
            reference: self.reference(),
        })
    }

    /// The methods that the plot shows.
    pub(super) fn methods(&self) -> &'static [Method] {
        match self.content {
            Content::RelativeTime(methods)
            | Content::Overhead(methods)
            | Content::NodeShare(methods)
            | Content::SegmentShare(methods)
            | Content::Times(methods)
            | Content::Settled(methods)
            | Content::BreakEven(methods) => methods,
            Content::Skipping { .. } => &[],
        }
    }

    /// The name of a method in the plot; lengths of `exact` do not depend on its table.
    pub(super) fn series_name(&self, method: Method) -> String {
        let is_exact = matches!(method.approach, Approach::Exact { .. });
        match self.content {
            Content::Overhead(_) if is_exact => "exact".to_owned(),
            Content::BreakEven(_) => format!("against {}", method.approach.name()),
            _ => method.approach.name().to_owned(),
        }
    }

    /// The value of a method in a cell.
    pub(super) fn estimate(
        &self,
        method: Method,
        cell: &Cell,
        resampler: &mut Resampler,
    ) -> Option<Estimate> {
        let is_exact = matches!(method.approach, Approach::Exact { .. });
        let nodes = cell.figures.facts.nodes as f64;
        let segments = cell.figures.facts.segments as f64;
        let mut mean_percent = |figure: &dyn Fn(&FailureRow, &Row) -> f64, whole: f64| {
            let shares = cell.values(method, |failure, row| 1e2 * figure(failure, row) / whole);
            resampler.of_mean(&shares)
        };
        match self.content {
            Content::RelativeTime(_) => {
                let pairs = cell.time_pairs(method, BASELINE);
                resampler.of_pairs(&pairs, Average::MedianOfRatios)
            }
            Content::Overhead(_) => mean_percent(
                &|failure, row| row.remaining_m / failure.optimum_m - 1.0,
                1.0,
            ),
            // It has no area: what it settles is what it looks at.
            Content::NodeShare(_) | Content::SegmentShare(_) if is_exact => {
                mean_percent(&|_, row| row.settled_nodes as f64, nodes)
            }
            Content::NodeShare(_) => mean_percent(&|_, row| row.area_nodes as f64, nodes),
            Content::SegmentShare(_) => mean_percent(&|_, row| row.area_segments as f64, segments),
            Content::Times(_) => resampler.of_median(&cell.times_us(method)),
            Content::Settled(_) => {
                resampler.of_mean(&cell.values(method, |_, row| row.settled_nodes as f64))
            }
            Content::BreakEven(_) => break_even(cell, method, resampler),
            Content::Skipping { .. } => None,
        }
    }

    fn horizontal(&self, cells: &[&Cell]) -> Axis {
        let (label, scale) = match self.sweep {
            Sweep::Nodes => ("nodes", Scale::Log),
            Sweep::Neighbours => ("most neighbours of a node", Scale::Linear),
            Sweep::Reach => ("longest segment, as a share of the map", Scale::Linear),
            Sweep::Map => ("side of the map, m", Scale::Log),
            Sweep::Real | Sweep::Everything => {
                let names = cells.iter().map(|cell| cell.plan.name.clone());
                ("network", Scale::Categories(names.collect()))
            }
        };
        Axis {
            label: label.to_owned(),
            scale,
        }
    }

    pub(super) fn vertical(&self) -> Axis {
        let (label, scale) = match self.content {
            Content::RelativeTime(_) => ("time / time of Dijkstra", Scale::Log),
            Content::Overhead(_) => ("longer than the shortest route, %", Scale::Linear),
            Content::NodeShare(_) => ("nodes searched, % of the network", Scale::Log),
            Content::SegmentShare(_) => ("segments searched, % of the network", Scale::Log),
            Content::Skipping { .. } => ("with skipping / without", Scale::Linear),
            Content::Times(_) => ("time, µs", Scale::Log),
            Content::Settled(_) => ("nodes settled", Scale::Log),
            Content::BreakEven(_) => ("queries per destination", Scale::Log),
        };
        Axis {
            label: label.to_owned(),
            scale,
        }
    }

    pub(super) fn reference(&self) -> Option<Reference> {
        let (y, label) = match self.content {
            Content::RelativeTime(_) => (1.0, "Dijkstra, A → destination, early exit"),
            Content::Skipping { .. } => (1.0, "every stage searched"),
            _ => return None,
        };
        Some(Reference {
            y,
            label: label.to_owned(),
        })
    }

    pub(super) fn caption(&self, cells: &[&Cell]) -> String {
        let what = match self.content {
            Content::RelativeTime(_) => {
                "Median over failures of the time of each method over that of Dijkstra's algorithm stopped at the destination"
            }
            Content::Overhead(_) => {
                "Mean over failures of how much longer the route from A to the destination is than the shortest"
            }
            Content::NodeShare(_) => {
                "Mean share of the network's nodes in the last area searched; for exact, which has no area, the share of nodes settled"
            }
            Content::SegmentShare(_) => {
                "Mean share of the network's segments in the last area searched; for exact, which has no area, the share of nodes settled"
            }
            Content::Skipping { effective: true } => {
                "Failures in which no skipped stage holds a path: means with skipping over means with every stage searched"
            }
            Content::Skipping { effective: false } => {
                "Failures in which a skipped stage holds a path: means with skipping over means with every stage searched"
            }
            Content::Times(_) => "Median time of a recomposition",
            Content::Settled(_) => {
                "Mean number of nodes settled by all searches of a recomposition"
            }
            Content::BreakEven(_) => {
                "Median time to make the table of a destination over the median time it saves on each query, against exact without it and against each other method; a method that is faster than exact with its table has no point"
            }
        };
        let areas = match self
            .methods()
            .iter()
            .any(|method| method.approach.has_areas())
        {
            true => {
                "; strategies with areas reconnect A and B with A* inside and keep the rest of the plan"
            }
            false => "",
        };
        format!("{what}{areas}. {}; 95 % bootstrap intervals.", basis(cells))
    }
}

/// After how many queries to a destination its table has paid for itself, beside another method.
pub(in super::super) fn break_even(
    cell: &Cell,
    method: Method,
    resampler: &mut Resampler,
) -> Option<Estimate> {
    let tables_us: Vec<f64> = cell
        .figures
        .failures
        .iter()
        .map(|failure| failure.table_us)
        .collect();
    let pairs = cell.time_pairs(method, Method::exact(true));
    resampler.estimate(pairs.len(), |drawn| {
        let of = |figure: &dyn Fn(usize) -> f64| {
            let mut figures: Vec<f64> = drawn.iter().map(|&case| figure(case)).collect();
            middle(&mut figures)
        };
        let saved_us = of(&|case| pairs[case].0) - of(&|case| pairs[case].1);
        match saved_us > 0.0 {
            true => of(&|case| tables_us[case]) / saved_us,
            // Never: left out of the interval, and no point where the cases themselves say so.
            false => f64::NAN,
        }
    })
}
