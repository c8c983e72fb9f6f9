//! The log as followers read it: pages of whole revisions, at once or as soon as there is something new.

use super::Registry;
use super::store::{ChangesQuery, ChangesRead, Version};
use skyway_contract::{ChangeOperation, ChangesPage};
use skyway_planted::{self as planted, Bug};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::time::Duration;
use tokio::time::Instant;

/// The most changes that a page may be asked to have.
const LIMIT_MAX: u64 = 10_000;

/// What a follower asks for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Follow {
    /// Revisions after this one.
    pub after: u64,
    /// The epoch of that revision; the current one where none is given.
    pub epoch: Option<u64>,
    /// The most changes, except that a page has at least one whole revision.
    pub limit: Option<u64>,
    /// How long to wait where there is nothing new.
    pub wait: Duration,
    /// Which edge asks, where one does.
    pub edge: Option<String>,
}

impl Registry {
    /// A page of the log. With nothing new it waits as long as it is asked to, or until `ended`.
    ///
    /// # Errors
    /// When there is no such network, or what comes after the revision is no longer there: then the snapshot has
    /// all that holds.
    pub async fn changes(
        &self,
        network: &str,
        follow: &Follow,
        ended: impl Future<Output = ()> + Send,
    ) -> Result<ChangesPage, Refusal> {
        let deadline = Instant::now() + follow.wait.min(self.settings.wait_max);
        let limit = follow.limit.unwrap_or(self.settings.page_changes);
        let query = ChangesQuery {
            network: network.to_owned(),
            after: follow.after,
            changes: limit.clamp(1, LIMIT_MAX),
            bytes: self.settings.page_bytes,
        };
        let mut faults = Faults::default();
        faults.id("?edge", follow.edge.as_deref());
        faults.check(Code::ParameterInvalid, "query")?;
        let mut read = self.read_changes(&query, follow).await?;
        if let Some(edge) = &follow.edge {
            let epoch = read.identity.epoch;
            self.heard(network, edge, epoch, follow.after, self.clock.now());
        }
        if !read.changes.is_empty() || Instant::now() >= deadline {
            return Ok(page(network, follow.after, read));
        }
        let mut news = self.heads.listen(network, read.state.head);
        if *news.borrow_and_update() != read.state.head {
            // Something may have been told between the question and listening. It is asked for once: what was told
            // last may be behind what the store has, as long as a commit is under way or another process writes.
            read = self.read_changes(&query, follow).await?;
        }
        let mut ended = std::pin::pin!(ended);
        while read.changes.is_empty() && Instant::now() < deadline {
            let is_last = tokio::select! {
                // An error would mean that the registry is gone, and so would be the caller.
                _ = news.changed() => false,
                () = tokio::time::sleep_until(deadline) => true,
                () = &mut ended => true,
            };
            read = self.read_changes(&query, follow).await?;
            if is_last {
                break;
            }
        }
        Ok(page(network, follow.after, read))
    }

    async fn read_changes(
        &self,
        query: &ChangesQuery,
        follow: &Follow,
    ) -> Result<ChangesRead, Refusal> {
        let read = self.store.changes(query).await?;
        let read = read.ok_or_else(|| Refusal::not_found("network", &query.network))?;
        let (oldest, head) = (read.state.oldest, read.state.head);
        let after = query.after;
        let detail = match follow.epoch {
            Some(epoch) if epoch != read.identity.epoch => {
                let current = read.identity.epoch;
                format!("epoch {epoch} is over, this is epoch {current}; take the snapshot")
            }
            _ if after < oldest => {
                format!("changes are kept from revision {oldest} on; take the snapshot")
            }
            _ if after > head => {
                format!(
                    "revision {head} is the last, {after} is of another life; take the snapshot"
                )
            }
            _ => {
                // It may be of another process, or of a commit that is not remembered yet.
                let version = Version {
                    epoch: read.identity.epoch,
                    revision: head,
                };
                self.remember(&query.network, version).await;
                return Ok(read);
            }
        };
        Err(Refusal::new(Code::ChangesGone, detail).with_oldest_revision(oldest))
    }
}

fn page(network: &str, after: u64, read: ChangesRead) -> ChangesPage {
    let mut changes = read.changes;
    let revision = changes.last().map_or(after, |change| change.revision);
    if planted::is(Bug::SkipTombstone) {
        changes.retain(|change| change.operation != ChangeOperation::Delete);
    }
    let mut page = ChangesPage {
        registry_id: read.identity.registry_id,
        epoch: read.identity.epoch,
        network: network.to_owned(),
        after,
        revision,
        head: read.state.head,
        oldest: read.state.oldest,
        changes,
        checksum: String::new(),
    };
    page.checksum = page.digest();
    page
}
