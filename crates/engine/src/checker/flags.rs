//! That every flag has its ground, and that what holds is flagged.

use super::begin::Begun;
use super::claim::{Claim, Drone, Flag, Need, Sky, StretchKind, Told, Whereabouts};
use super::fault::{Fault, Place, Rule};
use super::lines::{OnLeg, is_in_zone};
use crate::geo::AltitudeBand;

pub(super) fn check(
    claim: &Claim<'_>,
    drone: &Drone<'_>,
    sky: &Sky<'_>,
    begun: &Begun,
) -> Result<(), Fault> {
    for flag in Flag::ALL {
        let is_set = claim.flags.has(flag);
        let (may, must) = match flag {
            Flag::LeavingZone => (is_set && is_in_active_zone(drone, sky), begun.is_in_zone),
            Flag::CannotStop => (begun.overruns, begun.overruns),
            Flag::Unverified => {
                let is_straight =
                    begun.stretch.kind == StretchKind::Straight && begun.stretch.length_m > 0.0;
                (is_straight, is_straight)
            }
            Flag::ReserveUsed => draws_on_reserve(claim, sky),
            Flag::PadOccupied => is_occupied(claim, drone, sky, is_set),
            // Only with times can two plans be apart; who looks at traffic is the planner.
            Flag::Unseparated => (claim.flight.is_some(), false),
        };
        if is_set && !may {
            return Err(Fault::new(Rule::FlagWithoutGround(flag), Place::Answer));
        }
        if must && !is_set {
            return Err(Fault::new(Rule::FlagMissing(flag), Place::Answer));
        }
    }
    Ok(())
}

/// Whether the place of the drone is in an active zone now.
fn is_in_active_zone(drone: &Drone<'_>, sky: &Sky<'_>) -> bool {
    let leg = OnLeg::of(drone, sky);
    // How high a drone flies that is off its leg is unknown.
    let band = if leg.is_off() {
        AltitudeBand::UNLIMITED
    } else {
        leg.band
    };
    let flown = leg.flown.filter(|_| !leg.is_off());
    let on_leg = flown.map(|flown| leg.ends.0.towards(leg.ends.1, flown));
    let place = match drone.at {
        Whereabouts::At(place) => Some(place),
        Whereabouts::LegStart => Some(leg.ends.0),
        Whereabouts::Unknown => None,
    };
    [place, on_leg]
        .into_iter()
        .flatten()
        .any(|place| is_in_zone(sky, place, &band))
}

/// Whether the reserve may be, and is, drawn on: only to land elsewhere.
fn draws_on_reserve(claim: &Claim<'_>, sky: &Sky<'_>) -> (bool, bool) {
    let (Some(flight), Some(world)) = (claim.flight, sky.flight) else {
        return (false, false);
    };
    let reserve = world.rules.reserve;
    let lowest = flight.lowest_battery();
    let is_below = lowest < reserve - 1e-6;
    // What was promised no more than the floor may stay above the reserve all the same.
    let may = claim.told == Told::Diverted && (is_below || flight.reserve < reserve);
    (may, is_below && claim.told == Told::Diverted)
}

/// Whether a drone that has to come down does so where no pad is free.
fn is_occupied(claim: &Claim<'_>, drone: &Drone<'_>, sky: &Sky<'_>, is_set: bool) -> (bool, bool) {
    let is_forced = claim.told == Told::Diverted && drone.need == Need::Ground;
    let Some(&node) = claim.nodes.last().filter(|_| is_forced && is_set) else {
        return (false, false);
    };
    let is_taken = match (claim.flight, sky.flight) {
        (Some(flight), Some(world)) => {
            let from_s = flight.plan.arrives_s;
            let until_s = from_s + world.refuge_stay_s;
            let pads = sky.airspace.topology().pads(node);
            (0..pads).all(|pad| (world.is_taken)(node, pad, from_s, until_s))
        }
        _ => !sky.has_open_pads(node),
    };
    (is_taken || !sky.has_open_pads(node), false)
}
