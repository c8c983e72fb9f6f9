//! What became of messages, written together: what comes while a write is under way waits for the next one.

use skyway_registry::documents::{Documents, Settlement};
use skyway_service::refusal::{Code, Refusal};
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::oneshot;

/// Notes of a sender. There are at most as many at a time as it has messages under way, and one more.
#[derive(Debug)]
pub(super) struct Notes {
    documents: Arc<dyn Documents>,
    waiting: Mutex<Vec<Waiting>>,
    /// Of who writes, what waits for it.
    turn: tokio::sync::Mutex<()>,
}

#[derive(Debug)]
struct Waiting {
    settlement: Settlement,
    is_noted: oneshot::Sender<bool>,
}

impl Notes {
    pub(super) fn new(documents: Arc<dyn Documents>) -> Self {
        Self {
            documents,
            waiting: Mutex::default(),
            turn: tokio::sync::Mutex::default(),
        }
    }

    /// Notes what became of a message: it is written once this is done. Tells whether it was: not where the message has moved
    /// since.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(super) async fn note(&self, settlement: Settlement) -> Result<bool, Refusal> {
        let (is_noted, mut noted) = oneshot::channel();
        self.waiting().push(Waiting {
            settlement,
            is_noted,
        });
        let _turn = self.turn.lock().await;
        let together = mem::take(&mut *self.waiting());
        let (settled, waiting): (Vec<Settlement>, Vec<_>) = together
            .into_iter()
            .map(|one| (one.settlement, one.is_noted))
            .unzip();
        if !settled.is_empty() {
            let noted = self.documents.settle_messages(&settled).await?;
            for (one, was_noted) in waiting.into_iter().zip(noted) {
                // Who has gone does not ask.
                let _ = one.send(was_noted);
            }
        }
        // A write before this turn has taken it along; where that failed, there is no word of it.
        noted.try_recv().map_err(|_| {
            let detail = "what became of a message was not written with others";
            Refusal::new(Code::StoreUnavailable, detail)
        })
    }

    fn waiting(&self) -> MutexGuard<'_, Vec<Waiting>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
