//! Where a drone in flight re-enters the network: when, and with how much battery.

use super::flight_failure::{BatteryNow, FlightFailure};
use crate::flight::{FlightStart, Location, Reentry};
use crate::itinerary::{FlightCause, FlightSetting};
use crate::network::Topology;
use crate::recompose::ReentryPoints;

/// The battery of a drone now: as it says, or as its plan has it where it is.
pub(super) fn battery_now(topology: &Topology, failure: &FlightFailure<'_>) -> f64 {
    battery_after(failure.battery, fraction_flown(topology, failure))
}

/// The battery after a fraction of the leg.
fn battery_after(battery: BatteryNow, flown: f64) -> f64 {
    match battery {
        BatteryNow::Given(battery) | BatteryNow::Assumed(battery) => battery,
        BatteryNow::ByPlan { before, after } => before - flown * (before - after),
    }
}

/// The battery where a way back begins: a drone's place may be unknown, and then every way begins
/// where it is worst for it.
fn battery_where(topology: &Topology, failure: &FlightFailure<'_>, reentry: &Reentry) -> f64 {
    let leg = reentry.stretch.leg;
    let on_leg = leg.filter(|leg| (leg.from, leg.to) == failure.request.report.leg);
    let flown = on_leg.map_or_else(
        || fraction_flown(topology, failure),
        |leg| leg.fraction.clamp(0.0, 1.0),
    );
    battery_after(failure.battery, flown)
}

/// The fraction of its leg that the drone has flown; all of it where that is unknown.
fn fraction_flown(topology: &Topology, failure: &FlightFailure<'_>) -> f64 {
    let report = &failure.request.report;
    let place = match report.location {
        Location::LegStart => return 0.0,
        Location::Unknown => return 1.0,
        Location::At(place) => place,
    };
    let (from, to) = (
        topology.position(report.leg.0),
        topology.position(report.leg.1),
    );
    place.fraction_along(from, to)
}

/// The starts of a request, one for each way back that can be flown in this wind.
#[derive(Debug, Default)]
pub(super) struct Beginnings {
    /// Those that are reached with the floor, or where the drone is already.
    pub(super) starts: Vec<FlightStart>,
    /// Those that are reached with less, if at all.
    pub(super) short: Vec<FlightStart>,
    /// Why there are no others.
    pub(super) causes: Vec<FlightCause>,
}

impl Beginnings {
    /// The starts of all ways back.
    pub(super) fn of(
        setting: &FlightSetting,
        failure: &FlightFailure<'_>,
        ways: &ReentryPoints,
    ) -> Self {
        let mut found = Self::default();
        for reentry in &ways.ways {
            let battery = battery_where(setting.topology(), failure, reentry);
            match setting.start_by(reentry, battery, failure.at_s) {
                // A drone that is at the node need not draw on anything to get there.
                Ok(start) if start.battery < setting.rules().floor && start.flown_m > 0.0 => {
                    found.causes.push(FlightCause::BelowReserve);
                    found.short.push(start);
                }
                Ok(start) => found.starts.push(start),
                Err(why) => found.causes.push(FlightCause::Unflyable {
                    from: failure.request.report.leg.0,
                    segment: reentry.stretch.leg.and_then(|leg| leg.segment),
                    why,
                    legs: 1,
                }),
            }
        }
        found.causes.dedup();
        // A way that closes before it is flown is taken where there is no other.
        let stays_open = |start: &FlightStart| !setting.closes_on_stretch(start, failure.at_s);
        if found.starts.iter().any(stays_open) {
            found.starts.retain(stays_open);
        }
        found
    }

    /// All of them, for a drone that has to land whatever its battery.
    pub(super) fn all(&self) -> Vec<FlightStart> {
        self.starts.iter().chain(&self.short).copied().collect()
    }
}
