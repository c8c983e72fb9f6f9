//! What an edge knows of the registry that it follows, and what it has to tell it.

mod failure_rates;
pub(crate) mod news;
pub(crate) mod published;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract::{ChangeOperation, ObjectKind};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How far an edge has followed a registry: moved only together with what it stands for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegistryCursor {
    /// Which registry.
    pub registry_id: Arc<str>,
    /// Its epoch; greater after it was restored from a backup.
    pub epoch: u64,
    /// The last revision that is in force here.
    pub revision: u64,
}

/// The version that an object has at the registry; a pair in rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "(u64, u64)", into = "(u64, u64)")]
pub struct Upstream {
    /// The epoch of the revision.
    pub epoch: u64,
    /// The revision that made the object so.
    pub revision: u64,
}

impl From<(u64, u64)> for Upstream {
    fn from((epoch, revision): (u64, u64)) -> Self {
        Self { epoch, revision }
    }
}

impl From<Upstream> for (u64, u64) {
    fn from(Upstream { epoch, revision }: Upstream) -> Self {
        (epoch, revision)
    }
}

/// A change made here that the registry has to learn of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutboxEntry {
    /// Counts them; never given twice by one edge. The key of its row.
    #[serde(skip)]
    pub number: u64,
    /// What it is about.
    pub kind: ObjectKind,
    /// Which one.
    pub id: Arc<str>,
    /// What it does.
    pub operation: ChangeOperation,
    /// The text of its JSON; none for a tombstone.
    pub body: Option<Arc<str>>,
    /// The version at the registry that it was decided on; none where there is none.
    pub expected: Option<Upstream>,
    /// When it was made.
    pub made_at: Timestamp,
    /// Who made it.
    pub subject: Arc<str>,
}

/// Who stands for what an edge does by itself, in the log of the registry.
pub(crate) const ITSELF: &str = "edge";

impl OutboxEntry {
    /// Whether it removes what has ended here by itself: no operator has asked for that.
    pub(crate) fn is_end(&self) -> bool {
        self.operation == ChangeOperation::Delete && &*self.subject == ITSELF
    }
}

/// Things remembered in [`Told`], and in [`Ended`].
const TOLD_MAX: usize = 10_000;

/// Versions at the registry that are known before the log has brought them: those that changes from here have made, also of
/// what was lifted since, and those of pages in doubt. What comes up to one of ours is nothing that anyone else has made meanwhile.
///
/// A restart forgets them. At worst a change then meets an earlier one from here, and waits for an operator, or a version in
/// doubt is taken for known.
#[derive(Clone, Debug, Default)]
pub(crate) struct Told(BTreeMap<Arc<str>, BTreeMap<ObjectKind, Upstream>>);

impl Told {
    pub(crate) fn of(&self, kind: ObjectKind, id: &str) -> Option<Upstream> {
        self.0.get(id)?.get(&kind).copied()
    }

    pub(crate) fn note(&mut self, kind: ObjectKind, id: &Arc<str>, version: Upstream) {
        if self.0.len() < TOLD_MAX {
            let versions = self.0.entry(id.clone()).or_default();
            versions.insert(kind, version);
        }
    }

    /// Forgets what the log has brought.
    pub(crate) fn passed(&mut self, cursor: &RegistryCursor) {
        self.0.retain(|_, versions| {
            versions.retain(|_, version| is_after(*version, cursor));
            !versions.is_empty()
        });
    }
}

/// The versions at the registry of closures that have ended by themselves: the registry keeps them for a while, and what is
/// closed again under such an id takes the place of that version.
///
/// A restart forgets them. The registry then judges by its own clock that they are over.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ended(BTreeMap<Arc<str>, Upstream>);

impl Ended {
    /// Notes what has ended, where the registry knows it.
    pub(crate) fn note(&mut self, id: &str, version: Option<Upstream>) {
        let Some(version) = version else {
            return;
        };
        if self.0.len() >= TOLD_MAX {
            // Any of them: the registry judges, too.
            self.0.pop_first();
        }
        self.0.insert(Arc::from(id), version);
    }

    /// The version of what has ended under this id, and is there no more from now on.
    pub(crate) fn take(&mut self, id: &str) -> Option<Upstream> {
        self.0.remove(id)
    }
}

/// Whether a version was made after all that a cursor stands for.
pub(crate) fn is_after(upstream: Upstream, cursor: &RegistryCursor) -> bool {
    (upstream.epoch, upstream.revision) > (cursor.epoch, cursor.revision)
}
