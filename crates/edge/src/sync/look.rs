//! Once a second: whether answers have become stale, what the registry is to hear of this edge, and what it works out that the
//! edge pulls.

use super::client::RegistryClient;
use super::task::Sync;
use serde_json::json;
use skyway_contract::{EdgeReport, EventKind};
use std::time::Duration;

/// How often the edge looks.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// After how many looks it reports at the latest: the answer names keys that were revoked meanwhile.
const REPORT_EVERY: u32 = 10;
/// After how many looks the failure rates are pulled anew: they are of days.
const PULL_EVERY: u32 = 600;
/// And after how many where they could not be.
const PULL_AGAIN: u32 = 30;

impl<C: RegistryClient> Sync<C> {
    /// Notices when answers become stale, and tells the registry how far the edge is.
    pub(super) async fn look(&self) {
        let mut told: Option<EdgeReport> = None;
        let mut looks = 0;
        let mut pull_in = 0;
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
            if is_heard && pull_in == 0 {
                pull_in = self.pull_failure_rates().await;
            }
            pull_in = pull_in.saturating_sub(1);
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

    /// Pulls how often what fails; tells after how many looks to do so again.
    async fn pull_failure_rates(&self) -> u32 {
        match self.client.statistics().await {
            Ok(statistics) => {
                self.edge.keep_failure_rates(statistics);
                PULL_EVERY
            }
            Err(error) => {
                tracing::debug!(%error, "the registry has not told how often what fails");
                PULL_AGAIN
            }
        }
    }

    fn notice_loss(&self) {
        let contact = self.contact();
        let unheard = contact.unheard();
        if unheard >= self.edge.settings.stale_after && contact.lose() {
            tracing::warn!("the registry is not heard: answers are stale");
            let age_s = unheard.as_secs_f64();
            self.tell(EventKind::RegistryLost, json!({"age_s": age_s}));
        }
    }
}
