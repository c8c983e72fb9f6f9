//! What edges and their registry say to each other: the log of changes, the snapshot, and who follows.
//!
//! A body travels as the text of its JSON, so that a digest of it needs no agreement on the order of members or
//! the form of numbers; `registry_checksum` has the digests.

use super::id::Id;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What a change is about.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    utoipa::ToSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum ObjectKind {
    /// The network itself, of which there is one; its id is empty.
    Network,
    /// A closure that no zone causes.
    Closure,
    /// The weather, of which there is one; its id is empty.
    Weather,
    /// A no-fly zone.
    Zone,
}

impl ObjectKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Network, Self::Closure, Self::Weather, Self::Zone];

    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Network => "network",
            Self::Closure => "closure",
            Self::Weather => "weather",
            Self::Zone => "zone",
        }
    }
}

/// What a change does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ChangeOperation {
    /// The body takes the place of what was there, if anything.
    Put,
    /// The body is a `NetworkPatch` to be applied to the network.
    Patch,
    /// It is gone: a tombstone without a body.
    Delete,
}

impl ChangeOperation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Put, Self::Patch, Self::Delete];

    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Put => "put",
            Self::Patch => "patch",
            Self::Delete => "delete",
        }
    }
}

/// One change of the log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct LoggedChange {
    /// The revision that it belongs to: all changes of one revision were made together.
    pub revision: u64,
    /// The epoch it was made in.
    pub epoch: u64,
    /// When it was made, RFC 3339.
    pub at: String,
    /// Who made it; of what an edge has forwarded `ROLE:SUBJECT@EDGE`, with who made it there.
    pub subject: String,
    /// What it is about.
    pub kind: ObjectKind,
    /// Which one.
    pub id: String,
    /// What it does.
    pub operation: ChangeOperation,
    /// The text of its JSON: a network, a patch, a GeoJSON feature, a closure or weather; null for a tombstone.
    pub body: Option<String>,
    /// SHA-256 of the change in hexadecimal, as `docs/registry.md` says.
    pub sha256: String,
}

/// A page of the log: whole revisions in their order, without a gap.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ChangesPage {
    /// Which registry: random, made once.
    pub registry_id: String,
    /// Which life of it: one more when it was restored from a backup.
    pub epoch: u64,
    /// Which network.
    pub network: String,
    /// The revision after which the page begins.
    pub after: u64,
    /// The last revision in it; `after` where there is none. Follow from here.
    pub revision: u64,
    /// The last revision there is.
    pub head: u64,
    /// The oldest revision that can be followed from.
    pub oldest: u64,
    /// The changes.
    pub changes: Vec<LoggedChange>,
    /// SHA-256 of the page in hexadecimal, as `docs/registry.md` says.
    pub checksum: String,
}

/// Something that holds at the revision of a snapshot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct SnapshotObject {
    /// What it is.
    pub kind: ObjectKind,
    /// Which one.
    pub id: String,
    /// The revision that made it so.
    pub revision: u64,
    /// The epoch of that revision.
    pub epoch: u64,
    /// The text of its JSON.
    pub body: String,
    /// SHA-256 of the object in hexadecimal, as `docs/registry.md` says.
    pub sha256: String,
}

/// A page of everything that holds at one revision, by kind and id.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RegistrySnapshot {
    /// Which registry: random, made once.
    pub registry_id: String,
    /// Which life of it: one more when it was restored from a backup.
    pub epoch: u64,
    /// Which network.
    pub network: String,
    /// The revision of all pages. Follow from here.
    pub revision: u64,
    /// How many objects all pages have together.
    pub object_count: u64,
    /// Whether there is neither a zone nor a closure because none holds: a follower that has some may drop them.
    pub authoritative_empty: bool,
    /// The objects of this page.
    pub objects: Vec<SnapshotObject>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// SHA-256 of the page in hexadecimal, as `docs/registry.md` says.
    pub checksum: String,
}

/// Nodes and segments added, changed and removed: the body of `PATCH /v1/networks/{network}`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NetworkPatch {
    /// Features, as in the file of a network, that are not there yet.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<Object>)]
    pub added: Vec<Value>,
    /// Features that take the place of those with the same ids.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<Object>)]
    pub changed: Vec<Value>,
    /// Ids of nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub removed_nodes: Vec<Id<'static>>,
    /// Ids of segments, before nodes are removed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub removed_segments: Vec<String>,
}

/// Why a closure of the registry is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PublishedCause {
    /// An operator's word.
    #[default]
    Operator,
    /// A drone's failure report, forwarded by its edge.
    Report,
}

