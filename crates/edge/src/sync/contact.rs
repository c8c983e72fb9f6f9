//! How current the edge is: when it last had all that the registry has, and what went wrong since.

use super::client::ClientError;
use crate::locks::lock;
use arc_swap::ArcSwapOption;
use jiff::SignedDuration;
use serde::Serialize;
use skyway_contract::{self as wire, Nack};
use skyway_service::clock::{Clock, Stopwatch};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::watch;

/// How following the registry stands: counts and bounds, no places.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SyncStatus {
    /// The registry that is followed.
    pub registry_id: Option<String>,
    /// Changes that the registry has yet to be told.
    pub outbox: usize,
    /// How long the oldest of them has waited, in seconds.
    pub outbox_age_s: f64,
    /// Changes that the registry has taken.
    pub forwarded: u64,
    /// Changes that the registry will not take.
    pub forwards_refused: u64,
    /// News of flights and failures that the registry has yet to be told.
    pub news: usize,
    /// News that were forgotten untold, as there were too many, or the registry will not take them.
    pub news_lost: u64,
    /// Positions of drones that the registry has yet to be told.
    pub positions: usize,
    /// Positions that were left out, as the registry did not take them in time.
    pub positions_left_out: u64,
    /// What the registry said and was not taken over.
    pub nacks: u64,
    /// The last of these, since something was taken over.
    pub last_nack: Option<Nack>,
    /// Questions to the registry that failed, by reason.
    pub failures: BTreeMap<&'static str, u64>,
    /// Times that following began anew after a defect.
    pub restarts: u64,
}

/// What is known of the contact with the registry.
#[derive(Debug)]
pub(crate) struct Contact {
    start: Stopwatch,
    /// Since the edge last had all that the registry had.
    current: ArcSwapOption<Stopwatch>,
    /// Whether what answers is the registry that is followed, as far as is known.
    is_ours: AtomicBool,
    is_lost: AtomicBool,
    /// How often the log was read to its end.
    times_read: AtomicU64,
    nacks: AtomicU64,
    forwarded: AtomicU64,
    forwards_refused: AtomicU64,
    news_refused: AtomicU64,
    restarts: AtomicU64,
    told: Mutex<Told>,
    /// Counts what was read of the registry, to wake those who wait for it.
    pub(super) turns: watch::Sender<u64>,
}

#[derive(Debug, Default)]
struct Told {
    last_nack: Option<Nack>,
    failures: BTreeMap<&'static str, u64>,
    /// The code or reason of the last failure, since something was taken over.
    last_failure: Option<String>,
}

impl Contact {
    pub(crate) fn new(clock: &Clock) -> Self {
        Self {
            start: clock.stopwatch(),
            current: ArcSwapOption::empty(),
            is_ours: AtomicBool::new(false),
            is_lost: AtomicBool::new(false),
            times_read: AtomicU64::new(0),
            nacks: AtomicU64::new(0),
            forwarded: AtomicU64::new(0),
            forwards_refused: AtomicU64::new(0),
            news_refused: AtomicU64::new(0),
            restarts: AtomicU64::new(0),
            told: Mutex::default(),
            turns: watch::Sender::new(0),
        }
    }

    /// How long ago the edge had all that the registry had; none where it never did since the start.
    pub(crate) fn age(&self) -> Option<Duration> {
        let current = self.current.load();
        current.as_ref().map(|stopwatch| stopwatch.elapsed())
    }

    /// How current an edge is that follows a registry and has read it once.
    pub(crate) fn freshness(
        &self,
        stale_after: SignedDuration,
        degraded_after: SignedDuration,
    ) -> wire::Freshness {
        match self.unheard() {
            unheard if unheard >= degraded_after => wire::Freshness::Degraded,
            // Not heard since the start: what has changed meanwhile is unknown.
            unheard if unheard >= stale_after || self.age().is_none() => wire::Freshness::Stale,
            _ => wire::Freshness::Fresh,
        }
    }

