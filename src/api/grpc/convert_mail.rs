//! Mailboxes and sessions, as messages and back.

use super::mirror::{mirror, mirror_enum};
use crate::wire;

mirror_enum!(MessageKind {
    Version,
    Offer,
    Relieved,
    Contingencies,
    NoWay,
    Ended,
    Alarm,
    WhereAreYou,
    Assigned,
});
mirror_enum!(AlarmKind {
    NoRoute,
    Grounded,
    Lost,
    Unacknowledged,
    Declined,
    Contingent,
    Unseparated,
    Checker,
    Degraded,
    Overdue,
});

mirror!(wire::DroneMessage<'_> => DroneMessage {
    id: plain,
    drone_id: plain,
    kind: plain,
    at: time,
    plan_id: plain,
    version: plain,
    causes: plain,
    unsafe_way: plain,
    ended_as: plain,
    alarm: plain,
    text: plain,
    stamp: message,
});

mirror!(wire::MailLeft<'_> => MailLeft {
    drone_id: plain,
    left: plain,
    stamp: message,
});

mirror!(wire::HelloDrone => HelloDrone {
    drone_id: plain,
    ends_session: plain,
    received_through: plain,
});

mirror!(wire::RefusedDrone<'_> => RefusedDrone {
    drone_id: plain,
    reason: message,
});

mirror!(wire::Welcome<'_> => Welcome {
    session_id: plain,
    drones: plain,
    refused: plain,
    ended: plain,
    stamp: message,
});

mirror!(wire::EndedSession<'_> => EndedSession {
    drone_id: plain,
    session_id: plain,
    taken_over_by: plain,
});
