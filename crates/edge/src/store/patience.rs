//! How long the storekeeper waits: for something to store, and for its file.

use super::file::StoreFault;
use super::keeper::{Shared, Waiting};
use std::pin::pin;
use std::time::Duration;

/// So long entries of the journal are gathered before they are written.
const GATHER: Duration = Duration::from_millis(20);

/// Until there is something to store, or time to try again.
pub(super) async fn sleep(shared: &Shared, pause: Duration) {
    loop {
        let (has_work, has_journal) = {
            let inbox = shared.inbox();
            (inbox.has_work(), !inbox.journal.is_empty())
        };
        let longest = match (has_work, shared.health.is_failing(), has_journal) {
            (true, ..) => return,
            (false, true, _) => pause,
            (false, false, true) => GATHER,
            (false, false, false) => {
                shared.wake.notified().await;
                continue;
            }
        };
        tokio::select! {
            // In one order, so that a simulation is the same every time.
            biased;
            () = shared.wake.notified() => {}
            () = tokio::time::sleep(longest) => return,
        }
    }
}

/// Waits for the file. When it takes too long, the caller is told that nothing is stored.
pub(super) async fn patiently<T>(
    shared: &Shared,
    waiting: &mut Vec<Waiting>,
    work: impl Future<Output = Result<T, StoreFault>>,
) -> Result<T, StoreFault> {
    let mut work = pin!(work);
    let mut patience = pin!(tokio::time::sleep(shared.patience));
    let mut is_late = false;
    loop {
        tokio::select! {
            biased;
            done = &mut work => return done,
            () = &mut patience, if !is_late => {
                is_late = true;
                let message = format!("nothing was heard of a write for {:?}", shared.patience);
                tracing::error!(message, "the store fails; what is in force stays so in memory");
                shared.health.failed(StoreFault::Unavailable { message }.to_string());
                for waiting in waiting.drain(..) {
                    waiting.release(false);
                }
                shared.release_all(false);
            }
            () = shared.wake.notified(), if is_late => shared.release_all(false),
        }
    }
}
