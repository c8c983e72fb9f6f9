//! Where the new path starts: the ways from the drone back into the network, and what each costs.
//!
//! The drone is projected on its leg A - B. A is always a way back; B only if the leg is open or the cause
//! lies behind the drone. The first stretch never passes the cause nor enters a zone from outside while
//! the other way does not.

use super::answer::Warning;
use super::request::Request;
use crate::airspace::{Airspace, Closed, Zone};
use crate::flight::{FirstStretch, Location, Reentry, StretchKind, StretchLeg};
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx, Topology};

/// A drone farther from its leg than this, in metres, is off it.
const OFF_LEG_TOLERANCE_M: f64 = 50.0;
/// A drone off its leg is offered this many nodes at most.
const OFF_LEG_CANDIDATES: usize = 8;
/// How many of the nearest nodes are looked at to find open ones.
const OFF_LEG_LOOKED_AT: usize = 64;

/// The ways back into the network.
#[derive(Debug, Default)]
pub(super) struct Starts {
    pub(super) ways: Vec<Reentry>,
    /// True when the drone is off its leg, so that no way begins with the old plan.
    pub(super) off_leg: bool,
    /// True when the drone is inside an active zone, which its first stretch leaves.
    pub(super) leaves_zone: bool,
}

/// The failed leg with the drone on it.
pub(super) struct Leg {
    pub(super) from: NodeIx,
    pub(super) to: NodeIx,
    pub(super) segment: Option<SegmentIx>,
    pub(super) length_m: f64,
}

impl Leg {
    pub(super) fn of(request: &Request, closed: &Closed<'_>) -> Self {
        let topology = closed.topology();
        let (from, to) = request.report.leg;
        let segment = topology.segment_between(from, to);
        let straight_m = || topology.position(from).distance_m(topology.position(to));
        Self {
            from,
            to,
            segment,
            length_m: segment.map_or_else(straight_m, |found| topology.segment(found).length_m),
        }
    }

    /// The way from a place on the leg to one of its ends.
    fn reentry(&self, closed: &Closed<'_>, node: NodeIx, flown: f64) -> Reentry {
        let topology = closed.topology();
        let (from, to) = (topology.position(self.from), topology.position(self.to));
        let place = from.towards(to, flown);
        let leg = StretchLeg {
            from: self.from,
            to: self.to,
            segment: self.segment,
            fraction: flown,
        };
        let share = if node == self.from {
            flown
        } else {
            1.0 - flown
        };
        let length_m = share * self.length_m;
        if length_m == 0.0 {
            return Reentry::at_node(node, place, Some(leg));
        }
        let stretch = FirstStretch {
            kind: StretchKind::Leg,
            leg: Some(leg),
            length_m,
            overrun_m: 0.0,
            begin: place,
        };
        Reentry { node, stretch }
    }
}

/// What lies on the leg, by fraction flown.
#[derive(Debug, Default)]
struct Obstacles {
    /// Parts of the leg inside active zones.
    zones: Vec<(f64, f64)>,
    /// Where the drone saw the cause.
    cause: Option<f64>,
    /// The leg is closed and nobody knows where: ahead, then.
    unknown_ahead: bool,
}

impl Obstacles {
    fn found(request: &Request, airspace: &Airspace, closed: &Closed<'_>, leg: &Leg) -> Self {
        let topology = closed.topology();
        let ends = (topology.position(leg.from), topology.position(leg.to));
        let cause = request
            .report
            .cause_location
            .map(|place| fraction_along(ends, place).0);
        let is_closed = leg
            .segment
            .is_some_and(|segment| closed.closes_segment(segment));
        let mut zones = Vec::new();
        // Most requests close the leg themselves, without a zone: then there is none to look for.
        let by_zone = |segment| airspace.closed().closes_segment(segment) || request.zone.is_some();
        if leg.segment.is_some_and(by_zone) {
            for zone in zones_on(request, airspace, leg.segment) {
                zones.extend(zone.coverage(ends.0, ends.1));
            }
        }
        let unknown_ahead = is_closed && cause.is_none() && zones.is_empty();
        Self {
            zones,
            cause,
            unknown_ahead,
        }
    }

