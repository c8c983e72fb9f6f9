//! A failure report settled: its names looked up, what it leaves open filled in from what is known, what is
//! doubtful assumed for the worst.
//!
//! A report that names anything that locates the drone always settles; only one that names nothing is a
//! problem. What was assumed or passed over becomes a warning, and some warnings make the report
//! doubtful: it is answered like any other, but nothing should be published on its word.

use super::circumstances::{
    MAX_AGE, MAX_AHEAD, MAX_AIRSPEED_MPS, PlaceSource, has_flown_on, settle_circumstances,
    speed_mps,
};
use super::close::find_close_targets;
use super::known::{CloseTarget, Known, Unplaced};
use super::leg::{Clues, LegSource, SettledLeg};
use super::names::Names;
use super::place::{Spot, Written, find_place};
use super::problem::{ReadWarning, ReportProblem, cut};
use crate::airspace::{Airspace, Hits};
use crate::flight::{FailureReport, FailureType, LastPlace, Location, check_place};
use crate::network::{NodeIx, Topology};
use crate::recompose::{BroughtZone, OFF_LEG_TOLERANCE_M, Parameters, Request};
use crate::wire;
use crate::wire_terms::IntoTerm;
use crate::zones::{ZoneId, is_path_step, zone_from_feature};
use jiff::Timestamp;
use serde_json::Value;
use std::sync::Arc;

/// Warnings that make a report doubtful.
const DOUBTS: [&str; 8] = [
    "unknown_failure_type",
    "unknown_leg",
    "unknown_node",
    "leg_assumed",
    "location_ignored",
    "location_doubtful",
    "timestamp_doubtful",
    "member_twice",
];

/// A failure report, settled.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedReport {
    /// What is asked.
    pub request: Request,
    /// True when something about it is doubtful or assumed, so that nothing should be published on its word.
    pub doubts: bool,
    /// What is to be closed beforehand; only files of requests have it.
    pub close: Vec<CloseTarget>,
    /// How the drone's place is written, where there is one.
    pub(crate) location: Option<Written>,
    /// How the cause's place is written, where there is one.
    pub(crate) cause_location: Option<Written>,
}

/// Settles a failure report: looks its names up, and fills in what it leaves open.
///
/// `warnings` holds those of reading the report, which count as doubts here, and takes those that arise.
///
/// # Errors
/// [`ReportProblem::NotLocated`] or [`ReportProblem::UnknownNode`] when nothing at all locates the drone.
pub fn resolve_report(
    report: &wire::FailureReport,
    known: &Known<'_>,
    airspace: &Airspace,
    warnings: &mut Vec<ReadWarning>,
) -> Result<ResolvedReport, ReportProblem> {
    let topology = airspace.topology();
    warn_of_unknown_plan(report, known, warnings);
    let stated = report.location.as_ref();
    let stated = stated.and_then(|place| find_place(topology, place, "location", warnings));
    let seen = known
        .position
        .and_then(|position| Spot::known(topology, position));
    let service_leg = report.service.as_ref().and_then(|service| service.leg);
    let stated_leg = service_leg.or(report.leg);
    let clues = Clues {
        topology,
        names: Names::find(topology, report, warnings),
        stated_leg: stated_leg.filter(|_| known.plan.is_none_or(|plan| plan.is_meant)),
        plan: known.plan.filter(|plan| plan.nodes.len() >= 2),
        spot: stated.or(seen),
    };
    let leg = clues.settle(warnings)?;
    let spots = (stated, seen);
    let (location, written, source) = locate(report, spots, &leg, known, topology, warnings);
    let stated_cause = report.cause_location.as_ref();
    let cause =
        stated_cause.and_then(|place| find_place(topology, place, "cause_location", warnings));
    let mut failure = settle_failure_type(report, warnings);
    if leg.destination.is_none() {
        let message = "nothing says where the delivery goes; the nearest alternate is taken";
        warnings.push(ReadWarning::new("destination_unknown", message));
        failure = FailureType::Operational;
    }
    check_times(report, known.now, warnings);
    check_drone(report, warnings);
    check_objective(report, warnings);
    let (failed, place) = ((failure, leg.nodes), (location, source));
    let circumstances = settle_circumstances(report, known, topology, failed, place, warnings);
    let request = Request {
        report: FailureReport {
            failure,
            leg: leg.nodes,
            location,
            cause_location: cause.map(|spot| spot.point),
            destination: leg.destination.unwrap_or(leg.nodes.1),
            remaining_path: leg.remaining_path,
        },
        circumstances,
        onward: Vec::new(),
        zone: settle_zone(airspace, report.zone.as_ref(), warnings),
        strategy: report.strategy.map(IntoTerm::into_term).unwrap_or_default(),
        scope: report.scope.map(IntoTerm::into_term).unwrap_or_default(),
        parameters: settle_parameters(report.parameters.as_ref(), warnings),
        optimum: report.optimum == Some(true),
        explain: report.explain == Some(true),
    };
    let close = find_close_targets(topology, report.close.as_deref(), warnings);
    let is_segment = topology.segment_between(leg.nodes.0, leg.nodes.1).is_some();
    let is_doubtful = |warning: &ReadWarning| DOUBTS.contains(&warning.code);
    Ok(ResolvedReport {
        request,
        doubts: !is_segment || warnings.iter().any(is_doubtful),
        close,
        location: written,
        cause_location: cause.map(|spot| spot.written),
    })
}

