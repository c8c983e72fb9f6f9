//! What an edge knows of the registry that it follows, and what it has to tell it.

use crate::wire::{ChangeOperation, ObjectKind};
use jiff::Timestamp;
use std::sync::Arc;

/// How far an edge has followed a registry: moved only together with what it stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RegistryCursor {
    /// Which registry.
    pub registry_id: Arc<str>,
    /// Its epoch; greater after it was restored from a backup.
    pub epoch: u64,
    /// The last revision that is in force here.
    pub revision: u64,
}

/// The version that an object has at the registry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Upstream {
    /// The epoch of the revision.
    pub epoch: u64,
    /// The revision that made the object so.
    pub revision: u64,
}

/// A change made here that the registry has to learn of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutboxEntry {
    /// Counts them; never given twice by one edge.
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
