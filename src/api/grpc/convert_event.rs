//! Events, as messages and back.

use super::mirror::{mirror, mirror_enum};
use crate::wire;

mirror_enum!(EventKind {
    ZonePut,
    ZoneDeleted,
    ClosurePut,
    ClosureEnded,
    WindowsTurned,
    Recomposed,
    PlanComposed,
    PlanAffected,
    PlanRelieved,
    PlanOffered,
    PlanAcknowledged,
    PlanUnacknowledged,
    PlanDeclined,
    PlanNonconforming,
    PlanConforming,
    PlanContingent,
    PlanOverdue,
    PlanEnded,
    CheckerCase,
    ProposalMade,
    ProposalDecided,
    HoldMade,
    HoldDecided,
    RegistryRefused,
    RegistryLost,
    RegistryBack,
    RegistryEpoch,
    ForwardRefused,
    NetworkChanged,
    WeatherPut,
    AlarmRaised,
    AlarmAcknowledged,
    AlarmEnded,
    Replanned,
    ClockStepped,
    ClockSettled,
});

mirror!(wire::Event<'_> => Event {
    id: plain,
    kind: plain,
    at: time,
    clock: plain,
    revision: plain,
    by: message,
    reason: plain,
    data: json,
});

mirror!(wire::Author => Author {
    tenant: plain,
    subject: plain,
    role: plain,
});
