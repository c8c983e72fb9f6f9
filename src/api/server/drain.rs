//! The drain: first the edge says that it is not ready, then it stops accepting, then connections close.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};

/// How far the drain is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Phase {
    /// Serving.
    Open,
    /// Connections finish what is in flight; streams end.
    Closing,
    /// What is still open is cut.
    Forced,
}

/// The drain of one listener. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Drain {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    begun: CancellationToken,
    closing: CancellationToken,
    forced: CancellationToken,
    // Beside the tokens, because connections look at it whenever they are polled, and asking a token takes a lock.
    phase: AtomicU8,
}

impl Drain {
    /// A drain that has not begun.
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins: the edge is no longer ready, and closes after the delay of the configuration.
    pub fn begin(&self) {
        self.shared.begun.cancel();
    }

    /// Whether it has begun; readiness is its opposite.
    pub fn has_begun(&self) -> bool {
        self.shared.begun.is_cancelled()
    }

    /// Waits until it has begun.
    pub async fn begun(&self) {
        self.shared.begun.cancelled().await;
    }

    pub(crate) fn phase(&self) -> Phase {
        match self.shared.phase.load(Ordering::Acquire) {
            0 => Phase::Open,
            1 => Phase::Closing,
            _ => Phase::Forced,
        }
    }

    pub(crate) fn close(&self) {
        self.shared.phase.store(1, Ordering::Release);
        self.shared.closing.cancel();
    }

    pub(crate) fn force(&self) {
        self.shared.phase.store(2, Ordering::Release);
        self.shared.forced.cancel();
    }

    /// Ready when the phase is past the one given.
    pub(crate) fn past(&self, phase: Phase) -> WaitForCancellationFutureOwned {
        let token = match phase {
            Phase::Open => &self.shared.closing,
            Phase::Closing | Phase::Forced => &self.shared.forced,
        };
        token.clone().cancelled_owned()
    }
}
