//! The store in one file: SQLite, on board, without anything to set up.
//!
//! One connection writes, others read beside it (WAL). Every commit is on the disk before it is acknowledged
//! (`synchronous = FULL`). A write begins with `BEGIN IMMEDIATE`: one that began as a read and wants to write
//! would fail at once where another writes, whatever patience is configured. After an error of the disk every
//! connection is opened anew: what one of them remembers of the file may not be what is on the disk.

#![expect(
    clippy::duplicate_mod,
    reason = "each engine compiles the modules below sql for its own types"
)]

#[path = "sql/documents.rs"]
mod documents;
#[path = "sql/documents_engine.rs"]
mod documents_engine;
#[path = "sql/engine.rs"]
mod engine;
#[path = "sql/history.rs"]
mod history;
#[path = "sql/messages.rs"]
mod messages;
#[path = "sql/positions_sqlite.rs"]
mod positions;
#[path = "sql/statements.rs"]
mod statements;
#[path = "sql/upkeep.rs"]
mod upkeep;

use super::sql::Trouble;
use super::sql::schema::STEPS;
use super::store::StoreError;
use skyway_service::intake::{StoreLook, look_at_store};
use sqlx::pool::{PoolConnection, PoolOptions};
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteRow, SqliteSynchronous};
use sqlx::{Connection as _, Pool, Sqlite, SqliteConnection, Transaction};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;
use tokio::sync::Mutex;

type Connection = SqliteConnection;
type Database = Sqlite;
type Row = SqliteRow;

/// How long a write waits for another process that has the file.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);
/// How many may write at once.
const WRITERS: u32 = 1;
/// How many may read at once.
const READERS: u32 = 4;

/// A store in a file.
#[derive(Debug)]
pub struct SqlStore {
    writer: Pool<Sqlite>,
    readers: Pool<Sqlite>,
    writing: Mutex<()>,
    distrusted: [Distrusted; 2],
}

/// How many connections of a pool are to be closed before they are used again.
#[derive(Clone, Debug, Default)]
struct Distrusted(Arc<AtomicU32>);

impl Distrusted {
    /// A pool whose connections are looked at before each use.
    fn pool(&self, connections: u32) -> PoolOptions<Sqlite> {
        let distrusted = self.0.clone();
        let is_trusted = move || {
            let less = |count: u32| count.checked_sub(1);
            let taken = distrusted.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
            taken.is_err()
        };
        PoolOptions::new()
            .max_connections(connections)
            .before_acquire(move |_, _| {
                let is_trusted = is_trusted();
                Box::pin(async move { Ok(is_trusted) })
            })
    }
}

/// Refuses what is no store of a registry, before anything is made in it.
async fn look(file: &Path) -> Result<StoreLook, StoreError> {
    let name = file.display().to_string();
    match look_at_store(file, "facts").await {
        look @ (StoreLook::Openable | StoreLook::Bare) => Ok(look),
        StoreLook::Empty => Err(StoreError::Empty { name }),
        StoreLook::Foreign => Err(StoreError::Foreign { name }),
    }
}

async fn check_schema(connection: &mut Connection) -> Result<(), StoreError> {
    let known = STEPS.len() as u64;
    match statements::schema(connection).await {
        Ok(found) if found > known => Err(StoreError::Newer { found, known }),
        Ok(_) => Ok(()),
        Err(Trouble::Lasting(error)) => Err(error),
        Err(Trouble::Contended) => Err(StoreError::Contended),
    }
}

impl SqlStore {
    /// Opens a store, and makes it where there is none, with this id.
    ///
    /// # Errors
    /// When the file cannot be opened, is no store, or was made by a later version.
    pub async fn open(file: &Path, fresh_id: &str) -> Result<Self, StoreError> {
        look(file).await?;
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(BUSY_TIMEOUT);
        let unusable = |error: sqlx::Error| StoreError::Unusable {
            name: file.display().to_string(),
            message: error.to_string(),
        };
        let distrusted = [Distrusted::default(), Distrusted::default()];
        let writer = distrusted[0].pool(WRITERS).connect_with(options.clone());
        let writer = writer.await.map_err(unusable)?;
        let readers = distrusted[1].pool(READERS);
        let readers = readers.connect_lazy_with(options.pragma("query_only", "ON"));
        let store = Self {
            writer,
            readers,
            writing: Mutex::new(()),
            distrusted,
        };
        store.migrate(fresh_id).await?;
        Ok(store)
    }

