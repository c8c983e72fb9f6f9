//! Flights in the words of the checker.

use crate::checker::{ClosedTimes, FlightClaim, FlightSky};
use crate::delivery::FlightComposition;
use crate::flight::Reservation;
use crate::itinerary::FlightSetting;
use crate::network::NodeIx;

/// What a flight is held against.
#[derive(Clone, Copy)]
pub struct FlightWorld<'a> {
    /// The drone with its payload in the wind. What it says is in the way is not looked at.
    pub setting: &'a FlightSetting,
    /// What is closed when.
    pub closed: &'a ClosedTimes,
    /// Whether a node swaps batteries.
    pub swaps: &'a dyn Fn(NodeIx) -> bool,
    /// Whether somebody else has a pad at some time between two instants, in seconds.
    pub is_taken: &'a dyn Fn(NodeIx, u16, f64, f64) -> bool,
    /// For how long a pad has to be free for a drone that lands elsewhere than at its destination, in seconds.
    pub refuge_stay_s: f64,
}

impl std::fmt::Debug for FlightWorld<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("FlightWorld")
            .finish_non_exhaustive()
    }
}

impl<'a> FlightWorld<'a> {
    pub(super) fn sky(&self) -> FlightSky<'a> {
        FlightSky {
            legs: self.setting.legs(),
            airframe: self.setting.airframe(),
            rules: self.setting.rules(),
            closed: self.closed,
            swaps: self.swaps,
            is_taken: self.is_taken,
            refuge_stay_s: self.refuge_stay_s,
        }
    }
}

/// What a composition says of times, battery and pads.
pub fn claim_of_flight(
    composition: &FlightComposition,
    alternate: Option<Reservation>,
    is_energy_checked: bool,
) -> FlightClaim<'_> {
    FlightClaim {
        start: composition.plan.start,
        plan: &composition.plan,
        began_s: composition.began_s,
        alternate,
        reserve: composition.reserve,
        is_energy_checked,
    }
}
