//! The raw figures of a run in memory: per cell its failures, and per method one row for each of them.

use super::design::{CellPlan, Sweep};
use super::method::Method;
use super::record::NetworkFacts;
use super::rows::Row;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A failure that has a detour: what is the same for all methods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailureRow {
    /// Its number among those drawn, from 0.
    pub failure: usize,
    /// Id of the node where the delivery began.
    pub source: String,
    /// Id of A, where the failed leg begins.
    pub from: String,
    /// Id of B, where it ends.
    pub to: String,
    /// Id of the destination.
    pub destination: String,
    /// Length of the failed segment, in metres.
    pub segment_m: f64,
    /// From the source to A, in metres.
    pub flown_m: f64,
    /// The shortest way from A to B without the failed segment, in metres, as the oracle has it.
    pub local_optimum_m: f64,
    /// The shortest way from A to the destination without it, in metres, as the oracle has it.
    pub optimum_m: f64,
    /// Time to make the table of the destination, in microseconds.
    pub table_us: f64,
}

/// The figures of one cell.
#[derive(Clone, Debug, PartialEq)]
pub struct CellRows {
    /// What the cell is.
    pub facts: NetworkFacts,
    /// Its failures that have a detour.
    pub failures: Vec<FailureRow>,
    /// One row per failure, in the same order, for each method.
    pub rows: BTreeMap<Method, Vec<Row>>,
}

/// A cell that has been computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Where it stands in the design.
    pub plan: CellPlan,
    /// Its figures.
    pub figures: CellRows,
}

/// All cells of a run that have been computed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells(pub Vec<Cell>);

impl CellRows {
    /// Sorts rows by their methods; `None` where a method has not exactly one row per failure.
    pub fn sorted(
        facts: NetworkFacts,
        failures: Vec<FailureRow>,
        unsorted: Vec<Row>,
    ) -> Option<Self> {
        // Where no failure has a detour, every method has its rows: none.
        let mut rows: BTreeMap<Method, Vec<Row>> = Method::all()
            .into_iter()
            .map(|method| (method, Vec::new()))
            .collect();
        for row in unsorted {
            rows.entry(row.method).or_default().push(row);
        }
        let is_whole = Method::all().iter().all(|method| {
            rows.get(method).is_some_and(|rows| {
                rows.len() == failures.len()
                    && rows
                        .iter()
                        .zip(&failures)
                        .all(|(row, failure)| row.failure == failure.failure)
            })
        });
        is_whole.then_some(Self {
            facts,
            failures,
            rows,
        })
    }
}

impl Cell {
    /// A figure of every failure under a method.
    pub(super) fn values(
        &self,
        method: Method,
        figure: impl Fn(&FailureRow, &Row) -> f64,
    ) -> Vec<f64> {
        let rows = self.figures.rows.get(&method);
        let pairs = self.figures.failures.iter().zip(rows.into_iter().flatten());
        pairs.map(|(failure, row)| figure(failure, row)).collect()
    }

    /// The times of a method, in microseconds.
    pub(super) fn times_us(&self, method: Method) -> Vec<f64> {
        self.values(method, |_, row| row.time_us)
    }

    /// The times of two methods on the same failures.
    pub(super) fn time_pairs(&self, method: Method, baseline: Method) -> Vec<(f64, f64)> {
        let times = self.times_us(method).into_iter();
        times.zip(self.times_us(baseline)).collect()
    }
}

impl Cells {
    /// The cells on the way of a sweep, in its order.
    pub(super) fn on(&self, sweep: Sweep) -> Vec<&Cell> {
        let mut cells: Vec<&Cell> = self
            .0
            .iter()
            .filter(|cell| cell.plan.is_on(sweep))
            .collect();
        let variable = |cell: &&Cell| cell.plan.variable(sweep).unwrap_or_default();
        cells.sort_by(|one, other| variable(one).total_cmp(&variable(other)));
        cells
    }

    /// Sydney CBD alone, or every other cell, which stand for Table 1 or for whatever network was given.
    pub(super) fn of_sydney(&self, is_sydney: bool) -> Vec<&Cell> {
        let cells = self.0.iter();
        cells
            .filter(|cell| cell.plan.is_sydney() == is_sydney)
            .collect()
    }
}