    /// True when the way back from `flown` to the start of the leg meets the cause or enters a zone.
    fn behind(&self, flown: f64) -> bool {
        self.cause.is_some_and(|cause| cause < flown)
            || self.zones.iter().any(|&(_, until)| until < flown)
    }

    /// The same for the way on to the end of the leg.
    fn ahead(&self, flown: f64) -> bool {
        self.unknown_ahead
            || self.cause.is_some_and(|cause| cause >= flown)
            || self.zones.iter().any(|&(from, _)| from >= flown)
    }

    /// The part of the leg inside zones that the drone is in.
    fn around(&self, flown: f64) -> Option<(f64, f64)> {
        let holding = self
            .zones
            .iter()
            .filter(|part| part.0 <= flown && flown <= part.1);
        holding
            .copied()
            .reduce(|one, other| (one.0.min(other.0), one.1.max(other.1)))
    }
}

/// The zones that close a segment, standing and brought.
fn zones_on<'a>(
    request: &'a Request,
    airspace: &'a Airspace,
    segment: Option<SegmentIx>,
) -> impl Iterator<Item = &'a Zone> {
    let closes = move |segments: &[SegmentIx]| {
        segment.is_some_and(|segment| segments.binary_search(&segment).is_ok())
    };
    let standing = airspace
        .in_force()
        .filter(move |closure| closes(&closure.hits.segments))
        .filter_map(|closure| closure.zone().map(|zone| &**zone));
    let brought = request
        .zone
        .iter()
        .filter(move |brought| closes(&brought.hits.segments))
        .map(|brought| &*brought.zone);
    standing.chain(brought)
}

/// The fraction of the way from the first end to the second that is nearest to a point, and how far off it is in metres.
fn fraction_along(ends: (Point, Point), point: Point) -> (f64, f64) {
    let (from, to) = ends;
    let along = Point::new(to.x - from.x, to.y - from.y);
    let squared = along.x * along.x + along.y * along.y;
    let fraction = match squared > 0.0 {
        true => ((point.x - from.x) * along.x + (point.y - from.y) * along.y) / squared,
        false => 0.0,
    };
    let fraction = fraction.clamp(0.0, 1.0);
    (fraction, from.towards(to, fraction).distance_m(point))
}

/// Finds the ways back into the network, with what the receiver should know of them.
pub(super) fn find(
    request: &Request,
    airspace: &Airspace,
    closed: &Closed<'_>,
    leg: &Leg,
    starts: &mut Starts,
    warnings: &mut Vec<Warning>,
) {
    starts.ways.clear();
    starts.off_leg = false;
    starts.leaves_zone = false;
    let topology = closed.topology();
    let ends = (topology.position(leg.from), topology.position(leg.to));
    match request.report.location {
        Location::Unknown => {
            let obstacles = Obstacles::found(request, airspace, closed, leg);
            let back = leg.reentry(closed, leg.from, 1.0);
            let on = leg.reentry(closed, leg.to, 0.0);
            let passable =
                !obstacles.unknown_ahead && obstacles.cause.is_none() && obstacles.zones.is_empty();
            choose(
                closed,
                starts,
                warnings,
                Some(back),
                passable.then_some(on),
                false,
            );
        }
        Location::LegStart => on_leg(request, airspace, closed, leg, 0.0, starts, warnings),
        Location::At(place) => {
            let (flown, off_leg_m) = fraction_along(ends, place);
            if off_leg_m > OFF_LEG_TOLERANCE_M {
                starts.off_leg = true;
                off_leg(
                    request, airspace, closed, place, off_leg_m, starts, warnings,
                );
            } else {
                on_leg(request, airspace, closed, leg, flown, starts, warnings);
            }
        }
    }
}

