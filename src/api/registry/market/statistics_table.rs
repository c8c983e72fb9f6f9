//! Statistics as Apache Parquet, for pandas, DuckDB and others: a file holds one table.

use crate::wire::{FailureRate, FailureType, Lateness, NetworkStatistics};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde::Deserialize;
use std::sync::Arc;
use utoipa::ToSchema;

/// The media type of Parquet.
pub(super) const PARQUET: &str = "application/vnd.apache.parquet";

/// A table of the statistics.
#[derive(Clone, Copy, Debug, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum StatisticsTable {
    /// Failures by segment, hour and type.
    #[default]
    Failures,
    /// Lateness by service.
    Lateness,
}

/// The values of a column.
enum Values {
    Text(Vec<Option<String>>),
    Count(Vec<i64>),
    Number(Vec<f64>),
}

type Column = (&'static str, Values);

/// One table of the statistics; its network and its span of time are in the metadata of the file.
pub(super) fn as_parquet(
    statistics: &NetworkStatistics,
    table: StatisticsTable,
) -> Result<Vec<u8>, ParquetError> {
    let columns = match table {
        StatisticsTable::Failures => failures(&statistics.failures),
        StatisticsTable::Lateness => lateness(&statistics.lateness),
    };
    let about = [
        ("network", &statistics.network),
        ("from", &statistics.from),
        ("until", &statistics.until),
    ];
    let about = about.map(|(key, value)| KeyValue::new(key.to_owned(), value.clone()));
    write(&columns, about.to_vec())
}

fn failures(rates: &[FailureRate]) -> Vec<Column> {
    let numbers = |of: fn(&FailureRate) -> f64| Values::Number(rates.iter().map(of).collect());
    let counts = |of: fn(&FailureRate) -> u64| counts(rates.iter().map(of));
    let segments = rates.iter().map(|rate| rate.segment.clone());
    let types = rates.iter().map(|rate| type_name(rate.failure_type));
    vec![
        ("segment", Values::Text(segments.collect())),
        ("hour", counts(|rate| u64::from(rate.hour))),
        ("failure_type", Values::Text(types.collect())),
        ("failures", counts(|rate| rate.failures)),
        ("per_day", numbers(|rate| rate.per_day)),
        ("low_per_day", numbers(|rate| rate.low_per_day)),
        ("high_per_day", numbers(|rate| rate.high_per_day)),
    ]
}

fn lateness(services: &[Lateness]) -> Vec<Column> {
    let numbers = |of: fn(&Lateness) -> f64| Values::Number(services.iter().map(of).collect());
    let counts = |of: fn(&Lateness) -> u64| counts(services.iter().map(of));
    let ids = services
        .iter()
        .map(|service| Some(service.service_id.clone()));
    vec![
        ("service_id", Values::Text(ids.collect())),
        ("on_time", counts(|service| service.on_time.count)),
        ("deliveries", counts(|service| service.on_time.of)),
        (
            "on_time_fraction",
            numbers(|service| service.on_time.fraction),
        ),
        (
            "low_fraction",
            numbers(|service| service.on_time.low_fraction),
        ),
        (
            "high_fraction",
            numbers(|service| service.on_time.high_fraction),
        ),
        ("median_s", numbers(|service| service.median_s)),
        ("p95_s", numbers(|service| service.p95_s)),
    ]
}

fn counts(values: impl Iterator<Item = u64>) -> Values {
    Values::Count(
        values
            .map(|count| i64::try_from(count).unwrap_or(i64::MAX))
            .collect(),
    )
}

/// The name on the wire.
fn type_name(failure_type: FailureType) -> Option<String> {
    let name = serde_json::to_value(failure_type).ok()?;
    name.as_str().map(str::to_owned)
}

fn write(columns: &[Column], about: Vec<KeyValue>) -> Result<Vec<u8>, ParquetError> {
    let fields: Result<Vec<_>, ParquetError> = columns.iter().map(field).collect();
    let schema = Type::group_type_builder("statistics")
        .with_fields(fields?)
        .build()?;
    let properties = WriterProperties::builder()
        .set_key_value_metadata(Some(about))
        .build();
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut rows = file.next_row_group()?;
    for (_, values) in columns {
        let Some(mut column) = rows.next_column()? else {
            break;
        };
        match values {
            Values::Text(texts) => {
                let present: Vec<ByteArray> = texts
                    .iter()
                    .flatten()
                    .map(|text| ByteArray::from(text.as_str()))
                    .collect();
                let levels: Vec<i16> = texts.iter().map(|text| i16::from(text.is_some())).collect();
                let column = column.typed::<ByteArrayType>();
                column.write_batch(&present, Some(&levels), None)?;
            }
            Values::Count(counts) => {
                column
                    .typed::<Int64Type>()
                    .write_batch(counts, None, None)?;
            }
            Values::Number(numbers) => {
                column
                    .typed::<DoubleType>()
                    .write_batch(numbers, None, None)?;
            }
        }
        column.close()?;
    }
    rows.close()?;
    file.into_inner()
}

fn field((name, values): &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, repetition, logical) = match values {
        Values::Text(_) => (
            Physical::BYTE_ARRAY,
            Repetition::OPTIONAL,
            Some(LogicalType::String),
        ),
        Values::Count(_) => (Physical::INT64, Repetition::REQUIRED, None),
        Values::Number(_) => (Physical::DOUBLE, Repetition::REQUIRED, None),
    };
    let field = Type::primitive_type_builder(name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical);
    Ok(Arc::new(field.build()?))
}
