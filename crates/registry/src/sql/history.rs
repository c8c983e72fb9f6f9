//! What is asked of the database about what edges told: how far their news were taken, failures, positions.

use super::{Connection, Database, Row, trouble};
use crate::documents::{FailureCount, FailureRow, NewsMark, PositionRow};
use crate::sql::{ROWS_AT_ONCE, Trouble, signed, unsigned};
use crate::store::StoreError;
use sqlx::{QueryBuilder, Row as _};
use tokio_stream::StreamExt;

/// How far the news of an edge were taken; 0 where none were.
pub(super) async fn news_through(
    connection: &mut Connection,
    network: &str,
    edge: &str,
    lineage: u64,
) -> Result<u64, Trouble> {
    let statement =
        "SELECT through FROM news_marks WHERE network = $1 AND edge = $2 AND lineage = $3";
    let asked = sqlx::query(statement)
        .bind(network)
        .bind(edge)
        .bind(lineage.cast_signed());
    let Some(row) = asked.fetch_optional(connection).await.map_err(trouble)? else {
        return Ok(0);
    };
    let through = row.try_get(0).map_err(trouble)?;
    Ok(unsigned(through, "a number of news")?)
}

/// Moves a mark on; false where it stands elsewhere than was seen.
pub(super) async fn move_mark(
    connection: &mut Connection,
    mark: &NewsMark,
) -> Result<bool, Trouble> {
    let (network, edge, lineage) = (&*mark.network, &*mark.edge, mark.lineage);
    if news_through(connection, network, edge, lineage).await? != mark.before {
        return Ok(false);
    }
    let statement = "INSERT INTO news_marks (network, edge, lineage, through) VALUES ($1, $2, $3, $4) \
                     ON CONFLICT (network, edge, lineage) DO UPDATE SET through = excluded.through";
    let done = sqlx::query(statement)
        .bind(network)
        .bind(edge)
        .bind(lineage.cast_signed())
        .bind(signed(mark.through));
    done.execute(connection).await.map_err(trouble)?;
    Ok(true)
}

/// Keeps failures; those that are there already are passed over.
pub(super) async fn insert_failures(
    connection: &mut Connection,
    failures: &[FailureRow],
) -> Result<(), Trouble> {
    for some in failures.chunks(ROWS_AT_ONCE) {
        let mut statement = QueryBuilder::<Database>::new(
            "INSERT INTO failures (network, edge, lineage, number, at_ms, failure_type, segment, outcome) ",
        );
        statement.push_values(some, |mut row, failure| {
            row.push_bind(failure.network.clone())
                .push_bind(failure.edge.clone())
                .push_bind(failure.lineage.cast_signed())
                .push_bind(signed(failure.number))
                .push_bind(failure.at_ms)
                .push_bind(failure.failure_type.clone())
                .push_bind(failure.segment.clone())
                .push_bind(failure.outcome.clone());
        });
        statement.push(" ON CONFLICT (network, edge, lineage, number) DO NOTHING");
        let done = statement.build().persistent(false);
        done.execute(&mut *connection).await.map_err(trouble)?;
    }
    Ok(())
}

/// Drops failures from before an instant.
pub(super) async fn drop_failures(
    connection: &mut Connection,
    before_ms: i64,
) -> Result<(), Trouble> {
    let statement = sqlx::query("DELETE FROM failures WHERE at_ms < $1").bind(before_ms);
    statement.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// Failures over a network in a span of time, counted; the most frequent first.
pub(super) async fn count_failures(
    connection: &mut Connection,
    network: &str,
    from_ms: i64,
    until_ms: i64,
    limit: u64,
) -> Result<Vec<FailureCount>, Trouble> {
    let statement = "SELECT segment, hour, failure_type, COUNT(*) AS failures FROM \
                     (SELECT segment, (at_ms / 3600000) % 24 AS hour, failure_type FROM failures \
                     WHERE network = $1 AND at_ms >= $2 AND at_ms < $3) counted \
                     GROUP BY segment, hour, failure_type \
                     ORDER BY failures DESC, segment, hour, failure_type LIMIT $4";
    let asked = sqlx::query(statement)
        .bind(network)
        .bind(from_ms)
        .bind(until_ms)
        .bind(signed(limit));
    let rows = asked.fetch_all(connection).await.map_err(trouble)?;
    let mut counts = Vec::with_capacity(rows.len());
    for row in rows {
        let hour: i64 = row.try_get(1).map_err(trouble)?;
        let hour = u8::try_from(hour).map_err(|_| StoreError::Damaged {
            message: format!("the hour of a failure is {hour}"),
        })?;
        counts.push(FailureCount {
            segment: row.try_get(0).map_err(trouble)?,
            hour,
            failure_type: row.try_get(2).map_err(trouble)?,
            count: unsigned(row.try_get(3).map_err(trouble)?, "a number of failures")?,
        });
    }
    Ok(counts)
}

/// Positions of a drone in a span of time, oldest first.
pub(super) async fn positions(
    connection: &mut Connection,
    drone: &str,
    from_ms: i64,
    until_ms: i64,
    limit: u64,
) -> Result<Vec<PositionRow>, Trouble> {
    let statement = "SELECT at_ms, lon, lat, altitude_m, battery_fraction, speed_mps FROM positions \
                     WHERE drone = $1 AND at_ms >= $2 AND at_ms < $3 ORDER BY at_ms LIMIT $4";
    let asked = sqlx::query(statement)
        .bind(drone)
        .bind(from_ms)
        .bind(until_ms)
        .bind(signed(limit));
    // One by one: a day has 86,400, and as rows of the database they take several times the room.
    let mut rows = asked.fetch(connection);
    let mut found = Vec::new();
    while let Some(row) = rows.try_next().await.map_err(trouble)? {
        found.push(position_of(&row, drone)?);
    }
    Ok(found)
}

/// The last position of each of some drones, not before an instant.
pub(super) async fn last_positions(
    connection: &mut Connection,
    drones: &[String],
    from_ms: i64,
) -> Result<Vec<PositionRow>, Trouble> {
    let statement = "SELECT at_ms, lon, lat, altitude_m, battery_fraction, speed_mps FROM positions \
                     WHERE drone = $1 AND at_ms >= $2 ORDER BY at_ms DESC LIMIT 1";
    let mut found = Vec::new();
    for drone in drones {
        let asked = sqlx::query(statement).bind(drone).bind(from_ms);
        let row = asked.fetch_optional(&mut *connection).await;
        if let Some(row) = row.map_err(trouble)? {
            found.push(position_of(&row, drone)?);
        }
    }
    Ok(found)
}

fn position_of(row: &Row, drone: &str) -> Result<PositionRow, Trouble> {
    Ok(PositionRow {
        drone: drone.to_owned(),
        at_ms: row.try_get(0).map_err(trouble)?,
        lon: row.try_get(1).map_err(trouble)?,
        lat: row.try_get(2).map_err(trouble)?,
        altitude_m: row.try_get(3).map_err(trouble)?,
        battery_fraction: row.try_get(4).map_err(trouble)?,
        speed_mps: row.try_get(5).map_err(trouble)?,
    })
}
