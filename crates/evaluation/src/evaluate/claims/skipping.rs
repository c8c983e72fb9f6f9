//! What the sentences about skipped stages can mean.
//!
//! A skipped stage is effective where its area holds no path, so that searching it would have been in
//! vain; the same failure with every stage searched tells.

use super::super::cells::Cell;
use super::super::record::Reading;
use super::super::skipped::{Case, Extent, cases};
use super::super::statistics::{Average, Resampler};
use super::readings::reading;

/// What is meant by search space.
type Space = fn(&Extent) -> f64;

const SPACES: [(&str, Space); 4] = [
    ("nodes of the last area", |extent| extent.nodes),
    ("segments of the last area", |extent| extent.segments),
    ("nodes of all areas searched", |extent| {
        extent.searched_nodes
    }),
    ("nodes settled", |extent| extent.settled),
];

fn all_cases(cells: &[&Cell]) -> Vec<Case> {
    cells.iter().flat_map(|cell| cases(cell)).collect()
}

/// The share of failures with a skipped stage in which skipping was effective, in per cent.
pub(super) fn effective_cases(cells: &[&Cell], seed: u64) -> Vec<Reading> {
    let of = |name: &str, chosen: Vec<Case>| {
        let hits: Vec<f64> = chosen
            .iter()
            .map(|case| if case.is_effective { 1e2 } else { 0.0 })
            .collect();
        let estimate = Resampler::new(seed, name).of_mean(&hits)?;
        Some(reading(name, estimate))
    };
    let mut readings = vec![of(
        "failures with a skipped stage, all networks",
        all_cases(cells),
    )];
    let only = |chosen: fn(&Case) -> bool| all_cases(cells).into_iter().filter(chosen).collect();
    readings.push(of(
        "of these, where the triangle alone was skipped",
        only(|case| case.skipped == "triangle"),
    ));
    readings.push(of(
        "of these, where the rhombus was skipped",
        only(|case| case.skipped.contains("rhombus")),
    ));
    for cell in cells {
        let name = format!("failures with a skipped stage, {}", cell.plan.name);
        readings.push(of(&name, cases(cell)));
    }
    readings.into_iter().flatten().collect()
}

/// The search space with skipping over that without, where skipping was ineffective.
pub(super) fn ineffective_space(cells: &[&Cell], mut resampler: Resampler) -> Vec<Reading> {
    let cases = all_cases(cells);
    let mut readings = Vec::new();
    for (what, space) in SPACES {
        let ineffective = cases.iter().filter(|case| !case.is_effective);
        let pairs: Vec<(f64, f64)> = ineffective
            .map(|case| (space(&case.with_skipping), space(&case.without)))
            .filter(|&(_, without)| without > 0.0)
            .collect();
        for average in Average::ALL {
            let name = format!("{what}; {}", average.name());
            let estimate = resampler.of_pairs(&pairs, average);
            readings.extend(estimate.map(|estimate| reading(&name, estimate)));
        }
    }
    readings
}

/// By how many per cent the search space of effective skipping is smaller than that of ineffective.
pub(super) fn effective_space(cells: &[&Cell], mut resampler: Resampler) -> Vec<Reading> {
    let cases = all_cases(cells);
    let mut readings = Vec::new();
    for (what, space) in SPACES {
        let groups = |figure: &dyn Fn(&Case) -> f64| {
            [true, false].map(|is_effective| {
                let group = cases
                    .iter()
                    .filter(|case| case.is_effective == is_effective);
                group
                    .map(figure)
                    .filter(|figure| figure.is_finite())
                    .collect::<Vec<f64>>()
            })
        };
        let ratio = |case: &Case| space(&case.with_skipping) / space(&case.without);
        let kinds: [(String, [Vec<f64>; 2]); 2] = [
            (
                format!("{what}; means"),
                groups(&|case| space(&case.with_skipping)),
            ),
            (
                format!("{what}, each over that without skipping; means"),
                groups(&ratio),
            ),
        ];
        for (name, [effective, ineffective]) in kinds {
            let estimate = resampler.of_groups(&effective, &ineffective);
            let percent = |ratio: f64| 1e2 * (1.0 - ratio);
            readings.extend(estimate.map(|estimate| reading(&name, estimate.map(percent))));
        }
    }
    readings
}
