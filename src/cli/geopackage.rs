//! The database around the layers of a GeoPackage: made and read in memory, as files are opened elsewhere.

use super::edge::runtime;
use super::stop::Stop;
use crate::formats::{
    Cell, GeopackageLayer, GeopackageNetwork, GeopackageStatement, LoadedNetwork, NETWORK_TABLE,
    NODES_LAYER, SEGMENTS_LAYER, load_geopackage,
};
use crate::network::Coordinates;
use sqlx::sqlite::{SqliteConnectOptions, SqliteOwnedBuf, SqliteRow};
use sqlx::{AssertSqlSafe, ColumnIndex, Connection, Row, SqliteConnection, TypeInfo, ValueRef};
use std::path::Path;
use std::sync::Arc;

/// Where a file of SQLite says how its journal is kept, and what it says for a rollback journal and for a log.
const JOURNAL: std::ops::Range<usize> = 18..20;
const ROLLBACK: [u8; 2] = [1, 1];
const LOG: [u8; 2] = [2, 2];
/// The reference system of planar networks (OGC 12-128, 1.1.2).
const CARTESIAN: i64 = -1;

/// The bytes of the database that the statements make.
pub(super) fn database_of(statements: &[GeopackageStatement]) -> Result<Vec<u8>, Stop> {
    runtime()?
        .block_on(made(statements))
        .map_err(|error| Stop::failed(format!("cannot make the GeoPackage: {error}")))
}

async fn made(statements: &[GeopackageStatement]) -> Result<Vec<u8>, sqlx::Error> {
    let mut connection = in_memory().await?;
    let mut transaction = connection.begin().await?;
    for statement in statements {
        let sql: Arc<str> = Arc::from(statement.sql.as_str());
        for row in &statement.rows {
            let mut query = sqlx::query(AssertSqlSafe(Arc::clone(&sql)));
            for cell in row {
                query = match cell {
                    Cell::Null => query.bind(None::<i64>),
                    Cell::Whole(number) => query.bind(*number),
                    Cell::Real(number) => query.bind(*number),
                    Cell::Text(words) => query.bind(words.as_str()),
                    Cell::Blob(bytes) => query.bind(bytes.as_slice()),
                };
            }
            query.execute(&mut *transaction).await?;
        }
    }
    transaction.commit().await?;
    let bytes = connection.serialize(None).await?;
    Ok(bytes.to_vec())
}

async fn in_memory() -> Result<SqliteConnection, sqlx::Error> {
    // What a file says in its schema is not run with more rights than it has.
    let options = SqliteConnectOptions::new()
        .in_memory(true)
        .pragma("trusted_schema", "OFF");
    SqliteConnection::connect_with(&options).await
}

/// Why a database gives no network.
enum Fault {
    /// What the database says of itself.
    Database(sqlx::Error),
    /// What it lacks, with the remedy.
    Lacks(String),
}

impl From<sqlx::Error> for Fault {
    fn from(error: sqlx::Error) -> Self {
        Self::Database(error)
    }
}

/// Loads the network in a GeoPackage.
pub(super) fn load(path: &Path, bytes: &[u8]) -> Result<LoadedNetwork, Stop> {
    let path = path.display();
    let read = runtime()?.block_on(read(bytes));
    let network = read.map_err(|fault| match fault {
        Fault::Database(error) => Stop::failed(format!("{path} cannot be read: {error}")),
        Fault::Lacks(told) => Stop::failed(format!("{path} is a GeoPackage and {told}")),
    })?;
    load_geopackage(&network, bytes)
        .map_err(|error| Stop::all_of(&path.to_string(), &error.lines()))
}

async fn read(bytes: &[u8]) -> Result<GeopackageNetwork, Fault> {
    let mut bytes = bytes.to_vec();
    // A log lies in a file of its own, which the last program to close this one has written back and removed.
    if let Some(journal) = bytes.get_mut(JOURNAL).filter(|journal| **journal == LOG) {
        journal.copy_from_slice(&ROLLBACK);
    }
    let buffer = SqliteOwnedBuf::try_from(bytes.as_slice())?;
    let mut connection = in_memory().await?;
    connection.deserialize(None, buffer, true).await?;
    let layers = sqlx::query(
        "SELECT g.table_name, g.column_name, g.srs_id, s.organization, s.organization_coordsys_id \
         FROM gpkg_geometry_columns g JOIN sqlite_schema t ON t.type = 'table' AND t.name = g.table_name \
         LEFT JOIN gpkg_spatial_ref_sys s ON s.srs_id = g.srs_id ORDER BY g.table_name",
    );
    let layers = layers.fetch_all(&mut connection).await?;
    let coordinates = coordinates_of(layer_called(&layers, NODES_LAYER)?)?;
    if coordinates_of(layer_called(&layers, SEGMENTS_LAYER)?)? != coordinates {
        let told = "its two layers have different reference systems; give both the same";
        return Err(Fault::Lacks(told.to_owned()));
    }
    let nodes = sqlx::query("SELECT * FROM nodes")
        .fetch_all(&mut connection)
        .await?;
    let segments = sqlx::query("SELECT * FROM segments")
        .fetch_all(&mut connection)
        .await?;
    let [name, attribution] = facts(&mut connection).await?;
    Ok(GeopackageNetwork {
        name,
        attribution,
        coordinates,
        nodes: layer(layer_called(&layers, NODES_LAYER)?, &nodes)?,
        segments: layer(layer_called(&layers, SEGMENTS_LAYER)?, &segments)?,
    })
}

