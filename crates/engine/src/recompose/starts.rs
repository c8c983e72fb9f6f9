//! Where the new path starts: the ways from the drone back into the network, and what each costs.
//!
//! The drone is projected on its leg A - B. A is a way back unless something lies between; B only if the leg is
//! open, or every cause that closes it lies behind the drone. A first stretch passes no cause and never enters a
//! zone from outside; from past an end it is as long as the drone is away. Inside a zone it leads out, by the shorter
//! way along the leg where one is free.

use super::answer::Warning;
use super::causes::{Causes, all_zones, fraction_along, way_out, zone_parts};
use super::request::Request;
use super::safety::{UnsafeCode, UnsafeWay};
use crate::airspace::{Airspace, Closed};
use crate::flight::{Aloft, FirstStretch, Location, Reentry, StretchKind, StretchLeg};
use crate::geo::{Point, total_m};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::planted::{self, Bug};

/// A drone farther from its leg than this, in metres, is off it.
pub const OFF_LEG_TOLERANCE_M: f64 = 50.0;
/// A drone off its leg is offered this many nodes at most.
const OFF_LEG_CANDIDATES: usize = 8;
/// How many of the nearest nodes are looked at to find open ones.
const OFF_LEG_LOOKED_AT: usize = 64;
/// A drone within this many metres of a node may stand there.
pub(super) const AT_NODE_WITHIN_M: f64 = 15.0;
/// So far beyond the margin of a zone, in metres, is outside of it.
const OUTSIDE_M: f64 = 1.0;

/// The ways back into the network.
#[derive(Debug, Default)]
pub(super) struct Starts {
    /// The ways; none where none is safe.
    pub(super) ways: Vec<Reentry>,
    /// For a drone that leaves a zone: the longer way out, for where the shorter one leads nowhere.
    pub(super) spare: Option<Reentry>,
    /// True when the drone does not begin on its leg, so that no way begins with the old plan.
    pub(super) off_leg: bool,
    /// True when the drone is inside an active zone, which its first stretch leaves.
    pub(super) leaves_zone: bool,
    /// True when it comes into a zone before it can turn.
    pub(super) cannot_stop: bool,
    /// Where there is no way: the least bad one.
    pub(super) least_bad: Option<UnsafeWay>,
}

impl Starts {
    fn clear(&mut self) {
        self.ways.clear();
        self.spare = None;
        self.off_leg = false;
        self.leaves_zone = false;
        self.cannot_stop = false;
        self.least_bad = None;
    }
}

/// The failed leg with the drone on it.
pub(super) struct Leg {
    pub(super) from: NodeIx,
    pub(super) to: NodeIx,
    pub(super) segment: Option<SegmentIx>,
    pub(super) length_m: f64,
}

impl Leg {
    pub(super) fn of(request: &Request, topology: &Topology) -> Self {
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

    /// The way from a place on the leg to one of its ends, after the metres flown on before the drone turns. From past that end it
    /// is as long as the drone is away.
    fn reentry(
        &self,
        topology: &Topology,
        (node, flown): (NodeIx, f64),
        overrun_m: f64,
        past: Option<(Point, f64)>,
    ) -> Reentry {
        let (from, to) = (topology.position(self.from), topology.position(self.to));
        let on_leg = from.towards(to, flown);
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
        let along_m = share * self.length_m;
        let (begin, away_m) = match past {
            Some((place, off_m)) if off_m > along_m => (place, off_m),
            _ => (on_leg, along_m),
        };
        let length_m = away_m + 2.0 * overrun_m;
        Reentry::along(node, leg, begin, (length_m, overrun_m))
    }
}

/// Whether a drone is level with an end of its leg or past it, by the fraction that it has flown, as exact as that is.
pub(crate) fn is_past_end(flown: f64) -> bool {
    flown.min(1.0 - flown) < 1e-6
}

/// Where on its leg a drone is.
#[derive(Clone, Copy, Debug)]
struct Flown {
    /// As it was reported: for the way on, and for what lies behind.
    reported: f64,
    /// As far as it may have come since: for what lies ahead, and for the way back.
    latest: f64,
    /// True where it is moving, as far as anybody knows.
    moves: bool,
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
    starts.clear();
    let mut finder = Finder {
        request,
        airspace,
        closed,
        topology: closed.topology(),
        leg,
        past: None,
        starts,
        warnings,
    };
    finder.find();
}

struct Finder<'a, 'b> {
    request: &'a Request,
    airspace: &'a Airspace,
    closed: &'a Closed<'a>,
    topology: &'a Topology,
    leg: &'a Leg,
    /// Where the drone says that it is, and how far off its leg.
    past: Option<(Point, f64)>,
    starts: &'b mut Starts,
    warnings: &'b mut Vec<Warning>,
}

impl Finder<'_, '_> {
    fn find(&mut self) {
        let ends = self.ends();
        match self.request.report.location {
            Location::Unknown => self.anywhere(),
            Location::LegStart => self.on_leg(Flown {
                reported: 0.0,
                latest: 0.0,
                moves: false,
            }),
            Location::At(place) => {
                let (flown, off_leg_m) = fraction_along(ends, place);
                if off_leg_m > OFF_LEG_TOLERANCE_M {
                    self.off_leg(place, off_leg_m);
                    return;
                }
                self.past = is_past_end(flown).then_some((place, off_leg_m));
                let drone = &self.request.circumstances;
                let since_m = drone.speed_mps * drone.place_age_s;
                let since = match self.leg.length_m > 0.0 {
                    true => since_m / self.leg.length_m,
                    false => 0.0,
                };
                let latest = (flown + since).min(1.0);
                self.on_leg(Flown {
                    reported: flown,
                    latest,
                    moves: flown < 1.0 && latest > 0.0,
                });
            }
        }
    }

