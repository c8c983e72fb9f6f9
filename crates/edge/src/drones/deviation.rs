//! Whether a position of a drone is where, as high, and as far as what it may be flying has it.

use super::Sighting;
use super::agreement::Deviation;
use super::progress::{FlownSoFar, ON_NODE_M, legs_at, spot_on};
use crate::planner::{Planner, Version};
use crate::plans::entry::PlanEntry;
use jiff::Timestamp;
use skyway_engine::compose::Leg;
use skyway_engine::flight::LegCourse;
use skyway_engine::geo::{AltitudeReference, Point};
use skyway_engine::network::{NodeIx, Topology};

/// So far from its way a drone may be, in metres over ground.
const LATERAL_M: f64 = 30.0;
/// And so far above or below it, in metres.
const VERTICAL_M: f64 = 10.0;
/// And so much earlier or later there than planned, in seconds; or this share of the time that it has flown.
const TIME_S: f64 = 15.0;
const TIME_SHARE: f64 = 0.1;

/// How a position of a drone in flight deviates from everything that it may be flying; in time from what it reported.
pub(crate) fn deviation(
    topology: &Topology,
    plan: &PlanEntry,
    sighting: &Sighting,
    planner: &dyn Planner,
) -> Option<Deviation> {
    let place = sighting.position(topology.frame());
    let versions = plan.versions();
    let best = versions.map(|version| fit(topology, version, place, sighting));
    match best.max() {
        Some(Fit::Off(deviation)) => Some(deviation),
        _ => off_time(topology, &plan.reported, place, sighting, planner),
    }
}

/// How well a position fits a version in space, from the worst to the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    /// Nothing of it says where the drone should be.
    Unknown,
    Off(Deviation),
    Fits,
}

fn fit(topology: &Topology, version: &Version, place: Point, sighting: &Sighting) -> Fit {
    let Some(spot) = spot_on(topology, version, place, FlownSoFar::UNKNOWN) else {
        return Fit::Unknown;
    };
    if spot.off_m > LATERAL_M {
        return Fit::Off(Deviation::Lateral);
    }
    if sighting.airborne == Some(false) {
        let mut stands = stands_of(version);
        let is_on = |node: NodeIx| topology.position(node).distance_m(place) <= ON_NODE_M;
        return match stands.any(is_on) {
            true => Fit::Fits,
            false => Fit::Off(Deviation::Landed),
        };
    }
    let height = sighting.altitude_m.zip(sighting.altitude_reference);
    let Some(height) = height else {
        return Fit::Fits;
    };
    let gap_m = spot
        .leg
        .and_then(|leg| height_gap_m(topology, version, leg, place, height));
    match gap_m {
        Some(gap_m) if gap_m > VERTICAL_M => Fit::Off(Deviation::Vertical),
        Some(_) => Fit::Fits,
        // The first stretch has no heights, or those of another reference.
        None => Fit::Unknown,
    }
}

/// The nodes on which a drone may stand: where it begins, stops and lands.
fn stands_of(version: &Version) -> impl Iterator<Item = NodeIx> {
    let nodes = &version.composition.way.nodes;
    let ends = nodes.first().into_iter().chain(nodes.last()).copied();
    let stays: Vec<NodeIx> = version
        .reservations()
        .iter()
        .map(|stay| stay.node)
        .collect();
    ends.chain(stays)
}

/// How far a height is from those that the legs at a place have within what a drone may be off over ground; `None` where
/// they cannot be compared.
fn height_gap_m(
    topology: &Topology,
    version: &Version,
    leg: usize,
    place: Point,
    (altitude_m, reference): (f64, AltitudeReference),
) -> Option<f64> {
    let legs = &version.composition.legs;
    let near = leg.saturating_sub(1)..(leg + 2).min(legs.len());
    let stands: Vec<NodeIx> = stands_of(version).collect();
    let mut least: Option<f64> = None;
    for leg in &legs[near] {
        for [low_m, high_m] in heights_near(topology, leg, place, reference, &stands)? {
            let gap_m = (low_m - altitude_m).max(altitude_m - high_m).max(0.0);
            least = Some(least.map_or(gap_m, |least| least.min(gap_m)));
        }
    }
    least
}

/// The heights that a leg has near a place: of each piece the lowest and the highest.
fn heights_near(
    topology: &Topology,
    leg: &Leg,
    place: Point,
    reference: AltitudeReference,
    stands: &[NodeIx],
) -> Option<Vec<[f64; 2]>> {
    let course = LegCourse::of(topology, leg.from, leg.to, leg.segment);
    if course.reference != Some(reference) {
        return None;
    }
    let mut heights = Vec::with_capacity(course.corners.len() + 1);
    for corners in course.corners.windows(2) {
        let [from, to] = [&corners[0], &corners[1]];
        let (from_m, to_m) = (from.height_m?, to.height_m?);
        let fraction = place.fraction_along(from.place, to.place);
        let off_m = place.distance_m(from.place.towards(to.place, fraction));
        let length_m = from.place.distance_m(to.place);
        if off_m > LATERAL_M {
            continue;
        }
        let either_way = match length_m > 0.0 {
            true => (LATERAL_M.powi(2) - off_m.powi(2)).sqrt() / length_m,
            // Straight up or down: all of it.
            false => 1.0,
        };
        let height_m = |fraction: f64| from_m + fraction.clamp(0.0, 1.0) * (to_m - from_m);
        let [one_m, other_m] = [fraction - either_way, fraction + either_way].map(height_m);
        heights.push([one_m.min(other_m), one_m.max(other_m)]);
    }
    let ends = [
        (leg.from, course.corners.first()),
        (leg.to, course.corners.last()),
    ];
    for (node, corner) in ends {
        let is_near = topology.position(node).distance_m(place) <= LATERAL_M;
        let ground = topology.node_altitude(node);
        let ground = ground.filter(|ground| ground.reference == reference);
        if let (true, Some(ground), Some(passed_m)) =
            (is_near && stands.contains(&node), ground, corner?.height_m)
        {
            heights.push([ground.value_m.min(passed_m), ground.value_m.max(passed_m)]);
        }
    }
    Some(heights)
}

/// How a position deviates in time, where times are computed: from all times at which the plan has the drone there, as a way back
/// leads over the same legs.
fn off_time(
    topology: &Topology,
    version: &Version,
    place: Point,
    sighting: &Sighting,
    planner: &dyn Planner,
) -> Option<Deviation> {
    let flown_s = |until: Timestamp| until.duration_since(version.departs_at).as_secs_f64();
    let seen_s = flown_s(sighting.seen_at);
    let has_landed = sighting.airborne == Some(false);
    let is_over_end = version
        .last_node()
        .is_some_and(|end| topology.position(end).distance_m(place) <= ON_NODE_M);
    let legs = &version.composition.legs;
    let late_s = |leg: usize| {
        let apart_s = planner.apart_s(topology, version, (leg, place), seen_s)?;
        let is_on_last = leg + 1 == legs.len() && seen_s >= legs[leg].departure_s;
        // Above the node where it is to land it is only late.
        Some(match is_on_last && is_over_end && !has_landed {
            true => seen_s - flown_s(version.arrives_at()),
            false => apart_s,
        })
    };
    let late_s = legs_at(topology, version, place)
        .map(late_s)
        .try_fold(f64::INFINITY, |least, late_s| Some(least.min(late_s?)))?;
    let tolerance_s = (TIME_SHARE * seen_s).max(TIME_S);
    (late_s.is_finite() && late_s > tolerance_s).then_some(Deviation::Time)
}