    /// How long the edge has not had all that the registry had, at least since the start.
    pub(super) fn unheard(&self) -> SignedDuration {
        let unheard = self.age().unwrap_or_else(|| self.start.elapsed());
        SignedDuration::try_from(unheard).unwrap_or(SignedDuration::MAX)
    }

    /// All that the registry has is in service; true where it had been lost.
    pub(super) fn is_current(&self, clock: &Clock) -> bool {
        self.current.store(Some(Arc::new(clock.stopwatch())));
        self.times_read.fetch_add(1, Ordering::Relaxed);
        self.is_lost.swap(false, Ordering::Relaxed)
    }

    /// How often all that the registry had was in service when it was read.
    pub(super) fn times_read(&self) -> u64 {
        self.times_read.load(Ordering::Relaxed)
    }

    /// Something of the registry was taken over, or there was nothing new; true where that had failed before.
    pub(super) fn moved(&self) -> bool {
        self.is_ours.store(true, Ordering::Relaxed);
        let mut told = lock(&self.told);
        told.last_nack = None;
        let had_failed = told.last_failure.take().is_some();
        drop(told);
        self.turn();
        had_failed
    }

    fn turn(&self) {
        self.turns
            .send_modify(|turns| *turns = turns.wrapping_add(1));
    }

    /// Notes that answers have become stale; true where they had not been.
    pub(super) fn lose(&self) -> bool {
        !self.is_lost.swap(true, Ordering::Relaxed)
    }

    pub(super) fn is_lost(&self) -> bool {
        self.is_lost.load(Ordering::Relaxed)
    }

    /// Whether changes may be told to what answers there.
    pub(super) fn is_ours(&self) -> bool {
        self.is_ours.load(Ordering::Relaxed)
    }

    /// What answers there is another registry.
    pub(super) fn estrange(&self) {
        self.is_ours.store(false, Ordering::Relaxed);
    }

    /// Notes what was not taken over; true where the same was not noted just before.
    pub(super) fn refused(&self, nack: &Nack) -> bool {
        self.nacks.fetch_add(1, Ordering::Relaxed);
        let mut told = lock(&self.told);
        let is_new = told.last_nack.as_ref() != Some(nack);
        told.last_nack = Some(nack.clone());
        is_new
    }

    pub(super) fn last_nack(&self) -> Option<Nack> {
        lock(&self.told).last_nack.clone()
    }

    pub(super) fn failed(&self, reason: &'static str) {
        *lock(&self.told).failures.entry(reason).or_default() += 1;
    }

    /// Notes why a question has no answer; true where the one before had another reason, or had an answer.
    pub(super) fn failed_anew(&self, error: &ClientError) -> bool {
        let what = match error {
            ClientError::Refused { code, .. } => code.as_str(),
            error => error.reason(),
        };
        let mut told = lock(&self.told);
        let is_new = told.last_failure.as_deref() != Some(what);
        told.last_failure = Some(what.to_owned());
        is_new
    }

    pub(super) fn forwarded(&self, was_taken: bool) {
        let counter = match was_taken {
            true => &self.forwarded,
            false => &self.forwards_refused,
        };
        counter.fetch_add(1, Ordering::Relaxed);
    }

    /// The registry will never take one of the news.
    pub(super) fn news_refused(&self) {
        self.news_refused.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn restarted(&self) {
        self.restarts.fetch_add(1, Ordering::Relaxed);
    }

    /// What is counted, without what the snapshot says.
    pub(crate) fn status(&self) -> SyncStatus {
        let told = lock(&self.told);
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        SyncStatus {
            forwarded: count(&self.forwarded),
            forwards_refused: count(&self.forwards_refused),
            news_lost: count(&self.news_refused),
            nacks: count(&self.nacks),
            last_nack: told.last_nack.clone(),
            failures: told.failures.clone(),
            restarts: count(&self.restarts),
            ..SyncStatus::default()
        }
    }
}
