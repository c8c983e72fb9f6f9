//! What became of messages, written together: what comes while a write is under way waits for the next one.

use crate::refusal::{Code, Refusal};
use crate::registry::documents::{Documents, Message};
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
    message: Message,
    is_noted: oneshot::Sender<()>,
}

impl Notes {
    pub(super) fn new(documents: Arc<dyn Documents>) -> Self {
        Self {
            documents,
            waiting: Mutex::default(),
            turn: tokio::sync::Mutex::default(),
        }
    }

    /// Notes what became of a message: it is written once this is done.
    ///
    /// # Errors
    /// When the store does not answer.
    pub(super) async fn note(&self, message: Message) -> Result<(), Refusal> {
        let (is_noted, mut noted) = oneshot::channel();
        self.waiting().push(Waiting { message, is_noted });
        let _turn = self.turn.lock().await;
        let together = mem::take(&mut *self.waiting());
        let (messages, waiting): (Vec<Message>, Vec<_>) = together
            .into_iter()
            .map(|one| (one.message, one.is_noted))
            .unzip();
        if !messages.is_empty() {
            self.documents.settle_messages(&messages).await?;
            for one in waiting {
                // Who has gone does not ask.
                let _ = one.send(());
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
