//! Answers to failure reports, as messages and back.

use super::convert::{FromProto, IntoProto, Unreadable};
use super::mirror::{mirror, mirror_enum};
use super::proto;
use crate::wire;

mirror_enum!(FailureType {
    Environmental,
    Navigational,
    Regulatory,
    Infrastructure,
    Operational,
    ServiceLevel,
});
mirror_enum!(OperationalDetail {
    Battery,
    Payload,
    Propulsion,
    LandNow,
});
mirror_enum!(Strategy {
    Exact,
    TwoPhased,
    CellDensity,
    Radius,
    Dijkstra,
    Astar,
    BellmanFord,
});
mirror_enum!(Scope { Local, Global });
mirror_enum!(Stage {
    Global,
    Circle,
    Cells,
    Triangle,
    Rhombus,
    Rectangle,
    Grown,
    Local,
});
mirror_enum!(PublicationState {
    Published,
    Proposed,
    None
});

mirror!(wire::Repair<'_> => Repair {
    from: plain,
    to: plain,
    recomposed_length_m: plain,
    stage: plain,
    searches: plain,
    area_nodes: plain,
    area_segments: plain,
    settled_nodes: plain,
});

mirror!(wire::AreaStage<'_> => AreaStage {
    stage: plain,
    skipped: plain,
    nodes: plain,
    area: json,
    searched: plain,
    path_found: plain,
});

mirror!(wire::Publication<'_> => Publication {
    state: plain,
    closure_id: plain,
    proposal_ids: plain,
    reason: plain,
});

mirror!(wire::PlanReference<'_> => PlanReference {
    id: plain,
    version: plain,
});

mirror_enum!(StretchKind {
    Leg,
    Straight,
    None
});
mirror_enum!(Flag {
    LeavingZone,
    CannotStop,
    Unverified,
    ReserveUsed,
    PadOccupied,
    Unseparated,
});

mirror!(wire::Waypoint => Waypoint {
    x: plain,
    y: plain,
    height_m: plain,
});

mirror!(wire::FirstStretch<'_> => FirstStretch {
    kind: plain,
    from: plain,
    to: plain,
    segment: plain,
    fraction: plain,
    enters: plain,
    length_m: plain,
    overrun_m: plain,
    geometry: plain,
});

mirror!(wire::UnsafeWay<'_> => UnsafeWay {
    reason: plain,
    code: plain,
    nodes: plain,
    geometry: plain,
    length_m: plain,
    battery_fraction: plain,
});

mirror!(wire::Near<'_> => Near {
    node: plain,
    length_m: plain,
    pads: plain,
    battery_fraction: plain,
    why_not: plain,
});

mirror!(wire::IfAirborne<'_> => IfAirborne {
    outcome: plain,
    path: message,
    first_stretch: plain,
    first_stretch_m: plain,
    remaining_length_m: plain,
    flags: plain,
    unsafe_way: plain,
});

mirror!(wire::Answer<'_> => Answer {
    outcome: plain,
    path: message,
    first_stretch_m: plain,
    first_stretch: plain,
    flags: plain,
    unsafe_way: plain,
    near: plain,
    if_airborne: plain,
    recomposed_length_m: plain,
    remaining_length_m: plain,
    strategy: plain,
    strategy_used: plain,
    fallback_reason: plain,
    stage: plain,
    searches: plain,
    area_nodes: plain,
    area_segments: plain,
    settled_nodes: plain,
    local_optimum_m: plain,
    global_optimum_m: plain,
    remaining_optimum_m: plain,
    repairs: plain,
    severed_by: plain,
    stages: plain,
    warnings: plain,
    energy: plain,
    assumed: plain,
});

mirror!(wire::Recomposition<'_> => RecompositionAnswer {
    id: plain,
    answer: message,
    remaining_time_s: plain,
    times: plain,
    airframe: plain,
    publication: message,
    plan: plain,
    legs: plain,
    flight: plain,
    causes: plain,
    opens: plain,
    replayed: plain,
    valid_until: maybe_time,
    stamp: message,
});

mirror!(wire::BatchAnswer<'_> => ReportFailuresResponse {
    answers: plain,
});

mirror!(wire::Fault => Fault {
    code: plain,
    pointer: plain,
    message: plain,
    hint: plain,
});

impl IntoProto<proto::Problem> for wire::Problem {
    fn into_proto(self) -> proto::Problem {
        proto::Problem {
            r#type: self.kind,
            title: self.title,
            status: u32::from(self.status),
            code: self.code,
            detail: self.detail,
            errors: self.errors.into_proto(),
            request_id: self.request_id,
            retry_after_s: self.retry_after_s,
            current_etag: self.current_etag,
        }
    }
}

impl FromProto<proto::Problem> for wire::Problem {
    fn from_proto(message: proto::Problem) -> Result<Self, Unreadable> {
        Ok(Self {
            kind: message.r#type,
            title: message.title,
            status: u16::from_proto(message.status)?,
            code: message.code,
            detail: message.detail,
            errors: Vec::from_proto(message.errors)?,
            request_id: message.request_id,
            retry_after_s: message.retry_after_s,
            current_etag: message.current_etag,
            // Only a registry says it, which speaks no gRPC.
            oldest_revision: None,
            // Answers to failure reports wait for no disk.
            enforced: None,
            durable: None,
        })
    }
}

impl IntoProto<proto::BatchEntry> for wire::BatchEntry<'_> {
    fn into_proto(self) -> proto::BatchEntry {
        use proto::batch_entry::Entry;
        let entry = match self {
            Self::Recomposition(answer) => Entry::Recomposition((*answer).into_proto()),
            Self::Problem(problem) => Entry::Problem((*problem).into_proto()),
        };
        proto::BatchEntry { entry: Some(entry) }
    }
}

impl FromProto<proto::BatchEntry> for wire::BatchEntry<'_> {
    fn from_proto(message: proto::BatchEntry) -> Result<Self, Unreadable> {
        use proto::batch_entry::Entry;
        match message.entry {
            Some(Entry::Recomposition(answer)) => {
                let answer = wire::Recomposition::from_proto(answer)?;
                Ok(Self::Recomposition(Box::new(answer)))
            }
            Some(Entry::Problem(problem)) => {
                let problem = wire::Problem::from_proto(problem)?;
                Ok(Self::Problem(Box::new(problem)))
            }
            None => Err(Unreadable::Missing { field: "entry" }),
        }
    }
}

impl IntoProto<proto::Severance> for wire::Severance<'_> {
    fn into_proto(self) -> proto::Severance {
        let (cause, id) = match self {
            Self::Report => (proto::SeveranceCause::Report, None),
            Self::Closure { id } => (proto::SeveranceCause::Closure, Some(id.into_owned())),
            Self::Network => (proto::SeveranceCause::Network, None),
        };
        let cause = cause as i32;
        proto::Severance { cause, id }
    }
}

impl FromProto<proto::Severance> for wire::Severance<'_> {
    fn from_proto(message: proto::Severance) -> Result<Self, Unreadable> {
        let number = message.cause;
        match proto::SeveranceCause::try_from(number) {
            Ok(proto::SeveranceCause::Report) => Ok(Self::Report),
            Ok(proto::SeveranceCause::Network) => Ok(Self::Network),
            Ok(proto::SeveranceCause::Closure) => {
                let id = message.id.ok_or(Unreadable::Missing { field: "id" })?;
                Ok(Self::Closure { id: id.into() })
            }
            Ok(proto::SeveranceCause::Unspecified) | Err(_) => {
                let what = "SeveranceCause";
                Err(Unreadable::UnknownNumber { what, number })
            }
        }
    }
}
