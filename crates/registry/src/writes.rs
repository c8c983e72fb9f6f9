//! How a write is done: decided on what is there, committed only where that still holds, answered once.

use super::store::{
    Append, Appended, Expectation, Identity, KeptReply, MakeReply, NewChange, ReplyKey, StoreError,
    Version,
};
use super::topologies::{Made, aside};
use super::{Registry, count};
use serde_json::Value;
use skyway_contract::{NetworkPatch, ObjectKind, PublishedClosure, Weather, Written};
use skyway_planted::{self as planted, Bug};
use skyway_service::refusal::{Code, Refusal};
use std::sync::{Arc, PoisonError};

/// How often a write is decided anew because others got in between.
const DECISIONS: u32 = 16;
/// The longest idempotency key, in bytes.
const KEY_BYTES_MAX: usize = 256;

/// How something is to be written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// Who writes.
    pub subject: String,
    /// The idempotency key; without one every request is done.
    pub key: Option<String>,
    /// SHA-256 of the request in hexadecimal.
    pub fingerprint: String,
    /// Entity tags of the version it replaces, as in `If-Match`.
    pub if_match: Option<String>,
    /// The same checks and the same answer, without effect.
    pub validate_only: bool,
    /// For whom an edge writes: `ROLE:SUBJECT` of who made the change there.
    pub on_behalf_of: Option<String>,
}

impl WriteOptions {
    /// Who stands in the log: the subject, and before it for whom an edge has written.
    fn author(&self) -> String {
        match &self.on_behalf_of {
            Some(author) => format!("{author}@{}", self.subject),
            None => self.subject.clone(),
        }
    }
}

/// What is answered to a write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Whether the object is new.
    pub created: bool,
    /// Its version as an entity tag; none where it is gone or was only validated.
    pub etag: Option<String>,
    /// Its id.
    pub id: String,
    /// A `Written` as JSON, byte for byte what was answered before where the request is a repetition.
    pub body: String,
}

impl From<KeptReply> for Reply {
    fn from(kept: KeptReply) -> Self {
        Self {
            created: kept.created,
            etag: kept.etag,
            id: kept.id,
            body: kept.body,
        }
    }
}

/// What is to be written.
#[derive(Debug)]
pub(super) enum Intent {
    PutNetwork {
        text: Arc<str>,
    },
    PatchNetwork {
        patch: NetworkPatch,
    },
    PutZone {
        feature: Value,
        /// The id of the path; none for a new zone, which then has its own, or the one made for it.
        id: Option<String>,
        made: String,
    },
    PutClosure {
        closure: Box<PublishedClosure>,
        id: Option<String>,
        made: String,
    },
    PutWeather {
        weather: Weather,
    },
    Delete {
        kind: ObjectKind,
        id: String,
    },
}

/// A write that may be committed while what it was decided on holds.
#[derive(Debug)]
pub(super) struct Decision {
    /// Whether the network itself is new.
    pub(super) creates: bool,
    /// Whether the object is.
    pub(super) created: bool,
    /// The revision of the whole network that it was decided on, where all of it matters.
    pub(super) head: Option<u64>,
    pub(super) expects: Vec<Expectation>,
    pub(super) change: NewChange,
    /// What is lifted with it, in the same revision and before it.
    pub(super) lifts: Option<NewChange>,
    /// The object as it is understood, for the answer.
    pub(super) object: Option<Value>,
    /// The network that it makes, where it makes one.
    pub(super) network: Option<Made>,
}

impl Registry {
    /// Does a write.
    pub(super) async fn write(
        self: &Arc<Self>,
        network: &str,
        intent: Intent,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        let Some(key) = manner.key.as_deref().filter(|_| !manner.validate_only) else {
            return self.decide_and_commit(network, &intent, manner).await;
        };
        if key.is_empty() || key.len() > KEY_BYTES_MAX {
            let detail = format!("the idempotency key has to have 1 to {KEY_BYTES_MAX} bytes");
            return Err(Refusal::new(Code::ParameterInvalid, detail));
        }
        // Freed however this ends, also by being dropped at a deadline.
        let _running = self.begin(&manner.subject, key)?;
        if let Some((fingerprint, reply)) = self.store.reply(&manner.subject, key).await? {
            return repeated(&fingerprint, reply, manner);
        }
        self.decide_and_commit(network, &intent, manner).await
    }