fn warn_of_unknown_plan(
    report: &wire::FailureReport,
    known: &Known<'_>,
    warnings: &mut Vec<ReadWarning>,
) {
    let named = report
        .service
        .as_ref()
        .and_then(|service| service.plan_id.as_deref());
    let is_told = warnings
        .iter()
        .any(|warning| warning.code == "unknown_plan");
    if let Some(id) = named
        && known.plan.is_none()
        && !is_told
    {
        let id = cut(id);
        let message = format!(
            "the plan '{id}' is not known here; it is answered from what else the report says"
        );
        warnings.push(ReadWarning::new("unknown_plan", message));
    }
}

/// True for a place that the drone can be at; else it is passed over with a warning.
fn is_possible(
    topology: &Topology,
    spot: Spot,
    known: &Known<'_>,
    leg: (NodeIx, NodeIx),
    warnings: &mut Vec<ReadWarning>,
) -> bool {
    if spot.node().is_some() {
        return true;
    }
    let last = known.position.map(|point| LastPlace {
        point,
        before_s: known.position_age_s,
    });
    // Also where it agrees with telemetry: what is settled has to settle again when telemetry is forgotten.
    let judged = check_place(topology, spot.point, None, Some(leg));
    let judged = judged.and_then(|()| check_place(topology, spot.point, last, Some(leg)));
    let Err(why) = judged else {
        return true;
    };
    let remedy = match topology.frame().is_geographic() {
        true => "; longitude comes first: were they swapped?",
        false => "",
    };
    let message = format!("'location' {why}; it counts as unknown{remedy}");
    warnings.push(ReadWarning::new("location_doubtful", message));
    false
}

