//! The file of an edge in SQLite: on board, without anything to set up.
//!
//! One connection, a write-ahead log, and every commit on the disk before it is acknowledged (`synchronous =
//! FULL`). Each row carries a sum of what it says, so that what was bent on the disk is an error and is never
//! enforced. A commit that fails is never taken for done later: the file is opened anew, and what its log has
//! is copied into the file proper, with pages that the system has to write again.

use super::file::{Pending, Row, StoreFault, StoreFile, Table, Transaction};
use sha2::{Digest, Sha256};
use skyway_planted::{self as planted, Bug};
use skyway_service::intake::{StoreLook, look_at_store};
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous};
use sqlx::{Connection, QueryBuilder, Row as _, Sqlite, SqliteConnection};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::time::Duration;

/// How long a transaction waits for another process that has the file.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);
/// Pages that may be kept in memory: 32 MiB.
const CACHE: &str = "-32768";
/// Rows in one statement.
const ROWS_IN_STATEMENT: usize = 24;
/// Statements that stay prepared: for each number of rows one that puts and one that removes, and those of a transaction.
const STATEMENTS_KEPT: usize = 2 * ROWS_IN_STATEMENT + 16;
/// The schema that this version knows.
const SCHEMA: i64 = 1;
/// The first version of SQLite whose write-ahead log never loses a commit.
const VERSION_MIN: [u32; 3] = [3, 51, 3];

const MAKE: [&str; 5] = [
    "CREATE TABLE IF NOT EXISTS meta (name TEXT PRIMARY KEY NOT NULL, number INTEGER NOT NULL)",
    "CREATE TABLE IF NOT EXISTS entries (kind INTEGER NOT NULL, key TEXT NOT NULL, body TEXT NOT NULL, \
     sum INTEGER NOT NULL, PRIMARY KEY (kind, key))",
    "INSERT INTO meta (name, number) VALUES ('schema', 1) ON CONFLICT (name) DO NOTHING",
    "INSERT INTO meta (name, number) VALUES ('transaction', 0) ON CONFLICT (name) DO NOTHING",
    "INSERT INTO meta (name, number) VALUES ('writer', 0) ON CONFLICT (name) DO NOTHING",
];

/// A file of SQLite.
#[derive(Debug)]
pub struct SqliteFile {
    path: PathBuf,
    /// None after a failure, until it is opened anew.
    connection: Option<SqliteConnection>,
}

impl SqliteFile {
    /// Opens a file, and makes it where there is none.
    ///
    /// # Errors
    /// When it cannot be opened, is empty, damaged or no store, or was made by a later version.
    pub async fn open(path: &Path) -> Result<Self, StoreFault> {
        look(path).await?;
        let options = SqliteConnectOptions::new()
            .filename(path)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            // A thousand plans in one transaction stay in memory, with what undoes a statement, until they are committed.
            .pragma("cache_size", CACHE)
            .pragma("temp_store", "MEMORY")
            .statement_cache_capacity(STATEMENTS_KEPT)
            .busy_timeout(BUSY_TIMEOUT);
        let mut connection = connect(path, &options).await?;
        check_engine(path, &mut connection).await?;
        for statement in MAKE {
            let made = sqlx::query(statement).execute(&mut connection).await;
            made.map_err(|error| unusable(path, &fault(error)))?;
        }
        check_schema(&mut connection).await?;
        check_structure(&mut connection).await?;
        Ok(Self {
            path: path.to_owned(),
            connection: Some(connection),
        })
    }

    /// Whether a file that is there would be opened, without changing anything in it.
    ///
    /// # Errors
    /// What keeps it from being opened.
    pub async fn check(path: &Path) -> Result<(), StoreFault> {
        if look(path).await? == StoreLook::Bare {
            return Ok(());
        }
        let mut file = Self::open_to_read(path).await?;
        let checked = check_structure(file.connection()?).await;
        Box::new(file).close().await;
        checked
    }

