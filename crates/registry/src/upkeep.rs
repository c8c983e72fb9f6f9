//! What a registry does by itself: look for news of other processes, drop what is old, keep who follows.

use super::Registry;
use super::store::{Compaction, NetworkState};
use skyway_service::refusal::Refusal;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::time::{MissedTickBehavior, interval, timeout};
use tokio_util::sync::CancellationToken;

/// How often the store is asked for news that no notice has told.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// How often the store gets who follows.
const KEEP_EVERY: Duration = Duration::from_secs(5);
/// A store that takes longer to say that it is there is not.
const PATIENCE: Duration = Duration::from_secs(5);

impl Registry {
    /// Whether the store answers now. A probe that comes while another looks waits for one further
    /// look at most, so that a flood of probes is no flood of questions.
    pub async fn probe(&self) -> bool {
        let begun_before = self.probes.begun.load(Ordering::Relaxed);
        let _turn = self.probes.turn.lock().await;
        if self.probes.begun.load(Ordering::Relaxed) == begun_before {
            self.probes.begun.fetch_add(1, Ordering::Relaxed);
            let answered = timeout(PATIENCE, self.store.ping()).await;
            // That it answers again, the next look finds out: it asks for more.
            if !matches!(answered, Ok(Ok(()))) {
                self.noted(false);
            }
        }
        self.is_ready()
    }

    /// Does all of it until it is stopped; then keeps what is left and closes the store.
    pub async fn run(self: Arc<Self>, stop: CancellationToken) {
        let work = async {
            tokio::join!(
                self.look_for_news(),
                self.hear_hints(),
                self.keep_following(),
                self.drop_what_is_old(),
            );
        };
        tokio::select! {
            () = work => {}
            () = stop.cancelled() => {}
        }
        if let Err(error) = self.keep_followers().await {
            tracing::warn!(%error, "who follows is not kept");
        }
        self.store.close().await;
    }

    /// Other processes may write; and whether the store answers decides whether this one is ready.
    async fn look_for_news(&self) {
        let mut ticks = interval(LOOK_EVERY);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            self.look().await;
        }
    }

    async fn look(&self) {
        let answers = match timeout(PATIENCE, self.store.networks()).await {
            Ok(Ok(networks)) => {
                self.heads.tell_all(&networks);
                true
            }
            Ok(Err(error)) => {
                tracing::debug!(%error, "the store does not answer");
                false
            }
            Err(_) => false,
        };
        self.noted(answers);
    }

    /// Notes whether the store answers.
    fn noted(&self, answers: bool) {
        let answered = self.answers.swap(answers, Ordering::Relaxed);
        if answered != answers {
            tracing::warn!(answers, "the store");
        }
    }

    async fn hear_hints(&self) {
        loop {
            self.store.hint().await;
            self.look().await;
        }
    }

    async fn keep_following(&self) {
        let mut ticks = interval(KEEP_EVERY);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            if let Err(error) = self.keep_followers().await {
                tracing::debug!(%error, "who follows is not kept");
            }
        }
    }

    async fn drop_what_is_old(self: &Arc<Self>) {
        let mut ticks = interval(self.settings.compact_every);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            if let Err(refusal) = self.compact().await {
                tracing::warn!(%refusal, "old revisions are not dropped");
            }
        }
    }

    /// Lifts closures that are over, and drops revisions and answers that are no longer kept.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn compact(self: &Arc<Self>) -> Result<(), Refusal> {
        for state in self.store.networks().await? {
            self.lift_ended(&state).await?;
            self.compact_network(&state).await?;
        }
        let before = self.clock.now().checked_sub(self.settings.replies_age);
        let before_ms = before.map_or(i64::MIN, |before| before.as_millisecond());
        let bytes_max = self.settings.replies_bytes_max;
        self.store.forget_replies(before_ms, bytes_max).await?;
        Ok(())
    }

    async fn compact_network(&self, state: &NetworkState) -> Result<(), Refusal> {
        let oldest = state.head.saturating_sub(self.settings.revisions_kept);
        if oldest <= state.oldest {
            return Ok(());
        }
        let base = self.composed_at(&state.id, oldest).await?;
        let compaction = Compaction {
            network: state.id.clone(),
            oldest,
            base_revision: base.version.revision,
            base: base.text.to_string(),
        };
        self.store.compact(&compaction).await?;
        super::count(&self.counts.compactions);
        tracing::info!(network = state.id, oldest, "older revisions are dropped");
        Ok(())
    }
}
