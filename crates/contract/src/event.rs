//! What happened: the events of `GET /v1/events`.

use super::author::Author;
use super::status::ClockKind;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::borrow::Cow;

/// What kind of thing happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A zone is new or has another version: its feature.
    ZonePut,
    /// A zone is gone: its id.
    ZoneDeleted,
    /// A closure that no zone causes is new, renewed, confirmed or extended.
    ClosurePut,
    /// A closure that no zone causes is gone: lifted or over.
    ClosureEnded,
    /// A window has opened or closed by itself: the ids of what counts or ceased to.
    WindowsTurned,
    /// A failure report was answered: a summary as in `GET /v1/recompositions`.
    Recomposed,
    /// A plan is new.
    PlanComposed,
    /// Something ahead of a plan has closed, or the wind leaves it short.
    PlanAffected,
    /// What affected a plan is over, or lies behind its drone: it is flown as it was, unless something else affects it.
    PlanRelieved,
    /// Something has opened, so that a better version is offered; the plan stays as it is unless it is acknowledged.
    PlanOffered,
    /// A drone took over a recomposed version.
    PlanAcknowledged,
    /// A recomposed version was not acknowledged in time.
    PlanUnacknowledged,
    /// A drone does not take a recomposed version over.
    PlanDeclined,
    /// The drone of a plan is elsewhere, higher, lower, earlier or later than anything that it was told has it.
    PlanNonconforming,
    /// The drone of a plan is where it is to be again, or heard of again.
    PlanConforming,
    /// Nothing was heard of the drone of a plan in flight for long.
    PlanContingent,
    /// A plan has not ended some time after its arrival.
    PlanOverdue,
    /// A plan is over; `ended_as` says what became of it.
    PlanEnded,
    /// An answer did not pass the checker and was not sent: why, and what went instead.
    CheckerCase,
    /// A report brought something that an operator is to decide.
    ProposalMade,
    /// An operator decided it, or its time is over.
    ProposalDecided,
    /// Removals wait for an operator.
    HoldMade,
    /// An operator decided them.
    HoldDecided,
    /// The registry said something that cannot be taken over: what, and why.
    RegistryRefused,
    /// The registry has not been heard for so long that answers are stale.
    RegistryLost,
    /// The registry is heard again.
    RegistryBack,
    /// The registry began a new epoch: what differs from before.
    RegistryEpoch,
    /// The registry will not take a change made here: which, and why.
    ForwardRefused,
    /// Another network is in service: its name, its size and its topology revision.
    NetworkChanged,
    /// The weather is stated anew: the wind.
    WeatherPut,
    /// The wall clock has stepped: by how much. Nothing opens by it until an operator confirms it.
    ClockStepped,
    /// A stepped clock was confirmed, or has come back: why.
    ClockSettled,
    /// The drones of all plans that a closure meets have been told what to fly: how many, by outcome.
    Replanned,
    /// Something needs an operator: the alarm, as in `GET /v1/alarms`.
    AlarmRaised,
    /// An operator acknowledged an alarm.
    AlarmAcknowledged,
    /// What an alarm was about is over.
    AlarmEnded,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Event<'a> {
    /// `epoch-sequence`; give the last one seen as `Last-Event-ID` to go on from there.
    pub id: Cow<'a, str>,
    /// What kind.
    pub kind: EventKind,
    /// When, RFC 3339.
    pub at: Cow<'a, str>,
    /// What clock that time is of.
    pub clock: ClockKind,
    /// Revision of the edge after it.
    pub revision: Cow<'a, str>,
    /// Who has made it happen; the role `edge` where it happened by itself.
    pub by: Author,
    /// Why, where they have said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Cow<'a, str>>,
    /// What it is about, by its kind.
    #[schema(value_type = Object)]
    pub data: Value,
}
