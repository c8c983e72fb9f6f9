//! Plans, drones, the network, and what all services share, as messages and back.

use super::convert::{FromProto, IntoProto, Unreadable, number_value};
use super::mirror::{mirror, mirror_enum};
use super::proto;
use crate::wire;
use serde_json::{Map, Value};

mirror_enum!(Freshness {
    Fresh,
    Stale,
    Degraded
});
mirror_enum!(ClockKind {
    Real,
    Simulated,
    External
});
mirror_enum!(Outcome {
    Rerouted,
    Unaffected,
    Hold,
    Diverted,
    NoRoute
});
mirror_enum!(PlanState {
    Accepted,
    Activated,
    Nonconforming,
    Contingent,
    Ended
});
mirror_enum!(EndedAs {
    Delivered,
    Diverted,
    Cancelled,
    Lost
});
mirror_enum!(PlanFlag {
    Affected,
    Overdue,
    Unacknowledged,
    Silent
});

mirror!(wire::ServiceStop<'_> => ServiceStop {
    node: plain,
    service_s: plain,
});

mirror!(wire::SentVersion<'_> => SentVersion {
    version: plain,
    sent_at: time,
    outcome: plain,
});

mirror!(wire::Stamp<'_> => Stamp {
    revision: plain,
    topology_revision: plain,
    registry_revision: plain,
    registry_age_s: plain,
    freshness: plain,
    clock: plain,
    network: message,
});

mirror!(wire::NetworkName<'_> => NetworkName {
    name: plain,
    sha256: plain,
});

mirror!(wire::ClockReading<'_> => GetClockResponse {
    kind: plain,
    time: time,
    rate: plain,
});

mirror!(wire::ClockAdvanced<'_> => AdvanceToResponse {
    time: time,
    fired: plain,
    stamp: message,
});

mirror!(wire::Path<'_> => Path {
    nodes: plain,
    segments: plain,
});

mirror!(wire::Warning<'_> => Warning {
    code: plain,
    message: plain,
});

mirror!(wire::Contingency<'_> => Contingency {
    outcome: plain,
    nodes: plain,
    rejoins: plain,
    remaining_length_m: plain,
    extra_m: plain,
    flight: plain,
});

mirror!(wire::Alternate<'_> => Alternate {
    node: plain,
    nodes: plain,
    length_m: plain,
    flight: plain,
});

mirror!(wire::Leg<'_> => Leg {
    from: plain,
    to: plain,
    segment: plain,
    length_m: plain,
    length_air_m: plain,
    geometry: plain,
    height_reference: plain,
    speed_mps: plain,
    speed_limit_mps: plain,
    climb_m: plain,
    departs_at: time,
    arrives_at: time,
    if_closed: plain,
    alternate: plain,
    flight: plain,
});

mirror!(wire::Conflict<'_> => Conflict {
    plan_id: plain,
    segment: plain,
    leg: plain,
    direction: plain,
    gap_s: plain,
});

mirror!(wire::PlanVersion<'_> => PlanVersion {
    version: plain,
    epoch: plain,
    token: plain,
    sent_at: time,
    outcome: plain,
    first_stretch: plain,
    path: message,
    length_m: plain,
    flight_time_s: plain,
    departs_at: time,
    arrives_at: time,
    legs: plain,
    recomposition_id: plain,
    acknowledge_by: maybe_time,
    flight: plain,
    flags: plain,
    warnings: plain,
});

mirror!(wire::Plan<'_> => Plan {
    id: plain,
    state: plain,
    ended_as: plain,
    flags: plain,
    drone_id: plain,
    delivery_id: plain,
    source: plain,
    destination: plain,
    stops: plain,
    payload_kg: plain,
    airspeed_mps: plain,
    airframe: plain,
    objective: plain,
    deadline: maybe_time,
    priority: plain,
    expires_at: maybe_time,
    reported: message,
    wanted: plain,
    versions: plain,
    affected_by: plain,
    conflicts: plain,
    energy: plain,
    assumed: plain,
    times: plain,
    stamp: message,
});

