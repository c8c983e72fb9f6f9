//! Networks put together from the log: the last whole one, and the patches after it.

use super::Registry;
use super::store::{NetworkParts, NetworkState, StoreError, Version};
use skyway_contract::{ChangeOperation, LoggedChange, NetworkPatch};
use skyway_engine::network::{NetworkDraft, Topology};
use skyway_formats::{fingerprint, patch_network, read_network, write_network};
use skyway_service::refusal::{Code, Refusal};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::runtime::{Handle, RuntimeFlavor};

/// Networks kept put together; the one asked for least recently goes first.
const KEPT: usize = 8;

/// A network at a version.
#[derive(Debug)]
pub(super) struct Composed {
    pub(super) version: Version,
    pub(super) draft: NetworkDraft,
    /// The network in the native format.
    pub(super) text: Arc<str>,
    pub(super) topology: Arc<Topology>,
}

/// A network that is to be written, as it will be put together once it is.
#[derive(Clone, Debug)]
pub(super) struct Made {
    pub(super) draft: NetworkDraft,
    pub(super) text: Arc<str>,
    pub(super) topology: Arc<Topology>,
}

impl Made {
    fn at(self, version: Version) -> Composed {
        let Self {
            draft,
            text,
            topology,
        } = self;
        Composed {
            version,
            draft,
            text,
            topology,
        }
    }
}

/// The networks asked for lately.
#[derive(Debug, Default)]
pub(super) struct Topologies {
    kept: Mutex<VecDeque<(String, Arc<Composed>)>>,
    /// One at a time: the next caller finds it made.
    making: tokio::sync::Mutex<()>,
}

impl Topologies {
    fn get(&self, network: &str, version: Version) -> Option<Arc<Composed>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it =
            |(id, composed): &(String, Arc<Composed>)| id == network && composed.version == version;
        let place = kept.iter().position(is_it)?;
        let found = kept.remove(place)?;
        let composed = found.1.clone();
        kept.push_back(found);
        Some(composed)
    }

    fn put(&self, network: &str, composed: &Arc<Composed>) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push_back((network.to_owned(), composed.clone()));
        if kept.len() > KEPT {
            kept.pop_front();
        }
    }
}

impl Registry {
    /// Keeps a network that has just been written: no reader has to put it together from the log.
    pub(super) fn keep_made(&self, network: &str, made: Made, version: Version) {
        self.topologies.put(network, &Arc::new(made.at(version)));
    }

    /// How a network stands.
    pub(super) async fn state(&self, network: &str) -> Result<NetworkState, Refusal> {
        let found = self.store.network(network).await?;
        found.ok_or_else(|| Refusal::not_found("network", network))
    }

    /// The nodes and segments of a network as it is now.
    ///
    /// # Errors
    /// When there is none, or the store does not answer.
    pub async fn topology(&self, network: &str) -> Result<Arc<Topology>, Refusal> {
        let (_, composed) = self.composed(network).await?;
        Ok(composed.topology.clone())
    }

    /// A network as it is now.
    pub(super) async fn composed(
        &self,
        network: &str,
    ) -> Result<(NetworkState, Arc<Composed>), Refusal> {
        let state = self.state(network).await?;
        if let Some(composed) = self.topologies.get(network, state.topology) {
            return Ok((state, composed));
        }
        let _turn = self.topologies.making.lock().await;
        self.compose(network, None).await
    }

    /// A network as it was at a revision that is kept.
    pub(super) async fn composed_at(
        &self,
        network: &str,
        revision: u64,
    ) -> Result<Arc<Composed>, Refusal> {
        let state = self.state(network).await?;
        if state.topology.revision <= revision
            && let Some(composed) = self.topologies.get(network, state.topology)
        {
            return Ok(composed);
        }
        let _turn = self.topologies.making.lock().await;
        let (_, composed) = self.compose(network, Some(revision)).await?;
        Ok(composed)
    }

    async fn compose(
        &self,
        network: &str,
        at: Option<u64>,
    ) -> Result<(NetworkState, Arc<Composed>), Refusal> {
        let read = self.store.network_parts(network, at).await?;
        let NetworkParts { state, parts } =
            read.ok_or_else(|| Refusal::not_found("network", network))?;
        if parts.is_empty() {
            let detail = "the network as it was then is no longer kept; begin anew";
            let gone = Refusal::new(Code::ChangesGone, detail);
            return Err(gone.with_oldest_revision(state.oldest));
        }
        let version = parts.last().map_or(state.topology, version_of);
        if let Some(composed) = self.topologies.get(network, version) {
            return Ok((state, composed));
        }
        let composed = aside(move || put_together(&parts)).await??;
        let composed = Arc::new(composed);
        self.topologies.put(network, &composed);
        Ok((state, composed))
    }
}

/// Does what may take long where blocking is allowed; at once where the runtime has one thread, so that all that
/// happens there has one order.
pub(super) async fn aside<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Refusal> {
    if Handle::current().runtime_flavor() == RuntimeFlavor::CurrentThread {
        return Ok(work());
    }
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|error| Refusal::new(Code::Internal, format!("a computation failed: {error}")))
}

pub(super) fn version_of(change: &LoggedChange) -> Version {
    Version {
        epoch: change.epoch,
        revision: change.revision,
    }
}

/// What cannot be put together was put in as something that could be: damage.
fn put_together(parts: &[LoggedChange]) -> Result<Composed, StoreError> {
    let damaged = |change: &LoggedChange, what: &str| StoreError::Damaged {
        message: format!("the network at revision {}: {what}", change.revision),
    };
    let Some((whole, patches)) = parts.split_first() else {
        return Err(StoreError::Damaged {
            message: "a network without a beginning".to_owned(),
        });
    };
    let text = whole.body.as_deref().unwrap_or_default();
    let mut draft = read_network(text).map_err(|_| damaged(whole, "it is no network"))?;
    let mut last = whole;
    for change in patches {
        if change.operation != ChangeOperation::Patch {
            return Err(damaged(change, "it is no patch"));
        }
        let patch: NetworkPatch = serde_json::from_str(change.body.as_deref().unwrap_or_default())
            .map_err(|error| damaged(change, &error.to_string()))?;
        draft = patch_network(&draft, &patch).map_err(|_| damaged(change, "it does not fit"))?;
        last = change;
    }
    let text = match patches.is_empty() {
        true => text.to_owned(),
        false => write_network(&draft),
    };
    let topology = Topology::build(draft.clone(), fingerprint(&[&text]));
    let topology = topology.map_err(|_| damaged(last, "it cannot be flown"))?;
    let made = Made {
        draft,
        text: text.into(),
        topology: Arc::new(topology),
    };
    Ok(made.at(version_of(last)))
}
