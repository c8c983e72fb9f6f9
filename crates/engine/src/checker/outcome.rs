//! That an outcome says what the path does.

use super::claim::{Claim, Drone, Flag, Need, Sky, Told};
use super::fault::{Fault, Place, Rule};
use crate::network::NodeIx;

/// Times this much apart, in seconds, count as equal: instants that were stored are rounded.
const SAME_S: f64 = 2e-3;

/// Without a path there is nothing to fly, and nothing that says so.
pub(super) fn without_path(claim: &Claim<'_>) -> Result<(), Fault> {
    let is_bare = claim.nodes.is_empty()
        && claim.segments.is_empty()
        && claim.stretch.is_none()
        && claim.length_m.is_none()
        && claim.flight.is_none();
    if !is_bare {
        return Err(Fault::new(Rule::Outcome, Place::Answer));
    }
    match Flag::ALL.into_iter().find(|flag| claim.flags.has(*flag)) {
        Some(flag) => Err(Fault::new(Rule::FlagWithoutGround(flag), Place::Answer)),
        None => Ok(()),
    }
}

/// A drone on the ground in an active zone stays on its pad.
pub(super) fn on_the_ground(
    claim: &Claim<'_>,
    drone: &Drone<'_>,
    sky: &Sky<'_>,
) -> Result<(), Fault> {
    // When a flight departs is looked at with its times.
    let Some(node) = drone.stands_at.filter(|_| claim.flight.is_none()) else {
        return Ok(());
    };
    let stays = claim.told == Told::Hold;
    if !stays && sky.closes_node(node) && is_in_zone_now(sky, node) {
        return Err(Fault::new(Rule::SentUp, Place::Node(node)));
    }
    Ok(())
}

/// Whether a zone that is in force closes a node.
fn is_in_zone_now(sky: &Sky<'_>, node: NodeIx) -> bool {
    let mut causes = sky.airspace.in_force();
    let brought = sky.own.zone;
    causes
        .any(|closure| closure.zone().is_some() && closure.hits.nodes.binary_search(&node).is_ok())
        || brought.is_some_and(|(_, hits)| hits.nodes.binary_search(&node).is_ok())
}

/// What the path does is what the outcome says.
pub(super) fn with_path(claim: &Claim<'_>, drone: &Drone<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    let wrong = Fault::new(Rule::Outcome, Place::Answer);
    let (Some(&first), Some(&last)) = (claim.nodes.first(), claim.nodes.last()) else {
        return Err(wrong);
    };
    if claim.has_unsafe_way {
        return Err(wrong);
    }
    let may_fly_on = match drone.need {
        Need::Nothing => true,
        Need::Pad { shown } => shown,
        Need::Ground => false,
    };
    let goal = served(claim, drone)?;
    match claim.told {
        Told::Rerouted if last == goal && may_fly_on => Ok(()),
        Told::Unaffected if last == goal && may_fly_on => flies_on(claim, drone),
        Told::Hold => {
            let waits_on_pad = drone.stands_at == Some(first) || sky.has_open_pads(first);
            let waits = claim.flight.is_some() || waits_on_pad;
            let leads_there = last == goal || claim.segments.is_empty();
            match waits && leads_there {
                true => Ok(()),
                false if leads_there => Err(Fault::new(Rule::Pad, Place::Node(first))),
                false => Err(wrong),
            }
        }
        Told::Diverted => lands(claim, last, drone, sky),
        Told::Rerouted | Told::Unaffected | Told::NoRoute => Err(wrong),
    }
}

/// Where the path has to end: where the delivery goes once it has been served at all stops that the flight makes for it. They
/// are its next ones, and none is shorter than it takes.
fn served(claim: &Claim<'_>, drone: &Drone<'_>) -> Result<NodeIx, Fault> {
    let stops = claim.flight.map_or(&[][..], |flight| &flight.plan.stops);
    let mut onward = drone.onward.iter();
    for (number, stop) in stops.iter().enumerate() {
        let Some(stated_s) = stop.service_s else {
            continue;
        };
        let place = Place::Stop(number);
        let next = onward.next().filter(|next| next.node == stop.node);
        let Some(next) = next else {
            return Err(Fault::new(Rule::Service, place));
        };
        let stay_s = (stop.takes_off_s - stop.lands_s).min(stated_s);
        if stay_s < next.service_s - SAME_S {
            return Err(Fault::figures(Rule::Service, place, stay_s, next.service_s));
        }
    }
    let next = onward.next();
    match (drone.onward.is_empty(), next) {
        (true, _) => Ok(drone.destination),
        (false, Some(next)) => Ok(next.node),
        (false, None) => Err(Fault::new(Rule::Service, Place::Answer)),
    }
}

/// What is unaffected is what was planned, from the leg that the drone is on to where it is served next.
fn flies_on(claim: &Claim<'_>, drone: &Drone<'_>) -> Result<(), Fault> {
    let (from, to) = drone.leg;
    let first = claim.nodes.first();
    let goes_on = match first {
        Some(&node) if node == to => true,
        Some(&node) => node == from && (claim.nodes.get(1) == Some(&to) || from == to),
        None => false,
    };
    let stops = claim.flight.map_or(&[][..], |flight| &flight.plan.stops);
    let mut served = stops.iter().filter(|stop| stop.service_s.is_some());
    let all = claim.nodes.len();
    let end = served
        .next()
        .map_or(all, |stop| (stop.before_leg + 1).min(all));
    let nodes = &claim.nodes[..end];
    let is_planned = drone.planned.is_none_or(|planned| {
        let ahead = planned.len().checked_sub(nodes.len());
        ahead.is_some_and(|ahead| ahead <= 1 && planned[ahead..] == *nodes)
    });
    match goes_on && is_planned {
        true => Ok(()),
        false => Err(Fault::new(Rule::Outcome, Place::Answer)),
    }
}

/// A diversion ends at a pad that can be used; a drone that has to come down ends at any node that is not closed.
///
/// In flight, whether either is closed is looked at when the drone is there.
fn lands(claim: &Claim<'_>, node: NodeIx, drone: &Drone<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    let is_flown = claim.flight.is_some();
    let may_land = match drone.need {
        Need::Ground => is_flown || !sky.closes_node(node),
        Need::Nothing | Need::Pad { .. } if drone.stands_at == Some(node) => true,
        Need::Nothing | Need::Pad { .. } if is_flown => sky.has_pads(node),
        Need::Nothing | Need::Pad { .. } => sky.has_open_pads(node),
    };
    match may_land {
        true => Ok(()),
        false => Err(Fault::new(Rule::Pad, Place::Node(node))),
    }
}
