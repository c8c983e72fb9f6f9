//! Answers and requests in the words of the checker.

use super::flight::FlightWorld;
use crate::airspace::Airspace;
use crate::checker::{
    Claim, Drone, Fault, Flag, Flags, FlightClaim, Need, OwnClosures, Sky, Stretch, StretchKind,
    Told, Whereabouts, check,
};
use crate::flight::{self, FailureType, Location, OperationalDetail, Reentry};
use crate::network::{NodeIx, Topology};
use crate::recompose::{self, Outcome, Recomposition, Request, Warning};

/// A drone that does not say how it flies needs at most so much to turn, in metres: 16 m/s, 2 s and 3.5 m/s².
const STOPPING_M: f64 = 16.0 * 2.0 + 16.0 * 16.0 / (2.0 * 3.5);

/// What is known of a drone beside its request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The node on whose pad it stands; `None` in the air.
    pub stands_at: Option<NodeIx>,
    /// How far it may have flown since it was where it says, in metres.
    pub drift_m: f64,
    /// How far it flies before it can turn, in metres.
    pub stopping_m: f64,
    /// When that is, in seconds of the clock of its flight.
    pub at_s: f64,
    /// Its battery then, where it or its telemetry said so.
    pub battery: Option<f64>,
    /// Whether the report itself has a figure that can show that it is able to fly on.
    pub has_figure: bool,
}

impl Default for Known {
    fn default() -> Self {
        Self {
            stands_at: None,
            drift_m: 0.0,
            stopping_m: STOPPING_M,
            at_s: 0.0,
            battery: None,
            has_figure: false,
        }
    }
}

/// An outcome in the words of the checker.
pub fn told(outcome: Outcome) -> Told {
    match outcome {
        Outcome::Rerouted => Told::Rerouted,
        Outcome::Unaffected => Told::Unaffected,
        Outcome::Hold => Told::Hold,
        Outcome::Diverted => Told::Diverted,
        Outcome::NoRoute => Told::NoRoute,
    }
}

fn flag(flag: recompose::Flag) -> Flag {
    match flag {
        recompose::Flag::LeavingZone => Flag::LeavingZone,
        recompose::Flag::CannotStop => Flag::CannotStop,
        recompose::Flag::Unverified => Flag::Unverified,
        recompose::Flag::ReserveUsed => Flag::ReserveUsed,
        recompose::Flag::PadOccupied => Flag::PadOccupied,
    }
}

fn stretch(reentry: &Reentry) -> Stretch {
    let stretch = &reentry.stretch;
    Stretch {
        kind: match stretch.kind {
            flight::StretchKind::None => StretchKind::None,
            flight::StretchKind::Leg => StretchKind::Leg,
            flight::StretchKind::Straight => StretchKind::Straight,
        },
        leg: stretch.leg.map(|leg| (leg.from, leg.to)),
        enters: reentry.node,
        length_m: stretch.length_m,
        overrun_m: stretch.overrun_m,
    }
}

/// What an answer says.
pub(super) fn claim<'a>(
    answer: &'a Recomposition,
    flight: Option<&'a FlightClaim<'a>>,
) -> Claim<'a> {
    let flags: Flags = answer.flags.iter().copied().map(flag).collect();
    Claim {
        told: told(answer.outcome),
        stretch: answer.reentry.as_ref().map(stretch),
        nodes: &answer.path.nodes,
        segments: &answer.path.segments,
        length_m: answer.remaining_length_m,
        flags,
        has_unsafe_way: answer.unsafe_way.is_some(),
        waits_until: answer.warnings.iter().find_map(|warning| match warning {
            Warning::HoldsUntil { until, .. } => Some(*until),
            _ => None,
        }),
        flight,
    }
}

/// What has failed of the drone that reports.
pub fn need_of(request: &Request, has_figure: bool) -> Need {
    let detail = request.circumstances.detail;
    let lands_anywhere = detail.is_some_and(OperationalDetail::lands_anywhere);
    match request.report.failure {
        FailureType::Operational if lands_anywhere => Need::Ground,
        FailureType::Operational => Need::Pad { shown: has_figure },
        _ => Need::Nothing,
    }
}

/// Who is answered.
pub(super) fn drone<'a>(request: &'a Request, known: &Known) -> Drone<'a> {
    let drone = &request.circumstances;
    let report = &request.report;
    Drone {
        leg: report.leg,
        at: match report.location {
            Location::At(place) => Whereabouts::At(place),
            Location::LegStart => Whereabouts::LegStart,
            Location::Unknown => Whereabouts::Unknown,
        },
        drift_m: known.drift_m.max(drone.speed_mps * drone.place_age_s),
        stopping_m: known.stopping_m.max(drone.stopping_m()),
        stands_at: known.stands_at,
        destination: report.destination,
        planned: report.remaining_path.as_deref(),
        need: need_of(request, known.has_figure),
        at_s: known.at_s,
        battery: known.battery,
    }
}

/// What its report closes for itself alone.
pub(super) fn own<'a>(request: &'a Request, topology: &Topology) -> OwnClosures<'a> {
    let report = &request.report;
    let closes_leg = report.failure.closes_leg();
    let (from, to) = report.leg;
    let segment = topology.segment_between(from, to);
    // A zone that it brings says where the cause of a regulatory failure lies.
    let is_told_by_zone = report.failure == FailureType::Regulatory
        && report.cause_location.is_none()
        && request
            .zone
            .as_ref()
            .zip(segment)
            .is_some_and(|(zone, leg)| zone.hits.segments.binary_search(&leg).is_ok());
    let failed = request.failed_pads().filter(|pads| {
        let has = topology.pads(pads.node);
        pads.count.is_none_or(|count| count >= has)
    });
    OwnClosures {
        segment: segment.filter(|_| closes_leg),
        closes_leg: closes_leg && !is_told_by_zone,
        cause: report.cause_location,
        zone: request
            .zone
            .as_ref()
            .map(|brought| (&*brought.zone, &brought.hits)),
        pads: failed.map(|pads| pads.node),
    }
}

/// Checks an answer against a world, and beside it the one for a drone that may be in the air.
///
/// # Errors
/// The first rule that it breaks.
pub fn check_answer(
    airspace: &Airspace,
    request: &Request,
    known: &Known,
    answer: &Recomposition,
    flight: Option<(&FlightClaim<'_>, &FlightWorld<'_>)>,
) -> Result<(), Fault> {
    let topology = airspace.topology();
    let sky = flight.map(|(_, world)| world.sky());
    let sky = Sky {
        airspace,
        own: own(request, topology),
        flight: sky.as_ref(),
    };
    let mut who = drone(request, known);
    // One that holds by distance stands where the zone over it has to end.
    let stands = answer.outcome == Outcome::Hold && flight.is_none();
    if stands && request.circumstances.aloft != flight::Aloft::Airborne {
        who.stands_at = who.stands_at.or(answer.path.nodes.first().copied());
    }
    check(&claim(answer, flight.map(|(claim, _)| claim)), &who, &sky)?;
    let Some(airborne) = answer.if_airborne.as_deref() else {
        return Ok(());
    };
    let in_the_air = Drone {
        stands_at: None,
        ..who
    };
    let by_distance = Sky {
        flight: None,
        ..sky
    };
    check(&claim(airborne, None), &in_the_air, &by_distance)
}
