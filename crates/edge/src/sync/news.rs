//! Telling the registry of flights and failures: in their order, in batches, and again until it has them.
//!
//! This is a task of its own beside that of the outbox: no zone waits for news, and no news for a zone.

use super::client::{ClientError, RegistryClient};
use super::task::Sync;
use crate::writer::commands::{Command, NewsOrder};
use skyway_contract::{EdgeNews, NewsTaken};
use std::time::Duration;

/// The most entries in one batch.
const BATCH_MAX: usize = 500;

impl<C: RegistryClient> Sync<C> {
    /// Sends what waits, for ever.
    pub(super) async fn tell_news(&self) {
        let mut pace = self.pace(2);
        let mut turns = self.contact().turns.subscribe();
        let mut stored = self.edge.store.health().last_news();
        let mut most = BATCH_MAX;
        loop {
            // Seen from here on, so that what happens meanwhile wakes.
            turns.mark_unchanged();
            stored.mark_unchanged();
            let Some((batch, last)) = self.next_news(most) else {
                // Both live as long as the edge.
                tokio::select! {
                    _ = turns.changed() => {}
                    _ = stored.changed() => {}
                }
                continue;
            };
            match self.client.news(&batch).await {
                Ok(NewsTaken { through }) if through >= batch.news[0].number => {
                    self.settle_news(NewsOrder::Taken {
                        // What was not sent is not there, whatever the registry says.
                        through: through.min(last),
                    })
                    .await;
                    most = BATCH_MAX;
                    pace.succeeded();
                }
                Ok(NewsTaken { through }) => {
                    tracing::warn!(through, "the registry does not take the news of this edge");
                    self.pause(pace.failed()).await;
                }
                Err(error) if !is_refused(&error) => {
                    self.contact().failed(error.reason());
                    tracing::debug!(%error, "the registry was not told the news");
                    self.pause(pace.failed().max(retry_after(&error))).await;
                }
                // One of them: the others are told without it.
                Err(_) if batch.news.len() > 1 => most = batch.news.len() / 2,
                Err(error) => {
                    self.contact().news_refused();
                    tracing::error!(%error, number = last, "the registry will not take news of this edge");
                    self.settle_news(NewsOrder::Refused { number: last }).await;
                    most = BATCH_MAX;
                }
            }
        }
    }

    /// The next news that may be told, and the number of the last of them: a crash must not forget what others know.
    fn next_news(&self, most: usize) -> Option<(EdgeNews, u64)> {
        let snapshot = self.edge.snapshot();
        let is_followed = snapshot.registry.is_some() && self.contact().is_ours();
        let through = self.edge.store.news_through().filter(|_| is_followed)?;
        let entries = snapshot.news.between(0..=through).take(most);
        let news: Vec<_> = entries.map(|entry| (**entry).clone()).collect();
        let last = news.last()?.number;
        let lineage = self.edge.lineage;
        Some((EdgeNews { lineage, news }, last))
    }

    async fn settle_news(&self, order: NewsOrder) {
        if let Err(refusal) = self.edge.command(Command::News(order)).await {
            // They stay, and are answered the same when they are sent again.
            tracing::warn!(%refusal, "what the registry has taken could not be noted");
            self.pause(Duration::from_secs(1)).await;
        }
    }
}

/// Whether the registry will answer the same however often it is asked.
pub(super) fn is_refused(error: &ClientError) -> bool {
    let ClientError::Refused { status, .. } = error else {
        return false;
    };
    matches!(status, 400 | 413 | 415 | 422)
}

/// How long the registry wants to be left alone.
pub(super) fn retry_after(error: &ClientError) -> Duration {
    let ClientError::Refused { retry_after_s, .. } = error else {
        return Duration::ZERO;
    };
    Duration::from_secs(retry_after_s.unwrap_or_default().into())
}