    fn ends(&self) -> (Point, Point) {
        let (from, to) = (self.leg.from, self.leg.to);
        (self.topology.position(from), self.topology.position(to))
    }

    fn back(&self, flown: f64, overrun_m: f64) -> Reentry {
        let at = (self.leg.from, flown);
        self.leg.reentry(self.topology, at, overrun_m, self.past)
    }

    fn on(&self, flown: f64) -> Reentry {
        let at = (self.leg.to, flown);
        self.leg.reentry(self.topology, at, 0.0, self.past)
    }

    /// True when a drone at a place on the leg may come to its start: it is open, or the drone is there.
    fn may_go_back(&self, flown: f64) -> bool {
        let is_entered = planted::is(Bug::ClosedNodeEntered);
        flown == 0.0 || is_entered || !self.closed.closes_node(self.leg.from)
    }

    /// The same for its end.
    fn may_go_on(&self, flown: f64) -> bool {
        flown == 1.0 || !self.closed.closes_node(self.leg.to)
    }

    /// The drone's place is unknown: it may be at either end, whichever is worse.
    fn anywhere(&mut self) {
        let causes = Causes::found(self.request, self.airspace, self.leg);
        // What the drone itself cannot pass does not lie behind it; a zone may.
        if !causes.have_zones() && self.may_go_back(1.0) {
            self.starts.ways.push(self.back(1.0, 0.0));
        }
        if causes.are_none() && self.may_go_on(0.0) {
            self.starts.ways.push(self.on(0.0));
        }
        if self.starts.ways.is_empty() {
            let back = self.back(1.0, 0.0);
            let (from, to) = self.ends();
            self.give_up(UnsafeCode::PlaceUnknown, vec![back.node], vec![to, from]);
        }
    }

    fn on_leg(&mut self, drone: Flown) {
        if self.stands(drone) {
            return;
        }
        let causes = Causes::found(self.request, self.airspace, self.leg);
        if let Some(part) = causes.around(drone.reported) {
            self.out_of_zone(&causes, drone, part);
            return;
        }
        if self.runs_into_zone(&causes, drone) {
            return;
        }
        if !causes.lie_behind(drone.reported) && self.may_go_back(drone.latest) {
            let back = self.back(drone.latest, 0.0);
            if self.closed.closes_node(back.node) {
                self.warnings.push(Warning::StartClosed { node: back.node });
            }
            self.starts.ways.push(back);
        }
        if !causes.lie_ahead(drone.reported) && self.may_go_on(drone.reported) {
            self.starts.ways.push(self.on(drone.reported));
        }
        if self.starts.ways.is_empty() {
            self.trapped(&causes, drone.reported);
        }
    }

