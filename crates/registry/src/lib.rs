//! The registry: the log of changes that every edge follows, and the writes that make it.
//!
//! It keeps no state that matters outside its store, so that several processes may serve one store. Nothing
//! here knows HTTP, nor SQL outside `sql`, `sqlite` and `postgres`. A write is decided on what the store says,
//! and committed only where that still holds; `writes` has the loop. `follow` and `snapshot` tell what there is.

mod closures;
pub mod documents;
mod ended;
mod follow;
mod followers;
mod heads;
mod high_water;
mod networks;
mod objects;
mod postgres;
mod probes;
mod refused;
mod settings;
mod snapshot;
mod sql;
mod sqlite;
mod status;
pub mod store;
mod topologies;
mod upkeep;
mod writes;

pub use follow::Follow;
pub use high_water::HighWater;
pub use postgres::SqlStore as PostgresStore;
pub use settings::Settings;
pub use snapshot::SnapshotRequest;
pub use sqlite::SqlStore as SqliteStore;
pub use status::Status;
pub use writes::{Reply, WriteOptions};

use documents::Documents;
use followers::Followers;
use heads::Heads;
use probes::Probes;
use skyway_planted::{self as planted, Bug};
use skyway_service::clock::Clock;
use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use store::{Identity, Store, StoreError};
use thiserror::Error;
use topologies::Topologies;

/// Why a registry cannot be opened.
#[derive(Debug, Error)]
pub enum OpenError {
    /// Its store cannot.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The file that remembers how far the store had come cannot be read or written.
    #[error("cannot use {path}, which remembers how far the store had come: {error}")]
    HighWater {
        /// The file.
        path: String,
        /// Why not.
        error: io::Error,
    },
    /// That file is of another registry.
    #[error(
        "{path} is of the registry {expected}, and the store of {found}; name the right store, or remove the file"
    )]
    Foreign {
        /// The file.
        path: String,
        /// The registry that the file remembers.
        expected: String,
        /// The registry of the store.
        found: String,
    },
}

/// What a registry is opened with.
#[derive(Debug)]
pub struct Opening {
    /// Where everything is kept.
    pub store: Arc<dyn Store>,
    /// The bounds.
    pub settings: Settings,
    /// What tells the time.
    pub clock: Clock,
    /// What remembers how far the store had come, if anything does.
    pub high_water: Option<HighWater>,
    /// Whether the store was restored, as someone says who knows.
    pub new_epoch: bool,
}

/// A registry: everything behind its use cases.
#[derive(Debug)]
pub struct Registry {
    store: Arc<dyn Store>,
    settings: Settings,
    clock: Clock,
    high_water: Option<Arc<HighWater>>,
    heads: Heads,
    topologies: Topologies,
    followers: Followers,
    /// Subjects and keys of the writes being answered.
    running: Mutex<BTreeSet<(String, String)>>,
    /// Whether the store answered when it was last asked.
    answers: AtomicBool,
    probes: Probes,
    counts: Counts,
}

/// What is counted since the start.
#[derive(Debug, Default)]
struct Counts {
    commits: AtomicU64,
    moved: AtomicU64,
    store_failures: AtomicU64,
    high_water_failures: AtomicU64,
    compactions: AtomicU64,
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// Opens the store of this name: `postgres://...`, or a file.
///
/// # Errors
/// When it cannot be opened, is no store, or was made by a later version; when the system has no random bits.
pub async fn open_store(name: &str) -> Result<Arc<dyn Store>, StoreError> {
    check_store_name(name)?;
    let fresh_id = random_hex().map_err(|error| StoreError::Unavailable {
        message: format!("the system has no random bits: {error}"),
    })?;
    if is_database(name) {
        return Ok(Arc::new(PostgresStore::open(name, &fresh_id).await?));
    }
    Ok(Arc::new(
        SqliteStore::open(Path::new(name), &fresh_id).await?,
    ))
}

/// Whether a store of this name is a database, and not a file.
pub fn is_database(name: &str) -> bool {
    name.starts_with("postgres://") || name.starts_with("postgresql://")
}

/// Checks what can be known of a store by its name alone.
///
/// # Errors
/// When it names something that is neither a file nor a PostgreSQL database.
pub fn check_store_name(name: &str) -> Result<(), StoreError> {
    if is_database(name) {
        return PostgresStore::check_name(name);
    }
    if !name.contains("://") {
        return Ok(());
    }
    Err(StoreError::Unusable {
        name: format!("'{name}'"),
        message: "it is neither a file nor a PostgreSQL database".to_owned(),
    })
}

/// 128 random bits in hexadecimal.
fn random_hex() -> Result<String, getrandom::Error> {
    let mut random = [0_u8; 16];
    getrandom::fill(&mut random)?;
    Ok(hex::encode(random))
}

impl Registry {
    /// Opens a registry. A store that is behind what was remembered of it begins a new epoch.
    ///
    /// # Errors
    /// When the store does not answer, or what remembers it is of no use or of another store.
    pub async fn open(opening: Opening) -> Result<Arc<Self>, OpenError> {
        let Opening {
            store,
            settings,
            clock,
            high_water,
            new_epoch,
        } = opening;
        let mut identity = store.identity().await?;
        let networks = store.networks().await?;
        let mark_epoch = match &high_water {
            Some(file) => remembered(file, &identity, &networks)?,
            None => None,
        };
        if let Some(epoch) = mark_epoch.or(new_epoch.then_some(identity.epoch)) {
            identity = store.begin_epoch(epoch).await?;
            let (registry_id, epoch) = (&identity.registry_id, identity.epoch);
            tracing::warn!(
                registry_id,
                epoch,
                "the store was restored: a new epoch begins"
            );
        }
        if let Some(file) = &high_water {
            let begun = file.begin(&identity, &networks);
            begun.map_err(|error| unusable(file, error))?;
        }
        Ok(Arc::new(Self {
            store,
            settings,
            clock,
            high_water: high_water.map(Arc::new),
            heads: Heads::default(),
            topologies: Topologies::default(),
            followers: Followers::default(),
            running: Mutex::default(),
            answers: AtomicBool::new(true),
            probes: Probes::default(),
            counts: Counts::default(),
        }))
    }

    /// The clock that all times of this registry come from.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The documents that are kept in its store.
    pub fn documents(&self) -> Arc<dyn Documents> {
        self.store.clone()
    }

    /// Which registry this is.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn identity(&self) -> Result<Identity, StoreError> {
        self.store.identity().await
    }

    /// Whether the store answered when it was last asked.
    pub fn is_ready(&self) -> bool {
        self.answers.load(Ordering::Relaxed)
    }
}

fn unusable(file: &HighWater, error: io::Error) -> OpenError {
    OpenError::HighWater {
        path: file.path().display().to_string(),
        error,
    }
}

/// The epoch after which a new one has to begin, where the store is behind what was remembered.
fn remembered(
    file: &HighWater,
    identity: &Identity,
    networks: &[store::NetworkState],
) -> Result<Option<u64>, OpenError> {
    let Some(mark) = file.read().map_err(|error| unusable(file, error))? else {
        return Ok(None);
    };
    if mark.registry_id != identity.registry_id {
        return Err(OpenError::Foreign {
            path: file.path().display().to_string(),
            expected: mark.registry_id,
            found: identity.registry_id.clone(),
        });
    }
    let is_behind = mark.is_ahead_of(identity, networks) && !planted::is(Bug::KeepEpoch);
    Ok(is_behind.then(|| mark.epoch.max(identity.epoch)))
}
