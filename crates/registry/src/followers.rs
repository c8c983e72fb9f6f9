//! Who follows, how far they are, and what they refused last.
//!
//! Every request of a follower is noted in memory; the store gets the notes now and then, all at once, so that a
//! hundred edges that wait cost no commits. What a process that ends has not stored yet, edges tell again.

use super::Registry;
use super::store::{EdgeHeard, StoreError};
use jiff::Timestamp;
use skyway_contract::{EdgeReport, EdgeStatus, EdgeStatuses};
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The most edges noted at once; further ones wait until some of these are silent.
const NOTED_MAX: usize = 10_000;
/// An edge that has been silent for so long is known from the store alone, in milliseconds.
const NOTED_MS: i64 = 3_600_000;
/// One that has been silent for so long is forgotten, in milliseconds.
const KNOWN_MS: i64 = 30 * 86_400_000;
/// The longest code and object of a refusal, in bytes.
const WORD_BYTES_MAX: usize = 256;
/// The longest reason of a refusal, in bytes.
const REASON_BYTES_MAX: usize = 1_000;
/// The longest address of an edge, in bytes.
const URL_BYTES_MAX: usize = 500;

type Key = (String, String);

/// What was heard since the start.
#[derive(Debug, Default)]
pub(super) struct Followers(Mutex<Noted>);

#[derive(Debug, Default)]
struct Noted {
    heard: BTreeMap<Key, EdgeHeard>,
    /// Those that the store has not got yet.
    fresh: BTreeSet<Key>,
}

impl Followers {
    fn lock(&self) -> MutexGuard<'_, Noted> {
        // Both maps are whole after every call, so a panic elsewhere cannot spoil them.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, heard: EdgeHeard) {
        let mut noted = self.lock();
        let key = (heard.network.clone(), heard.edge.clone());
        if noted.heard.len() >= NOTED_MAX && !noted.heard.contains_key(&key) {
            return;
        }
        noted.fresh.insert(key.clone());
        noted.heard.insert(key, heard);
    }

    fn last(&self, network: &str, edge: &str) -> Option<EdgeHeard> {
        let key = (network.to_owned(), edge.to_owned());
        self.lock().heard.get(&key).cloned()
    }

    fn take_fresh(&self) -> Vec<EdgeHeard> {
        let mut noted = self.lock();
        let fresh = std::mem::take(&mut noted.fresh);
        let heard = fresh.iter().filter_map(|key| noted.heard.get(key));
        heard.cloned().collect()
    }

    /// Leaves those that the store has, and that were not heard since, to it.
    fn leave_silent(&self, since_ms: i64) {
        let noted = &mut *self.lock();
        let fresh = &noted.fresh;
        noted
            .heard
            .retain(|key, edge| edge.heard_ms >= since_ms || fresh.contains(key));
    }

    fn put_back(&self, heard: &[EdgeHeard]) {
        let keys = heard.iter();
        let keys = keys.map(|edge| (edge.network.clone(), edge.edge.clone()));
        self.lock().fresh.extend(keys);
    }

    pub(super) fn count(&self) -> usize {
        self.lock().heard.len()
    }
}

impl Registry {
    /// Notes that an edge has asked for what comes after a revision.
    pub(super) fn heard(
        &self,
        network: &str,
        edge: &str,
        epoch: u64,
        revision: u64,
        now: Timestamp,
    ) {
        let before = self.followers.last(network, edge);
        let (nack, url) = before.map_or((None, None), |before| (before.nack, before.url));
        // What it refused is settled once it has gone beyond it.
        let nack = nack.filter(|nack| nack.revision > revision);
        self.followers.note(EdgeHeard {
            network: network.to_owned(),
            edge: edge.to_owned(),
            epoch,
            revision,
            heard_ms: now.as_millisecond(),
            nack,
            url,
        });
    }