/// The row that declares a layer.
fn layer_called<'r>(layers: &'r [SqliteRow], name: &str) -> Result<&'r SqliteRow, Fault> {
    let names: Result<Vec<String>, _> = layers.iter().map(|layer| layer.try_get(0)).collect();
    let names = names?;
    let place = names.iter().position(|found| found == name);
    place.map(|place| &layers[place]).ok_or_else(|| {
        let has = match names.is_empty() {
            true => "no layers".to_owned(),
            false => format!("the layers {}", names.join(", ")),
        };
        Fault::Lacks(format!(
            "has {has}; a network has the layers {NODES_LAYER} (points) and {SEGMENTS_LAYER} (lines): rename them so"
        ))
    })
}

fn coordinates_of(layer: &SqliteRow) -> Result<Coordinates, Fault> {
    let srs_id: i64 = layer.try_get(2)?;
    let organization: Option<String> = layer.try_get(3)?;
    let number: Option<i64> = layer.try_get(4)?;
    let is_epsg = organization.is_some_and(|name| name.eq_ignore_ascii_case("EPSG"));
    match (srs_id, number) {
        (CARTESIAN, _) => Ok(Coordinates::Planar),
        (_, Some(4326)) if is_epsg => Ok(Coordinates::Geographic),
        _ => Err(Fault::Lacks(format!(
            "has layers in the reference system {srs_id}; write them in EPSG:4326, as ogr2ogr -t_srs EPSG:4326 does, or \
             as undefined cartesian (-1) in metres"
        ))),
    }
}

/// The name and the attribution, where the network says them.
async fn facts(connection: &mut SqliteConnection) -> Result<[Option<String>; 2], sqlx::Error> {
    let columns = "SELECT count(*) FROM pragma_table_info(?) WHERE name IN ('name', 'attribution')";
    let columns = sqlx::query_scalar(columns).bind(NETWORK_TABLE);
    let columns: i64 = columns.fetch_one(&mut *connection).await?;
    if columns < 2 {
        return Ok([None, None]);
    }
    let row = sqlx::query("SELECT name, attribution FROM network LIMIT 1");
    let row = row.fetch_optional(connection).await?;
    row.map_or(Ok([None, None]), |row| {
        Ok([row.try_get(0)?, row.try_get(1)?])
    })
}

fn layer(declared: &SqliteRow, rows: &[SqliteRow]) -> Result<GeopackageLayer, Fault> {
    let geometry: String = declared.try_get(1)?;
    let Some(first) = rows.first() else {
        return Ok(GeopackageLayer::default());
    };
    let columns = first
        .columns()
        .iter()
        .map(|column| sqlx::Column::name(column).to_owned());
    let cells = rows
        .iter()
        .map(|row| (0..row.len()).map(|place| cell(row, place)).collect());
    Ok(GeopackageLayer {
        columns: columns.collect(),
        geometry: geometry.as_str().index(first)?,
        rows: cells.collect::<Result<_, sqlx::Error>>()?,
    })
}

/// A value by what it is, whatever its column was declared to be.
fn cell(row: &SqliteRow, place: usize) -> Result<Cell, sqlx::Error> {
    let value = row.try_get_raw(place)?;
    if value.is_null() {
        return Ok(Cell::Null);
    }
    let kind = value.type_info();
    Ok(match kind.name() {
        "INTEGER" => Cell::Whole(row.try_get_unchecked(place)?),
        "REAL" => Cell::Real(row.try_get_unchecked(place)?),
        "BLOB" => Cell::Blob(row.try_get_unchecked(place)?),
        _ => Cell::Text(row.try_get_unchecked(place)?),
    })
}
