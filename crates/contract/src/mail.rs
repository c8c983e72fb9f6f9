//! What a drone is told by itself: the messages of its mailbox, and how a session begins.

use super::alarm::AlarmKind;
use super::first_stretch::UnsafeWay;
use super::outcome::Warning;
use super::plan::{EndedAs, PlanVersion};
use super::status::Stamp;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// What a message tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MessageKind {
    /// What it flies has to change: a version to acknowledge or to decline. Told again until it is, or until there is a
    /// newer one.
    Version,
    /// Something has opened: a better version, which it need not take.
    Offer,
    /// What was in its way is over, or lies behind it: it goes on as it flies.
    Relieved,
    /// The detours and alternates of a version, which was told without them.
    Contingencies,
    /// Something ahead has closed, and there is no way that it could be told.
    NoWay,
    /// Its plan is over, and not because it has landed.
    Ended,
    /// An operator was alarmed about it.
    Alarm,
    /// Where is it? Nothing was heard of it for long: it sends telemetry.
    WhereAreYou,
    /// It flies a delivery of the registry: the first version of its plan.
    Assigned,
}

impl MessageKind {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Version => "version",
            Self::Offer => "offer",
            Self::Relieved => "relieved",
            Self::Contingencies => "contingencies",
            Self::NoWay => "no_way",
            Self::Ended => "ended",
            Self::Alarm => "alarm",
            Self::WhereAreYou => "where_are_you",
            Self::Assigned => "assigned",
        }
    }
}

/// A message from the mailbox of a drone. It is told on every new session or stream until the drone says that it has
/// received it; a version until it is acknowledged, declined or overtaken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DroneMessage<'a> {
    /// `lineage-number`; numbers rise from message to message, also over restarts of the edge.
    pub id: Cow<'a, str>,
    /// Whose it is.
    pub drone_id: Cow<'a, str>,
    /// What it tells.
    pub kind: MessageKind,
    /// When it was put into the mailbox, RFC 3339.
    pub at: Cow<'a, str>,
    /// The plan that it is about.
    pub plan_id: Cow<'a, str>,
    /// What is to be flown, may be flown, was assigned, or has its contingencies now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<PlanVersion<'a>>,
    /// Ids of the zones and closures that it is for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<Cow<'a, str>>,
    /// The least bad way, where there is no other; it crosses something closed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsafe_way: Option<UnsafeWay<'a>>,
    /// What became of the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_as: Option<EndedAs>,
    /// What an operator was alarmed about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alarm: Option<AlarmKind>,
    /// What is wrong and what to do, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<Cow<'a, str>>,
    /// The world of this message.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// A drone has received messages: the body of `POST /v1/drones/{id}/received`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Received {
    /// Id of the last message that it has received; all before it are received with it.
    #[schema(pattern = "^[0-9]{1,15}-[0-9]{1,15}$")]
    pub through: String,
}

/// How many messages are left in the mailbox of a drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct MailLeft<'a> {
    /// Whose mailbox.
    pub drone_id: Cow<'a, str>,
    /// How many: versions that wait for their acknowledgement, and what came later.
    pub left: u32,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// A drone on the line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HelloDrone {
    /// Its id.
    pub drone_id: String,
    /// The session of it that this one ends, where it had one: the id from the last welcome.
    pub ends_session: Option<String>,
    /// Id of the last message that it has received, where it has received any.
    pub received_through: Option<String>,
}

/// A drone that is not on the line of a session after its hello.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RefusedDrone<'a> {
    /// Its id.
    pub drone_id: Cow<'a, str>,
    /// Why, and what to do.
    pub reason: Warning<'a>,
}

/// The answer to a hello.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Welcome<'a> {
    /// Id of the session, to name when a drone comes back on another connection.
    pub session_id: Cow<'a, str>,
    /// The drones that are on its line now because of the hello.
    pub drones: Vec<Cow<'a, str>>,
    /// Those that are not.
    pub refused: Vec<RefusedDrone<'a>>,
    /// The sessions that have ended for it, each with its drone.
    pub ended: Vec<EndedSession<'a>>,
    /// The world of this answer.
    pub stamp: Stamp<'a>,
}

/// A drone left the line of a session, as another one took it over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndedSession<'a> {
    /// The drone.
    pub drone_id: Cow<'a, str>,
    /// The session that it was on.
    pub session_id: Cow<'a, str>,
    /// The session that it is on now.
    pub taken_over_by: Cow<'a, str>,
}