    /// Opens a file that is there, only to read it; another process may have it open.
    ///
    /// # Errors
    /// When it cannot be opened, is no store, or was made by a later version.
    pub async fn open_to_read(path: &Path) -> Result<Self, StoreFault> {
        let options = SqliteConnectOptions::new()
            .filename(path)
            .create_if_missing(false)
            .busy_timeout(BUSY_TIMEOUT)
            .pragma("query_only", "ON");
        let mut connection = connect(path, &options).await?;
        let checked = check_schema(&mut connection).await;
        checked.map_err(|error| match error {
            StoreFault::Newer { .. } => error,
            other => unusable(path, &other),
        })?;
        Ok(Self {
            path: path.to_owned(),
            connection: Some(connection),
        })
    }

    fn connection(&mut self) -> Result<&mut SqliteConnection, StoreFault> {
        let message = "it is being opened anew".to_owned();
        self.connection
            .as_mut()
            .ok_or(StoreFault::Unavailable { message })
    }
}

/// Refuses what is no store of an edge, before anything is made in it.
async fn look(path: &Path) -> Result<StoreLook, StoreFault> {
    let name = path.display().to_string();
    match look_at_store(path, "entries").await {
        look @ (StoreLook::Openable | StoreLook::Bare) => Ok(look),
        StoreLook::Empty => Err(StoreFault::Empty { name }),
        StoreLook::Foreign => Err(StoreFault::Foreign { name }),
    }
}

async fn connect(
    path: &Path,
    options: &SqliteConnectOptions,
) -> Result<SqliteConnection, StoreFault> {
    let connected = SqliteConnection::connect_with(options).await;
    connected.map_err(|error| unusable(path, &fault(error)))
}

fn unusable(path: &Path, fault: &StoreFault) -> StoreFault {
    StoreFault::Unusable {
        name: path.display().to_string(),
        message: fault.to_string(),
    }
}

/// Whether the engine keeps what it promises: its version, its log, and that commits reach the disk.
async fn check_engine(path: &Path, connection: &mut SqliteConnection) -> Result<(), StoreFault> {
    let refused = |message: String| StoreFault::Unusable {
        name: path.display().to_string(),
        message,
    };
    let version: String = sqlx::query_scalar("SELECT sqlite_version()")
        .fetch_one(&mut *connection)
        .await
        .map_err(fault)?;
    let numbers: Vec<u32> = version
        .split('.')
        .map(|part| part.parse().unwrap_or_default())
        .collect();
    if numbers.as_slice() < VERSION_MIN.as_slice() {
        let message =
            format!("SQLite {version} may lose commits; 3.51.3 is the oldest that does not");
        return Err(refused(message));
    }
    let mode: String = sqlx::query_scalar("PRAGMA journal_mode")
        .fetch_one(&mut *connection)
        .await
        .map_err(fault)?;
    if mode != "wal" {
        let message = format!("its file system allows no write-ahead log, only '{mode}'");
        return Err(refused(message));
    }
    let synchronous: i64 = sqlx::query_scalar("PRAGMA synchronous")
        .fetch_one(&mut *connection)
        .await
        .map_err(fault)?;
    match synchronous {
        2.. => Ok(()),
        other => Err(refused(format!("synchronous is {other}, not FULL"))),
    }
}

async fn check_schema(connection: &mut SqliteConnection) -> Result<(), StoreFault> {
    let found = meta(connection, "schema").await?;
    match found > SCHEMA {
        false => Ok(()),
        true => Err(StoreFault::Newer {
            found: found.unsigned_abs(),
            known: SCHEMA.unsigned_abs(),
        }),
    }
}

/// Whether the pages of the file still make trees. What rows say is looked at when they are read.
async fn check_structure(connection: &mut SqliteConnection) -> Result<(), StoreFault> {
    let said: String = sqlx::query_scalar("PRAGMA quick_check(1)")
        .fetch_one(&mut *connection)
        .await
        .map_err(fault)?;
    match said == "ok" {
        true => Ok(()),
        false => Err(StoreFault::damaged(said)),
    }
}

async fn meta(connection: &mut SqliteConnection, name: &str) -> Result<i64, StoreFault> {
    let number = sqlx::query_scalar("SELECT number FROM meta WHERE name = ?").bind(name);
    number.fetch_one(&mut *connection).await.map_err(fault)
}

/// What a row says, in a number that changes with every bit of it.
fn sum(kind: i64, key: &str, body: &str) -> i64 {
    let mut digest = Sha256::new();
    for field in [kind.to_string().as_str(), key, body] {
        digest.update(field.len().to_le_bytes());
        digest.update(field);
    }
    let digest = digest.finalize();
    let mut first = [0; 8];
    first.copy_from_slice(&digest[..8]);
    i64::from_le_bytes(first)
}

