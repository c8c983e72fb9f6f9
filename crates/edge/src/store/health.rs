//! How the store stands: whether it takes what it is given, for those who decide, count or look on.

use crate::locks::lock;
use serde::Serialize;
use skyway_service::clock::{Clock, Stopwatch};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::watch;

/// How the store of an edge stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StoreStatus {
    /// Whether there is one: without one the edge forgets everything when it ends.
    pub kept: bool,
    /// Whether all that is in force is on the disk, but for what is being written now.
    pub durable: bool,
    /// Why the last attempt to write has failed; absent while the store works.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failing: Option<String>,
    /// For how long something has been waiting to be stored, in seconds.
    pub unstored_age_s: f64,
    /// Transactions written.
    pub commits: u64,
    /// How long they took together, in seconds.
    pub commit_seconds: f64,
    /// Attempts that failed, or took too long.
    pub failures: u64,
    /// Decisions and answers that were not kept, because there were too many at once or the store failed for long.
    pub journal_lost: u64,
}

#[derive(Debug, Default)]
struct Figures {
    status: StoreStatus,
    /// Since when something is not stored.
    unstored: Option<Stopwatch>,
}

/// The same, as the storekeeper keeps it.
#[derive(Debug, Default)]
pub(crate) struct Health {
    failing: AtomicBool,
    /// The first change for the registry that is stored; told also when the store begins to fail.
    first_change: watch::Sender<Option<u64>>,
    /// The last of the news for the registry that may be told: that are stored, or of which nothing is.
    last_news: watch::Sender<Option<u64>>,
    figures: Mutex<Figures>,
}

impl Health {
    /// Whether the store is known to fail: what must not be lost is refused then.
    pub(crate) fn is_failing(&self) -> bool {
        self.failing.load(Ordering::Relaxed)
    }

    pub(crate) fn status(&self) -> StoreStatus {
        let figures = lock(&self.figures);
        let mut status = figures.status.clone();
        status.durable = status.kept && status.failing.is_none();
        let unstored = figures.unstored.as_ref();
        status.unstored_age_s = unstored.map_or(0.0, |since| since.elapsed().as_secs_f64());
        status
    }

    /// Whether a restart would begin with this change for the registry, as far as this store can see to that.
    pub(crate) fn begins_with(&self, number: u64) -> bool {
        self.is_failing() || *self.first_change.borrow() == Some(number)
    }

    /// Tells when another change for the registry is the first that is stored, or none can be.
    pub(crate) fn first_changes(&self) -> watch::Receiver<Option<u64>> {
        self.first_change.subscribe()
    }

    /// This change for the registry is the first that is stored.
    pub(super) fn stored(&self, first: Option<u64>) {
        self.first_change
            .send_if_modified(|known| std::mem::replace(known, first) != first);
    }

    /// The last of the news for the registry that may be told, as it changes; told also when the store begins to fail.
    pub(crate) fn last_news(&self) -> watch::Receiver<Option<u64>> {
        self.last_news.subscribe()
    }

    /// The news for the registry up to this number may be told.
    pub(super) fn stored_news(&self, last: Option<u64>) {
        self.last_news
            .send_if_modified(|known| std::mem::replace(known, last) != last);
    }

    pub(super) fn begin(&self) {
        lock(&self.figures).status.kept = true;
    }

    /// Something is in force that is not stored.
    pub(super) fn published(&self, clock: &Clock) {
        let mut figures = lock(&self.figures);
        if figures.unstored.is_none() {
            figures.unstored = Some(clock.stopwatch());
        }
    }

    pub(super) fn committed(&self, seconds: f64) {
        let mut figures = lock(&self.figures);
        figures.status.commits += 1;
        figures.status.commit_seconds += seconds;
        figures.status.failing = None;
        self.failing.store(false, Ordering::Relaxed);
    }

    /// All that was published is stored.
    pub(super) fn caught_up(&self) {
        lock(&self.figures).unstored = None;
    }

    pub(super) fn failed(&self, why: String) {
        let mut figures = lock(&self.figures);
        figures.status.failures += 1;
        figures.status.failing = Some(why);
        self.failing.store(true, Ordering::Relaxed);
        self.first_change.send_modify(|_| {});
        self.last_news.send_modify(|_| {});
    }

    pub(super) fn lost(&self, entries: u64) {
        lock(&self.figures).status.journal_lost += entries;
    }
}
