//! What drones are to fly: composed, recomposed, checked, held against what changes.

mod flown;
mod traffic;
mod version;

pub(super) use flown::{
    DetourEnd, DroneKind, FlightOrder, Flights, FlownAnswer, FlownVersion, LegEnds, RefusedAnswer,
    ReportedFlight, Reporter, ReportingDrone, Scene, Stand, Wanted, battery_of,
};
pub(super) use traffic::{OccupationKey, Own, PadKey, meets_others, shares_pad, stays, stays_at};
pub(super) use version::{Version, later, version_flags};
