//! What is asked of the database, one function for each question, on a connection within a transaction.

use super::{Connection, Row, trouble};
use crate::sql::{Trouble, signed, unsigned};
use crate::store::{
    Append, ChangesQuery, Expectation, Identity, NetworkState, NewChange, ObjectsQuery, StoreError,
    Version,
};
use skyway_contract::{ChangeOperation, LoggedChange, ObjectKind};
use skyway_planted::{self as planted, Bug};
use sqlx::Row as _;
use std::time::Duration;
use tokio_stream::StreamExt;

const REGISTRY_ID: &str = "registry_id";
/// How long the planted bug of half batches waits before the second half.
const BETWEEN_HALVES: Duration = Duration::from_millis(5);
const EPOCH: &str = "epoch";

/// The columns of a change, in the order that `change_of` reads them.
macro_rules! change_columns {
    () => {
        "c.revision, c.epoch, c.made_at, c.subject, c.kind, c.id, c.operation, c.body, c.sha256"
    };
}

/// That no later change up to $2 takes the place of this one.
macro_rules! still_holds {
    () => {
        "c.network = $1 AND c.revision <= $2 AND c.kind <> 'network' AND c.operation = 'put' \
         AND ($3 = '' OR c.kind = $3) AND NOT EXISTS (SELECT 1 FROM changes n WHERE n.network = c.network \
         AND n.kind = c.kind AND n.id = c.id AND n.revision > c.revision AND n.revision <= $2)"
    };
}

fn damaged(message: impl Into<String>) -> Trouble {
    Trouble::Lasting(StoreError::Damaged {
        message: message.into(),
    })
}

async fn fact(connection: &mut Connection, name: &str) -> Result<Option<String>, Trouble> {
    let found = sqlx::query("SELECT value FROM facts WHERE name = $1")
        .bind(name)
        .fetch_optional(connection)
        .await;
    match found.map_err(trouble)? {
        Some(row) => row.try_get(0).map(Some).map_err(trouble),
        None => Ok(None),
    }
}

