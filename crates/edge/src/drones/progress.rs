//! How far the drone of a plan has come, and what of its way is ahead of it.

use super::{Drones, Sighting};
use crate::planner::Version;
use crate::plans::entry::PlanEntry;
use crate::plans::stretches::Stretch;
use jiff::Timestamp;
use skyway_engine::airspace::{Airspace, Closure};
use skyway_engine::compose::{Composition, Leg};
use skyway_engine::flight::{FailureReport, Location, check_place};
use skyway_engine::geo::{Point, total_m};
use skyway_engine::network::{NodeIx, Topology};

/// So far, in metres, telemetry may lie behind where a drone was: it does not fly back on its way.
const BACK_M: f64 = 15.0;
/// Distances that differ by less, in metres, are equal: a segment that a way leads over twice.
const AS_NEAR_M: f64 = 1e-3;
/// So far from its first stretch a drone may be, in metres, that has just begun a version: it takes as much to turn.
const BEGINS_WITHIN_M: f64 = 50.0;

/// So near to its way a drone may be on it, in metres.
const ON_WAY_M: f64 = 50.0;
/// A drone so near to a node is on it, in metres.
pub(crate) const ON_NODE_M: f64 = 15.0;

/// How far a drone has come on a version of its plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Progress {
    /// The leg it is on; the first where it is on the way there.
    pub(crate) leg: usize,
    /// Whether it is on the first stretch, before all legs.
    pub(crate) on_stretch: bool,
    pub(crate) location: Location,
    /// What lies ahead on the plan, in metres.
    pub(crate) remaining_m: f64,
}

impl Progress {
    /// The leg and the place that a drone reports on a way, where it does: by the clock alone it may be elsewhere.
    pub(crate) fn as_reported(self, way: &[NodeIx], report: &FailureReport) -> Self {
        let legs = way.windows(2).enumerate();
        let its = legs.filter(|(_, ends)| (ends[0], ends[1]) == report.leg);
        let nearest = its
            .map(|(leg, _)| leg)
            .min_by_key(|leg| leg.abs_diff(self.leg));
        match nearest {
            Some(leg) if leg != self.leg => Self {
                leg,
                on_stretch: false,
                location: report.location,
                ..self
            },
            Some(_) if report.location != Location::Unknown => Self {
                location: report.location,
                ..self
            },
            _ => self,
        }
    }
}

/// Where a drone is on a version.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot {
    /// The leg; `None` on the first stretch.
    pub(crate) leg: Option<usize>,
    /// How far that is from where the version begins, in metres.
    pub(crate) at_m: f64,
    /// How far off its line the drone is.
    pub(crate) off_m: f64,
}

/// What is known of how far a drone has come on a version before it is seen, in metres from where that begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlownSoFar {
    /// So far it has come.
    pub(crate) flown_m: f64,
    /// So far it may have come since, at twice its airspeed.
    pub(crate) reach_m: f64,
    /// Its next stop is before this leg.
    pub(crate) stops_before: Option<usize>,
}

impl FlownSoFar {
    /// It may be anywhere.
    pub(crate) const UNKNOWN: Self = Self {
        flown_m: 0.0,
        reach_m: f64::INFINITY,
        stops_before: None,
    };
}

/// The nearest place on a version, not before what has been flown of it already; of equally near ones the earliest.
///
/// A way often leads back over what it has led over before. So a place beyond the next stop counts only where none before it is
/// near, and where the drone can have come there.
pub(crate) fn spot_on(
    topology: &Topology,
    version: &Version,
    place: Point,
    known: FlownSoFar,
) -> Option<Spot> {
    let flown_m = known.flown_m;
    let stretch = version.stretch.as_ref().map(|stretch| {
        let node = topology.position(stretch.reentry.node);
        (None, stretch.begin(), node)
    });
    let legs = version.composition.legs.iter().enumerate();
    let legs = legs.map(|(number, leg)| {
        let [from, to] = [leg.from, leg.to].map(|node| topology.position(node));
        (Some(number), from, to)
    });
    let mut nearest: Option<Spot> = None;
    let mut begins_m = 0.0;
    for (leg, from, to) in stretch.into_iter().chain(legs) {
        let is_beyond = leg.is_some_and(|leg| known.stops_before.is_some_and(|stop| leg >= stop));
        if is_beyond && nearest.is_some_and(|nearest| nearest.off_m <= ON_WAY_M) {
            break;
        }
        let length_m = from.distance_m(to);
        let flown_of_it_m = (flown_m - BACK_M - begins_m).max(0.0);
        if flown_of_it_m <= length_m {
            let least = if length_m > 0.0 {
                flown_of_it_m / length_m
            } else {
                0.0
            };
            let fraction = place.fraction_along(from, to).max(least);
            let spot = Spot {
                leg,
                at_m: begins_m + fraction * length_m,
                off_m: place.distance_m(from.towards(to, fraction)),
            };
            // A drone that has just begun, and brakes to turn, is on its first stretch and on no leg that happens to be near.
            if leg.is_none() && flown_m < BACK_M && fraction < 1.0 && spot.off_m <= BEGINS_WITHIN_M
            {
                return Some(spot);
            }
            // One that is past the stop already is somewhere beyond it.
            if is_beyond && nearest.is_some() && spot.at_m > known.reach_m + BACK_M {
                break;
            }
            if nearest.is_none_or(|nearest| spot.off_m < nearest.off_m - AS_NEAR_M) {
                nearest = Some(spot);
            }
        }
        begins_m += length_m;
    }
    nearest
}