mirror!(wire::PlanCounts => PlanCounts {
    accepted: plain,
    activated: plain,
    nonconforming: plain,
    contingent: plain,
    ended: plain,
});

mirror!(wire::Plans<'_> => ListPlansResponse {
    plans: plain,
    next_page_token: plain,
    counts: message,
    stamp: message,
});

mirror!(wire::Position<'_> => Position {
    drone_id: plain,
    accepted: plain,
    plan_id: plain,
    affected: plain,
    wanted: plain,
    recomposition_id: plain,
    warnings: plain,
});

mirror!(wire::TelemetryAnswer<'_> => ReportTelemetryResponse {
    positions: plain,
    stamp: message,
});

mirror!(wire::NearNode<'_> => NearNode {
    id: plain,
    location: message,
    distance_m: plain,
    pads: plain,
    closed: plain,
});

mirror!(wire::Nearest<'_> => NearestResponse {
    nodes: plain,
    stamp: message,
});

impl IntoProto<proto::Place> for wire::Place {
    fn into_proto(self) -> proto::Place {
        use proto::place::Place;
        let place = match self {
            Self::Pair([lon, lat]) => Place::LonLat(proto::LonLat { lon, lat }),
            Self::Planar { x, y } => Place::Planar(proto::PlanarPosition { x, y }),
            Self::Node(id) => Place::Node(id.into_proto()),
        };
        proto::Place { place: Some(place) }
    }
}

impl FromProto<proto::Place> for wire::Place {
    fn from_proto(message: proto::Place) -> Result<Self, Unreadable> {
        use proto::place::Place;
        match message.place {
            Some(Place::LonLat(proto::LonLat { lon, lat })) => Ok(Self::Pair([lon, lat])),
            Some(Place::Planar(proto::PlanarPosition { x, y })) => Ok(Self::Planar { x, y }),
            Some(Place::Node(id)) => Ok(Self::Node(wire::Id::new(id))),
            None => Err(Unreadable::Missing { field: "place" }),
        }
    }
}

/// The entry as REST has it, for the reader that passes over what it cannot read, entry by entry.
pub(super) fn telemetry_value(entry: proto::TelemetryEntry) -> Value {
    let mut fields = Map::new();
    if !entry.drone_id.is_empty() {
        fields.insert("drone_id".to_owned(), Value::from(entry.drone_id));
    }
    if let Some(place) = entry.location {
        fields.insert("location".to_owned(), place_value(place));
    }
    if let Some(instant) = &entry.timestamp {
        let text = super::convert::instant_text(instant);
        fields.insert("timestamp".to_owned(), Value::from(text));
    }
    let numbers = [
        ("altitude_m", entry.altitude_m),
        ("battery_fraction", entry.battery_fraction),
        ("ground_speed_mps", entry.ground_speed_mps),
        ("heading_deg", entry.heading_deg),
        ("fraction", entry.fraction),
    ];
    for (name, number) in numbers {
        if let Some(number) = number {
            fields.insert(name.to_owned(), number_value(number));
        }
    }
    let others = [
        (
            "altitude_reference",
            entry.altitude_reference.map(Value::from),
        ),
        ("airborne", entry.airborne.map(Value::from)),
        ("leg", entry.leg.map(Value::from)),
    ];
    for (name, value) in others {
        if let Some(value) = value {
            fields.insert(name.to_owned(), value);
        }
    }
    Value::Object(fields)
}

/// A place as REST has it; one that says nothing is an object that says nothing.
fn place_value(place: proto::Place) -> Value {
    match wire::Place::from_proto(place) {
        Ok(wire::Place::Pair([lon, lat])) => {
            Value::Array(vec![number_value(lon), number_value(lat)])
        }
        Ok(wire::Place::Planar { x, y }) => {
            serde_json::json!({"x": number_value(x), "y": number_value(y)})
        }
        Ok(wire::Place::Node(id)) => serde_json::json!({"node": id}),
        Err(_) => Value::Object(Map::new()),
    }
}
