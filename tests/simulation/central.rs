//! The registry of a run: the use cases as they ship over a store in memory; it crashes, begins again, and is
//! restored from a backup.

use crate::history::Version;
use crate::memory_store::{Contents, MemoryPlace};
use crate::places::{NETWORK, lattice};
use crate::rounds::Chance;
use crate::world::clock_after;
use skyway::registry::{HighWater, Opening, Registry, Settings, WriteOptions};
use skyway::wire::LoggedChange;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tempfile::TempDir;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

/// Revisions kept for followers, and how often they are dropped.
const REVISIONS_KEPT: u64 = 30;
const COMPACT_EVERY: Duration = Duration::from_secs(7);

/// The registry as it is up.
#[derive(Clone)]
pub(crate) struct Life {
    pub(crate) registry: Arc<Registry>,
    /// It has crashed.
    pub(crate) ended: CancellationToken,
}

/// Where the registry is, whether it is up or not.
pub(crate) struct Central {
    place: MemoryPlace,
    life: Mutex<Option<Life>>,
    /// Has what remembers how far the store had come.
    folder: TempDir,
    opened: Instant,
}

/// What a store has, kept for a bad day.
pub(crate) struct Backup(Contents);

/// A life of a registry that a backup has ended.
#[derive(Clone, Debug)]
pub(crate) struct Lost {
    pub(crate) epoch: u64,
    pub(crate) log: Vec<LoggedChange>,
    /// What of it the backup does not have.
    pub(crate) gone: Vec<LoggedChange>,
}

impl Central {
    /// A registry that is up and has a network.
    pub(crate) async fn open(seed: u64) -> Self {
        let central = Self {
            place: MemoryPlace::new(&format!("registry-{seed}")),
            life: Mutex::new(None),
            folder: tempfile::tempdir().expect("a folder"),
            opened: Instant::now(),
        };
        central.begin().await;
        let life = central.life().expect("it is up");
        let manner = WriteOptions {
            subject: "operator".to_owned(),
            ..WriteOptions::default()
        };
        let text = lattice();
        let put = life.registry.put_network(NETWORK, &text, &manner);
        put.await.expect("a network");
        let mut chance = Chance::of(seed, 0);
        central.place.slow_down(Box::new(move || {
            // Most commits are quick, some take their time.
            let most_ms = if chance.below(20) == 0 { 400 } else { 12 };
            Duration::from_millis(chance.below(most_ms))
        }));
        central
    }

    /// Opens what there is.
    pub(crate) async fn begin(&self) {
        if self.life().is_some() {
            return;
        }
        let opening = Opening {
            store: self.place.open(),
            settings: Settings {
                page_changes: 5,
                revisions_kept: REVISIONS_KEPT,
                compact_every: COMPACT_EVERY,
                ..Settings::default()
            },
            clock: clock_after(self.opened),
            high_water: Some(HighWater::at(self.folder.path().join("high-water"))),
            new_epoch: false,
        };
        let registry = Registry::open(opening).await.expect("a registry");
        let ended = CancellationToken::new();
        tokio::spawn(registry.clone().run(ended.clone()));
        *self.lock() = Some(Life { registry, ended });
    }

    /// Ends it without a warning.
    pub(crate) fn crash(&self) {
        if let Some(life) = self.lock().take() {
            self.place.crash();
            life.ended.cancel();
        }
    }

    pub(crate) fn life(&self) -> Option<Life> {
        self.lock().clone()
    }

    pub(crate) fn back_up(&self) -> Backup {
        Backup(self.place.back_up())
    }

    /// Puts a backup in place of what there is; gives what is lost with it.
    pub(crate) fn restore(&self, backup: &Backup) -> Lost {
        self.crash();
        let log = self.annals();
        let kept = backup.0.annals(NETWORK);
        let is_gone = |change: &&LoggedChange| !kept.contains(change);
        let lost = Lost {
            epoch: self.head().epoch,
            gone: log.iter().filter(is_gone).cloned().collect(),
            log,
        };
        self.place.restore(backup.0.clone());
        lost
    }

    /// How often it was asked for its log.
    pub(crate) fn questions(&self) -> u64 {
        self.place.questions()
    }

    /// All that was ever committed, in this life and those before it.
    pub(crate) fn annals(&self) -> Vec<LoggedChange> {
        self.place
            .look(|contents| contents.annals(NETWORK).to_vec())
    }

    /// The epoch and the last revision.
    pub(crate) fn head(&self) -> Version {
        self.place.look(|contents| Version {
            epoch: contents.identity().epoch,
            revision: contents.head(NETWORK),
        })
    }

    // Set or taken, never half.
    fn lock(&self) -> MutexGuard<'_, Option<Life>> {
        self.life.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