fn checked(table: Table, key: &str, row: &sqlx::sqlite::SqliteRow) -> Result<String, StoreFault> {
    let bent = || StoreFault::damaged(format!("row '{key}' of {table:?} is not what was written"));
    let body: String = row.try_get("body").map_err(|_| bent())?;
    let stated: i64 = row.try_get("sum").map_err(|_| bent())?;
    match stated == sum(table.number(), key, &body) || planted::is(Bug::TrustTheDisk) {
        true => Ok(body),
        false => Err(bent()),
    }
}

/// Writes rows, in the order of the file. Each statement is a way to the thread of the file and back, which costs more than
/// the row that it brings, so that rows share statements.
async fn write(connection: &mut SqliteConnection, rows: &[Row]) -> Result<(), StoreFault> {
    // Of rows with the same key the last one counts.
    let rows = rows.iter().map(|row| {
        let place = (row.table.number(), row.key.as_str());
        (place, row.body.as_deref())
    });
    let rows: BTreeMap<Place<'_>, Option<&str>> = rows.collect();
    let puts = rows
        .iter()
        .filter_map(|(&place, body)| Some((place, (*body)?)));
    let puts: Vec<(Place<'_>, &str)> = puts.collect();
    for some in puts.chunks(ROWS_IN_STATEMENT) {
        let done = puts_of(some).build().execute(&mut *connection).await;
        done.map_err(fault)?;
    }
    let removals = rows.iter().filter(|(_, body)| body.is_none());
    let removals: Vec<Place<'_>> = removals.map(|(&place, _)| place).collect();
    for of_table in removals.chunk_by(|one, next| one.0 == next.0) {
        for some in of_table.chunks(ROWS_IN_STATEMENT) {
            let done = removal_of(some).build().execute(&mut *connection).await;
            done.map_err(fault)?;
        }
    }
    Ok(())
}

/// The number of a table, and a key in it.
type Place<'a> = (i64, &'a str);

