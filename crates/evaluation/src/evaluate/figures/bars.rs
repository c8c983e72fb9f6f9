//! Plots with a name to each place: a method, or what skipping a stage changes.

use super::super::cells::Cell;
use super::super::record::{Axis, Figure, Point, Scale, Series};
use super::super::skipped::{Case, Extent, cases};
use super::super::statistics::{Average, Resampler};
use super::super::text::counted;
use super::{FigurePlan, point};

impl FigurePlan {
    /// A plot of one cell with a place for each method.
    pub(super) fn by_method(&self, cells: &[&Cell], seed: u64) -> Option<Figure> {
        let cell = *cells.first()?;
        let mut names = Vec::new();
        let mut series = Vec::new();
        for &method in self.methods() {
            let mut resampler = self.resampler(&method.id(), cell, seed);
            let Some(estimate) = self.estimate(method, cell, &mut resampler) else {
                continue;
            };
            let name = self.series_name(method);
            series.push(Series {
                name: name.clone(),
                points: vec![point(names.len() as f64, estimate)],
            });
            names.push(name);
        }
        // The plan says Sydney CBD; on somebody's own network it is a plot of that.
        let is_sydney = cell.plan.is_sydney();
        let named = |text: &str, sydney: &str, name: &str| match is_sydney {
            true => text.to_owned(),
            false => text.replace(sydney, name),
        };
        Some(Figure {
            slug: named(self.slug, "sydney", "network"),
            paper: self.counterpart().filter(|_| is_sydney),
            title: named(self.title, "Sydney CBD", &cell.plan.name),
            caption: self.caption(cells),
            x: Axis {
                label: "method".to_owned(),
                scale: Scale::Categories(names),
            },
            y: self.vertical(),
            series,
            reference: self.reference(),
        })
    }

    /// What skipping changes, in the cases where it was effective or in the others.
    pub(super) fn skipping(&self, cells: &[&Cell], effective: bool, seed: u64) -> Option<Figure> {
        let all: Vec<Case> = cells.iter().flat_map(|cell| cases(cell)).collect();
        let chosen: Vec<&Case> = all
            .iter()
            .filter(|case| case.is_effective == effective)
            .collect();
        type Space = fn(&Extent) -> f64;
        let spaces: [(&str, Space); 5] = [
            ("nodes, last area", |extent| extent.nodes),
            ("segments, last area", |extent| extent.segments),
            ("nodes, all areas", |extent| extent.searched_nodes),
            ("nodes settled", |extent| extent.settled),
            ("searches", |extent| extent.searches),
        ];
        let settled_place = 3;
        let mut resampler = Resampler::new(seed, self.slug);
        let mut of = |place: usize, pairs: Vec<(f64, f64)>| -> Option<Point> {
            let estimate = resampler.of_pairs(&pairs, Average::RatioOfMeans)?;
            Some(point(place as f64, estimate))
        };
        let mut own = Vec::new();
        for (place, (_, space)) in spaces.iter().enumerate() {
            let pairs = chosen
                .iter()
                .map(|case| (space(&case.with_skipping), space(&case.without)));
            own.extend(of(place, pairs.collect()));
        }
        let exact = chosen
            .iter()
            .map(|case| (case.exact_settled, case.without.settled));
        let exact: Vec<Point> = of(settled_place, exact.collect()).into_iter().collect();
        let names = spaces.map(|(name, _)| name.to_owned());
        let series = [("exact, warm", exact), ("two-phased", own)];
        Some(Figure {
            slug: self.slug.to_owned(),
            paper: self.counterpart(),
            title: self.title.to_owned(),
            caption: format!(
                "{} {} of {} with a skipped stage.",
                self.caption(cells),
                chosen.len(),
                counted(all.len(), "failure", "failures")
            ),
            x: Axis {
                label: "what is counted".to_owned(),
                scale: Scale::Categories(names.to_vec()),
            },
            y: self.vertical(),
            series: series
                .map(|(name, points)| Series {
                    name: name.to_owned(),
                    points,
                })
                .to_vec(),
            reference: self.reference(),
        })
    }
}
