//! What each drone has yet to be told: a mailbox for each, kept until the drone says that it has received what is in it.
//!
//! Of a plan only the newest order stands in it, as a version that is overtaken must not be flown; everything else
//! stays in its order. Messages refer to versions by their numbers, and are written out when they are told.

use super::plan_entry::PlanEntry;
use super::planner::Version;
use super::snapshot::Snapshot;
use super::state_fleet::WITHOUT_WAY_TEXT;
use super::views;
use super::words;
use crate::network::Topology;
use crate::refusal::{Code, Refusal};
use crate::wire::{self, AlarmKind, EndedAs, MessageKind};
use jiff::Timestamp;
use std::borrow::Cow;
use std::ops::Bound;
use std::sync::Arc;

/// At most so many messages are kept for one drone; the oldest that is no order goes first.
pub(super) const KEPT_MAX: usize = 64;

/// Where a message lies: whose it is, and its number.
pub(super) type MailKey = (Arc<str>, u64);

/// What a message says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// This version is to be flown.
    Version(u32),
    /// This version may be flown.
    Offer(u32),
    /// What was in the way is over.
    Relieved,
    /// This version has its contingencies now.
    Contingencies(u32),
    /// There is no way: the least bad one as JSON, where there is any.
    NoWay { unsafe_way: Option<Arc<str>> },
    /// The plan is over.
    Ended(EndedAs),
    /// An operator was alarmed.
    Alarm { kind: AlarmKind, text: Arc<str> },
    /// Nothing was heard of the drone for long.
    WhereAreYou,
}

impl Content {
    fn kind(&self) -> MessageKind {
        match self {
            Self::Version(_) => MessageKind::Version,
            Self::Offer(_) => MessageKind::Offer,
            Self::Relieved => MessageKind::Relieved,
            Self::Contingencies(_) => MessageKind::Contingencies,
            Self::NoWay { .. } => MessageKind::NoWay,
            Self::Ended(_) => MessageKind::Ended,
            Self::Alarm { .. } => MessageKind::Alarm,
            Self::WhereAreYou => MessageKind::WhereAreYou,
        }
    }

    /// Whether it stays until its version is acknowledged, declined or overtaken, received or not.
    pub(super) fn is_order(&self) -> bool {
        matches!(self, Self::Version(_) | Self::Offer(_))
    }

    /// Whether a message says nothing any more once this one is there, of the same plan.
    pub(super) fn overtakes(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Version(_) | Self::Offer(_) | Self::Relieved | Self::NoWay { .. },
                Self::Version(_) | Self::Offer(_) | Self::Relieved,
            ) => true,
            (Self::Contingencies(_), Self::Contingencies(_))
            | (Self::WhereAreYou, Self::WhereAreYou) => true,
            (Self::Alarm { kind, .. }, Self::Alarm { kind: other, .. }) => kind == other,
            // What became of a plan is told once more where an operator knows better.
            (Self::Ended(_), _) => true,
            _ => false,
        }
    }

    /// The number of the version that it speaks of.
    fn version_number(&self) -> Option<u32> {
        match self {
            Self::Version(number) | Self::Offer(number) | Self::Contingencies(number) => {
                Some(*number)
            }
            _ => None,
        }
    }
}

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MailEntry {
    pub(super) drone: Arc<str>,
    /// Of all messages of this edge; those of a drone rise.
    pub(super) number: u64,
    pub(super) at: Timestamp,
    pub(super) plan: Arc<str>,
    /// Ids of the closures that it is for.
    pub(super) causes: Vec<String>,
    pub(super) content: Content,
}

impl MailEntry {
    pub(super) fn key(&self) -> MailKey {
        (self.drone.clone(), self.number)
    }

    /// Whether it has to be told again, received or not: the version that it orders is still wanted.
    pub(super) fn is_open_order(&self, plan: Option<&PlanEntry>) -> bool {
        let wanted = plan.and_then(|plan| plan.wanted.as_ref());
        let number = self.content.version_number();
        self.content.is_order() && wanted.is_some_and(|wanted| number == Some(wanted.number))
    }
}

impl Snapshot {
    /// The messages of a drone that come after a number.
    pub(super) fn mail_of(
        &self,
        drone: &Arc<str>,
        after: u64,
    ) -> impl Iterator<Item = &Arc<MailEntry>> {
        let from = Bound::Excluded((drone.clone(), after));
        let until = Bound::Included((drone.clone(), u64::MAX));
        self.mail.range((from, until)).map(|(_, entry)| entry)
    }

    /// A message as its drone is told it; none where the version that it speaks of is there no more.
    pub(super) fn told_message(
        &self,
        entry: &MailEntry,
        stamp: wire::Stamp<'static>,
    ) -> Option<wire::DroneMessage<'static>> {
        let plan = self.plans.get(&entry.plan);
        let version = entry.content.version_number();
        let version = version.map(|number| version_of(self.topology(), plan?, number));
        if version.as_ref().is_some_and(Option::is_none) {
            return None;
        }
        let (unsafe_way, ended_as, alarm, text) = match &entry.content {
            Content::NoWay { unsafe_way } => {
                let way = unsafe_way.as_deref();
                let way = way.and_then(|way| serde_json::from_str(way).ok());
                (way, None, None, Some(WITHOUT_WAY_TEXT.into()))
            }
            Content::Ended(how) => (None, Some(*how), None, None),
            Content::Alarm { kind, text } => (None, None, Some(*kind), Some(words::text(text))),
            _ => (None, None, None, None),
        };
        Some(wire::DroneMessage {
            id: Cow::Owned(message_id(self.lineage, entry.number)),
            drone_id: words::text(&entry.drone),
            kind: entry.content.kind(),
            at: words::instant(entry.at),
            plan_id: words::text(&entry.plan),
            version: version.flatten(),
            causes: entry.causes.iter().cloned().map(Cow::Owned).collect(),
            unsafe_way,
            ended_as,
            alarm,
            text,
            stamp,
        })
    }
}

fn message_id(lineage: u64, number: u64) -> String {
    format!("{lineage}-{number}")
}

/// The number of the message with an id; 0, before all others, for one of a store that is gone.
///
/// # Errors
/// When it is not the id of a message.
pub(super) fn message_number(id: &str, lineage: u64) -> Result<u64, Refusal> {
    let part = |text: &str| text.parse::<u64>().ok();
    let parts = id.split_once('-');
    let parts = parts.and_then(|(stated, number)| Some((part(stated)?, part(number)?)));
    match parts {
        Some((stated, number)) if stated == lineage => Ok(number),
        Some(_) => Ok(0),
        None => {
            let detail = format!(
                "'{id}' is not the id of a message; those of this edge look like {lineage}-1"
            );
            Err(Refusal::new(Code::ParameterInvalid, detail))
        }
    }
}

/// A version of a plan that was sent and has not ended.
fn version_of(
    topology: &Topology,
    plan: &PlanEntry,
    number: u32,
) -> Option<wire::PlanVersion<'static>> {
    let is_it = |version: &&Arc<Version>| version.number == number;
    let version = plan.versions().find(is_it)?;
    Some(views::version(topology, version))
}
