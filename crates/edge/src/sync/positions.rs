//! Telling the registry where drones are: batches that are at most a second old, one request at a time.

use super::client::{ClientError, RegistryClient};
use super::news::{is_refused, retry_after};
use super::task::Sync;
use std::sync::Arc;
use std::time::Duration;

/// So long positions are gathered before they are told.
const GATHERED_FOR: Duration = Duration::from_millis(500);
/// The most positions in one batch.
const BATCH_MAX: usize = 10_000;

impl<C: RegistryClient> Sync<C> {
    /// Sends what has been gathered, for ever.
    pub(super) async fn tell_positions(&self) {
        let mut pace = self.pace(4);
        let mut most = BATCH_MAX;
        loop {
            self.pause(GATHERED_FOR).await;
            while self.contact().is_ours()
                && let Some(batch) = self.edge.positions.take(most)
            {
                let batch = Arc::new(batch);
                let told = self.client.positions(&batch).await;
                let Err(error) = told else {
                    pace.succeeded();
                    most = (2 * most).min(BATCH_MAX);
                    continue;
                };
                if is_too_large(&error) && batch.positions.len() > 1 {
                    most = batch.positions.len() / 2;
                    self.edge.positions.put_back(Arc::unwrap_or_clone(batch));
                    continue;
                }
                self.contact().failed(error.reason());
                if is_refused(&error) {
                    tracing::error!(%error, "the registry will not take positions of this edge");
                    self.edge.positions.give_up(&batch);
                    continue;
                }
                tracing::debug!(%error, "the registry was not told where drones are");
                self.edge.positions.put_back(Arc::unwrap_or_clone(batch));
                self.pause(pace.failed().max(retry_after(&error))).await;
            }
        }
    }
}

/// Whether the registry may well take less at once.
fn is_too_large(error: &ClientError) -> bool {
    matches!(error, ClientError::Refused { status: 413, .. })
}
