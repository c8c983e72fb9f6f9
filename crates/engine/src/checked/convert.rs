//! Answers and requests in the words of the checker.

use super::flight::FlightWorld;
use crate::airspace::Airspace;
use crate::checker::{
    Claim, Drone, Fault, Flag, Flags, FlightClaim, Need, OwnClosures, Sky, Stretch, StretchKind,
    Told, Whereabouts, check,
};
use crate::flight::{self, Aloft, FailureType, Location, Reentry};
use crate::network::{NodeIx, Topology};
use crate::recompose::{self, Outcome, Recomposition, Request, Warning};

/// Within this many metres of a node a drone may stand there.
const AT_NODE_M: f64 = 15.0;

/// What is known of a drone beside its request.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// The node on whose pad its plan has it stand; `None` where it flies, or its request says.
    pub stands_at: Option<NodeIx>,
    /// When that is, in seconds of the clock of its flight.
    pub at_s: f64,
    /// Its battery then, where it or its telemetry said so.
    pub battery: Option<f64>,
    /// Whether the report itself has a figure that can show that it is able to fly on.
    pub has_figure: bool,
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
        recompose::Flag::Unseparated => Flag::Unseparated,
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
fn need_of(request: &Request, has_figure: bool) -> Need {
    let detail = request.circumstances.detail;
    match request.report.failure {
        FailureType::Operational if detail.is_some_and(|it| it.lands_anywhere()) => Need::Ground,
        FailureType::Operational => Need::Pad { shown: has_figure },
        FailureType::Environmental
        | FailureType::Navigational
        | FailureType::Regulatory
        | FailureType::Infrastructure
        | FailureType::ServiceLevel => Need::Nothing,
    }
}

/// The node at which the drone stands, or may stand.
pub(super) fn stands_at(request: &Request, topology: &Topology) -> Option<NodeIx> {
    let (from, to) = request.report.leg;
    let place = match (request.circumstances.aloft, request.report.location) {
        (Aloft::Airborne, _) | (_, Location::Unknown) => return None,
        (_, Location::LegStart) => return Some(from),
        (_, Location::At(place)) => place,
    };
    let off_m = |node: NodeIx| topology.position(node).distance_m(place);
    let nearer = if off_m(from) <= off_m(to) { from } else { to };
    (off_m(nearer) <= AT_NODE_M).then_some(nearer)
}

/// Who is answered.
pub(super) fn drone<'a>(request: &'a Request, known: &Known, topology: &Topology) -> Drone<'a> {
    let circumstances = &request.circumstances;
    let report = &request.report;
    Drone {
        leg: report.leg,
        at: match report.location {
            Location::At(place) => Whereabouts::At(place),
            Location::LegStart => Whereabouts::LegStart,
            Location::Unknown => Whereabouts::Unknown,
        },
        drift_m: circumstances.speed_mps * circumstances.place_age_s,
        stopping_m: circumstances.stopping_m(),
        stands_at: known.stands_at.or_else(|| stands_at(request, topology)),
        destination: report.destination,
        onward: &request.onward,
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
    let failed = request.failed_pads().filter(|pads| {
        let has = topology.pads(pads.node);
        pads.count.is_none_or(|count| count >= has)
    });
    OwnClosures {
        segment: segment.filter(|_| closes_leg),
        closes_leg,
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
    let who = drone(request, known, topology);
    check(&claim(answer, flight.map(|(claim, _)| claim)), &who, &sky)?;
    // How a flight goes on in the air is checked by its own figures.
    let airborne = answer.if_airborne.as_deref();
    let Some(airborne) = airborne.filter(|_| flight.is_none()) else {
        return Ok(());
    };
    let in_the_air = Drone {
        stands_at: None,
        ..who
    };
    check(&claim(airborne, None), &in_the_air, &sky)
}