    /// Whether a file that is there would be opened, without changing anything in it.
    ///
    /// # Errors
    /// What keeps it from being opened.
    pub async fn check(file: &Path) -> Result<(), StoreError> {
        if look(file).await? == StoreLook::Bare {
            return Ok(());
        }
        let unusable = |message: String| StoreError::Unusable {
            name: file.display().to_string(),
            message,
        };
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(false)
            .busy_timeout(BUSY_TIMEOUT)
            .pragma("query_only", "ON");
        let connected = SqliteConnection::connect_with(&options).await;
        let mut connection = connected.map_err(|error| unusable(error.to_string()))?;
        let said: Result<String, sqlx::Error> = sqlx::query_scalar("PRAGMA quick_check(1)")
            .fetch_one(&mut connection)
            .await;
        let checked = match said {
            Ok(said) if said == "ok" => check_schema(&mut connection).await,
            Ok(said) => Err(unusable(said)),
            Err(error) => Err(unusable(error.to_string())),
        };
        // What was read is known, however it is closed.
        let _ = connection.close().await;
        checked
    }

    /// Whether it answers.
    async fn answer(&self) -> Result<(), StoreError> {
        let asked = sqlx::query("SELECT value FROM facts LIMIT 1").fetch_optional(&self.readers);
        let asked = asked.await;
        asked.map(drop).map_err(|error| {
            self.distrust();
            StoreError::Unavailable {
                message: error.to_string(),
            }
        })
    }

    async fn begin_write(&self) -> Result<Transaction<'static, Sqlite>, Trouble> {
        self.writer
            .begin_with("BEGIN IMMEDIATE")
            .await
            .map_err(trouble)
    }

    async fn begin_read(&self) -> Result<Transaction<'static, Sqlite>, Trouble> {
        self.readers.begin().await.map_err(trouble)
    }

    async fn reader(&self) -> Result<PoolConnection<Sqlite>, Trouble> {
        self.readers.acquire().await.map_err(trouble)
    }

    /// After trouble that may be the disk's: no connection that is open now is used again.
    pub(super) fn distrust(&self) {
        let [writer, readers] = &self.distrusted;
        writer.0.store(WRITERS, Ordering::Relaxed);
        readers.0.store(READERS, Ordering::Relaxed);
    }

    /// There are no others: one process has the file.
    async fn tell_others(&self, _network: &str) {}

    async fn hear_others(&self) {
        std::future::pending().await
    }

    async fn close_all(&self) {
        self.readers.close().await;
        self.writer.close().await;
    }
}

/// What an error of SQLite means. Its extended codes have the primary one in the lowest byte.
fn trouble(error: sqlx::Error) -> Trouble {
    const BUSY: u32 = 5;
    const LOCKED: u32 = 6;
    const READ_ONLY: u32 = 8;
    const IO: u32 = 10;
    const CORRUPT: u32 = 11;
    const FULL: u32 = 13;
    const NO_DATABASE: u32 = 26;
    let message = error.to_string();
    let Some(code) = error.as_database_error().and_then(|error| error.code()) else {
        return Trouble::Lasting(StoreError::Unavailable { message });
    };
    let primary = code.parse::<u32>().unwrap_or_default() & 0xff;
    Trouble::Lasting(match primary {
        BUSY | LOCKED => return Trouble::Contended,
        READ_ONLY | IO | FULL => StoreError::Full { message },
        CORRUPT | NO_DATABASE => StoreError::Damaged { message },
        _ => StoreError::Unavailable { message },
    })
}
