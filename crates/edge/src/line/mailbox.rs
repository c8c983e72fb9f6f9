//! What each drone has yet to be told: a mailbox for each, kept until the drone says that it has received what is in it.
//!
//! Of a plan only the newest order stands in it, as a version that is overtaken must not be flown; everything else
//! stays in its order. Messages refer to versions by their numbers, and are written out when they are told.

use crate::plans::entry::PlanEntry;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract::{AlarmKind, EndedAs, MessageKind};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// What the drone of a plan is told to do where it has no way. It is never ordered to land.
pub(crate) const WITHOUT_WAY_TEXT: &str = "no open way is known: keep out of what is closed, hover or stay where that can be done, and report again; \
an operator has been alarmed, and unsafe_way is the least bad way where there is any";

/// What a drone is told to do that was sent nothing after what it has declined.
pub(crate) const DECLINED_TEXT: &str = "no version is left that this drone has not declined: keep out of what is closed, hover or stay where that can be \
done, and report what is in the way; an operator has been alarmed";

/// The most messages that are kept for one drone; the oldest that tells neither an order nor a plan goes first.
pub(crate) const KEPT_MAX: usize = 64;

/// The version with which every plan begins.
pub(crate) const FIRST_VERSION: u32 = 1;

/// Where a message lies: whose it is, and its number.
pub(crate) type MailKey = (Arc<str>, u64);

/// What a message says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Content {
    /// This version is to be flown.
    Version(u32),
    /// This version may be flown.
    Offer(u32),
    /// What was in the way is over.
    Relieved,
    /// This version has its contingencies now.
    Contingencies(u32),
    /// There is no way: the least bad one as JSON, where there is any.
    NoWay(Option<Arc<str>>),
    /// There is no other version after those that its drone has declined.
    Declined,
    /// The plan is over.
    Ended(EndedAs),
    /// An operator was alarmed: about what, and in which words.
    Alarm(AlarmKind, Arc<str>),
    /// Nothing was heard of the drone for long.
    WhereAreYou,
    /// The plan is flown for a delivery of the registry: its first version.
    Assigned,
}

impl Content {
    /// What it tells.
    pub(crate) fn kind(&self) -> MessageKind {
        match self {
            Self::Version(_) => MessageKind::Version,
            Self::Offer(_) => MessageKind::Offer,
            Self::Relieved => MessageKind::Relieved,
            Self::Contingencies(_) => MessageKind::Contingencies,
            Self::NoWay(_) | Self::Declined => MessageKind::NoWay,
            Self::Ended(_) => MessageKind::Ended,
            Self::Alarm(..) => MessageKind::Alarm,
            Self::WhereAreYou => MessageKind::WhereAreYou,
            Self::Assigned => MessageKind::Assigned,
        }
    }

    /// Whether it stays until its version is acknowledged, declined or overtaken, received or not.
    pub(crate) fn is_order(&self) -> bool {
        matches!(self, Self::Version(_) | Self::Offer(_))
    }

    /// Whether a message says nothing any more once this one is there, of the same plan.
    pub(crate) fn overtakes(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Version(_)
                | Self::Offer(_)
                | Self::Relieved
                | Self::NoWay(_)
                | Self::Declined,
                Self::Version(_) | Self::Offer(_) | Self::Relieved,
            ) => true,
            (Self::Contingencies(number), Self::Contingencies(other)) => number == other,
            (Self::WhereAreYou, Self::WhereAreYou) => true,
            (Self::Alarm(kind, _), Self::Alarm(other, _)) => kind == other,
            // What became of a plan is told once more where an operator knows better.
            (Self::Ended(_), _) => true,
            _ => false,
        }
    }

    /// The number of the version that it speaks of.
    pub(crate) fn version_number(&self) -> Option<u32> {
        match self {
            Self::Version(number) | Self::Offer(number) | Self::Contingencies(number) => {
                Some(*number)
            }
            Self::Assigned => Some(FIRST_VERSION),
            _ => None,
        }
    }
}

/// A message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MailEntry {
    pub(crate) drone: Arc<str>,
    /// Of all messages of this edge; those of a drone rise. The key of its row.
    #[serde(skip)]
    pub(crate) number: u64,
    pub(crate) plan: Arc<str>,
    pub(crate) at: Timestamp,
    /// Ids of the closures that it is for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) causes: Vec<String>,
    pub(crate) content: Content,
}

impl MailEntry {
    pub(crate) fn key(&self) -> MailKey {
        (self.drone.clone(), self.number)
    }

    /// Whether it has to be told again, received or not: the version that it orders is still wanted.
    pub(crate) fn is_open_order(&self, plan: Option<&PlanEntry>) -> bool {
        let wanted = plan.and_then(|plan| plan.wanted.as_ref());
        let number = self.content.version_number();
        self.content.is_order() && wanted.is_some_and(|wanted| number == Some(wanted.number))
    }
}

/// The id of a message.
pub(crate) fn message_id(lineage: u64, number: u64) -> String {
    format!("{lineage}-{number}")
}

/// The number of the message with an id; 0, before all others, for one of a store that is gone.
///
/// # Errors
/// When it is not the id of a message.
pub(crate) fn message_number(id: &str, lineage: u64) -> Result<u64, Refusal> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contingencies_overtake_those_of_their_version() {
        let first = Content::Contingencies(1);
        assert!(first.overtakes(&Content::Contingencies(1)));
        assert!(!Content::Contingencies(2).overtakes(&first));
    }
}
