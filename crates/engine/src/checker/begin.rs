//! That a path begins where the drone is, and that the way to its first node passes nothing.

use super::claim::{Claim, Drone, Flag, OwnClosures, Sky, Stretch, StretchKind, Whereabouts};
use super::fault::{Fault, Place, Rule};
use super::lines::{OFF_LEG_M, OnLeg, is_in_zone, nearest_fraction, zone_parts};
use crate::airspace::Cause;
use crate::geo::{AltitudeBand, Point};
use crate::network::NodeIx;

/// Lengths and places this much apart, in metres, count as the same.
const SAME_M: f64 = 1e-2;
/// A drone that is in a zone by less than this, in metres, may count as outside.
const EDGE_M: f64 = 1.0;

/// Where an answer begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun {
    /// How it comes to the path.
    pub(super) stretch: Stretch,
    /// Whether the drone is well inside an active zone on its leg.
    pub(super) is_in_zone: bool,
    /// Whether the overrun enters something closed.
    pub(super) overruns: bool,
}

/// The way along the leg to one of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Back,
    On,
}

pub(super) fn check(claim: &Claim<'_>, drone: &Drone<'_>, sky: &Sky<'_>) -> Result<Begun, Fault> {
    let elsewhere = Fault::new(Rule::BeginsAtDrone, Place::FirstStretch);
    let (Some(stretch), Some(&first)) = (claim.stretch, claim.nodes.first()) else {
        return Err(elsewhere);
    };
    if stretch.enters != first {
        return Err(elsewhere);
    }
    if !(stretch.overrun_m >= 0.0 && stretch.overrun_m <= drone.stopping_m + SAME_M) {
        let (stated, most) = (stretch.overrun_m, drone.stopping_m);
        let place = Place::FirstStretch;
        return Err(Fault::figures(Rule::BeginsAtDrone, place, stated, most));
    }
    let leg = OnLeg::of(drone, sky);
    let is_there = drone.stands_at == Some(first) || is_at(drone, sky, first);
    if stretch.kind == StretchKind::None || (is_there && stretch.length_m <= SAME_M) {
        if !is_there || stretch.length_m > SAME_M {
            return Err(elsewhere);
        }
        return Ok(Begun::at(stretch));
    }
    // Past the end of its leg it comes back to a node over which it has flown.
    let comes_back = stretch.kind == StretchKind::Leg && is_past(&leg, drone, first);
    if sky.closes_node(first) && !comes_back {
        return Err(Fault::new(Rule::ClosedNode, Place::Node(first)));
    }
    if let Some(other) = stretch.leg.filter(|other| *other != drone.leg) {
        return match is_at(drone, sky, other.0) {
            true => along_another(&stretch, drone, other, sky),
            false => Err(elsewhere),
        };
    }
    match stretch.kind {
        StretchKind::Straight => straight(&stretch, drone, &leg, sky),
        StretchKind::Leg | StretchKind::None => along(&stretch, drone, &leg, sky),
    }
}

/// Along another segment of the node that the drone is at: so it leaves a zone that closes the node.
fn along_another(
    stretch: &Stretch,
    drone: &Drone<'_>,
    leg: (NodeIx, NodeIx),
    sky: &Sky<'_>,
) -> Result<Begun, Fault> {
    let there = Drone {
        leg,
        at: Whereabouts::LegStart,
        drift_m: 0.0,
        ..*drone
    };
    // What the drone reports is about its own leg.
    let own = OwnClosures {
        closes_leg: false,
        cause: None,
        ..sky.own
    };
    let sky = Sky { own, ..*sky };
    let on = OnLeg::of(&there, &sky);
    let is_own = on.segment.is_some() && on.segment == sky.own.segment;
    if is_own || stretch.enters != leg.1 {
        return Err(Fault::new(Rule::PassesCause, Place::FirstStretch));
    }
    along(stretch, &there, &on, &sky)
}

impl Begun {
    fn at(stretch: Stretch) -> Self {
        Self {
            stretch,
            is_in_zone: false,
            overruns: false,
        }
    }
}

/// Whether the drone is at a node.
fn is_at(drone: &Drone<'_>, sky: &Sky<'_>, node: NodeIx) -> bool {
    match drone.at {
        Whereabouts::At(place) => {
            place.distance_m(sky.airspace.topology().position(node)) <= SAME_M
        }
        Whereabouts::LegStart => drone.leg.0 == node,
        Whereabouts::Unknown => false,
    }
}

