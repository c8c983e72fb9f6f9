//! Where a drone in flight re-enters the network: when, and with how much battery.

use super::failure::{BatteryNow, FlightFailure};
use crate::flight::{FlightStart, Location, Unflyable};
use crate::itinerary::{FlightCause, FlightSetting, UnderWay};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::WaysBack;

/// The battery of a drone now: as it says, or as its plan has it where it is.
pub(super) fn battery_now(topology: &Topology, failure: &FlightFailure<'_>) -> f64 {
    match failure.battery {
        BatteryNow::Given(battery) => battery,
        BatteryNow::ByPlan { before, after } => {
            let flown = fraction_flown(topology, failure);
            before - flown * (before - after)
        }
    }
}

/// The fraction of its leg that the drone has flown; all of it where nobody knows.
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
    let (along_x, along_y) = (to.x - from.x, to.y - from.y);
    let squared = along_x * along_x + along_y * along_y;
    if squared <= 0.0 {
        return 0.0;
    }
    let share = ((place.x - from.x) * along_x + (place.y - from.y) * along_y) / squared;
    share.clamp(0.0, 1.0)
}

/// The starts of a request, one for each way back that can be flown in this wind, down to the floor; where there is none, why.
pub(super) fn starts(
    setting: &FlightSetting,
    failure: &FlightFailure<'_>,
    ways: &WaysBack,
    battery: f64,
) -> Result<Vec<FlightStart>, Vec<FlightCause>> {
    let (mut starts, mut causes) = (Vec::new(), Vec::new());
    for way in &ways.ways {
        let start = match ways.segment.filter(|_| !ways.off_leg) {
            Some(segment) => {
                let length_m = setting.topology().segment(segment).length_m;
                let share = way.stretch.length_m / length_m;
                along_the_leg(setting, failure, segment, way.node, share, battery)
            }
            None => straight(setting, failure, way.node, battery),
        };
        let floor = setting.rules().floor;
        match (start, ways.segment) {
            // A drone that is at the node need not draw on anything to get there.
            (Ok(start), _) if start.battery < floor && start.flown_m > 0.0 => {
                causes.push(FlightCause::BelowReserve);
            }
            (Ok(start), _) => starts.push(start),
            (Err(why), Some(segment)) => causes.push(FlightCause::Unflyable {
                from: failure.request.report.leg.0,
                segment,
                why,
                legs: 1,
            }),
            (Err(_), None) => {}
        }
    }
    causes.dedup();
    match starts.is_empty() {
        true => Err(causes),
        false => Ok(starts),
    }
}

/// The start at an end of the leg that is so far ahead, as a share of the leg.
fn along_the_leg(
    setting: &FlightSetting,
    failure: &FlightFailure<'_>,
    segment: SegmentIx,
    node: NodeIx,
    share: f64,
    battery: f64,
) -> Result<FlightStart, Unflyable> {
    let (from, to) = failure.request.report.leg;
    let is_ahead = node == to;
    let drone = UnderWay {
        from,
        to,
        segment,
        flown: if is_ahead { 1.0 - share } else { share },
        battery,
        at_s: failure.at_s,
    };
    match is_ahead {
        true => setting.start_ahead(&drone),
        false => setting.start_behind(&drone),
    }
}

fn straight(
    setting: &FlightSetting,
    failure: &FlightFailure<'_>,
    node: NodeIx,
    battery: f64,
) -> Result<FlightStart, Unflyable> {
    let topology = setting.topology();
    let report = &failure.request.report;
    let place = match report.location {
        Location::At(place) => place,
        Location::LegStart => topology.position(report.leg.0),
        // The other end is the worst.
        Location::Unknown if node == report.leg.0 => topology.position(report.leg.1),
        Location::Unknown => topology.position(report.leg.0),
    };
    setting.start_straight(place, node, battery, failure.at_s)
}
