//! What an edge keeps beside its airspace: zones and closures with their versions, and what waits for an operator.

use crate::upstream::Upstream;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract::{self as wire, AlarmKind, Fault};
use skyway_engine::airspace::{Closure, Window, Zone};
use skyway_engine::flight::FailureType;
use skyway_service::access::Role;
use std::borrow::Cow;
use std::sync::Arc;

/// A zone and its version.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ZoneEntry {
    pub(super) zone: Arc<Zone>,
    /// The number of the write that made it so.
    pub(super) version: u64,
    /// Its version at the registry; none where it is not there yet.
    pub(super) upstream: Option<Upstream>,
    /// Who made it so here; none of what is from the registry.
    pub(super) by: Option<Arc<wire::Author>>,
}

/// A closure that no zone causes, and what is known of its cause.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ClosureEntry {
    pub(super) closure: Arc<Closure>,
    /// The number of the write that made it so.
    pub(super) version: u64,
    /// The failure type reported, where a report is the cause.
    pub(super) failure: Option<FailureType>,
    /// The drone that reported it first; its quota carries it, and that of its fleet.
    pub(super) reported_by: Option<Arc<str>>,
    /// Who made it so here; none of what is from the registry.
    pub(super) by: Option<Arc<wire::Author>>,
    pub(super) confirmed: bool,
    pub(super) from: Option<Timestamp>,
    pub(super) until: Option<Timestamp>,
    /// Its version at the registry; none where it is not there yet.
    pub(super) upstream: Option<Upstream>,
}

impl ClosureEntry {
    /// What it closes, where a report is its cause.
    pub(super) fn reported(&self) -> Reported {
        match self.reported_by {
            None => Reported::default(),
            Some(_) => Reported::of(&self.closure),
        }
    }

    /// The subject of the token with which a drone or a fleet reported it.
    pub(super) fn fleet(&self) -> Option<&str> {
        let by = self
            .by
            .as_deref()
            .filter(|by| by.role == Role::Drone.name());
        by.filter(|_| self.reported_by.is_some())
            .map(|by| by.subject.as_str())
    }
}

/// How much closures from reports close.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Reported {
    pub(super) segments: usize,
    /// Nodes whose pads are closed.
    pub(super) pads: usize,
}

impl Reported {
    pub(super) fn of(closure: &Closure) -> Self {
        Self {
            segments: closure.hits.segments.len(),
            pads: closure.pads.len(),
        }
    }

    pub(super) fn plus(self, more: Self) -> Self {
        Self {
            segments: self.segments + more.segments,
            pads: self.pads + more.pads,
        }
    }

    pub(super) fn minus(self, less: Self) -> Self {
        Self {
            segments: self.segments.saturating_sub(less.segments),
            pads: self.pads.saturating_sub(less.pads),
        }
    }
}

/// What brought a proposal.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ProposedBy {
    /// A drone's report.
    Report {
        recomposition_id: Arc<str>,
        drone_id: Option<Arc<str>>,
        failure: FailureType,
    },
    /// A feed whose zone is refused, for these faults.
    Feed { faults: Arc<[Fault]> },
}

/// Something a report or a feed brought that waits for an operator.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ProposalEntry {
    pub(super) number: u64,
    pub(super) reason: Cow<'static, str>,
    pub(super) proposed_at: Timestamp,
    pub(super) expires_at: Timestamp,
    pub(super) by: ProposedBy,
    /// Whose it is among those that share room: the subject of the token that the report came with, or the feed.
    pub(super) subject: Arc<str>,
    /// About how much it takes, in bytes.
    pub(super) bytes: usize,
    /// What accepting it puts into force: that of a zone is the zone's closure.
    pub(super) closure: Arc<Closure>,
}

/// A change made here that the registry has another version of, or will not take.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Contested {
    pub(super) kind: wire::ObjectKind,
    pub(super) id: Arc<str>,
    /// The text of what this edge would put; none where it would lift it.
    pub(super) body: Option<Arc<str>>,
    /// The id under which that is in force beside the registry's version.
    pub(super) aside: Option<Arc<str>>,
    /// Whether the registry will not take it, rather than having a newer version.
    pub(super) is_refused: bool,
    /// The version there that a removal that was refused would lift.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) removes: Option<Upstream>,
}

/// What waits for an operator: removals, or a change that is contested.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PendingReview {
    /// The key of its row.
    #[serde(skip)]
    pub(super) number: u64,
    /// Where they come from.
    pub(super) origin: Arc<str>,
    pub(super) held_at: Timestamp,
    /// Ids of the closures they would lift.
    pub(super) lifts: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) contested: Option<Arc<Contested>>,
}

/// What is to be told to an operator.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct AlarmDraft {
    pub(super) kind: AlarmKind,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) plan: Option<Arc<str>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) drone: Option<Arc<str>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) recomposition: Option<Arc<str>>,
    /// Ids of the zones and closures that cause it.
    pub(super) causes: Vec<String>,
    pub(super) message: String,
}

impl AlarmDraft {
    /// An alarm about nothing in particular.
    pub(super) fn new(kind: AlarmKind, message: impl Into<String>) -> Self {
        Self {
            kind,
            plan: None,
            drone: None,
            recomposition: None,
            causes: Vec::new(),
            message: message.into(),
        }
    }

    /// What it is about: alarms of one kind about the same are one alarm.
    pub(super) fn subject(&self) -> Arc<str> {
        let named = match (&self.plan, &self.drone) {
            (Some(plan), _) => format!("plan:{plan}"),
            (None, Some(drone)) => format!("drone:{drone}"),
            (None, None) => format!("causes:{}", self.causes.join(",")),
        };
        Arc::from(named)
    }
}

/// An alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlarmEntry {
    /// The key of its row.
    #[serde(skip)]
    pub(super) number: u64,
    /// What it says now.
    #[serde(flatten)]
    pub(super) draft: AlarmDraft,
    pub(super) raised_at: Timestamp,
    pub(super) renewed_at: Timestamp,
    pub(super) count: u64,
    /// When, and by whom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) acknowledged: Option<(Timestamp, Arc<str>)>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ended_at: Option<Timestamp>,
}

/// The windows of a closure from when until when; always, where neither is given.
pub(super) fn windows(from: Option<Timestamp>, until: Option<Timestamp>) -> Vec<Window> {
    match (from, until) {
        (None, None) => Vec::new(),
        // The ends were checked when they were read.
        _ => Window::new(from, until).into_iter().collect(),
    }
}
