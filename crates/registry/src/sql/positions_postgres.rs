//! Positions in PostgreSQL: a table for each day, so that a day is dropped at once.
//!
//! They are many, and each is small: a transaction of them does not wait for the disk, and what was acknowledged in the
//! last second may be lost with the machine's power. Nothing is read for them, so they need no serializable
//! transactions either, and go beside all other writes.

use super::{Connection, SqlStore, trouble};
use crate::documents::PositionRow;
use crate::sql::Trouble;
use crate::sql::transactions::{ATTEMPTS, PATIENCE, pause, settled, too_long};
use crate::store::StoreError;
use sqlx::{AssertSqlSafe, Row as _};
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// The table of positions, made where it is missing; days are added as they come.
pub(super) const TABLE: &[&str] = &["CREATE TABLE IF NOT EXISTS positions (
        drone TEXT NOT NULL,
        at_ms BIGINT NOT NULL,
        lon DOUBLE PRECISION NOT NULL,
        lat DOUBLE PRECISION NOT NULL,
        altitude_m DOUBLE PRECISION,
        battery_fraction DOUBLE PRECISION,
        speed_mps DOUBLE PRECISION,
        PRIMARY KEY (drone, at_ms)
    ) PARTITION BY RANGE (at_ms)"];

const DAY_MS: i64 = 24 * 60 * 60 * 1000;
/// What the name of the table of a day begins with; the day follows, counted from 1970.
const PREFIX: &str = "positions_of_day_";

/// Days whose tables are there.
#[derive(Debug, Default)]
pub(super) struct KnownDays(Mutex<BTreeSet<i64>>);

impl KnownDays {
    fn has(&self, day: i64) -> bool {
        let days = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        days.contains(&day)
    }

    fn add(&self, days: &BTreeSet<i64>) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.extend(days);
    }

    fn forget(&self) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.clear();
    }
}

/// Keeps positions; tells how many were not there.
pub(super) async fn keep(store: &SqlStore, positions: &[PositionRow]) -> Result<u64, StoreError> {
    let days = positions
        .iter()
        .map(|position| position.at_ms.div_euclid(DAY_MS));
    let days: BTreeSet<i64> = days.collect();
    for attempt in 0..ATTEMPTS {
        let write = tokio::time::timeout(PATIENCE, try_to_keep(store, &days, positions));
        match write.await {
            Ok(Ok(stored)) => return Ok(stored),
            Ok(Err(Trouble::Contended)) => tokio::time::sleep(pause(attempt)).await,
            Ok(Err(trouble)) => {
                // Another process may have dropped the table of a day.
                store.days.forget();
                return Err(settled(trouble));
            }
            Err(_) => return Err(too_long("a write of positions")),
        }
    }
    Err(StoreError::Contended)
}

async fn try_to_keep(
    store: &SqlStore,
    days: &BTreeSet<i64>,
    positions: &[PositionRow],
) -> Result<u64, Trouble> {
    let missing = days.iter().filter(|day| !store.days.has(**day));
    for day in missing {
        make_day(store, *day).await?;
    }
    store.days.add(days);
    let mut transaction = store.begin("BEGIN").await?;
    let quick = sqlx::query("SET LOCAL synchronous_commit = off").execute(&mut *transaction);
    quick.await.map_err(trouble)?;
    let stored = insert(&mut transaction, positions).await?;
    transaction.commit().await.map_err(trouble)?;
    Ok(stored)
}

/// Makes the table of a day. It has nothing but numbers in its text.
async fn make_day(store: &SqlStore, day: i64) -> Result<(), Trouble> {
    let from_ms = day.saturating_mul(DAY_MS);
    let until_ms = from_ms.saturating_add(DAY_MS);
    let statement = format!(
        "CREATE TABLE IF NOT EXISTS {} PARTITION OF positions FOR VALUES FROM ({from_ms}) TO ({until_ms})",
        table_of(day)
    );
    let done = sqlx::query(AssertSqlSafe(statement)).execute(&store.pool);
    done.await.map_err(trouble)?;
    Ok(())
}

/// The name of the table of a day; a minus sign cannot stand in a name.
fn table_of(day: i64) -> String {
    match day < 0 {
        true => format!("{PREFIX}before_{}", day.unsigned_abs()),
        false => format!("{PREFIX}{day}"),
    }
}

async fn insert(connection: &mut Connection, positions: &[PositionRow]) -> Result<u64, Trouble> {
    let statement = "INSERT INTO positions (drone, at_ms, lon, lat, altitude_m, battery_fraction, speed_mps) \
                     SELECT * FROM UNNEST($1::TEXT[], $2::BIGINT[], $3::DOUBLE PRECISION[], $4::DOUBLE PRECISION[], \
                     $5::DOUBLE PRECISION[], $6::DOUBLE PRECISION[], $7::DOUBLE PRECISION[]) \
                     ON CONFLICT (drone, at_ms) DO NOTHING";
    let all = positions.iter();
    let drones: Vec<&str> = all.clone().map(|position| &*position.drone).collect();
    let times: Vec<i64> = all.clone().map(|position| position.at_ms).collect();
    let number = |of: fn(&PositionRow) -> f64| -> Vec<f64> { all.clone().map(of).collect() };
    let optional =
        |of: fn(&PositionRow) -> Option<f64>| -> Vec<Option<f64>> { all.clone().map(of).collect() };
    let done = sqlx::query(statement)
        .bind(drones)
        .bind(times)
        .bind(number(|position| position.lon))
        .bind(number(|position| position.lat))
        .bind(optional(|position| position.altitude_m))
        .bind(optional(|position| position.battery_fraction))
        .bind(optional(|position| position.speed_mps));
    let done = done.execute(connection).await.map_err(trouble)?;
    Ok(done.rows_affected())
}

/// Drops the days that were over before an instant.
pub(super) async fn drop_before(store: &SqlStore, before_ms: i64) -> Result<(), StoreError> {
    let dropped = tokio::time::timeout(PATIENCE, drop_days(store, before_ms.div_euclid(DAY_MS)));
    let Ok(dropped) = dropped.await else {
        return Err(too_long("the end of a day of positions"));
    };
    dropped.map_err(settled)
}

async fn drop_days(store: &SqlStore, first_kept: i64) -> Result<(), Trouble> {
    let statement = "SELECT c.relname FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid \
                     WHERE i.inhparent = 'positions'::regclass";
    let found = sqlx::query(statement).fetch_all(&store.pool);
    for row in found.await.map_err(trouble)? {
        let name: String = row.try_get(0).map_err(trouble)?;
        let day = name.strip_prefix(PREFIX);
        let day = day.and_then(|day| day.parse::<i64>().ok());
        let Some(day) = day.filter(|day| *day < first_kept) else {
            continue;
        };
        store.days.forget();
        let statement = format!("DROP TABLE IF EXISTS {}", table_of(day));
        let done = sqlx::query(AssertSqlSafe(statement)).execute(&store.pool);
        done.await.map_err(trouble)?;
    }
    Ok(())
}