/// Whether a node is the end of the leg that the drone is past or beside, as near as it may be on it.
fn is_past(leg: &OnLeg, drone: &Drone<'_>, node: NodeIx) -> bool {
    let is_end = |fraction: f64, end: NodeIx| {
        let off_end_m = |flown: f64| (flown - fraction).abs() * leg.length_m;
        end == node && leg.flown.is_some_and(|flown| off_end_m(flown) <= SAME_M)
    };
    leg.off_m <= OFF_LEG_M && (is_end(0.0, drone.leg.0) || is_end(1.0, drone.leg.1))
}

/// Along the leg: to its start or to its end.
fn along(stretch: &Stretch, drone: &Drone<'_>, leg: &OnLeg, sky: &Sky<'_>) -> Result<Begun, Fault> {
    let elsewhere = Fault::new(Rule::BeginsAtDrone, Place::FirstStretch);
    if leg.off_m > OFF_LEG_M + SAME_M {
        return Err(elsewhere);
    }
    let way = match stretch.enters {
        node if node == drone.leg.0 => Way::Back,
        node if node == drone.leg.1 => Way::On,
        _ => return Err(elsewhere),
    };
    let length_m = along_m(way, stretch, drone, leg);
    let tolerance_m = SAME_M + 1e-6 * length_m;
    if (stretch.length_m - length_m).abs() > tolerance_m {
        return Err(Fault::figures(
            Rule::Length,
            Place::FirstStretch,
            stretch.length_m,
            length_m,
        ));
    }
    let zones = leg.zones(sky);
    let share = |metres: f64| match leg.length_m > 0.0 {
        true => metres / leg.length_m,
        false => 0.0,
    };
    let latest = leg.flown.map(|flown| flown + share(drone.drift_m));
    // What lies nearer than the drone needs to turn it cannot keep out of, and leaves on the shorter way.
    let turns = latest.map(|latest| latest + share(drone.stopping_m));
    let entered = |part: &&(f64, f64)| match (leg.flown, turns) {
        (Some(flown), Some(turns)) => part.0 > flown && part.0 <= turns,
        _ => false,
    };
    let flies_into = match way {
        Way::On => zones.iter().filter(entered).count(),
        Way::Back => 0,
    };
    let kept_out: Vec<(f64, f64)> = match flies_into {
        0 => Vec::new(),
        _ => zones
            .iter()
            .filter(|part| !entered(part))
            .copied()
            .collect(),
    };
    let forbidden = if flies_into == 0 { &zones } else { &kept_out };
    passes_nothing(way, leg, sky, forbidden)?;
    let (Some(flown), Some(latest)) = (leg.flown, latest) else {
        return Ok(Begun::at(*stretch));
    };
    let edge = share(EDGE_M);
    let is_inside = |part: &(f64, f64)| {
        let has_begun = part.0 <= 0.0 || part.0 + edge < flown;
        has_begun && (part.1 >= 1.0 || flown < part.1 - edge)
    };
    let turn = latest + share(stretch.overrun_m);
    // Who is in a zone already leaves it, whatever comes next.
    let may_enter = !zones.iter().any(|part| part.0 <= flown && flown <= part.1);
    let overruns = (stretch.overrun_m > 0.0 && cause_between(leg, sky, flown, turn))
        || (may_enter && zones.iter().any(|part| part.0 > flown && part.0 <= turn));
    Ok(Begun {
        stretch: *stretch,
        is_in_zone: zones.iter().any(is_inside),
        overruns: overruns || flies_into > 0,
    })
}

/// How long the way to an end of the leg is: for the way back an old place counts as farther on, and past an end it is as far
/// as the drone is from it.
fn along_m(way: Way, stretch: &Stretch, drone: &Drone<'_>, leg: &OnLeg) -> f64 {
    let Some(flown) = leg.flown else {
        return leg.length_m;
    };
    let flown_m = flown * leg.length_m;
    let is_past = flown.min(1.0 - flown) < 1e-6;
    let past_m = if is_past { leg.off_m } else { 0.0 };
    match way {
        Way::Back => {
            let back_m = (flown_m + drone.drift_m).min(leg.length_m);
            back_m.max(past_m) + 2.0 * stretch.overrun_m
        }
        Way::On => (leg.length_m - flown_m).max(past_m),
    }
}

