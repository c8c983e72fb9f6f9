//! The shared readings beside those of another implementation.

use super::super::cells::{Cells, FailureRow, on_paths};
use super::super::design::Pool;
use super::super::method::{Approach, Method};
use super::super::record::Note;
use super::super::rows::Row;
use super::super::statistics::{Estimate, Resampler};
use super::super::text::number;
use super::table;
use crate::network::Joining;

/// The other implementation: in Python, from the paper's text alone, on networks of its own.
///
/// A name, what is averaged, and for each pool its mean and standard error, where it has one.
type Measured = (
    &'static str,
    Approach,
    fn(&FailureRow, &Row) -> f64,
    [(f64, Option<f64>); 3],
);

/// The pools, with the numbers of its networks.
const POOLS: [(&str, Pool, f64); 3] = [
    ("nearest", Pool::Joined(Joining::Nearest), 60.0),
    ("random", Pool::Joined(Joining::Random), 60.0),
    ("random, short reach", Pool::ShortReach, 30.0),
];

const LONGER: fn(&FailureRow, &Row) -> f64 =
    |failure, row| 1e2 * (row.remaining_m / failure.optimum_m - 1.0);
const SEARCHED: fn(&FailureRow, &Row) -> f64 =
    |failure, row| 1e2 * row.area_nodes as f64 / failure.nodes as f64;
const SKIPPED: fn(&FailureRow, &Row) -> f64 = |_, row| match row.skipped.is_empty() {
    true => 0.0,
    false => 1e2,
};

const THEIRS: [Measured; 6] = [
    (
        "radius, longer by %",
        Approach::Radius,
        LONGER,
        [(3.6, Some(0.4)), (18.0, Some(1.2)), (9.6, Some(0.9))],
    ),
    (
        "cell density, longer by %",
        Approach::CellDensity,
        LONGER,
        [(3.6, None), (14.9, Some(0.9)), (9.0, Some(0.8))],
    ),
    (
        "two-phased, longer by %",
        Approach::TwoPhased,
        LONGER,
        [(4.1, None), (26.4, Some(1.6)), (12.7, None)],
    ),
    (
        "cell density, % of the nodes searched",
        Approach::CellDensity,
        SEARCHED,
        [(16.6, None), (24.7, None), (17.4, None)],
    ),
    (
        "two-phased, % of the nodes searched",
        Approach::TwoPhased,
        SEARCHED,
        [(1.6, None), (3.4, None), (1.8, None)],
    ),
    (
        "two-phased, % of failures with a skipped stage",
        Approach::TwoPhased,
        SKIPPED,
        [
            (1e2 * 24.0 / 668.0, None),
            (1e2 * 112.0 / 669.0, None),
            (1e2 * 30.0 / 309.0, None),
        ],
    ),
];

/// Every shared reading beside theirs; `None` where the run has none of their networks.
pub fn agreement(cells: &Cells, seed: u64) -> Option<Note> {
    let mut rows = Vec::new();
    let (mut beyond_two, mut beyond_three) = (0, 0);
    for (name, approach, figure, theirs) in THEIRS {
        for ((pool_name, pool, networks), (their_mean, their_error)) in
            POOLS.into_iter().zip(theirs)
        {
            let pool = cells.of(pool);
            let values = on_paths(&pool, [Method::of_paper(approach)], |failure, [row]| {
                figure(failure, row)
            });
            let mut resampler = Resampler::new(seed, &format!("agreement {name} {pool_name}"));
            let Some(ours) = resampler.of_mean(&values) else {
                continue;
            };
            let our_error = error(ours);
            // Where theirs is not known: what ours would be on as many networks as they had.
            let as_many = our_error * (values.len() as f64 / networks).sqrt();
            let together = our_error.hypot(their_error.unwrap_or(as_many));
            // Where no failure differs from another there is nothing to compare by.
            if together == 0.0 {
                continue;
            }
            let apart = (ours.value - their_mean) / together;
            beyond_two += usize::from(apart.abs() > 2.0);
            beyond_three += usize::from(apart.abs() > 3.0);
            let their_error =
                their_error.map_or_else(String::new, |error| format!(" ± {}", number(error)));
            rows.push(vec![
                name.to_owned(),
                pool_name.to_owned(),
                format!("{}{their_error}", number(their_mean)),
                format!("{} ± {}", number(ours.value), number(our_error)),
                number(apart),
            ]);
        }
    }
    let compared = rows.len();
    let header = [
        "mean over failures, A to B",
        "networks",
        "theirs",
        "ours",
        "standard errors apart",
    ];
    Some(Note {
        title: "Beside another implementation".to_owned(),
        text: format!(
            "Of {compared} means that were also measured by an implementation in Python, made from the paper's text alone and run on networks of its own, {beyond_two} lie more than two standard errors of the difference from ours, and {beyond_three} more than three.",
        ),
        table: Some(table(&header, rows)?),
    })
}

/// The standard error that an interval stands for.
fn error(estimate: Estimate) -> f64 {
    (estimate.high - estimate.low) / (2.0 * 1.96)
}