/// A closure as the registry keeps it, and as it is written there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedClosure {
    /// Its id; one is made where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 128)]
    pub id: Option<String>,
    /// Why.
    #[serde(default)]
    pub cause: PublishedCause,
    /// In words: the operator's reason, or the failure type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 1000)]
    pub reason: Option<String>,
    /// The drone that reported it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 256)]
    pub reported_by: Option<String>,
    /// Whether an operator has confirmed it; true where an operator is the cause.
    #[serde(default)]
    pub confirmed: bool,
    /// Ids of segments to close.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 10000)]
    pub segments: Vec<String>,
    /// Ids of nodes to close.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 10000)]
    pub nodes: Vec<Id<'static>>,
    /// Ids of nodes whose pads to close.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 10000)]
    pub pads: Vec<Id<'static>>,
    /// From when, RFC 3339; now where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub from: Option<String>,
    /// Until when, RFC 3339; without end where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub until: Option<String>,
}

/// The answer to a write.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Written {
    /// Which registry.
    pub registry_id: String,
    /// Which life of it.
    pub epoch: u64,
    /// Which network.
    pub network: String,
    /// The revision that the write made; with `validate_only`, the last there is.
    pub revision: u64,
    /// What was written.
    pub kind: ObjectKind,
    /// Which one.
    pub id: String,
    /// Its version, for `If-Match`; absent where it is gone or was only validated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub etag: Option<String>,
    /// The object as it is understood; absent for a network and where it is gone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub object: Option<Value>,
}

/// A network that the registry has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NetworkSummary {
    /// Its id.
    pub id: String,
    /// The version of its nodes and segments, for `If-Match`.
    pub etag: String,
    /// The last revision there is.
    pub head: u64,
    /// The oldest revision that can be followed from.
    pub oldest: u64,
    /// How many zones lie over it.
    pub zones: u64,
    /// How many closures are on it, ended ones too.
    pub closures: u64,
}

/// The networks that the registry has, by id.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NetworkSummaries {
    /// Which registry.
    pub registry_id: String,
    /// Which life of it.
    pub epoch: u64,
    /// The networks.
    pub networks: Vec<NetworkSummary>,
}

/// A page of zones or closures, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PublishedObjects {
    /// The last revision there is.
    pub revision: u64,
    /// The objects: GeoJSON features, or closures.
    #[schema(value_type = Vec<Object>)]
    pub objects: Vec<Value>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}

/// What an edge could not take over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Nack {
    /// The revision that it refused.
    pub revision: u64,
    /// Stable code of the reason, such as `zone_invalid` or `checksum_mismatch`.
    #[schema(max_length = 64)]
    pub code: String,
    /// The object at fault, where there is one: its kind and id.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 256)]
    pub object: Option<String>,
    /// The reason in words.
    #[schema(max_length = 1000)]
    pub reason: String,
}

/// What an edge tells of itself: the body of `PUT /v1/networks/{network}/edges/{id}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct EdgeReport {
    /// The epoch it follows.
    pub epoch: u64,
    /// The revision it has in service.
    pub revision: u64,
    /// What it refused last; absent where it refused nothing since.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nack: Option<Nack>,
    /// Where the registry reaches it, for the flights of deliveries; absent where it takes none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 500)]
    pub url: Option<String>,
}

/// An edge's report was noted: the answer to `PUT /v1/networks/{network}/edges/{id}`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct EdgeNoted {
    /// Ids of the keys that were revoked: no pack that one of them has signed is to be believed.
    #[schema(max_items = 1000)]
    pub revoked_keys: Vec<String>,
}

/// Why a key of packs is not to be believed any more: the body of `PUT /v1/revoked-keys/{id}`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyRevocation {
    /// Why, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 500)]
    pub reason: Option<String>,
}

/// A key of packs that was revoked, for good.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RevokedKey {
    /// Its id: 16 hexadecimal digits.
    pub id: String,
    /// Since when, RFC 3339.
    pub revoked_at: String,
    /// Who has revoked it.
    pub revoked_by: String,
    /// Why, for people.
    pub reason: Option<String>,
}

/// The keys that were revoked, by id.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RevokedKeys {
    /// At most 1,000.
    #[schema(max_items = 1000)]
    pub keys: Vec<RevokedKey>,
}

/// An edge that follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct EdgeStatus {
    /// Its id.
    pub id: String,
    /// The network it follows.
    pub network: String,
    /// The epoch it follows.
    pub epoch: u64,
    /// The revision it has.
    pub revision: u64,
    /// How many revisions it is behind.
    pub behind: u64,
    /// How long ago it was last heard, in seconds.
    pub age_s: f64,
    /// What it refused last.
    pub nack: Option<Nack>,
    /// Where the registry reaches it, for the flights of deliveries; absent where it takes none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
}

/// Who follows, by network and id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct EdgeStatuses {
    /// Which registry.
    pub registry_id: String,
    /// Which life of it.
    pub epoch: u64,
    /// The edges.
    pub edges: Vec<EdgeStatus>,
}