/// The legs of a version that a drone at a place may be on: those that are nearest, one as near as the other, and those that begin
/// or end there; none where it is on its first stretch.
pub(crate) fn legs_at(
    topology: &Topology,
    version: &Version,
    place: Point,
) -> impl Iterator<Item = usize> {
    let nearest = spot_on(topology, version, place, FlownSoFar::UNKNOWN);
    let nearest = nearest.filter(|nearest| nearest.leg.is_some());
    let legs = version.composition.legs.iter().enumerate();
    legs.filter_map(move |(number, leg)| {
        let [from, to] = [leg.from, leg.to].map(|node| topology.position(node));
        let off_m = place.distance_to_line_m(from, to);
        let is_at_end = place.distance_m(from).min(place.distance_m(to)) <= ON_NODE_M;
        (off_m <= nearest?.off_m + AS_NEAR_M || is_at_end).then_some(number)
    })
}

/// Where the drone of a plan is: by its telemetry, else by nominal times, and then somewhere on its leg.
///
/// `None` when the plan has no leg left.
pub(crate) fn progress(
    topology: &Topology,
    plan: &PlanEntry,
    drones: &Drones,
    now: Timestamp,
) -> Option<Progress> {
    let version = &plan.reported;
    let legs = &version.composition.legs;
    let stretch = version.stretch.as_ref();
    // One that runs straight has to lead to a leg.
    let stretch = stretch.filter(|stretch| stretch.leg().is_some() || !legs.is_empty());
    if legs.is_empty() && stretch.is_none() {
        return None;
    }
    let sighting = plan.drone_id.as_deref().and_then(|id| drones.last(id));
    if let Some(sighting) = sighting.filter(|it| tells_progress(topology, version, it)) {
        return seen_at(topology, plan, stretch, &sighting);
    }
    let elapsed_s = now.duration_since(version.departs_at).as_secs_f64();
    if elapsed_s <= 0.0 {
        return Some(Progress {
            leg: 0,
            on_stretch: stretch.is_some(),
            location: stretch.map_or(Location::LegStart, |stretch| Location::At(stretch.begin())),
            remaining_m: version.composition.length_m,
        });
    }
    let stretch_s = legs.first().map(|first| first.departure_s);
    let stretch_s = stretch_s.unwrap_or(version.composition.flight_time_s);
    if stretch.is_some() && (elapsed_s < stretch_s || legs.is_empty()) {
        return Some(Progress {
            leg: 0,
            on_stretch: true,
            location: Location::Unknown,
            remaining_m: version.composition.length_m,
        });
    }
    let flown = legs.iter().position(|leg| elapsed_s < leg.arrival_s);
    let served = plan.last_served().map_or(0, |stop| stop.before_leg);
    let leg = flown
        .unwrap_or(legs.len() - 1)
        .max(served)
        .min(legs.len() - 1);
    Some(Progress {
        leg,
        on_stretch: false,
        location: match version.stands_before(leg, elapsed_s) {
            true => Location::LegStart,
            false => Location::Unknown,
        },
        remaining_m: legs[leg].length_m + length_after(legs, leg),
    })
}

/// The same by telemetry.
fn seen_at(
    topology: &Topology,
    plan: &PlanEntry,
    stretch: Option<&Stretch>,
    sighting: &Sighting,
) -> Option<Progress> {
    let version = &plan.reported;
    let legs = &version.composition.legs;
    let position = sighting.position(topology.frame());
    let known = plan.known_by(topology, Some(sighting), sighting.seen_at);
    let spot = spot_on(topology, version, position, known)?;
    let (end, after_m) = match spot.leg {
        Some(leg) => (legs[leg].to, length_after(legs, leg)),
        None => (
            stretch?.reentry.node,
            legs.iter().map(|leg| leg.length_m).sum(),
        ),
    };
    Some(Progress {
        leg: spot.leg.unwrap_or_default(),
        on_stretch: spot.leg.is_none(),
        location: Location::At(position),
        remaining_m: position.distance_m(topology.position(end)) + after_m,
    })
}

/// The same, also of a drone that waits without a way on: it is where it is to be.
pub(crate) fn progress_or_wait(
    topology: &Topology,
    plan: &PlanEntry,
    drones: &Drones,
    now: Timestamp,
) -> Option<Progress> {
    progress(topology, plan, drones, now).or_else(|| {
        plan.waits_at().map(|_| Progress {
            leg: 0,
            on_stretch: false,
            location: Location::LegStart,
            remaining_m: 0.0,
        })
    })
}

