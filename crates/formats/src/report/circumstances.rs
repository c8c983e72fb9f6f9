//! What a failure report says of its drone beside its place: whether it is in the air, how fast, and what has failed.

use super::known::Known;
use super::names::find_named;
use super::problem::{ReadWarning, cut};
use crate::flight::{
    Aloft, Circumstances, DEFAULT_AIRSPEED_MPS, FailedPads, FailureType, Location,
};
use crate::geo::Point;
use crate::network::{NodeIx, Topology};
use crate::wire;
use crate::wire_terms::IntoTerm;
use jiff::{SignedDuration, Timestamp};

/// A drone within this many metres of a node may stand there.
const AT_NODE_WITHIN_M: f64 = 15.0;
/// A drone that moves faster than this, in metres per second, does not stand.
const STANDS_BELOW_MPS: f64 = 1.0;
/// The fastest airspeed that is believed, in metres per second.
pub(crate) const MAX_AIRSPEED_MPS: f64 = 100.0;
/// A time from so far in the future is doubted; clocks differ by less.
pub(crate) const MAX_AHEAD: SignedDuration = SignedDuration::from_secs(5);
/// A time as old as this is doubted.
pub(crate) const MAX_AGE: SignedDuration = SignedDuration::from_mins(5);

/// Where a place came from, with how old it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PlaceSource {
    /// The report states it.
    Stated,
    /// Telemetry has it.
    Seen,
    /// Not said.
    Nowhere,
}

/// What else a report says of its drone.
pub(crate) fn settle_circumstances(
    report: &wire::FailureReport,
    known: &Known<'_>,
    topology: &Topology,
    (failure, leg): (FailureType, (NodeIx, NodeIx)),
    (location, source): (Location, PlaceSource),
    warnings: &mut Vec<ReadWarning>,
) -> Circumstances {
    check_measured(report, warnings);
    let aloft = aloft(report, known, topology, leg, location);
    let is_flying = matches!(location, Location::At(_)) && aloft != Aloft::Grounded;
    let speed_mps = speed_mps(report, known);
    let age_s = match source {
        PlaceSource::Stated => stated_age_s(report, known.now),
        PlaceSource::Seen => known.position_age_s,
        PlaceSource::Nowhere => 0.0,
    };
    // One that hovers is where it was.
    let moves = is_flying && speed_mps > 0.0;
    let detail = report.detail.map(IntoTerm::into_term);
    let is_operational = failure == FailureType::Operational;
    Circumstances {
        aloft,
        speed_mps: if moves {
            speed_mps
        } else {
            DEFAULT_AIRSPEED_MPS
        },
        place_age_s: if moves { age_s.max(0.0) } else { 0.0 },
        detail: detail.filter(|_| is_operational),
        failed_pads: match failure {
            FailureType::Infrastructure => failed_pads(report, topology, leg, warnings),
            FailureType::Environmental
            | FailureType::Navigational
            | FailureType::Regulatory
            | FailureType::Operational
            | FailureType::ServiceLevel => None,
        },
        ..Circumstances::default()
    }
}

/// Whether a drone that states a node was there some time ago, in the air.
pub(crate) fn has_flown_on(
    report: &wire::FailureReport,
    known: &Known<'_>,
    topology: &Topology,
    leg: (NodeIx, NodeIx),
) -> bool {
    stated_age_s(report, known.now) > 0.0
        && aloft(report, known, topology, leg, Location::LegStart) == Aloft::Airborne
}