    fn begin(self: &Arc<Self>, subject: &str, key: &str) -> Result<Running, Refusal> {
        let entry = (subject.to_owned(), key.to_owned());
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        if !running.insert(entry.clone()) {
            let detail = "the first request with this idempotency key is still being answered";
            return Err(Refusal::new(Code::IdempotencyInProgress, detail).retry_after_s(1));
        }
        Ok(Running {
            registry: self.clone(),
            entry,
        })
    }

    async fn decide_and_commit(
        self: &Arc<Self>,
        network: &str,
        intent: &Intent,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        for _ in 0..DECISIONS {
            let mut decision = self.decide(network, intent, manner).await?;
            let made = decision.network.take();
            if manner.validate_only {
                return self.validated(network, decision).await;
            }
            let append = self.append_of(network, decision, manner);
            match self.commit(append).await? {
                Appended::Done { reply, version } => {
                    if let Some(made) = made {
                        self.keep_made(network, made, version);
                    }
                    return Ok(reply.into());
                }
                Appended::Moved => count(&self.counts.moved),
                Appended::Repeated { fingerprint, reply } => {
                    return repeated(&fingerprint, reply, manner);
                }
                Appended::Bounded { kind, limit } => return Err(bounded(kind, limit)),
            }
        }
        Err(StoreError::Contended.into())
    }

    async fn decide(
        self: &Arc<Self>,
        network: &str,
        intent: &Intent,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        match intent {
            Intent::PutNetwork { text } => self.decide_network(network, text, manner).await,
            Intent::PatchNetwork { patch } => self.decide_patch(network, patch, manner).await,
            Intent::PutZone { feature, id, made } => {
                self.decide_zone(network, feature, id.as_deref(), made, manner)
                    .await
            }
            Intent::PutClosure { closure, id, made } => {
                self.decide_closure(network, closure, id.as_deref(), made, manner)
                    .await
            }
            Intent::PutWeather { weather } => self.decide_weather(network, weather, manner).await,
            Intent::Delete { kind, id } => self.decide_delete(network, *kind, id, manner).await,
        }
    }

    fn append_of(&self, network: &str, decision: Decision, manner: &WriteOptions) -> Append {
        let now = self.clock.now();
        let Decision {
            creates,
            created,
            head,
            expects,
            change,
            lifts,
            object,
            network: _,
        } = decision;
        let key = manner.key.as_ref().map(|key| ReplyKey {
            subject: manner.subject.clone(),
            key: key.clone(),
            fingerprint: manner.fingerprint.clone(),
            at_ms: now.as_millisecond(),
        });
        Append {
            network: network.to_owned(),
            creates: creates.then_some(self.settings.networks_max),
            subject: manner.author(),
            at: now.to_string(),
            head,
            expects,
            reply: make_reply(network, created, &change, object),
            changes: lifts.into_iter().chain([change]).collect(),
            zones_max: self.settings.zones_max,
            closures_max: self.settings.closures_max,
            key,
        }
    }

    /// Commits in a task of its own, so that who goes away meanwhile leaves no half-done commit behind.
    pub(super) async fn commit(self: &Arc<Self>, append: Append) -> Result<Appended, Refusal> {
        if planted::is(Bug::AcknowledgeBeforeCommit) {
            return self.commit_afterwards(append).await;
        }
        let registry = self.clone();
        let commit = tokio::spawn(async move {
            let appended = registry.store.append(&append).await;
            match &appended {
                Ok(Appended::Done { version, .. }) => {
                    count(&registry.counts.commits);
                    registry.remember(&append.network, *version).await;
                    registry.heads.tell(&append.network, version.revision);
                }
                Ok(_) => {}
                Err(_) => count(&registry.counts.store_failures),
            }
            appended
        });
        let committed = commit
            .await
            .map_err(|error| Refusal::new(Code::Internal, format!("a commit failed: {error}")))?;
        Ok(committed?)
    }