/// Whether a sighting says how far a drone has come on a version. A place beyond the network does
/// not, believed or not.
fn tells_progress(topology: &Topology, version: &Version, sighting: &Sighting) -> bool {
    let place = sighting.position(topology.frame());
    let has_departed = sighting.seen_at >= version.departs_at;
    has_departed && check_place(topology, place, None, None).is_ok()
}

fn length_after(legs: &[Leg], leg: usize) -> f64 {
    total_m(legs[leg + 1..].iter().map(|leg| leg.length_m))
}

/// Whether anything from a leg on is blocked.
pub(crate) fn is_blocked(airspace: &Airspace, composition: &Composition, from_leg: usize) -> bool {
    let ahead = composition.legs.get(from_leg..).unwrap_or_default();
    ahead
        .iter()
        .any(|leg| airspace.closed().blocks(leg.segment))
}

/// Whether a closure closes anything from a leg on.
pub(crate) fn is_hit(closure: &Closure, composition: &Composition, from_leg: usize) -> bool {
    let ahead = composition.legs.get(from_leg..).unwrap_or_default();
    ahead.iter().any(|leg| is_leg_hit(closure, leg))
}

/// Whether a closure closes anything of a leg.
pub(crate) fn is_leg_hit(closure: &Closure, leg: &Leg) -> bool {
    let hits = &closure.hits;
    hits.segments.binary_search(&leg.segment).is_ok()
        || hits.nodes.binary_search(&leg.to).is_ok()
        || hits.nodes.binary_search(&leg.from).is_ok()
}

/// Whether a closure that was not known before lies ahead on a first stretch.
pub(crate) fn is_on_stretch(
    stretch: Option<(&Stretch, Point)>,
    closure: &Closure,
    topology: &Topology,
) -> bool {
    stretch.is_some_and(|(stretch, place)| {
        !stretch.knew.contains(&closure.id) && stretch.is_met(topology, closure, place)
    })
}

/// The leg that the drone of a plan is on, and what is left of its way from there. On its first stretch that is the leg on
/// which the stretch runs, as it was flown before; who flies back on it has left what was planned beyond.
pub(crate) fn leg_ahead(
    plan: &PlanEntry,
    progress: &Progress,
) -> ((NodeIx, NodeIx), Option<Vec<NodeIx>>) {
    let version = &plan.reported;
    let nodes = &version.composition.way.nodes;
    let stretch = version.stretch.as_ref().filter(|_| progress.on_stretch);
    if let Some((stretch, leg)) = stretch.and_then(|stretch| Some((stretch, stretch.leg()?))) {
        let path = std::iter::once(leg.0).chain(nodes.iter().copied());
        return (leg, stretch.reentry.leads_on().then(|| path.collect()));
    }
    if let Some(node) = plan.waits_at() {
        return ((node, node), Some(nodes.clone()));
    }
    let leg = &version.composition.legs[progress.leg];
    ((leg.from, leg.to), Some(nodes[progress.leg..].to_vec()))
}

/// What of a version is ahead of a drone: from which leg on, and from where on the first stretch.
pub(crate) type Ahead<'a> = (usize, Option<(&'a Stretch, Point)>);

/// What of the reported version is ahead of the drone of a plan.
pub(crate) fn ahead<'a>(plan: &'a PlanEntry, progress: &Progress) -> Ahead<'a> {
    let stretch = plan.reported.stretch.as_ref();
    let stretch = stretch.filter(|_| progress.on_stretch);
    let place = |stretch: &Stretch| match progress.location {
        Location::At(place) => place,
        Location::LegStart | Location::Unknown => stretch.begin(),
    };
    (
        progress.leg,
        stretch.map(|stretch| (stretch, place(stretch))),
    )
}

/// All of a version.
pub(crate) fn whole(version: &Version) -> Ahead<'_> {
    let stretch = version.stretch.as_ref();
    (0, stretch.map(|stretch| (stretch, stretch.begin())))
}

/// The closures that have come onto a first stretch since it was worked out.
pub(crate) fn closures_on(stretch: Option<(&Stretch, Point)>, airspace: &Airspace) -> Vec<String> {
    stretch.map_or_else(Vec::new, |(stretch, place)| {
        stretch.obstructed_by(airspace, place)
    })
}

/// The same, and those that close the pads on which it lands where it diverts.
pub(crate) fn closures_at_ends(
    version: &Version,
    stretch: Option<(&Stretch, Point)>,
    airspace: &Airspace,
) -> Vec<String> {
    let mut ids = closures_on(stretch, airspace);
    ids.extend(version.ends_on_closed_pads(airspace));
    ids
}

/// The first leg of a version from a place on that a closure closes anything of.
pub(crate) fn first_hit(
    version: &Version,
    (from, stretch): Ahead<'_>,
    closure: &Closure,
    topology: &Topology,
) -> Option<usize> {
    if is_on_stretch(stretch, closure, topology) {
        return Some(from);
    }
    let mut legs = version.composition.legs.get(from..)?.iter();
    let hit = legs.position(|leg| is_leg_hit(closure, leg))?;
    Some(from + hit)
}
