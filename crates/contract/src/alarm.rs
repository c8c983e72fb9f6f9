//! Alarms: what an operator has to look at.

use super::status::Stamp;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What an alarm is about.
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
pub enum AlarmKind {
    /// A drone has no open way from where it is.
    NoRoute,
    /// A drone stands on a pad inside a zone without an end.
    Grounded,
    /// A drone gave no sign for long after it should have landed.
    Lost,
    /// A drone did not acknowledge a version in time.
    Unacknowledged,
    /// A drone declined every version it was sent.
    Declined,
    /// A drone is silent and may fly its contingencies.
    Contingent,
    /// A drone in the air has no way that keeps away from all others.
    Unseparated,
    /// An answer failed the check before it was sent.
    Checker,
    /// The edge itself cannot do all it should.
    Degraded,
    /// A drone has not landed in time.
    Overdue,
}

impl AlarmKind {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::NoRoute,
        Self::Grounded,
        Self::Lost,
        Self::Unacknowledged,
        Self::Declined,
        Self::Contingent,
        Self::Unseparated,
        Self::Checker,
        Self::Degraded,
        Self::Overdue,
    ];

    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoRoute => "no_route",
            Self::Grounded => "grounded",
            Self::Lost => "lost",
            Self::Unacknowledged => "unacknowledged",
            Self::Declined => "declined",
            Self::Contingent => "contingent",
            Self::Unseparated => "unseparated",
            Self::Checker => "checker",
            Self::Degraded => "degraded",
            Self::Overdue => "overdue",
        }
    }
}

/// Something that an operator has to look at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Alarm<'a> {
    /// Its id.
    pub id: Cow<'a, str>,
    /// What it is about.
    pub kind: AlarmKind,
    /// When it was first raised, RFC 3339.
    pub at: Cow<'a, str>,
    /// When it was last raised, RFC 3339: the same alarm again renews this one.
    pub renewed_at: Cow<'a, str>,
    /// How often it was raised.
    pub count: u64,
    /// The plan, where it is about one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan_id: Option<Cow<'a, str>>,
    /// The drone, where one is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drone_id: Option<Cow<'a, str>>,
    /// The answer that raised it, where one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recomposition_id: Option<Cow<'a, str>>,
    /// Ids of the zones and closures that cause it; at most 100.
    pub causes: Vec<Cow<'a, str>>,
    /// What is wrong and what to do, in words.
    pub message: Cow<'a, str>,
    /// When an operator acknowledged it, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged_at: Option<Cow<'a, str>>,
    /// The operator who did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acknowledged_by: Option<Cow<'a, str>>,
    /// When its cause ended, RFC 3339; it is then kept for the record.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_at: Option<Cow<'a, str>>,
}

/// A page of alarms, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Alarms<'a> {
    /// The alarms.
    pub alarms: Vec<Alarm<'a>>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_on_the_wire() {
        for kind in AlarmKind::ALL {
            assert_eq!(serde_json::to_value(kind).expect("JSON"), kind.name());
        }
    }
}