fn aloft(
    report: &wire::FailureReport,
    known: &Known<'_>,
    topology: &Topology,
    leg: (NodeIx, NodeIx),
    location: Location,
) -> Aloft {
    match report.airborne {
        Some(true) => return Aloft::Airborne,
        Some(false) => return Aloft::Grounded,
        None => {}
    }
    let is_at = |place, node| topology.position(node).distance_m(place) <= AT_NODE_WITHIN_M;
    let place = match location {
        Location::LegStart => Some(topology.position(leg.0)),
        Location::At(place) => Some(place),
        Location::Unknown => None,
    };
    let is_seen_there = |place: &Point| {
        let seen = known.position;
        seen.is_some_and(|seen| seen.distance_m(*place) <= AT_NODE_WITHIN_M)
    };
    let seen_at = place.filter(is_seen_there);
    // What it says itself goes before its plan, which it may be late on.
    if known.airborne == Some(true) && seen_at.is_some() {
        return Aloft::Airborne;
    }
    let is_at_end = |place: Point| is_at(place, leg.0) || is_at(place, leg.1);
    let says_it_stands = known.airborne == Some(false) && seen_at.is_some_and(is_at_end);
    if says_it_stands || known.is_grounded {
        return Aloft::Grounded;
    }
    let moves = known
        .ground_speed_mps
        .is_some_and(|speed_mps| speed_mps >= STANDS_BELOW_MPS);
    let is_slow = known.ground_speed_mps.is_some() && !moves;
    let may_stand = match location {
        Location::LegStart => !moves,
        // Only a place that is stated as a node says by itself that the drone is not just passing.
        Location::At(place) => {
            let named = match &report.location {
                Some(wire::Place::Node(id)) => find_named(topology, id),
                _ => None,
            };
            let names_node = named.is_some_and(|node| topology.position(node) == place);
            (is_slow || (names_node && !moves)) && is_at_end(place)
        }
        Location::Unknown => false,
    };
    if may_stand {
        Aloft::Unknown
    } else {
        Aloft::Airborne
    }
}

/// The speed as the drone states it, as it was seen just now, as its plan has it, else the default.
pub(crate) fn speed_mps(report: &wire::FailureReport, known: &Known<'_>) -> f64 {
    let stated = report.drone.as_ref().and_then(|drone| drone.airspeed_mps);
    let is_possible = |speed_mps: &f64| *speed_mps > 0.0 && *speed_mps <= MAX_AIRSPEED_MPS;
    let seen = known.ground_speed_mps;
    stated
        .filter(is_possible)
        .or(seen.filter(|speed_mps| (0.0..=MAX_AIRSPEED_MPS).contains(speed_mps)))
        .or(known.airspeed_mps)
        .unwrap_or(DEFAULT_AIRSPEED_MPS)
}

/// How old a stated place is: as it says, else by the time of the report, unless that is doubted.
fn stated_age_s(report: &wire::FailureReport, now: Option<Timestamp>) -> f64 {
    let stated = report.location_age_s;
    if let Some(age_s) = stated.filter(|age_s| age_s.is_finite() && *age_s >= 0.0) {
        return age_s;
    }
    let happened = report.timestamp.as_deref();
    let happened = happened.and_then(|text| text.parse::<Timestamp>().ok());
    let age = now
        .zip(happened)
        .map(|(now, happened)| now.duration_since(happened));
    let believed = age.filter(|age| *age >= SignedDuration::ZERO && *age <= MAX_AGE);
    believed.map_or(0.0, |age| age.as_secs_f64())
}

fn failed_pads(
    report: &wire::FailureReport,
    topology: &Topology,
    leg: (NodeIx, NodeIx),
    warnings: &mut Vec<ReadWarning>,
) -> Option<FailedPads> {
    let named = report.node.as_ref();
    let node = named.and_then(|id| find_named(topology, id));
    if let (Some(id), None) = (named, node) {
        let id = cut(id.text());
        let message = format!(
            "the node '{id}' at /node is not a node of the network; the end of the leg is taken"
        );
        warnings.push(ReadWarning::new("unknown_node", message));
    }
    let count = report
        .pads
        .map(|count| u16::try_from(count).unwrap_or(u16::MAX));
    let is_said = node.is_some() || count.is_some();
    is_said.then(|| FailedPads {
        node: node.unwrap_or(leg.1),
        count,
    })
}

/// Warns of what was measured and cannot have been.
fn check_measured(report: &wire::FailureReport, warnings: &mut Vec<ReadWarning>) {
    let measured = [
        ("wind_mps", report.wind_mps),
        ("gust_mps", report.gust_mps),
        ("visibility_m", report.visibility_m),
        ("location_age_s", report.location_age_s),
    ];
    for (name, value) in measured {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value >= 0.0)) {
            let message = format!("'{name}' is {value}, not 0 or more, and is ignored");
            warnings.push(ReadWarning::new("measurement_ignored", message));
        }
    }
    let fraction = report.fraction;
    if let Some(value) = fraction.filter(|value| !(0.0..=1.0).contains(value)) {
        let message = format!("'fraction' is {value}, not within 0 and 1, and is ignored");
        warnings.push(ReadWarning::new("fraction_ignored", message));
    }
}