/// That neither a cause nor a zone that is entered from outside lies on the way to an end of the leg.
fn passes_nothing(way: Way, leg: &OnLeg, sky: &Sky<'_>, zones: &[(f64, f64)]) -> Result<(), Fault> {
    let same = match leg.length_m > 0.0 {
        true => SAME_M / leg.length_m,
        false => 1.0,
    };
    // Where that is unknown, the whole leg may lie on either way.
    let flown = leg.flown.unwrap_or(match way {
        Way::Back => 1.0,
        Way::On => 0.0,
    });
    let enters = match way {
        Way::Back => zones.iter().any(|part| part.1 < flown - same),
        Way::On => zones.iter().any(|part| part.0 > flown + same),
    };
    if enters {
        return Err(Fault::new(Rule::EntersZone, Place::FirstStretch));
    }
    let passed = Fault::new(Rule::PassesCause, Place::FirstStretch);
    let own = sky.own.cause.map(|cause| nearest_fraction(leg.ends, cause));
    let own = own.filter(|_| sky.own.closes_leg);
    let has_unplaced = (sky.own.closes_leg && own.is_none()) || has_unplaced_cause(leg, sky);
    let passes = match way {
        // What the drone itself cannot pass does not lie behind a drone whose place is unknown. What has no place lies
        // behind who has flown the whole leg.
        Way::Back => leg.flown.is_some_and(|flown| {
            (has_unplaced && flown >= 1.0) || own.is_some_and(|cause| cause < flown - same)
        }),
        Way::On => {
            let is_ahead = has_unplaced && flown < 1.0 - same;
            is_ahead || own.is_some_and(|cause| cause >= flown + same)
        }
    };
    if passes { Err(passed) } else { Ok(()) }
}

/// Whether something without a known place closes the leg for everyone: an operator's closure, a report.
fn has_unplaced_cause(leg: &OnLeg, sky: &Sky<'_>) -> bool {
    let Some(segment) = leg.segment else {
        return true;
    };
    if !sky.airspace.closed().closes_segment(segment) {
        return false;
    }
    let mut causes = sky.airspace.in_force();
    causes.any(|closure| {
        let has_shape = matches!(closure.cause, Cause::Zone(_));
        !has_shape && closure.hits.segments.binary_search(&segment).is_ok()
    })
}

/// Whether the cause of the report lies between two fractions of the leg.
fn cause_between(leg: &OnLeg, sky: &Sky<'_>, from: f64, until: f64) -> bool {
    let own = sky.own.cause.map(|cause| nearest_fraction(leg.ends, cause));
    own.is_some_and(|cause| cause >= from && cause <= until)
}

/// Straight, over whatever is there: for a drone off its leg, or in a zone that it cannot leave along its leg.
fn straight(
    stretch: &Stretch,
    drone: &Drone<'_>,
    leg: &OnLeg,
    sky: &Sky<'_>,
) -> Result<Begun, Fault> {
    let topology = sky.airspace.topology();
    let place = match drone.at {
        Whereabouts::At(place) => place,
        Whereabouts::LegStart => leg.ends.0,
        Whereabouts::Unknown => {
            return Err(Fault::new(Rule::BeginsAtDrone, Place::FirstStretch));
        }
    };
    let end = topology.position(stretch.enters);
    let length_m = place.distance_m(end);
    if (stretch.length_m - length_m).abs() > SAME_M + 1e-6 * length_m {
        return Err(Fault::figures(
            Rule::Length,
            Place::FirstStretch,
            stretch.length_m,
            length_m,
        ));
    }
    let is_off = leg.off_m > OFF_LEG_M - SAME_M;
    if !is_off && !is_shut_in(drone, leg, sky, place) {
        return Err(Fault::new(
            Rule::FlagWithoutGround(Flag::Unverified),
            Place::FirstStretch,
        ));
    }
    // No lower than the leg.
    let band = AltitudeBand {
        upper: None,
        ..leg.band
    };
    let parts = zone_parts(sky, (place, end), &band);
    let same = SAME_M / length_m.max(SAME_M);
    if parts.iter().any(|part| part.0 > same) {
        return Err(Fault::new(Rule::EntersZone, Place::FirstStretch));
    }
    let edge = EDGE_M / length_m.max(EDGE_M);
    Ok(Begun {
        stretch: *stretch,
        is_in_zone: parts.iter().any(|part| part.1 > edge),
        overruns: false,
    })
}

/// Whether the drone is in a zone, and neither end of its leg can be reached along it.
fn is_shut_in(drone: &Drone<'_>, leg: &OnLeg, sky: &Sky<'_>, place: Point) -> bool {
    let zones = leg.zones(sky);
    let flown = leg.flown.unwrap_or_default();
    let around = zones.iter().find(|part| part.0 <= flown && flown <= part.1);
    let is_shut = |way: Way, end: NodeIx| {
        let reaches_end = around.is_some_and(|part| match way {
            Way::Back => part.0 <= 0.0,
            Way::On => part.1 >= 1.0,
        });
        reaches_end || sky.closes_node(end) || passes_nothing(way, leg, sky, &zones).is_err()
    };
    (around.is_some() || is_in_zone(sky, place, &leg.band))
        && is_shut(Way::Back, drone.leg.0)
        && is_shut(Way::On, drone.leg.1)
}