/// Whether telemetry saw the drone off the leg that its report names so long ago that it may have come to it since.
fn has_left(
    topology: &Topology,
    seen: Spot,
    leg: &SettledLeg,
    (known, speed_mps): (&Known<'_>, f64),
    warnings: &mut Vec<ReadWarning>,
) -> bool {
    let (from, to) = leg.nodes;
    let (from, to) = (topology.position(from), topology.position(to));
    let on_leg = from.towards(to, seen.point.fraction_along(from, to));
    let (off_m, age_s) = (on_leg.distance_m(seen.point), known.position_age_s);
    // Of a leg that is that of the place nothing else is said.
    let is_named = leg.source != LegSource::Place;
    let has_left = is_named && off_m > OFF_LEG_TOLERANCE_M && off_m <= age_s * speed_mps;
    if has_left {
        let message = format!(
            "telemetry saw the drone {off_m:.0} m off this leg, {age_s:.0} s ago; its place counts as unknown: send \
             'location'"
        );
        warnings.push(ReadWarning::new("position_outdated", message));
    }
    has_left
}

/// The place that `fraction` of the leg says.
fn at_fraction(
    topology: &Topology,
    report: &wire::FailureReport,
    (from, to): (NodeIx, NodeIx),
) -> Option<Spot> {
    let fraction = report
        .fraction
        .filter(|share| (0.0..=1.0).contains(share))?;
    let (from, to) = (topology.position(from), topology.position(to));
    Spot::known(topology, from.towards(to, fraction))
}

/// Where the drone was: as it says, as its telemetry has it, else at the start of its leg where a report without a place
/// means that, else unknown.
fn locate(
    report: &wire::FailureReport,
    (stated, seen): (Option<Spot>, Option<Spot>),
    leg: &SettledLeg,
    known: &Known<'_>,
    topology: &Topology,
    warnings: &mut Vec<ReadWarning>,
) -> (Location, Option<Written>, PlaceSource) {
    let start = leg.nodes.0;
    let possible = stated.filter(|spot| is_possible(topology, *spot, known, leg.nodes, warnings));
    let is_lost = stated.is_some() && possible.is_none();
    let placed = possible.or_else(|| at_fraction(topology, report, leg.nodes));
    let can_be = |spot: &Spot| check_place(topology, spot.point, None, Some(leg.nodes)).is_ok();
    let seen = seen.filter(can_be);
    if let Some(spot) = placed {
        let has_flown_on = has_flown_on(report, known, topology, leg.nodes);
        return (
            spot.on_leg_from(start, has_flown_on),
            Some(spot.written),
            PlaceSource::Stated,
        );
    }
    let speed_mps = speed_mps(report, known);
    if let Some(spot) =
        seen.filter(|spot| !has_left(topology, *spot, leg, (known, speed_mps), warnings))
    {
        return (
            Location::At(spot.point),
            Some(spot.written),
            PlaceSource::Seen,
        );
    }
    let is_unsaid = report.location.is_none() && report.location_unknown != Some(true);
    let names_segment = report
        .service
        .as_ref()
        .is_none_or(|service| service.from.is_some());
    let means_start = match leg.source {
        LegSource::Service | LegSource::Path => names_segment,
        LegSource::Node => true,
        LegSource::Plan(_) | LegSource::Place => false,
    };
    let stands_there = known.is_grounded && matches!(leg.source, LegSource::Plan(_));
    let is_start = (means_start && known.unplaced == Unplaced::AtStart) || stands_there;
    match is_unsaid && !is_lost && is_start {
        true => (
            Location::LegStart,
            Some(Written::Node(start)),
            PlaceSource::Nowhere,
        ),
        false => (Location::Unknown, None, PlaceSource::Nowhere),
    }
}

fn settle_failure_type(
    report: &wire::FailureReport,
    warnings: &mut Vec<ReadWarning>,
) -> FailureType {
    if let Some(failure) = report.failure {
        return failure.into_term();
    }
    let is_told = warnings
        .iter()
        .any(|warning| warning.code == "unknown_failure_type");
    if !is_told {
        let message = "no failure type is given; it counts as navigational";
        warnings.push(ReadWarning::new("missing_failure_type", message));
    }
    FailureType::Navigational
}

fn check_times(
    report: &wire::FailureReport,
    now: Option<Timestamp>,
    warnings: &mut Vec<ReadWarning>,
) {
    let mut read = |name: &str, code, text: Option<&str>| {
        let text = text?;
        let instant = text.parse::<Timestamp>().ok();
        if instant.is_none() {
            let text = cut(text);
            let message = format!("'{name}' is '{text}', not an RFC 3339 time, and is ignored");
            warnings.push(ReadWarning::new(code, message));
        }
        instant
    };
    read("deadline", "deadline_ignored", report.deadline.as_deref());
    let happened = read(
        "timestamp",
        "timestamp_ignored",
        report.timestamp.as_deref(),
    );
    let Some((now, happened)) = now.zip(happened) else {
        return;
    };
    let age = now.duration_since(happened);
    let message = match age {
        _ if age < -MAX_AHEAD => format!(
            "'timestamp' is {} s in the future and doubted; is the drone's clock right?",
            -age.as_secs()
        ),
        _ if age > MAX_AGE => format!("'timestamp' is {} s ago and doubted", age.as_secs()),
        _ => return,
    };
    warnings.push(ReadWarning::new("timestamp_doubtful", message));
}

fn check_drone(report: &wire::FailureReport, warnings: &mut Vec<ReadWarning>) {
    let Some(drone) = &report.drone else {
        return;
    };
    if let Some(speed_mps) = drone.airspeed_mps
        && !(speed_mps > 0.0 && speed_mps <= MAX_AIRSPEED_MPS)
    {
        let message = format!(
            "'drone.airspeed_mps' is {speed_mps}, not above 0 and up to {MAX_AIRSPEED_MPS}, and is ignored"
        );
        warnings.push(ReadWarning::new("airspeed_ignored", message));
    }
    if let Some(fraction) = drone.battery_fraction
        && !(0.0..=1.0).contains(&fraction)
    {
        let meant = match fraction > 1.0 && fraction <= 100.0 {
            true => format!("; did you mean {}?", fraction / 100.0),
            false => String::new(),
        };
        let message = format!(
            "'drone.battery_fraction' is {fraction}, not within 0 and 1, and is ignored{meant}"
        );
        warnings.push(ReadWarning::new("battery_ignored", message));
    }
}

fn check_objective(report: &wire::FailureReport, warnings: &mut Vec<ReadWarning>) {
    let message = match report.objective.as_deref() {
        None | Some("distance") => return,
        Some(known @ ("time" | "energy")) => format!(
            "the objective '{known}' is not computed yet; the answer is the shortest by distance"
        ),
        Some(other) => format!(
            "the objective '{}' is not known; the answer is the shortest by distance",
            cut(other)
        ),
    };
    warnings.push(ReadWarning::new("objective_unsupported", message));
}

/// A zone that the report brings; one that cannot be read, or does not count now, binds nothing.
fn settle_zone(
    airspace: &Airspace,
    feature: Option<&Value>,
    warnings: &mut Vec<ReadWarning>,
) -> Option<BroughtZone> {
    let feature = feature.filter(|feature| !feature.is_null())?;
    let topology: &Topology = airspace.topology();
    let zone = match zone_from_feature(feature, ZoneId::StatedOr("brought"), topology.frame()) {
        Ok(zone) => zone,
        Err(problems) => {
            let ignored = problems.iter().map(|problem| {
                let (code, message) = (problem.code, &problem.message);
                let pointer = &problem.pointer;
                let message = format!("/zone{pointer}: {message} ({code})");
                ReadWarning::new("zone_ignored", message)
            });
            warnings.extend(ignored);
            return None;
        }
    };
    if is_path_step(zone.id()) {
        let message = format!(
            "/zone/id: the id '{}' cannot stand in an address (zone_id_invalid)",
            zone.id()
        );
        warnings.push(ReadWarning::new("zone_ignored", message));
        return None;
    }
    if !zone.counts_at(airspace.as_of(), airspace.horizon()) {
        let message = "the zone brought is not active within the planning horizon";
        warnings.push(ReadWarning::new("zone_not_active", message));
        return None;
    }
    let hits = Hits::of(topology, &zone);
    Some(BroughtZone {
        zone: Arc::new(zone),
        hits,
    })
}

/// Parameters; numbers that JSON cannot write, but the engine's other callers can, are left at their defaults.
fn settle_parameters(
    stated: Option<&wire::Parameters>,
    warnings: &mut Vec<ReadWarning>,
) -> Parameters {
    let mut parameters = Parameters::default();
    let Some(stated) = stated else {
        return parameters;
    };
    let mut finite = |name: &str, number: Option<f64>| {
        let number = number?;
        if !number.is_finite() {
            let message = format!("'parameters.{name}' is {number}; its default is taken");
            warnings.push(ReadWarning::new("unknown_value", message));
        }
        number.is_finite().then_some(number)
    };
    parameters.cell_size_m = finite("cell_size_m", stated.cell_size_m);
    if let Some(ratio) = finite("val_ratio", stated.val_ratio) {
        parameters.val_ratio = ratio;
    }
    if let Some(flag) = stated.stage_skipping {
        parameters.stage_skipping = flag;
    }
    if let Some(flag) = stated.full_tree {
        parameters.full_tree = flag;
    }
    parameters
}
