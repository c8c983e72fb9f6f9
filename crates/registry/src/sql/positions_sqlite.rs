//! Positions in SQLite: one table, in the order in which they are read.

use super::{Connection, Database, SqlStore, trouble};
use crate::documents::PositionRow;
use crate::sql::transactions::writing;
use crate::sql::{ROWS_AT_ONCE, Trouble};
use crate::store::StoreError;
use sqlx::QueryBuilder;

/// The tables of positions, made where they are missing.
pub(super) const TABLE: &[&str] = &[
    "CREATE TABLE IF NOT EXISTS positions (
        drone TEXT NOT NULL,
        at_ms INTEGER NOT NULL,
        lon REAL NOT NULL,
        lat REAL NOT NULL,
        altitude_m REAL,
        battery_fraction REAL,
        speed_mps REAL,
        PRIMARY KEY (drone, at_ms)
    ) WITHOUT ROWID",
    "CREATE INDEX IF NOT EXISTS positions_by_time ON positions (at_ms)",
];

/// How many positions are dropped in one transaction, so that none keeps the others waiting.
const DROPPED_AT_ONCE: i64 = 20_000;

/// Keeps positions; tells how many were not there.
pub(super) async fn keep(store: &SqlStore, positions: &[PositionRow]) -> Result<u64, StoreError> {
    writing!(store, |connection| insert(connection, positions))
}

async fn insert(connection: &mut Connection, positions: &[PositionRow]) -> Result<u64, Trouble> {
    let mut stored = 0;
    for some in positions.chunks(ROWS_AT_ONCE) {
        let mut statement = QueryBuilder::<Database>::new(
            "INSERT INTO positions (drone, at_ms, lon, lat, altitude_m, battery_fraction, speed_mps) ",
        );
        statement.push_values(some, |mut row, position| {
            row.push_bind(position.drone.clone())
                .push_bind(position.at_ms)
                .push_bind(position.lon)
                .push_bind(position.lat)
                .push_bind(position.altitude_m)
                .push_bind(position.battery_fraction)
                .push_bind(position.speed_mps);
        });
        statement.push(" ON CONFLICT (drone, at_ms) DO NOTHING");
        let is_whole = some.len() == ROWS_AT_ONCE;
        let done = statement.build().persistent(is_whole);
        let done = done.execute(&mut *connection).await.map_err(trouble)?;
        stored += done.rows_affected();
    }
    Ok(stored)
}

/// Drops positions from before an instant.
pub(super) async fn drop_before(store: &SqlStore, before_ms: i64) -> Result<(), StoreError> {
    loop {
        let dropped: u64 = writing!(store, |connection| drop_some(connection, before_ms))?;
        if dropped < DROPPED_AT_ONCE.unsigned_abs() {
            return Ok(());
        }
    }
}

async fn drop_some(connection: &mut Connection, before_ms: i64) -> Result<u64, Trouble> {
    let statement = "DELETE FROM positions WHERE (drone, at_ms) IN \
                     (SELECT drone, at_ms FROM positions WHERE at_ms < $1 LIMIT $2)";
    let done = sqlx::query(statement).bind(before_ms).bind(DROPPED_AT_ONCE);
    let done = done.execute(connection).await.map_err(trouble)?;
    Ok(done.rows_affected())
}