    /// The way of a drone on the ground: the node that it stands at, over whose open segments it may leave. False for any other.
    fn stands(&mut self, drone: Flown) -> bool {
        let left_m = |share: f64| share * self.leg.length_m;
        let (from_m, to_m) = (left_m(drone.reported), left_m(1.0 - drone.reported));
        let is_grounded = self.request.circumstances.aloft == Aloft::Grounded;
        if !is_grounded || from_m.min(to_m) > AT_NODE_WITHIN_M {
            return false;
        }
        // One that has landed past its node, as near as places are exact, stands there.
        let past = self.past.filter(|&(_, past_m)| past_m > AT_NODE_WITHIN_M);
        let node = if from_m <= to_m {
            self.leg.from
        } else {
            self.leg.to
        };
        let at = (node, drone.reported);
        let way = self.leg.reentry(self.topology, at, 0.0, past);
        if self.closed.closes_node(way.node) {
            self.warnings.push(Warning::StartClosed { node: way.node });
        }
        self.starts.ways.push(way);
        true
    }

    /// The ways of a drone that comes into a zone ahead before it can turn; false where there is none so near.
    fn runs_into_zone(&mut self, causes: &Causes, drone: Flown) -> bool {
        let stopping_m = self.request.circumstances.stopping_m();
        let Some(zone) = causes.next_zone(drone.reported).filter(|_| drone.moves) else {
            return false;
        };
        let (begins, ends) = zone;
        if (begins - drone.latest) * self.leg.length_m >= stopping_m {
            return false;
        }
        let turns = (drone.latest + stopping_m / self.leg.length_m).min(1.0);
        let overrun_m = (turns - drone.latest) * self.leg.length_m;
        self.starts.cannot_stop = true;
        let may_go_back = !causes.lie_behind(drone.reported) && self.may_go_back(drone.latest);
        let may_go_on = ends < 1.0
            && !causes.lie_ahead_but(drone.reported, zone)
            && self.may_go_on(drone.reported);
        let back = may_go_back.then(|| self.back(drone.latest, overrun_m));
        let on = may_go_on.then(|| self.on(drone.reported));
        if back.is_none() && on.is_none() {
            self.trapped(causes, drone.reported);
            return true;
        }
        // Once inside, it leaves by the shorter way.
        self.take_shorter(back, on, turns - begins <= ends - turns);
        true
    }

    /// Takes the shorter way out of a zone; the other one for where that leads nowhere.
    fn take_shorter(&mut self, back: Option<Reentry>, on: Option<Reentry>, is_back_shorter: bool) {
        let (first, other) = if is_back_shorter {
            (back, on)
        } else {
            (on, back)
        };
        let mut ways = first.into_iter().chain(other);
        self.starts.ways.extend(ways.next());
        self.starts.spare = ways.next();
    }

    /// The way of a drone out of the zones that it is in: along its leg, else straight.
    fn out_of_zone(&mut self, causes: &Causes, drone: Flown, part: (f64, f64)) {
        let flown = drone.reported;
        let (from, until) = part;
        self.warnings.push(Warning::InsideZone);
        self.starts.leaves_zone = true;
        let may_go_back = from > 0.0 && !causes.lie_behind(flown) && self.may_go_back(flown);
        let may_go_on = until < 1.0 && !causes.lie_ahead(flown) && self.may_go_on(flown);
        let back = may_go_back.then(|| self.back(drone.latest, 0.0));
        let on = may_go_on.then(|| self.on(flown));
        if back.is_some() || on.is_some() {
            // Where its place is old, both ways are the longest that they can be.
            let is_back_shorter = drone.latest - from <= until - flown;
            self.take_shorter(back, on, is_back_shorter);
            return;
        }
        let (start, end) = self.ends();
        let place = match self.request.report.location {
            Location::At(place) => place,
            Location::LegStart | Location::Unknown => start.towards(end, flown),
        };
        if self.straight_from(place, Some((self.leg.from, self.leg.to))) {
            self.warnings.push(Warning::Unverified { off_leg_m: 0.0 });
        } else {
            self.trapped(causes, flown);
        }
    }

