//! The import of a feed of zones: what it brought, what is refused, and what it changes.

use super::problem::Fault;
use super::status::Stamp;
use super::zone::AffectedPlan;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What an import does to one zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImportAction {
    /// It is new.
    Created,
    /// It differs from what was there.
    Changed,
    /// It was there just so.
    Unchanged,
    /// It came from this feed before and is absent now: lifted.
    Removed,
    /// The same, but with the others it is a mass change, which waits for an operator.
    Held,
    /// It came from this feed before and is refused now: its last version stays in force.
    Kept,
}

/// What an import does to a zone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ImportedZone<'a> {
    /// Id of the zone.
    pub id: Cow<'a, str>,
    /// Its identifier in the feed.
    pub identifier: Cow<'a, str>,
    /// `prohibited`, `req_authorization`, `conditional`, `uspace` or `no_restriction`; the last two close nothing.
    pub kind: Cow<'a, str>,
    /// Whether the drones of the network are authorized for it, or meet its conditions, so that it closes nothing.
    #[serde(default)]
    pub authorized: bool,
    /// What is done.
    pub action: ImportAction,
    /// Whether it is in force now, by its windows and schedules, and closes anything.
    pub in_force: bool,
}

/// A zone of a feed that is refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RefusedZone<'a> {
    /// Its identifier; null where it cannot be read.
    pub identifier: Option<Cow<'a, str>>,
    /// JSON Pointer of the zone in the feed; in KML as if elements were members.
    pub pointer: Cow<'a, str>,
    /// What is wrong, where, and what would set it right.
    pub faults: Vec<Fault>,
    /// Whether what can be read of it waits for an operator as a proposal: its shape, closed at all heights and always.
    #[serde(default)]
    pub is_proposed: bool,
}

/// Something that was read otherwise than it is written, or is kept and not acted on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ImportNote<'a> {
    /// The zone; null where it is about the feed.
    pub identifier: Option<Cow<'a, str>>,
    /// JSON Pointer of the place; in KML as if elements were members.
    pub pointer: Cow<'a, str>,
    /// What was done.
    pub message: Cow<'a, str>,
}

/// How many zones an import does what to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ImportCounts {
    /// New.
    pub created: usize,
    /// Different from before.
    pub changed: usize,
    /// As before.
    pub unchanged: usize,
    /// Absent from the feed, and lifted.
    pub removed: usize,
    /// Absent from the feed, and waiting for an operator.
    pub held: usize,
    /// Refused, with their last version in force.
    pub kept: usize,
    /// Entries of the feed that are refused.
    pub refused: usize,
    /// Of those, how many wait for an operator as proposals.
    #[serde(default)]
    pub proposed: usize,
}

/// The answer to an import of zones, or to its preview.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ZoneImport<'a> {
    /// The name of the feed.
    pub feed: Cow<'a, str>,
    /// `ed269`, `ed318`, `geojson`, `kml` or `qgc_plan`.
    pub format: Cow<'a, str>,
    /// How many zones what is done to.
    pub counts: ImportCounts,
    /// The zones; at most 1,000, those that change first.
    pub zones: Vec<ImportedZone<'a>>,
    /// What is refused; at most 1,000.
    pub refused: Vec<RefusedZone<'a>>,
    /// Repairs and what is not acted on; at most 1,000.
    pub notes: Vec<ImportNote<'a>>,
    /// How many notes there are beyond those.
    #[serde(default)]
    pub further_notes: usize,
    /// How many active plans the new and changed zones meet.
    pub plan_count: usize,
    /// Those of them whose drones have been told something already; at most 100.
    pub plans: Vec<AffectedPlan<'a>>,
    /// Whether drones are led around the zones now; false in a preview.
    pub enforced: bool,
    /// Whether that survives a restart of this edge.
    pub durable: bool,
    /// The world after it.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}
