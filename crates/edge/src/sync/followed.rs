//! What came of reading the registry: what the writer is to take over, as one batch and one revision.

use crate::network::replacement::NewNetwork;
use crate::upstream::published::Published;
use crate::upstream::{RegistryCursor, Upstream};
use skyway_contract::{ChangeOperation, Nack, ObjectKind};
use skyway_engine::network::Topology;
use std::sync::Arc;

/// How much of what the registry has a batch tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    /// What has changed since the cursor.
    Changes,
    /// Everything that holds: what is absent is gone.
    Everything,
    /// What may be taken over of a page that is not good: only what is stricter than before. The cursor stays.
    Restrictions,
}

/// Something that the registry has lifted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Tombstone {
    pub(crate) kind: ObjectKind,
    pub(crate) id: Arc<str>,
    pub(crate) upstream: Upstream,
}

/// A change that a later one of the same page has superseded: it may be one of ours on its way back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Superseded {
    pub(crate) kind: ObjectKind,
    pub(crate) id: Arc<str>,
    pub(crate) operation: ChangeOperation,
    pub(crate) body: Option<Arc<str>>,
    pub(crate) upstream: Upstream,
}

/// What the writer is to take over.
#[derive(Clone, Debug)]
pub(crate) struct RegistryDelta {
    pub(crate) extent: Extent,
    /// Where it goes on from: taken over only there.
    pub(crate) after: Option<Arc<RegistryCursor>>,
    /// Where it leads.
    pub(crate) cursor: RegistryCursor,
    /// The network that it was worked out on: the one in service, or the new one.
    pub(crate) topology: Arc<Topology>,
    pub(crate) network: Option<NewNetwork>,
    pub(crate) superseded: Vec<Superseded>,
    pub(crate) puts: Vec<Published>,
    pub(crate) lifts: Vec<Tombstone>,
    /// The text of the weather; none where it stays as it is, or, where this is everything, where there is none.
    pub(crate) weather: Option<Arc<str>>,
}

/// Something that the registry said and that is not taken over.
#[derive(Clone, Debug)]
pub(crate) struct Rejected {
    pub(crate) nack: Nack,
    /// What may be taken over of it all the same.
    pub(crate) restrictions: Option<Box<RegistryDelta>>,
}

/// What to do with what the registry said.
#[derive(Clone, Debug)]
pub(crate) enum Verdict {
    /// Nothing new: all that the registry has is in service.
    Idle,
    /// To be taken over.
    Follow(Box<RegistryDelta>),
    /// Not to be taken over.
    Nack(Box<Rejected>),
    /// What comes after the cursor cannot be told any more: everything has to be read anew.
    Resync(String),
}

/// The code of a page that is not as its digests say.
pub(crate) const CHECKSUM: &str = "checksum_mismatch";
/// The code of another registry.
pub(crate) const FOREIGN_REGISTRY: &str = "foreign_registry";
/// The code of something that would lead back.
pub(crate) const BACKWARDS: &str = "revision_backwards";
/// The code of a page that does not begin where it was asked to.
pub(crate) const OUT_OF_PLACE: &str = "page_out_of_place";
/// The code of a page whose revisions are not one after the other.
pub(crate) const REVISIONS: &str = "revisions_broken";
/// The code of a page that is no JSON, or of another shape.
pub(crate) const UNREADABLE: &str = "page_unreadable";
/// The code of an empty list that does not say that it is meant.
pub(crate) const NOT_AUTHORITATIVE: &str = "empty_not_authoritative";

/// Whether a page may come right when it is asked for again.
pub(super) fn is_damage(code: &str) -> bool {
    [
        CHECKSUM,
        FOREIGN_REGISTRY,
        BACKWARDS,
        OUT_OF_PLACE,
        REVISIONS,
    ]
    .contains(&code)
}
