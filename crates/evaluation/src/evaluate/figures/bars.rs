//! Plots with a name to each place: a method, a generator, or what skipping a stage changes.

use super::super::cells::Cell;
use super::super::failures::Placing;
use super::super::record::{Axis, Figure, Point, Scale, Series};
use super::super::skipped::{Case, Extent, cases};
use super::super::text::counted;
use super::{Average, FigurePlan, Resampler, point};

fn named(label: &str, names: Vec<String>) -> Axis {
    Axis {
        label: label.to_owned(),
        scale: Scale::Categories(names),
    }
}

impl FigurePlan {
    /// A plot of one network with a place for each method.
    pub(super) fn by_method(&self, cells: &[&Cell], seed: u64) -> Option<Figure> {
        let cell = *cells.first()?;
        let mut names = Vec::new();
        let mut series = Vec::new();
        for &method in self.methods() {
            let place = names.len() as f64;
            let Some(point) = self.point(method, cells, place, seed) else {
                continue;
            };
            let name = self.series_name(method);
            series.push(Series {
                name: name.clone(),
                points: vec![point],
            });
            names.push(name);
        }
        let mut figure = Figure {
            series,
            ..self.frame(cells, named("method", names.clone()))
        };
        for mark in &mut figure.marks {
            let place = names.iter().position(|name| *name == mark.series);
            mark.x = place.map(|place| place as f64);
        }
        figure.marks.retain(|mark| mark.x.is_some());
        // The plan says Sydney CBD; on somebody's own network it is a plot of that.
        if !cell.plan.is_sydney() {
            figure.slug = figure.slug.replace("sydney", "network");
            figure.title = figure.title.replace("Sydney CBD", &cell.plan.name);
            figure.paper = None;
            figure.marks.clear();
        }
        Some(figure)
    }

    /// A plot with a place for each generator.
    pub(super) fn by_pool(&self, pools: &[(&str, Vec<&Cell>)], seed: u64) -> Option<Figure> {
        let names = pools.iter().map(|(name, _)| (*name).to_owned()).collect();
        let all: Vec<&Cell> = pools.iter().flat_map(|(_, cells)| cells).copied().collect();
        let series = self.methods().iter().map(|&method| Series {
            name: self.series_name(method),
            points: pools
                .iter()
                .enumerate()
                .filter_map(|(place, (_, cells))| self.point(method, cells, place as f64, seed))
                .collect(),
        });
        Some(Figure {
            series: series.collect(),
            ..self.frame(&all, named("networks", names))
        })
    }

    /// What skipping changes, in the cases where it was effective or in the others.
    pub(super) fn skipping(&self, cells: &[&Cell], effective: bool, seed: u64) -> Option<Figure> {
        let all = cases(cells, Placing::Path, 0);
        let chosen: Vec<Vec<Case>> = all
            .iter()
            .map(|cases| {
                let cases = cases.iter().copied();
                cases
                    .filter(|case| case.is_effective == effective)
                    .collect()
            })
            .collect();
        type Space = fn(&Extent) -> f64;
        let spaces: [(&str, Space); 6] = [
            ("nodes, last area", |extent| extent.nodes),
            ("segments, last area", |extent| extent.segments),
            ("nodes, all areas", |extent| extent.searched_nodes),
            ("nodes settled", |extent| extent.settled),
            ("searches", |extent| extent.searches),
            ("time", |extent| extent.time_us),
        ];
        let mut resampler = Resampler::new(seed, self.slug);
        let mut of = |place: usize, extent: fn(&Case) -> Extent| -> Option<Point> {
            let space = spaces[place].1;
            let pairs: Vec<Vec<(f64, f64)>> = chosen
                .iter()
                .map(|cases| {
                    let pairs = cases
                        .iter()
                        .map(|case| (space(&extent(case)), space(&case.without)));
                    pairs.filter(|pair| pair.1 > 0.0).collect()
                })
                .collect();
            let estimate = resampler.of_pairs(&pairs, Average::RatioOfMeans)?;
            let ratios = pairs
                .concat()
                .iter()
                .map(|(one, other)| one / other)
                .collect();
            Some(point(place as f64, estimate, ratios))
        };
        let own: Vec<Point> = (0..spaces.len())
            .filter_map(|place| of(place, |case| case.with_skipping))
            .collect();
        // It has no areas: what it settles and its time can be compared.
        let exact: Vec<Point> = [3, 5]
            .iter()
            .filter_map(|&place| of(place, |case| case.exact))
            .collect();
        let count = |cases: &[Vec<Case>]| cases.iter().map(Vec::len).sum::<usize>();
        let names = spaces.map(|(name, _)| name.to_owned()).to_vec();
        let series = [("exact, warm", exact), ("two-phased", own)];
        let frame = self.frame(cells, named("what is counted", names));
        Some(Figure {
            caption: format!(
                "{} {} of {} with a skipped stage.",
                frame.caption,
                count(&chosen),
                counted(count(&all), "failure", "failures")
            ),
            series: series
                .map(|(name, points)| Series {
                    name: name.to_owned(),
                    points,
                })
                .to_vec(),
            ..frame
        })
    }
}