    /// Notes what an edge tells of itself.
    ///
    /// # Errors
    /// When there is no such network, or the report is not valid.
    pub async fn report_edge(
        &self,
        network: &str,
        edge: &str,
        report: EdgeReport,
    ) -> Result<(), Refusal> {
        let mut faults = Faults::default();
        faults.id("{id}", Some(edge));
        if let Some(nack) = &report.nack {
            faults.text("/nack/code", Some(&nack.code), WORD_BYTES_MAX);
            faults.text("/nack/object", nack.object.as_deref(), WORD_BYTES_MAX);
            faults.text("/nack/reason", Some(&nack.reason), REASON_BYTES_MAX);
        }
        faults.text("/url", report.url.as_deref(), URL_BYTES_MAX);
        if let Some(url) = &report.url
            && !(url.starts_with("http://") || url.starts_with("https://"))
        {
            let message = format!("'{url}' is no address of an edge");
            let hint = "write it like https://edge.example:8080".to_owned();
            faults.add("url_invalid", "/url", message, Some(hint));
        }
        faults.check(Code::BodyInvalid, "report")?;
        self.state(network).await?;
        if let Some(nack) = &report.nack {
            let (revision, code) = (nack.revision, &nack.code);
            tracing::warn!(network, edge, revision, code, "an edge refuses a revision");
        }
        self.followers.note(EdgeHeard {
            network: network.to_owned(),
            edge: edge.to_owned(),
            epoch: report.epoch,
            revision: report.revision,
            heard_ms: self.clock.now().as_millisecond(),
            nack: report.nack,
            url: Some(report.url.unwrap_or_default()),
        });
        Ok(())
    }

    /// Who follows, by network and id.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn edges(&self) -> Result<EdgeStatuses, Refusal> {
        let identity = self.store.identity().await?;
        let heads: BTreeMap<String, u64> = self
            .store
            .networks()
            .await?
            .into_iter()
            .map(|state| (state.id, state.head))
            .collect();
        let heard = self.heard_edges().await?;
        let now_ms = self.clock.now().as_millisecond();
        let edges = heard.into_values().map(|edge| EdgeStatus {
            behind: heads
                .get(&edge.network)
                .map_or(0, |head| head.saturating_sub(edge.revision)),
            age_s: now_ms.saturating_sub(edge.heard_ms).max(0) as f64 / 1e3,
            id: edge.edge,
            network: edge.network,
            epoch: edge.epoch,
            revision: edge.revision,
            nack: edge.nack,
            url: edge.url.filter(|url| !url.is_empty()),
        });
        Ok(EdgeStatuses {
            registry_id: identity.registry_id,
            epoch: identity.epoch,
            edges: edges.collect(),
        })
    }

    /// The edges of a network that were heard, by id, with what each has said last.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn edges_of(&self, network: &str) -> Result<Vec<EdgeHeard>, Refusal> {
        let heard = self.heard_edges().await?.into_values();
        Ok(heard.filter(|edge| edge.network == network).collect())
    }

    /// All that were heard, here or by other processes.
    async fn heard_edges(&self) -> Result<BTreeMap<Key, EdgeHeard>, StoreError> {
        let mut heard: BTreeMap<Key, EdgeHeard> = BTreeMap::new();
        let noted: Vec<EdgeHeard> = self.followers.lock().heard.values().cloned().collect();
        for mut edge in self.store.edges().await?.into_iter().chain(noted) {
            let key = (edge.network.clone(), edge.edge.clone());
            let known = heard.get(&key);
            if known.is_some_and(|known| known.heard_ms > edge.heard_ms) {
                continue;
            }
            edge.url = edge
                .url
                .or_else(|| known.and_then(|known| known.url.clone()));
            heard.insert(key, edge);
        }
        Ok(heard)
    }

    /// Gives the store what it has not got yet.
    pub(super) async fn keep_followers(&self) -> Result<(), StoreError> {
        let fresh = self.followers.take_fresh();
        let now_ms = self.clock.now().as_millisecond();
        if !fresh.is_empty() {
            let kept = self.store.keep_edges(&fresh, now_ms - KNOWN_MS).await;
            if kept.is_err() {
                self.followers.put_back(&fresh);
                return kept;
            }
        }
        self.followers.leave_silent(now_ms - NOTED_MS);
        Ok(())
    }
}