/// The statement that puts rows. There is one for each number of rows, so that they stay prepared.
fn puts_of(rows: &[(Place<'_>, &str)]) -> QueryBuilder<Sqlite> {
    let mut statement = QueryBuilder::new("INSERT INTO entries (kind, key, body, sum) ");
    statement.push_values(rows, |mut fields, &((kind, key), body)| {
        fields.push_bind(kind).push_bind(key).push_bind(body);
        fields.push_bind(sum(kind, key, body));
    });
    statement
        .push(" ON CONFLICT (kind, key) DO UPDATE SET body = excluded.body, sum = excluded.sum");
    statement
}

/// The statement that removes rows of one table.
fn removal_of(rows: &[Place<'_>]) -> QueryBuilder<Sqlite> {
    let mut statement = QueryBuilder::new("DELETE FROM entries WHERE kind = ");
    let kind = rows.first().map(|&(kind, _)| kind);
    statement.push_bind(kind).push(" AND key IN (");
    let mut keys = statement.separated(", ");
    for &(_, key) in rows {
        keys.push_bind(key);
    }
    statement.push(")");
    statement
}

async fn commit(
    connection: &mut SqliteConnection,
    transaction: &Transaction,
) -> Result<(), StoreFault> {
    let number = i64::try_from(transaction.number).unwrap_or(i64::MAX);
    let mut work = connection
        .begin_with("BEGIN IMMEDIATE")
        .await
        .map_err(fault)?;
    let writer = i64::try_from(transaction.writer).unwrap_or(i64::MAX);
    let statement = "UPDATE meta SET number = CASE name WHEN 'transaction' THEN ? ELSE ? END \
         WHERE name IN ('transaction', 'writer') \
         AND (SELECT number FROM meta WHERE name = 'transaction') = ?";
    let moved = sqlx::query(statement).bind(number).bind(writer);
    let moved = moved.bind(number - 1).execute(&mut *work).await;
    if moved.map_err(fault)?.rows_affected() == 0 {
        return Err(StoreFault::Taken);
    }
    let mut rows = transaction.rows.as_slice();
    if planted::is(Bug::HalfBatch) {
        let (first, rest) = rows.split_at(rows.len() / 2);
        write(&mut work, first).await?;
        work.commit().await.map_err(fault)?;
        let more = connection.begin_with("BEGIN IMMEDIATE").await;
        work = more.map_err(fault)?;
        rows = rest;
    }
    write(&mut work, rows).await?;
    work.commit().await.map_err(fault)
}

impl StoreFile for SqliteFile {
    fn number(&mut self) -> Pending<'_, u64> {
        Box::pin(async move {
            let number = meta(self.connection()?, "transaction").await?;
            Ok(number.unsigned_abs())
        })
    }

    fn load(&mut self, table: Table) -> Pending<'_, Vec<(String, String)>> {
        Box::pin(async move {
            let statement = "SELECT key, body, sum FROM entries WHERE kind = ? ORDER BY key";
            let rows = sqlx::query(statement).bind(table.number());
            let rows = rows.fetch_all(self.connection()?).await.map_err(fault)?;
            let entries = rows.iter().map(|row| {
                let key: String = row.try_get("key").map_err(fault)?;
                let body = checked(table, &key, row)?;
                Ok((key, body))
            });
            entries.collect()
        })
    }

    fn sizes(&mut self, table: Table) -> Pending<'_, Vec<(String, u64)>> {
        Box::pin(async move {
            let statement =
                "SELECT key, LENGTH(CAST(body AS BLOB)) FROM entries WHERE kind = ? ORDER BY key";
            let rows = sqlx::query_as(statement).bind(table.number());
            let rows: Vec<(String, i64)> =
                rows.fetch_all(self.connection()?).await.map_err(fault)?;
            let sizes = rows.into_iter();
            Ok(sizes
                .map(|(key, bytes)| (key, bytes.unsigned_abs()))
                .collect())
        })
    }

    fn read<'a>(&'a mut self, table: Table, key: &'a str) -> Pending<'a, Option<String>> {
        Box::pin(async move {
            let row = sqlx::query("SELECT body, sum FROM entries WHERE kind = ? AND key = ?");
            let row = row.bind(table.number()).bind(key);
            let row = row
                .fetch_optional(self.connection()?)
                .await
                .map_err(fault)?;
            row.map(|row| checked(table, key, &row)).transpose()
        })
    }

    fn commit<'a>(&'a mut self, transaction: &'a Transaction) -> Pending<'a, ()> {
        Box::pin(async move {
            let done = commit(self.connection()?, transaction).await;
            if done.is_err() {
                // What its cache says of the disk is not to be believed any more.
                self.connection = None;
            }
            done
        })
    }

    fn reopen(&mut self) -> Pending<'_, (u64, u64)> {
        Box::pin(async move {
            self.connection = None;
            let mut file = Self::open(&self.path).await?;
            let connection = file.connection()?;
            // A log whose sync has failed may look whole and not be on the disk: its pages are written again.
            let blocked: i64 = sqlx::query("PRAGMA wal_checkpoint(TRUNCATE)")
                .fetch_one(&mut *connection)
                .await
                .and_then(|row| row.try_get(0))
                .map_err(fault)?;
            if blocked != 0 {
                let message = "another process reads it".to_owned();
                return Err(StoreFault::Unavailable { message });
            }
            let number = meta(connection, "transaction").await?;
            let writer = meta(connection, "writer").await?;
            self.connection = file.connection.take();
            Ok((number.unsigned_abs(), writer.unsigned_abs()))
        })
    }

    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            if let Some(connection) = self.connection {
                // What is committed is kept, whether the log can be folded in or not.
                let _ = connection.close().await;
            }
        })
    }
}

/// What an error of SQLite means. Its extended codes have the primary one in the lowest byte.
fn fault(error: sqlx::Error) -> StoreFault {
    const READ_ONLY: u32 = 8;
    const IO: u32 = 10;
    const CORRUPT: u32 = 11;
    const FULL: u32 = 13;
    const NO_DATABASE: u32 = 26;
    let message = error.to_string();
    let code = error.as_database_error().and_then(|error| error.code());
    let code = code.and_then(|code| code.parse::<u32>().ok());
    match code.unwrap_or_default() & 0xff {
        READ_ONLY | IO | FULL => StoreFault::Full { message },
        CORRUPT | NO_DATABASE => StoreFault::Damaged { message },
        _ => StoreFault::Unavailable { message },
    }
}