    /// The planted bug: answers what will probably be, and commits later.
    async fn commit_afterwards(self: &Arc<Self>, append: Append) -> Result<Appended, Refusal> {
        let identity = self.store.identity().await?;
        let state = self.store.network(&append.network).await?;
        let version = Version {
            epoch: identity.epoch,
            revision: state.map_or(0, |state| state.head) + 1,
        };
        let reply = (append.reply)(&identity, version);
        let registry = self.clone();
        tokio::spawn(async move {
            tokio::time::sleep(planted::COMMITS_LATER).await;
            registry.store.append(&append).await
        });
        Ok(Appended::Done { version, reply })
    }

    /// Remembers a commit beside the store, before anyone is told of it. What is committed stays so, also where this
    /// fails.
    pub(super) async fn remember(&self, network: &str, version: Version) {
        let Some(file) = self.high_water.clone() else {
            return;
        };
        if file.has(network, version) {
            return;
        }
        let network = network.to_owned();
        let noted = aside(move || file.note(&network, version)).await;
        let failure = match noted {
            Ok(Ok(())) => return,
            Ok(Err(error)) => error.to_string(),
            Err(refusal) => refusal.to_string(),
        };
        count(&self.counts.high_water_failures);
        tracing::warn!(failure, "cannot remember how far the store is");
    }

    async fn validated(&self, network: &str, decision: Decision) -> Result<Reply, Refusal> {
        let identity = self.store.identity().await?;
        let head = self
            .store
            .network(network)
            .await?
            .map_or(0, |state| state.head);
        let written = Written {
            registry_id: identity.registry_id,
            epoch: identity.epoch,
            network: network.to_owned(),
            revision: head,
            kind: decision.change.kind,
            id: decision.change.id.clone(),
            etag: None,
            object: decision.object,
        };
        Ok(Reply {
            created: false,
            etag: None,
            id: decision.change.id,
            body: text_of(&written),
        })
    }
}

/// An answer is text and numbers, and always has a JSON form.
fn text_of(written: &Written) -> String {
    serde_json::to_string(written).unwrap_or_default()
}

fn make_reply(
    network: &str,
    created: bool,
    change: &NewChange,
    object: Option<Value>,
) -> MakeReply {
    let (network, kind, id) = (network.to_owned(), change.kind, change.id.clone());
    let is_gone = change.body.is_none();
    Box::new(move |identity: &Identity, version: Version| {
        let etag = (!is_gone).then(|| version.etag());
        let written = Written {
            registry_id: identity.registry_id.clone(),
            epoch: version.epoch,
            network: network.clone(),
            revision: version.revision,
            kind,
            id: id.clone(),
            etag: etag.clone(),
            object: object.clone(),
        };
        KeptReply {
            created,
            etag,
            id: id.clone(),
            body: text_of(&written),
        }
    })
}

/// The same request gets the same answer, another one a refusal.
fn repeated(fingerprint: &str, reply: KeptReply, manner: &WriteOptions) -> Result<Reply, Refusal> {
    if fingerprint == manner.fingerprint {
        return Ok(reply.into());
    }
    let detail = "this idempotency key was used with another request; take a new key";
    Err(Refusal::new(Code::IdempotencyMismatch, detail))
}

fn bounded(kind: ObjectKind, limit: u64) -> Refusal {
    let what = match kind {
        ObjectKind::Network => "networks",
        ObjectKind::Closure => "closures on this network",
        ObjectKind::Weather | ObjectKind::Zone => "zones over this network",
    };
    Refusal::new(
        Code::LimitReached,
        format!("there are {limit} {what} already"),
    )
}

/// A key whose request is being answered.
struct Running {
    registry: Arc<Registry>,
    entry: (String, String),
}

impl Drop for Running {
    fn drop(&mut self) {
        let running = self.registry.running.lock();
        running
            .unwrap_or_else(PoisonError::into_inner)
            .remove(&self.entry);
    }
}