    /// No way is safe: the drone stays, or goes to the nearest place on its leg outside every zone.
    fn trapped(&mut self, causes: &Causes, flown: f64) {
        let (from, to) = self.ends();
        let both_between = causes.lie_behind(flown) && causes.lie_ahead(flown);
        let code = if both_between {
            self.warnings.push(Warning::BetweenCauses);
            UnsafeCode::BetweenCauses
        } else {
            UnsafeCode::EndsClosed
        };
        let place = from.towards(to, flown);
        let Some((first, last)) = causes.around(flown) else {
            self.give_up(code, Vec::new(), vec![place]);
            return;
        };
        let beyond = OUTSIDE_M / self.leg.length_m.max(OUTSIDE_M);
        let out = [first - beyond, last + beyond].into_iter();
        let nearest = out
            .filter(|share| (0.0..=1.0).contains(share) && causes.around(*share).is_none())
            .min_by(|one, other| (one - flown).abs().total_cmp(&(other - flown).abs()));
        match nearest {
            Some(share) => {
                let line = vec![place, from.towards(to, share)];
                self.give_up(code, Vec::new(), line);
            }
            None => self.give_up_for_nearest(code, place),
        }
    }

    /// The least bad way is straight to the nearest open node, whatever is between.
    fn give_up_for_nearest(&mut self, code: UnsafeCode, place: Point) {
        let around = [place.x as f32, place.y as f32];
        let nodes = self.topology.node_tree().nearest_neighbor_iter(&around);
        let mut open = nodes.filter(|candidate| !self.closed.closes_node(candidate.node));
        let nearest = open.next().map(|candidate| candidate.node);
        match nearest {
            Some(node) => {
                let line = vec![place, self.topology.position(node)];
                self.give_up(code, vec![node], line);
            }
            None => self.give_up(code, Vec::new(), vec![place]),
        }
    }

    fn give_up(&mut self, code: UnsafeCode, nodes: Vec<NodeIx>, line: Vec<Point>) {
        let pairs = line.windows(2);
        let length_m = total_m(pairs.map(|pair| pair[0].distance_m(pair[1])));
        self.starts.least_bad = Some(UnsafeWay {
            code,
            nodes,
            line,
            length_m,
            battery: None,
        });
    }

    /// The nearest open nodes to a drone that is off its leg.
    fn off_leg(&mut self, place: Point, off_leg_m: f64) {
        let is_inside = all_zones(self.request, self.airspace)
            .any(|zone| zone.shape().covers_point(place, zone.margin_m()));
        if is_inside {
            self.warnings.push(Warning::InsideZone);
            self.starts.leaves_zone = true;
        }
        self.starts.off_leg = true;
        if self.straight_from(place, None) {
            self.warnings.push(Warning::Unverified { off_leg_m });
        } else {
            self.warnings.push(Warning::Unsafe { off_leg_m });
            self.give_up_for_nearest(UnsafeCode::Unverified, place);
        }
    }

    /// Offers the nearest open nodes whose straight line crosses no zone but those that it leaves; false where there are none.
    ///
    /// Lines by the ends of a leg that the drone is on are left out: what blocks the leg blocks the straight line along it.
    fn straight_from(&mut self, place: Point, on: Option<(NodeIx, NodeIx)>) -> bool {
        let topology = self.topology;
        let ends = on.map(|(from, to)| [from, to].map(|end| topology.position(end)));
        let comes_along_leg = |node: NodeIx| {
            let line = (place, topology.position(node));
            let comes_near = |end: &Point| fraction_along(line, *end).1 <= OFF_LEG_TOLERANCE_M;
            let is_beyond = |end: &&Point| end.distance_m(place) > OFF_LEG_TOLERANCE_M;
            ends.is_some_and(|ends| ends.iter().filter(is_beyond).any(comes_near))
        };
        let around = [place.x as f32, place.y as f32];
        let mut near: Vec<Reentry> = topology
            .node_tree()
            .nearest_neighbor_iter(&around)
            .filter(|near| !self.closed.closes_node(near.node) && !comes_along_leg(near.node))
            .take(OFF_LEG_LOOKED_AT)
            .map(|candidate| straight_to(topology, place, candidate.node))
            .collect();
        near.sort_by(|one, other| {
            let by_distance = one.stretch.length_m.total_cmp(&other.stretch.length_m);
            by_distance.then_with(|| topology.rank(one.node).cmp(&topology.rank(other.node)))
        });
        let is_clear = |way: &&Reentry| {
            let line = (place, topology.position(way.node));
            way_out(&zone_parts(all_zones(self.request, self.airspace), line)).is_some()
        };
        let clear = near.iter().filter(is_clear).take(OFF_LEG_CANDIDATES);
        self.starts.ways.extend(clear);
        self.starts.off_leg = true;
        !self.starts.ways.is_empty()
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
