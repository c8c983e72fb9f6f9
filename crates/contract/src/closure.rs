//! Closures, and what waits for an operator: proposals and holds.

use super::id::Id;
use super::problem::Fault;
use super::status::Stamp;
use super::zone::ZoneEffect;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// Why something is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClosureCause {
    /// A no-fly zone: lift the zone to lift it.
    Zone,
    /// A drone's failure report.
    Report,
    /// An operator's word.
    Operator,
}

/// Something that is closed, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Closure<'a> {
    /// Its id; that of a zone is the zone's.
    pub id: Cow<'a, str>,
    /// Why.
    pub cause: ClosureCause,
    /// In words: the zone's or the operator's reason, or the failure type.
    pub reason: Option<Cow<'a, str>>,
    /// The drone that reported it, for those who may speak for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reported_by: Option<Cow<'a, str>>,
    /// Whether an operator has confirmed it.
    pub confirmed: bool,
    /// From when, RFC 3339; null: always has been.
    pub from: Option<Cow<'a, str>>,
    /// Until when, RFC 3339; null: without end.
    pub until: Option<Cow<'a, str>>,
    /// Whether it is in force now, by its windows.
    pub in_force: bool,
    /// From when drones without computed times are led around it, which is `airspace.horizon` before it begins,
    /// RFC 3339; null where it is in force, or over.
    #[serde(default)]
    pub closes_from: Option<Cow<'a, str>>,
    /// How many segments it closes.
    pub segment_count: usize,
    /// Their ids; at most 1,000.
    pub segments: Vec<Cow<'a, str>>,
    /// How many nodes it closes.
    pub node_count: usize,
    /// Their ids; at most 1,000.
    pub nodes: Vec<Id<'a>>,
    /// Nodes whose recharging pads it closes.
    pub pads: Vec<Id<'a>>,
    /// Its version, for `If-Match`.
    pub etag: Cow<'a, str>,
    /// What it closes and whom it meets; only in the answer to a write.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effect: Option<ZoneEffect<'a>>,
}

/// A page of closures, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Closures<'a> {
    /// The closures.
    pub closures: Vec<Closure<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// An operator closes segments, nodes or pads: the body of `POST /v1/closures`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ClosureDraft {
    /// Id for the closure; one is made where none is given. 1 to 128 characters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 128)]
    pub id: Option<String>,
    /// Why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 1000)]
    pub reason: Option<String>,
    /// Ids of segments to close.
    #[serde(default)]
    #[schema(max_items = 10000)]
    pub segments: Vec<String>,
    /// Ids of nodes to close.
    #[serde(default)]
    #[schema(max_items = 10000)]
    pub nodes: Vec<Id<'static>>,
    /// Ids of nodes whose pads to close.
    #[serde(default)]
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

/// An operator confirms a closure or moves its end: the body of `PATCH /v1/closures/{id}`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ClosureChange {
    /// Confirms that it is so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmed: Option<bool>,
    /// The new end, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub until: Option<String>,
}

/// What a proposal is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProposalSubject {
    /// A zone that a report brought, or a feed whose zone is refused.
    Zone,
    /// What a report would have closed.
    Closure,
}

/// Something that a report or a feed of zones brought and that was not put into force: an operator decides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Proposal<'a> {
    /// Its id.
    pub id: Cow<'a, str>,
    /// What it is about.
    pub subject: ProposalSubject,
    /// Why it was not put into force; `refused_in_feed` for a zone of a feed, of which `faults` says more.
    pub reason: Cow<'a, str>,
    /// When it was made, RFC 3339.
    pub proposed_at: Cow<'a, str>,
    /// When it is dropped by itself, RFC 3339.
    pub expires_at: Cow<'a, str>,
    /// The answer to the report that brought it; null where an import did.
    pub recomposition_id: Option<Cow<'a, str>>,
    /// The drone, where the report names one.
    pub drone_id: Option<Cow<'a, str>>,
    /// Why a feed's zone was refused, of which this is the shape.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// The zone: a GeoJSON feature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub zone: Option<Value>,
    /// The segments it would close, where it is no zone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<Cow<'a, str>>,
    /// The nodes whose pads it would close.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pads: Vec<Id<'a>>,
}

/// A page of proposals, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Proposals<'a> {
    /// The proposals.
    pub proposals: Vec<Proposal<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// What waits for an operator: many removals at once, or a change that met a newer version at the registry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Hold<'a> {
    /// Its id.
    pub id: Cow<'a, str>,
    /// Where the change comes from.
    pub origin: Cow<'a, str>,
    /// Why it waits: `mass_removal`, `changed_elsewhere`, or `refused_there`.
    pub reason: Cow<'a, str>,
    /// Since when, RFC 3339.
    pub held_at: Cow<'a, str>,
    /// How many closures would be lifted, or changed.
    pub closure_count: usize,
    /// Their ids; at most 1,000.
    pub closures: Vec<Cow<'a, str>>,
    /// What this edge would put in place of the registry's version; absent where it would lift it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub ours: Option<Value>,
    /// The id under which that is in force beside the registry's version until it is decided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept_as: Option<Cow<'a, str>>,
}

/// A page of holds, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Holds<'a> {
    /// The holds.
    pub holds: Vec<Hold<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}
