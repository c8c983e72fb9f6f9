//! Raw rows as CSV: written once a cell is measured, read again when a run is resumed.

use super::cells::{Cell, Cells, FailureRow, on_paths};
use super::method::Method;
use super::record::{Figure, Scale};
use super::statistics::{Resampler, mean, quantile};
use csv::{ReaderBuilder, WriterBuilder};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What one method answered to one failure, and how long that took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The failure's number in its cell.
    pub failure: usize,
    /// The method.
    pub method: Method,
    /// The median time over all repetitions, in microseconds.
    pub time_us: f64,
    /// The lower quartile.
    pub lower_us: f64,
    /// The upper quartile.
    pub upper_us: f64,
    /// How often it was timed.
    pub repetitions: usize,
    /// Length of the new part, in metres: from A to B over the leg, the whole rest over the route.
    pub recomposed_m: f64,
    /// Length of the whole remaining route from A to the destination, in metres.
    pub remaining_m: f64,
    /// Nodes of the last area.
    pub area_nodes: usize,
    /// Open segments of the last area.
    pub area_segments: usize,
    /// Areas examined.
    pub searches: u32,
    /// Nodes settled by all searches.
    pub settled_nodes: usize,
    /// Where the last search looked.
    pub stage: String,
    /// The stages that were skipped, with `+` between them.
    pub skipped: String,
    /// Nodes of all areas examined, added up, where stages were recorded; without areas the nodes settled.
    pub searched_nodes: Option<usize>,
    /// Segments of all areas examined, added up, where stages were recorded; without areas those at the nodes
    /// settled.
    pub searched_segments: Option<usize>,
}

/// Why raw rows cannot be read or written.
#[derive(Debug, Error)]
pub enum RowsError {
    /// The text is not such a table.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// The writer could not finish.
    #[error("{0}")]
    Write(String),
}

impl Serialize for Method {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.id())
    }
}

impl<'de> Deserialize<'de> for Method {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let id = String::deserialize(deserializer)?;
        Self::from_id(&id)
            .ok_or_else(|| serde::de::Error::custom(format!("there is no method {id}")))
    }
}

/// Writes the rows of a cell.
///
/// # Errors
/// [`RowsError`] where a row cannot be written.
pub fn write_rows(rows: &[Row]) -> Result<String, RowsError> {
    write(rows)
}

/// Writes the failures of a cell.
///
/// # Errors
/// [`RowsError`] where a row cannot be written.
pub fn write_failures(failures: &[FailureRow]) -> Result<String, RowsError> {
    write(failures)
}

/// Reads the rows of a cell.
///
/// # Errors
/// [`RowsError`] where the text is not what was written.
pub fn read_rows(text: &str) -> Result<Vec<Row>, RowsError> {
    read(text)
}

/// Reads the failures of a cell.
///
/// # Errors
/// [`RowsError`] where the text is not what was written.
pub fn read_failures(text: &str) -> Result<Vec<FailureRow>, RowsError> {
    read(text)
}

/// One method on the networks of one generator and size; names of times end in `_us`.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    networks: &'a str,
    method: Method,
    failures: usize,
    median_us: f64,
    median_low_us: f64,
    median_high_us: f64,
    quartile_1_us: f64,
    quartile_3_us: f64,
    p99_us: f64,
    mean_us: f64,
    mean_overhead_percent: f64,
    p99_overhead_percent: f64,
    mean_area_nodes: f64,
    mean_area_segments: f64,
    mean_settled_nodes: f64,
    mean_searches: f64,
}

/// Writes the summary of a run: by generator, size and method the median time with its 95 % interval and its
/// spread, and the means of what the method looked at. Failures are those drawn uniform on the path.
///
/// # Errors
/// [`RowsError`] where a row cannot be written.
pub fn write_summary(cells: &Cells, seed: u64) -> Result<String, RowsError> {
    let mut rows = Vec::new();
    let sizes = cells.by_size();
    for (networks, group) in &sizes {
        for method in Method::all() {
            rows.extend(summary(networks, group, method, seed));
        }
    }
    write(&rows)
}

fn summary<'a>(
    networks: &'a str,
    group: &[&Cell],
    method: Method,
    seed: u64,
) -> Option<Summary<'a>> {
    let times_us = on_paths(group, [method], |_, [row]| row.time_us);
    let mut resampler = Resampler::new(seed, &format!("summary {networks} {}", method.id()));
    let median = resampler.of_median(&times_us)?;
    let mut times_us = times_us.concat();
    let all = |figure: &dyn Fn(&FailureRow, &Row) -> f64| {
        on_paths(group, [method], |failure, [row]| figure(failure, row)).concat()
    };
    let mut overheads = all(&|failure, row| (row.remaining_m / failure.optimum_m - 1.0) * 1e2);
    let mut at = |share| rounded(quantile(&mut times_us, share), 3);
    Some(Summary {
        networks,
        method,
        failures: median.cases,
        median_us: rounded(median.value, 3),
        median_low_us: rounded(median.low, 3),
        median_high_us: rounded(median.high, 3),
        quartile_1_us: at(0.25),
        quartile_3_us: at(0.75),
        p99_us: at(0.99),
        mean_us: rounded(mean(&all(&|_, row| row.time_us)), 3),
        mean_overhead_percent: rounded(mean(&overheads), 4),
        p99_overhead_percent: rounded(quantile(&mut overheads, 0.99), 4),
        mean_area_nodes: rounded(mean(&all(&|_, row| row.area_nodes as f64)), 2),
        mean_area_segments: rounded(mean(&all(&|_, row| row.area_segments as f64)), 2),
        mean_settled_nodes: rounded(mean(&all(&|_, row| row.settled_nodes as f64)), 2),
        mean_searches: rounded(mean(&all(&|_, row| f64::from(row.searches))), 3),
    })
}

/// One point of a plot.
#[derive(Debug, Serialize)]
struct PlotRow<'a> {
    series: &'a str,
    x: f64,
    place: &'a str,
    y: f64,
    low: f64,
    high: f64,
    quartile_1: f64,
    quartile_3: f64,
    cases: usize,
}

/// Writes the points of a plot; `place` names them on an axis of names.
///
/// # Errors
/// [`RowsError`] where a row cannot be written.
pub fn write_figure(figure: &Figure) -> Result<String, RowsError> {
    let places: &[String] = match &figure.x.scale {
        Scale::Categories(names) => names,
        Scale::Linear | Scale::Log => &[],
    };
    let mut rows = Vec::new();
    for series in &figure.series {
        rows.extend(series.points.iter().map(|point| PlotRow {
            series: &series.name,
            x: point.x,
            place: places.get(point.x as usize).map_or("", String::as_str),
            y: point.y,
            low: point.low,
            high: point.high,
            quartile_1: point.spread[0],
            quartile_3: point.spread[1],
            cases: point.cases,
        }));
    }
    write(&rows)
}

/// A figure with no more than a number of decimals: files need not tell noise.
pub(super) fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}

/// Writes rows of any table.
fn write<T: Serialize>(rows: &[T]) -> Result<String, RowsError> {
    let mut writer = WriterBuilder::new().from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| RowsError::Write(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| RowsError::Write(error.to_string()))
}

fn read<T: DeserializeOwned>(text: &str) -> Result<Vec<T>, RowsError> {
    let mut reader = ReaderBuilder::new().from_reader(text.as_bytes());
    let rows: Result<Vec<T>, csv::Error> = reader.deserialize().collect();
    Ok(rows?)
}
