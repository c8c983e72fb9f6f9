//! Once a second: whether answers have become stale, and what the registry is to hear of this edge.

use super::client::RegistryClient;
use super::task::Sync;
use crate::wire::{EdgeReport, EventKind};
use jiff::SignedDuration;
use serde_json::json;
use std::time::Duration;

/// How often the edge looks.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// After how many looks it reports at the latest: the answer names keys that were revoked meanwhile.
const REPORT_EVERY: u32 = 10;

impl<C: RegistryClient> Sync<C> {
    /// Notices when answers become stale, and tells the registry how far the edge is.
    pub(super) async fn look(&self) {
        let mut told: Option<EdgeReport> = None;
        let mut looks = 0;
        loop {
            self.pause(LOOK_EVERY).await;
            self.notice_loss();
            let snapshot = self.edge.snapshot();
            let Some(cursor) = &snapshot.registry else {
                continue;
            };
            let report = EdgeReport {
                epoch: cursor.epoch,
                revision: cursor.revision,
                nack: self.contact().last_nack(),
                url: self.settings.advertise.clone(),
            };
            let is_heard = self.contact().is_ours() && !self.contact().is_lost();
            looks += 1;
            let is_told = told.as_ref() == Some(&report) && looks < REPORT_EVERY;
            if is_told || !is_heard {
                continue;
            }
            match self.client.report(&report).await {
                Ok(noted) => {
                    (told, looks) = (Some(report), 0);
                    self.edge.revoke_pack_keys(&noted.revoked_keys);
                }
                Err(error) => {
                    tracing::debug!(%error, "the registry was not told how far the edge is")
                }
            }
        }
    }

    fn notice_loss(&self) {
        let contact = self.contact();
        let age = contact
            .age()
            .and_then(|age| SignedDuration::try_from(age).ok());
        let is_stale = age.is_some_and(|age| age >= self.edge.settings.stale_after);
        if is_stale && contact.lose() {
            tracing::warn!("the registry is not heard: answers are stale");
            let age_s = age.map(|age| age.as_secs_f64());
            self.tell(EventKind::RegistryLost, json!({"age_s": age_s}));
        }
    }
}