fn on_leg(
    request: &Request,
    airspace: &Airspace,
    closed: &Closed<'_>,
    leg: &Leg,
    flown: f64,
    starts: &mut Starts,
    warnings: &mut Vec<Warning>,
) {
    let obstacles = Obstacles::found(request, airspace, closed, leg);
    let back = leg.reentry(closed, leg.from, flown);
    let on = leg.reentry(closed, leg.to, flown);
    let (behind, ahead) = (obstacles.behind(flown), obstacles.ahead(flown));
    if let Some((from, until)) = obstacles.around(flown).filter(|_| flown > 0.0) {
        warnings.push(Warning::InsideZone);
        starts.leaves_zone = true;
        let back_is_shorter = flown - from <= until - flown;
        let goes_back = match (behind, ahead) {
            (false, true) => true,
            (true, false) => false,
            _ => back_is_shorter,
        };
        let (way, other) = if goes_back { (back, on) } else { (on, back) };
        debug_assert_ne!(way.node, other.node);
        choose(closed, starts, warnings, Some(way), None, false);
        return;
    }
    match (behind, ahead) {
        (false, false) => choose(closed, starts, warnings, Some(back), Some(on), false),
        (false, true) => choose(closed, starts, warnings, Some(back), None, false),
        (true, false) => choose(closed, starts, warnings, None, Some(on), true),
        (true, true) => {
            warnings.push(Warning::BetweenCauses);
            choose(closed, starts, warnings, Some(back), None, false);
        }
    }
}

/// Keeps the ways whose node is open, or one of them where none is.
fn choose(
    closed: &Closed<'_>,
    starts: &mut Starts,
    warnings: &mut Vec<Warning>,
    back: Option<Reentry>,
    on: Option<Reentry>,
    cause_is_behind: bool,
) {
    let ways = [back, on].into_iter().flatten();
    starts
        .ways
        .extend(ways.filter(|way| !closed.closes_node(way.node)));
    if !starts.ways.is_empty() {
        return;
    }
    let least_bad = match cause_is_behind {
        true => on.or(back),
        false => back.or(on),
    };
    if let Some(way) = least_bad {
        warnings.push(Warning::StartClosed { node: way.node });
        starts.ways.push(way);
    }
}

/// The straight line from a place off every leg to a node.
fn straight_to(topology: &Topology, place: Point, node: NodeIx) -> Reentry {
    let length_m = topology.position(node).distance_m(place);
    if length_m == 0.0 {
        return Reentry::at_node(node, place, None);
    }
    let stretch = FirstStretch {
        kind: StretchKind::Straight,
        leg: None,
        length_m,
        overrun_m: 0.0,
        begin: place,
    };
    Reentry { node, stretch }
}

/// The nearest open nodes to a drone that is off its leg.
fn off_leg(
    request: &Request,
    airspace: &Airspace,
    closed: &Closed<'_>,
    place: Point,
    off_leg_m: f64,
    starts: &mut Starts,
    warnings: &mut Vec<Warning>,
) {
    let topology = closed.topology();
    let around = [place.x as f32, place.y as f32];
    let mut near: Vec<Reentry> = topology
        .node_tree()
        .nearest_neighbor_iter(&around)
        .filter(|candidate| !closed.closes_node(candidate.node))
        .take(OFF_LEG_LOOKED_AT)
        .map(|candidate| straight_to(topology, place, candidate.node))
        .collect();
    near.sort_by(|one, other| {
        let by_distance = one.stretch.length_m.total_cmp(&other.stretch.length_m);
        by_distance.then_with(|| topology.rank(one.node).cmp(&topology.rank(other.node)))
    });
    let standing = airspace
        .in_force()
        .filter_map(|closure| closure.zone().map(|zone| &**zone));
    let zones: Vec<&Zone> = standing
        .chain(request.zone.iter().map(|brought| &*brought.zone))
        .collect();
    let is_clear = |start: &&Reentry| {
        let node = topology.position(start.node);
        zones
            .iter()
            .all(|zone| !zone.shape().meets_segment(place, node, zone.margin_m()))
    };
    starts
        .ways
        .extend(near.iter().filter(is_clear).take(OFF_LEG_CANDIDATES));
    if starts.ways.is_empty() {
        warnings.push(Warning::Unsafe { off_leg_m });
        starts.ways.extend(near.first());
    } else {
        warnings.push(Warning::Unverified { off_leg_m });
    }
}