pub(super) async fn set_fact(
    connection: &mut Connection,
    name: &str,
    value: &str,
) -> Result<(), Trouble> {
    let statement = "INSERT INTO facts (name, value) VALUES ($1, $2) \
                     ON CONFLICT (name) DO UPDATE SET value = excluded.value";
    let done = sqlx::query(statement).bind(name).bind(value);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// The number of the schema; 0 for a database in which nothing is yet.
pub(super) async fn schema(connection: &mut Connection) -> Result<u64, Trouble> {
    match fact(connection, "schema").await? {
        None => Ok(0),
        Some(text) => text
            .parse()
            .map_err(|_| damaged(format!("the schema is '{text}'"))),
    }
}

/// Which registry this is; with this id where it has none yet.
pub(super) async fn ensure_identity(
    connection: &mut Connection,
    fresh_id: &str,
) -> Result<(), Trouble> {
    if fact(connection, REGISTRY_ID).await?.is_none() {
        set_fact(connection, REGISTRY_ID, fresh_id).await?;
        set_fact(connection, EPOCH, "1").await?;
    }
    Ok(())
}

pub(super) async fn identity(connection: &mut Connection) -> Result<Identity, Trouble> {
    let registry_id = fact(connection, REGISTRY_ID).await?;
    let registry_id = registry_id.ok_or_else(|| damaged("the store has no id"))?;
    let epoch = fact(connection, EPOCH).await?.unwrap_or_default();
    let epoch = epoch
        .parse()
        .map_err(|_| damaged(format!("the epoch is '{epoch}'")))?;
    Ok(Identity { registry_id, epoch })
}

pub(super) async fn begin_epoch(
    connection: &mut Connection,
    after: u64,
) -> Result<Identity, Trouble> {
    let before = identity(connection).await?;
    let epoch = before.epoch.max(after) + 1;
    set_fact(connection, EPOCH, &epoch.to_string()).await?;
    let done = sqlx::query("UPDATE networks SET oldest = head").execute(connection);
    done.await.map_err(trouble)?;
    Ok(Identity { epoch, ..before })
}

fn state_of(row: &Row) -> Result<NetworkState, Trouble> {
    let number = |column: usize, what: &str| -> Result<u64, Trouble> {
        let number: i64 = row.try_get(column).map_err(trouble)?;
        Ok(unsigned(number, what)?)
    };
    Ok(NetworkState {
        id: row.try_get(0).map_err(trouble)?,
        head: number(1, "a head")?,
        oldest: number(2, "an oldest revision")?,
        topology: Version {
            epoch: number(3, "an epoch")?,
            revision: number(4, "a revision")?,
        },
        zones: number(5, "a number of zones")?,
        closures: number(6, "a number of closures")?,
    })
}

macro_rules! network_columns {
    () => {
        "network, head, oldest, topology_epoch, topology_revision, zones, closures"
    };
}

pub(super) async fn networks(connection: &mut Connection) -> Result<Vec<NetworkState>, Trouble> {
    let statement = concat!(
        "SELECT ",
        network_columns!(),
        " FROM networks ORDER BY network"
    );
    let rows = sqlx::query(statement).fetch_all(connection).await;
    rows.map_err(trouble)?.iter().map(state_of).collect()
}

pub(super) async fn network(
    connection: &mut Connection,
    id: &str,
) -> Result<Option<NetworkState>, Trouble> {
    let statement = concat!(
        "SELECT ",
        network_columns!(),
        " FROM networks WHERE network = $1"
    );
    let row = sqlx::query(statement)
        .bind(id)
        .fetch_optional(connection)
        .await;
    row.map_err(trouble)?.as_ref().map(state_of).transpose()
}

/// A change as it was put in; one whose digest is not right is damage, and goes no further.
fn change_of(row: &Row, network: &str) -> Result<LoggedChange, Trouble> {
    let number = |column: usize| -> Result<u64, Trouble> {
        let number: i64 = row.try_get(column).map_err(trouble)?;
        Ok(unsigned(number, "a revision or epoch")?)
    };
    let text = |column: usize| row.try_get::<String, _>(column).map_err(trouble);
    let (kind, operation) = (text(4)?, text(6)?);
    let change = LoggedChange {
        revision: number(0)?,
        epoch: number(1)?,
        at: text(2)?,
        subject: text(3)?,
        kind: kind_of(&kind)?,
        id: text(5)?,
        operation: operation_of(&operation)?,
        body: row.try_get(7).map_err(trouble)?,
        sha256: text(8)?,
    };
    if change.sha256 != change.digest(network) && !planted::is(Bug::TrustTheDisk) {
        let (revision, id) = (change.revision, &change.id);
        return Err(damaged(format!(
            "{kind} '{id}' of network '{network}' at revision {revision} has another digest"
        )));
    }
    Ok(change)
}

fn kind_of(name: &str) -> Result<ObjectKind, Trouble> {
    let found = ObjectKind::ALL.into_iter().find(|kind| kind.name() == name);
    found.ok_or_else(|| damaged(format!("there is no kind '{name}'")))
}

fn operation_of(name: &str) -> Result<ChangeOperation, Trouble> {
    let mut all = ChangeOperation::ALL.into_iter();
    let found = all.find(|operation| operation.name() == name);
    found.ok_or_else(|| damaged(format!("there is no operation '{name}'")))
}

/// The last change of an object, a tombstone too.
pub(super) async fn last_change(
    connection: &mut Connection,
    network: &str,
    kind: ObjectKind,
    id: &str,
) -> Result<Option<LoggedChange>, Trouble> {
    let statement = concat!(
        "SELECT ",
        change_columns!(),
        " FROM changes c WHERE c.network = $1 AND c.kind = $2 AND c.id = $3 ORDER BY c.revision DESC LIMIT 1"
    );
    let query = sqlx::query(statement)
        .bind(network)
        .bind(kind.name())
        .bind(id);
    let row = query.fetch_optional(connection).await.map_err(trouble)?;
    row.map(|row| change_of(&row, network)).transpose()
}

/// The version of an object that holds; none after a tombstone.
async fn version(
    connection: &mut Connection,
    network: &str,
    kind: ObjectKind,
    id: &str,
) -> Result<Option<Version>, Trouble> {
    let statement = "SELECT epoch, revision, operation FROM changes WHERE network = $1 AND kind = $2 AND id = $3 \
                     ORDER BY revision DESC LIMIT 1";
    let query = sqlx::query(statement)
        .bind(network)
        .bind(kind.name())
        .bind(id);
    let Some(row) = query.fetch_optional(connection).await.map_err(trouble)? else {
        return Ok(None);
    };
    let operation: String = row.try_get(2).map_err(trouble)?;
    if operation_of(&operation)? == ChangeOperation::Delete {
        return Ok(None);
    }
    let (epoch, revision) = (row.try_get(0), row.try_get(1));
    Ok(Some(Version {
        epoch: unsigned(epoch.map_err(trouble)?, "an epoch")?,
        revision: unsigned(revision.map_err(trouble)?, "a revision")?,
    }))
}

/// Whether everything is as a write was decided on.
pub(super) async fn holds(
    connection: &mut Connection,
    network: &str,
    expects: &[Expectation],
) -> Result<bool, Trouble> {
    for expected in expects {
        let found = version(connection, network, expected.kind, &expected.id).await?;
        if found != expected.version {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The last whole network up to a revision, and the patches after it.
pub(super) async fn network_parts(
    connection: &mut Connection,
    network: &str,
    at: u64,
) -> Result<Vec<LoggedChange>, Trouble> {
    let statement = concat!(
        "SELECT ",
        change_columns!(),
        " FROM changes c WHERE c.network = $1 AND c.kind = 'network' AND c.id = '' AND c.revision <= $2 \
         AND c.revision >= (SELECT MAX(revision) FROM changes WHERE network = $1 AND kind = 'network' AND id = '' \
         AND operation = 'put' AND revision <= $2) ORDER BY c.revision"
    );
    let query = sqlx::query(statement).bind(network).bind(signed(at));
    let rows = query.fetch_all(connection).await.map_err(trouble)?;
    rows.iter().map(|row| change_of(row, network)).collect()
}

/// The last revision of a page of the log: where the bounds are reached, at least one, never within one.
async fn page_end(connection: &mut Connection, query: &ChangesQuery) -> Result<u64, Trouble> {
    let statement = "SELECT revision, COUNT(*), CAST(SUM(bytes) AS BIGINT) FROM changes \
                     WHERE network = $1 AND revision > $2 GROUP BY revision ORDER BY revision LIMIT $3";
    let limit = signed(query.changes.max(1));
    let asked = sqlx::query(statement);
    let asked = asked
        .bind(&query.network)
        .bind(signed(query.after))
        .bind(limit);
    let rows = asked.fetch_all(connection).await.map_err(trouble)?;
    let (mut end, mut changes, mut bytes) = (query.after, 0_u64, 0_u64);
    for row in rows {
        let number = |column: usize| -> Result<u64, Trouble> {
            let number: i64 = row.try_get(column).map_err(trouble)?;
            Ok(unsigned(number, "a number in the log")?)
        };
        let (revision, more, more_bytes) = (number(0)?, number(1)?, number(2)?);
        let is_first = end == query.after;
        if !is_first && (changes + more > query.changes || bytes + more_bytes > query.bytes) {
            break;
        }
        (end, changes, bytes) = (revision, changes + more, bytes + more_bytes);
    }
    Ok(end)
}

/// A page of the log.
pub(super) async fn changes(
    connection: &mut Connection,
    query: &ChangesQuery,
) -> Result<Vec<LoggedChange>, Trouble> {
    let end = page_end(connection, query).await?;
    let statement = concat!(
        "SELECT ",
        change_columns!(),
        " FROM changes c WHERE c.network = $1 AND c.revision > $2 AND c.revision <= $3 ORDER BY c.revision, c.position"
    );
    let asked = sqlx::query(statement);
    let asked = asked
        .bind(&query.network)
        .bind(signed(query.after))
        .bind(signed(end));
    let rows = asked.fetch_all(connection).await.map_err(trouble)?;
    rows.iter()
        .map(|row| change_of(row, &query.network))
        .collect()
}

/// How many objects hold at a revision, and how many of them are zones or closures.
pub(super) async fn count_objects(
    connection: &mut Connection,
    query: &ObjectsQuery,
    at: u64,
) -> Result<(u64, u64), Trouble> {
    let statement = concat!(
        "SELECT COUNT(*), COUNT(CASE WHEN c.kind <> 'weather' THEN 1 END) FROM changes c WHERE ",
        still_holds!()
    );
    let kind = query.kind.map_or("", ObjectKind::name);
    let asked = sqlx::query(statement)
        .bind(&query.network)
        .bind(signed(at))
        .bind(kind);
    let row = asked.fetch_one(connection).await.map_err(trouble)?;
    let number = |column: usize| -> Result<u64, Trouble> {
        let number: i64 = row.try_get(column).map_err(trouble)?;
        Ok(unsigned(number, "a number of objects")?)
    };
    Ok((number(0)?, number(1)?))
}

/// A page of objects that hold at a revision, and whether there are more.
pub(super) async fn objects(
    connection: &mut Connection,
    query: &ObjectsQuery,
    at: u64,
) -> Result<(Vec<LoggedChange>, bool), Trouble> {
    let statement = concat!(
        "SELECT ",
        change_columns!(),
        " FROM changes c WHERE ",
        still_holds!(),
        " AND (c.kind > $4 OR (c.kind = $4 AND c.id > $5)) ORDER BY c.kind, c.id LIMIT $6"
    );
    let kind = query.kind.map_or("", ObjectKind::name);
    let (after_kind, after_id) = match &query.after {
        Some((kind, id)) => (kind.name(), id.as_str()),
        None => ("", ""),
    };
    let asked = sqlx::query(statement)
        .bind(&query.network)
        .bind(signed(at))
        .bind(kind);
    let asked = asked.bind(after_kind).bind(after_id);
    let mut rows = asked
        .bind(signed(query.limit.saturating_add(1)))
        .fetch(connection);
    let (mut found, mut bytes) = (Vec::new(), 0_u64);
    while let Some(row) = rows.next().await {
        let change = change_of(&row.map_err(trouble)?, &query.network)?;
        let more = change.body.as_ref().map_or(0, String::len) as u64;
        let is_full = found.len() as u64 >= query.limit || bytes + more > query.bytes;
        if !found.is_empty() && is_full {
            return Ok((found, true));
        }
        bytes += more;
        found.push(change);
    }
    Ok((found, false))
}

/// Puts a change into the log.
pub(super) async fn insert_change(
    connection: &mut Connection,
    append: &Append,
    change: &NewChange,
    version: Version,
    position: usize,
) -> Result<(), Trouble> {
    let mut logged = LoggedChange {
        revision: version.revision,
        epoch: version.epoch,
        at: append.at.clone(),
        subject: append.subject.clone(),
        kind: change.kind,
        id: change.id.clone(),
        operation: change.operation,
        body: change.body.clone(),
        sha256: String::new(),
    };
    logged.sha256 = logged.digest(&append.network);
    let statement = "INSERT INTO changes (network, kind, id, revision, position, epoch, made_at, subject, operation, \
                     body, bytes, sha256) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)";
    let bytes = logged.body.as_ref().map_or(0, String::len) as u64;
    let done = sqlx::query(statement)
        .bind(&append.network)
        .bind(logged.kind.name())
        .bind(&logged.id)
        .bind(signed(logged.revision))
        .bind(signed(position as u64))
        .bind(signed(logged.epoch))
        .bind(&logged.at)
        .bind(&logged.subject)
        .bind(logged.operation.name())
        .bind(&logged.body)
        .bind(signed(bytes))
        .bind(&logged.sha256);
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// The change that an object had before a write, for the counts.
pub(super) async fn is_there(
    connection: &mut Connection,
    network: &str,
    change: &NewChange,
) -> Result<bool, Trouble> {
    let found = version(connection, network, change.kind, &change.id).await?;
    Ok(found.is_some())
}

/// The planted bug of half batches: commits in the midst of a write.
pub(super) async fn commit_what_there_is(connection: &mut Connection) -> Result<(), Trouble> {
    let done = sqlx::query("COMMIT").execute(&mut *connection);
    done.await.map_err(trouble)?;
    tokio::time::sleep(BETWEEN_HALVES).await;
    let done = sqlx::query("BEGIN").execute(connection);
    done.await.map_err(trouble)?;
    Ok(())
}

pub(super) async fn insert_network(
    connection: &mut Connection,
    state: &NetworkState,
) -> Result<(), Trouble> {
    let statement = "INSERT INTO networks (network, head, oldest, topology_epoch, topology_revision, zones, closures) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7)";
    let done = sqlx::query(statement)
        .bind(&state.id)
        .bind(signed(state.head))
        .bind(signed(state.oldest))
        .bind(signed(state.topology.epoch))
        .bind(signed(state.topology.revision))
        .bind(signed(state.zones))
        .bind(signed(state.closures));
    done.execute(connection).await.map_err(trouble)?;
    Ok(())
}

/// Moves a network on from a head; false where another write has done so meanwhile.
pub(super) async fn update_network(
    connection: &mut Connection,
    state: &NetworkState,
    head_before: u64,
) -> Result<bool, Trouble> {
    let statement = "UPDATE networks SET head = $2, topology_epoch = $3, topology_revision = $4, zones = $5, \
                     closures = $6 WHERE network = $1 AND head = $7";
    let done = sqlx::query(statement)
        .bind(&state.id)
        .bind(signed(state.head))
        .bind(signed(state.topology.epoch))
        .bind(signed(state.topology.revision))
        .bind(signed(state.zones))
        .bind(signed(state.closures))
        .bind(signed(head_before));
    let done = done.execute(connection).await.map_err(trouble)?;
    Ok(done.rows_affected() == 1)
}
