//! The raw figures of a run in memory: per cell its failures, and per method one row for each of them.

use super::design::{CellPlan, Pool};
use super::failures::Placing;
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
    /// Number of its network in the cell, from 0.
    pub network: usize,
    /// How its segment was drawn.
    pub placing: Placing,
    /// Nodes of its network.
    pub nodes: usize,
    /// Segments of its network.
    pub segments: usize,
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
    /// One row per failure, in the same order, for each method; failures of a network follow each other.
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

impl Cells {
    /// The cells of a pool.
    pub(super) fn of(&self, pool: Pool) -> Vec<&Cell> {
        let cells = self.0.iter();
        cells.filter(|cell| cell.plan.is_in(pool)).collect()
    }

    /// The cells by generator and size, with the names of both.
    pub(super) fn by_size(&self) -> Vec<(String, Vec<&Cell>)> {
        let mut groups: Vec<(String, Vec<&Cell>)> = Vec::new();
        for cell in &self.0 {
            let name = cell.plan.summary_name();
            match groups.last_mut() {
                Some((last, group)) if *last == name => group.push(cell),
                _ => groups.push((name, vec![cell])),
            }
        }
        groups
    }

    /// The paper's Sydney CBD.
    pub(super) fn of_sydney(&self) -> Vec<&Cell> {
        let cells = self.0.iter();
        cells.filter(|cell| cell.plan.is_sydney()).collect()
    }
}

/// A figure of every failure under some methods, apart by network; `None` leaves a failure out.
pub(super) fn by_network<T, const METHODS: usize>(
    cells: &[&Cell],
    methods: [Method; METHODS],
    figure: impl Fn(&FailureRow, [&Row; METHODS]) -> Option<T>,
) -> Vec<Vec<T>> {
    let mut networks = Vec::new();
    for cell in cells {
        let rows = methods.map(|method| {
            cell.figures
                .rows
                .get(&method)
                .map_or(&[][..], Vec::as_slice)
        });
        if rows.iter().any(|rows| rows.is_empty()) {
            continue;
        }
        let mut numbered = cell.figures.failures.iter().enumerate().peekable();
        while let Some(&(_, first)) = numbered.peek() {
            let mut of_network = Vec::new();
            while let Some((place, failure)) =
                numbered.next_if(|(_, failure)| failure.network == first.network)
            {
                of_network.extend(figure(failure, rows.map(|rows| &rows[place])));
            }
            networks.push(of_network);
        }
    }
    networks
}

/// The same of the failures that are drawn uniform on the path, which is what plots and notes show.
pub(super) fn on_paths<T, const METHODS: usize>(
    cells: &[&Cell],
    methods: [Method; METHODS],
    figure: impl Fn(&FailureRow, [&Row; METHODS]) -> T,
) -> Vec<Vec<T>> {
    by_network(cells, methods, |failure, rows| {
        (failure.placing == Placing::Path).then(|| figure(failure, rows))
    })
}
