//! What the flight model adds to plans and answers, as messages and back.

use super::mirror::{mirror, mirror_enum};
use crate::wire;

mirror_enum!(StopKind {
    Start,
    Charge,
    Swap
});
mirror_enum!(PadReservation {
    Confirmed,
    Unconfirmed
});

mirror!(wire::Stop<'_> => Stop {
    node: plain,
    pad: plain,
    kind: plain,
    before_leg: plain,
    lands_at: time,
    takes_off_at: time,
    waits_s: plain,
    battery_before_fraction: plain,
    battery_after_fraction: plain,
    reservation: plain,
    service_s: plain,
});

mirror!(wire::PadHold<'_> => PadHold {
    node: plain,
    pad: plain,
    until: time,
});

mirror!(wire::Flight<'_> => Flight {
    airframe: plain,
    objective: plain,
    battery_at_departure_fraction: plain,
    battery_at_arrival_fraction: plain,
    energy_wh: plain,
    cost_usd: plain,
    reserve_fraction: plain,
    reserve_used: plain,
    proved: plain,
    value: plain,
    lower_bound: plain,
    unproved_reason: plain,
    hold: plain,
    stops: plain,
});

mirror!(wire::LegFlight<'_> => LegFlight {
    service_id: plain,
    time_s: plain,
    airspeed_mps: plain,
    ground_speed_mps: plain,
    energy_wh: plain,
    battery_before_fraction: plain,
    battery_after_fraction: plain,
    payload_kg: plain,
    cost_usd: plain,
});

mirror!(wire::DetourFlight<'_> => DetourFlight {
    arrives_at: time,
    battery_at_arrival_fraction: plain,
    reserve_used: plain,
});

mirror!(wire::FlightCause<'_> => FlightCause {
    code: plain,
    message: plain,
    id: plain,
    plan_id: plain,
    node: plain,
    segment: plain,
    missing_fraction: plain,
    from: maybe_time,
    until: maybe_time,
});

mirror!(wire::Opening<'_> => Opening {
    departs_at: time,
    arrives_at: time,
});
