//! What is closed and why, what waits for an operator, and events, as messages and back.

use super::convert::{FromProto, IntoProto, Unreadable};
use super::convert_zone::{feature_of, zone_of};
use super::mirror::{mirror, mirror_enum, required};
use super::proto;
use crate::wire;
use std::borrow::Cow;

mirror_enum!(ClosureCause {
    Zone,
    Report,
    Operator
});
mirror_enum!(ProposalSubject { Zone, Closure });
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

mirror!(wire::Wind => Wind {
    area: maybe_json,
    from: time,
    until: time,
    speed_mps: plain,
    from_deg: plain,
});

mirror!(wire::WeatherAnswer<'_> => WeatherAnswer {
    wind: plain,
    etag: plain,
    stamp: message,
});

mirror!(wire::AffectedPlan<'_> => AffectedPlan {
    plan_id: plain,
    drone_id: plain,
    outcome: plain,
    path: message,
    extra_m: plain,
    version: plain,
});

mirror!(wire::ZoneEffect<'_> => ZoneEffect {
    in_force: plain,
    closes_from: maybe_time,
    segment_count: plain,
    segments: plain,
    node_count: plain,
    nodes: plain,
    plan_count: plain,
    plans: plain,
    hint: plain,
    pending: plain,
    next: plain,
});

mirror!(wire::ZoneAck<'_> => ZoneAck {
    zone: zone,
    etag: plain,
    enforced: plain,
    durable: plain,
    effect: message,
    stamp: message,
});

mirror!(wire::Closure<'_> => Closure {
    id: plain,
    cause: plain,
    reason: plain,
    reported_by: plain,
    confirmed: plain,
    from: maybe_time,
    until: maybe_time,
    in_force: plain,
    closes_from: maybe_time,
    segment_count: plain,
    segments: plain,
    node_count: plain,
    nodes: plain,
    pads: plain,
    etag: plain,
    effect: plain,
});

mirror!(wire::Closures<'_> => ListClosuresResponse {
    closures: plain,
    next_page_token: plain,
    stamp: message,
});

mirror!(wire::Proposal<'_> => Proposal {
    id: plain,
    subject: plain,
    reason: plain,
    proposed_at: time,
    expires_at: time,
    recomposition_id: plain,
    drone_id: plain,
    zone: maybe_zone,
    segments: plain,
    pads: plain,
});

mirror!(wire::Proposals<'_> => ListProposalsResponse {
    proposals: plain,
    next_page_token: plain,
    stamp: message,
});

mirror!(wire::ClockState<'_> => ConfirmClockResponse {
    now: time,
    confirmed_step_s: plain,
    stamp: message,
});

mirror!(wire::Hold<'_> => Hold {
    id: plain,
    origin: plain,
    reason: plain,
    held_at: time,
    closure_count: plain,
    closures: plain,
    ours: maybe_json,
    kept_as: plain,
});

mirror!(wire::Holds<'_> => ListHoldsResponse {
    holds: plain,
    next_page_token: plain,
    stamp: message,
});

mirror!(wire::Event<'_> => Event {
    id: plain,
    kind: plain,
    at: time,
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

impl IntoProto<proto::ListZonesResponse> for wire::ZoneList<'_> {
    fn into_proto(self) -> proto::ListZonesResponse {
        proto::ListZonesResponse {
            zones: self.features.iter().map(zone_of).collect(),
            etags: self.etags.into_iter().map(Cow::into_owned).collect(),
            next_page_token: self.next_page_token,
            stamp: Some(self.stamp.into_proto()),
        }
    }
}

impl FromProto<proto::ListZonesResponse> for wire::ZoneList<'_> {
    fn from_proto(message: proto::ListZonesResponse) -> Result<Self, Unreadable> {
        Ok(Self {
            kind: "FeatureCollection".into(),
            features: message.zones.iter().map(feature_of).collect(),
            etags: message.etags.into_iter().map(Cow::Owned).collect(),
            next_page_token: message.next_page_token,
            stamp: wire::Stamp::from_proto(required!(message.stamp, stamp))?,
        })
    }
}
