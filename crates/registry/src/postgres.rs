//! The store in PostgreSQL, or in what speaks like it and spreads over machines.
//!
//! Writes are serializable and tried again where the database says that another got in between, so that any
//! number of registry processes may share one database. A notification tells the others at once that there is
//! something new; where the database knows no notifications they find out when they look.

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
#[path = "sql/positions_postgres.rs"]
mod positions;
#[path = "sql/statements.rs"]
mod statements;
#[path = "sql/upkeep.rs"]
mod upkeep;

use super::sql::Trouble;
use super::store::StoreError;
use sqlx::pool::{PoolConnection, PoolOptions};
use sqlx::postgres::{PgConnectOptions, PgListener, PgRow};
use sqlx::{Connection as _, PgConnection, Pool, Postgres, Transaction};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::Mutex;
use tokio::time::timeout;

type Connection = PgConnection;
type Database = Postgres;
type Row = PgRow;

const CHANNEL: &str = "skyway_registry";
const CONNECTIONS: u32 = 8;
/// How long to wait for a connection.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long to wait before listening again after the connection broke.
const PAUSE: Duration = Duration::from_secs(5);

/// A store in a database.
#[derive(Debug)]
pub struct SqlStore {
    pool: Pool<Postgres>,
    writing: Mutex<()>,
    /// False once the database has refused a notification.
    notifies: AtomicBool,
    listener: Mutex<Option<PgListener>>,
    /// For asking whether the database is there: a pool asks again for as long as it has patience.
    probe: Mutex<Option<PgConnection>>,
    options: PgConnectOptions,
    /// Days that positions have a table for.
    days: positions::KnownDays,
}

impl SqlStore {
    /// Opens the store in a database, and makes its tables where there are none, with this id.
    ///
    /// # Errors
    /// When the database cannot be reached, or its tables were made by a later version.
    pub async fn open(url: &str, fresh_id: &str) -> Result<Self, StoreError> {
        let options = PgConnectOptions::from_str(url).map_err(unusable)?;
        let options = options.application_name("skyway-registry");
        // A pool asks again until its time is over, and then does not know why.
        let unreached = |message: String| StoreError::Unusable {
            name: place_of(&options),
            message,
        };
        match timeout(PATIENCE, PgConnection::connect_with(&options)).await {
            Ok(Ok(connection)) => drop(connection.close().await),
            Ok(Err(error)) => return Err(unreached(error.to_string())),
            Err(_) => {
                let patience_s = PATIENCE.as_secs();
                return Err(unreached(format!("nothing has come for {patience_s} s")));
            }
        }
        let pool = PoolOptions::new()
            .max_connections(CONNECTIONS)
            .acquire_timeout(PATIENCE);
        let store = Self {
            pool: pool.connect_with(options.clone()).await.map_err(unusable)?,
            writing: Mutex::new(()),
            notifies: AtomicBool::new(true),
            listener: Mutex::new(None),
            probe: Mutex::new(None),
            options,
            days: positions::KnownDays::default(),
        };
        store.migrate(fresh_id).await?;
        Ok(store)
    }

    /// Checks the name of a database without asking it anything.
    pub(super) fn check_name(url: &str) -> Result<(), StoreError> {
        PgConnectOptions::from_str(url).map(drop).map_err(unusable)
    }

    /// Whether it answers: over the connection of before, else over a new one.
    async fn answer(&self) -> Result<(), StoreError> {
        let mut held = self.probe.lock().await;
        if let Some(mut connection) = held.take()
            && connection.ping().await.is_ok()
        {
            *held = Some(connection);
            return Ok(());
        }
        let connected = PgConnection::connect_with(&self.options).await;
        let connection = connected.map_err(|error| StoreError::Unavailable {
            message: error.to_string(),
        })?;
        *held = Some(connection);
        Ok(())
    }

    async fn begin_write(&self) -> Result<Transaction<'static, Postgres>, Trouble> {
        self.begin("BEGIN ISOLATION LEVEL SERIALIZABLE").await
    }

    async fn begin_read(&self) -> Result<Transaction<'static, Postgres>, Trouble> {
        self.begin("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY")
            .await
    }

    async fn reader(&self) -> Result<PoolConnection<Postgres>, Trouble> {
        self.pool.acquire().await.map_err(trouble)
    }

    /// Begins a transaction, to the end though nobody waits any more: sqlx 0.9.0 takes no note of one whose beginning is given
    /// up, and hands its connection to the next within it (sqlx issue 4393).
    pub(super) async fn begin(
        &self,
        how: &'static str,
    ) -> Result<Transaction<'static, Postgres>, Trouble> {
        let pool = self.pool.clone();
        let begun = tokio::spawn(async move { pool.begin_with(how).await });
        match begun.await {
            Ok(begun) => begun.map_err(trouble),
            Err(stopped) => Err(Trouble::Lasting(StoreError::Unavailable {
                message: stopped.to_string(),
            })),
        }
    }

    /// What a connection that has failed is good for, the pool finds out before it is used again.
    pub(super) fn distrust(&self) {}

    /// After the commit and not within it: a database without notifications would undo the write.
    async fn tell_others(&self, network: &str) {
        if !self.notifies.load(Ordering::Relaxed) {
            return;
        }
        let told = sqlx::query("SELECT pg_notify($1, $2)")
            .bind(CHANNEL)
            .bind(network);
        if let Err(error) = told.execute(&self.pool).await
            && error.as_database_error().is_some()
        {
            self.notifies.store(false, Ordering::Relaxed);
            tracing::info!(%error, "the database has no notifications; others find out when they look");
        }
    }

    async fn hear_others(&self) {
        let mut held = self.listener.lock().await;
        let heard = async {
            let listener = match &mut *held {
                Some(listener) => listener,
                none => {
                    let mut listener = PgListener::connect_with(&self.pool).await?;
                    listener.listen(CHANNEL).await?;
                    none.insert(listener)
                }
            };
            listener.recv().await
        };
        if let Err(error) = heard.await {
            tracing::debug!(%error, "no notifications of the database");
            *held = None;
            tokio::time::sleep(PAUSE).await;
        }
    }

    async fn close_all(&self) {
        *self.listener.lock().await = None;
        *self.probe.lock().await = None;
        self.pool.close().await;
    }
}

/// The name may have a password in it, and is not repeated.
/// A database as a message names it, without its password.
fn place_of(options: &PgConnectOptions) -> String {
    let database = options.get_database().unwrap_or_default();
    let (host, port) = (options.get_host(), options.get_port());
    format!("the database '{database}' at {host}:{port}")
}

fn unusable(error: sqlx::Error) -> StoreError {
    StoreError::Unusable {
        name: "the database".to_owned(),
        message: error.to_string(),
    }
}

/// What an error of PostgreSQL means, by its class (appendix A of its manual).
fn trouble(error: sqlx::Error) -> Trouble {
    let message = error.to_string();
    let Some(code) = error.as_database_error().and_then(|error| error.code()) else {
        return Trouble::Lasting(StoreError::Unavailable { message });
    };
    Trouble::Lasting(match &*code {
        // Serialization failure, deadlock, and two that put the same row or table at once.
        "40001" | "40P01" | "23505" | "42P07" => return Trouble::Contended,
        // Disk full, out of memory, and the like; read-only, as a standby is; an I/O error.
        "25006" | "58030" => StoreError::Full { message },
        code if code.starts_with("53") && code != "53300" => StoreError::Full { message },
        "XX001" | "XX002" => StoreError::Damaged { message },
        _ => StoreError::Unavailable { message },
    })
}
