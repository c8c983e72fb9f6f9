//! Where a path may start, read from the rules once more and in the plainest way: a drone is walked along its leg, and
//! every cause lies on a part of the leg, or at an unknown place.

use super::ground::{DOUBT_M, Doubt, Walk};
use super::world::{Place, PlainWorld, Spot, apart_m, between};

/// Farther from its leg than this a drone is off it, in metres.
const OFF_LEG_M: f64 = 50.0;
/// A drone off its leg is offered this many nodes.
const STRAIGHT_WAYS: usize = 8;
/// How long it takes to begin to brake, and how hard a drone brakes.
const REACTION_S: f64 = 2.0;
const BRAKING_MPS2: f64 = 3.5;

/// A way back into the network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlainWay {
    pub(super) node: usize,
    pub(super) length_m: f64,
    pub(super) overrun_m: f64,
    pub(super) is_straight: bool,
    /// Where on the leg it begins.
    pub(super) fraction: Option<f64>,
}

/// What the rules say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Expected {
    pub(super) ways: Vec<PlainWay>,
    pub(super) spare: Option<PlainWay>,
    pub(super) off_leg: bool,
    pub(super) leaves_zone: bool,
    pub(super) cannot_stop: bool,
    /// A drone that runs into a zone and is sooner out of it ahead: it may be told to turn all the same, and has no other
    /// way than these.
    pub(super) either_way: bool,
    /// How far it is to the least bad place, where there is no way.
    pub(super) least_bad_m: Option<f64>,
}

/// The leg with what lies on it.
struct Leg<'a> {
    world: &'a PlainWorld,
    ends: (Spot, Spot),
    length_m: f64,
    /// How far past one of its ends the drone is.
    past_m: f64,
    walk: Walk,
    /// Where the drone says that its cause is.
    known: Option<f64>,
    /// Something closes it at an unknown place.
    unknown: bool,
}

/// The share of the way from the first end to the second that is nearest to a spot, and how far off it is.
fn projected((from, to): (Spot, Spot), spot: Spot) -> (f64, f64) {
    let along = (to.0 - from.0, to.1 - from.1);
    let squared = along.0 * along.0 + along.1 * along.1;
    let share = ((spot.0 - from.0) * along.0 + (spot.1 - from.1) * along.1) / squared;
    let share = share.clamp(0.0, 1.0);
    (share, apart_m(between(from, to, share), spot))
}

pub(super) fn expected(world: &PlainWorld) -> Result<Expected, Doubt> {
    let leg = Leg::of(world)?;
    for node in 0..world.nodes.len() {
        let mut zones = world.zones.iter();
        if zones.any(|zone| zone.clearance_m(world.nodes[node]).abs() < DOUBT_M) {
            return Err("a node is at a boundary");
        }
    }
    let stays = |fraction: f64| leg.starts_on_leg(fraction, fraction, false);
    match world.place {
        Place::Unknown => Ok(leg.starts_anywhere()),
        Place::AtStart => stays(0.0),
        Place::At(spot) => {
            let (fraction, off_m) = projected(leg.ends, spot);
            if (off_m - OFF_LEG_M).abs() < DOUBT_M {
                return Err("it is just off its leg");
            }
            if off_m > OFF_LEG_M {
                return leg.starts_aside(spot);
            }
            let since = world.speed_mps * world.age_s / leg.length_m;
            let latest = (fraction + since).min(1.0);
            if fraction == 0.0 && latest > 0.0 {
                return Err("it stood at the start of its leg, some time ago");
            }
            leg.starts_on_leg(fraction, latest, fraction > 0.0 && fraction < 1.0)
        }
    }
}

impl<'a> Leg<'a> {
    fn of(world: &'a PlainWorld) -> Result<Self, Doubt> {
        let ends = (world.nodes[world.leg.0], world.nodes[world.leg.1]);
        let segment = world.segment_of_leg();
        let cause = world.cause.filter(|_| world.closes_leg);
        let is_shut = segment.is_some_and(|segment| world.closed_segments.contains(&segment));
        let past_m = match world.place {
            Place::At(spot) => match projected(ends, spot) {
                (along, _) if along.min(1.0 - along) >= 1e-6 => 0.0,
                (_, off_m) => off_m,
            },
            Place::AtStart | Place::Unknown => 0.0,
        };
        Ok(Self {
            world,
            ends,
            past_m,
            length_m: segment.map_or(apart_m(ends.0, ends.1), |found| world.segments[found].2),
            walk: world.walk(ends.0, ends.1)?,
            known: cause.map(|spot| projected(ends, spot).0),
            unknown: is_shut || segment.is_none() || (world.closes_leg && cause.is_none()),
        })
    }

    fn is_closed(&self, node: usize) -> bool {
        let world = self.world;
        let mut zones = world.zones.iter();
        world.closed_nodes.contains(&node)
            || zones.any(|zone| zone.clearance_m(world.nodes[node]) <= 0.0)
    }

    fn back(&self, from: f64, overrun_m: f64) -> PlainWay {
        PlainWay {
            node: self.world.leg.0,
            length_m: (from * self.length_m).max(self.past_m) + 2.0 * overrun_m,
            overrun_m,
            is_straight: false,
            fraction: Some(from),
        }
    }

    fn on(&self, from: f64) -> PlainWay {
        PlainWay {
            node: self.world.leg.1,
            length_m: ((1.0 - from) * self.length_m).max(self.past_m),
            overrun_m: 0.0,
            is_straight: false,
            fraction: Some(from),
        }
    }

    /// Back to the start: past no cause, into no zone, to a node that may be entered or that the drone is at.
    fn may_go_back(&self, at: f64, latest: f64) -> bool {
        let is_passed = self.unknown && at == 1.0;
        let passes =
            is_passed || self.known.is_some_and(|cause| cause < at) || self.walk.enters(at, 0.0);
        let comes_in = latest == 0.0 || !self.is_closed(self.world.leg.0);
        let ends_inside = at > 0.0 && self.walk.part_at(0.0).is_some();
        !passes && comes_in && !ends_inside
    }

    /// On to the end likewise, and only where every cause has a known place behind the drone, or the drone is there.
    fn may_go_on(&self, at: f64) -> bool {
        let passes = self.known.is_some_and(|cause| cause >= at) || self.walk.enters(at, 1.0);
        let comes_in = at == 1.0 || !self.is_closed(self.world.leg.1);
        let ends_inside = at < 1.0 && self.walk.part_at(1.0).is_some();
        (!self.unknown || at == 1.0) && !passes && comes_in && !ends_inside
    }

    fn starts_on_leg(&self, at: f64, latest: f64, moves: bool) -> Result<Expected, Doubt> {
        let near_cause = |cause: f64| (cause - at).abs() * self.length_m < DOUBT_M;
        if self.walk.is_doubtful_at(at) || self.known.is_some_and(near_cause) {
            return Err("it is at a boundary, or at its cause");
        }
        if let Some(part) = self.walk.part_at(at) {
            return self.starts_inside(at, latest, part);
        }
        if let Some(run_in) = self.cannot_stop(at, latest, moves)? {
            return Ok(run_in);
        }
        let mut expected = Expected::default();
        expected
            .ways
            .extend(self.may_go_back(at, latest).then(|| self.back(latest, 0.0)));
        expected
            .ways
            .extend(self.may_go_on(at).then(|| self.on(at)));
        if expected.ways.is_empty() {
            expected.least_bad_m = Some(self.least_bad_m(at));
        }
        Ok(expected)
    }

    /// A drone that comes into the next zone before it can turn; none where it can.
    fn cannot_stop(&self, at: f64, latest: f64, moves: bool) -> Result<Option<Expected>, Doubt> {
        let speed_mps = self.world.speed_mps;
        let stopping_m = speed_mps * REACTION_S + speed_mps * speed_mps / (2.0 * BRAKING_MPS2);
        let ahead = self.walk.parts.iter().find(|part| part.0 > at);
        let Some(&zone) = ahead.filter(|_| moves) else {
            return Ok(None);
        };
        let room_m = (zone.0 - latest) * self.length_m - stopping_m;
        if room_m.abs() < DOUBT_M {
            return Err("it can just stop, or just not");
        }
        if room_m > 0.0 {
            return Ok(None);
        }
        let turns = (latest + stopping_m / self.length_m).min(1.0);
        let overrun_m = (turns - latest) * self.length_m;
        let mut expected = Expected {
            cannot_stop: true,
            ..Expected::default()
        };
        // Once inside, the rules for the inside hold: the shorter way out that passes nothing.
        let others = self.walk.parts.iter().filter(|part| part.0 > zone.1);
        let passes_ahead = self.unknown || self.known.is_some_and(|cause| cause >= at);
        let on = zone.1 < 1.0
            && !passes_ahead
            && others.count() == 0
            && !self.is_closed(self.world.leg.1);
        let back = self.may_go_back(at, latest.max(f64::MIN_POSITIVE));
        let (back_m, on_m) = (turns - zone.0, zone.1 - turns);
        if back && on && (on_m - back_m).abs() * self.length_m < DOUBT_M {
            return Err("both ways out are as short");
        }
        if on && (!back || on_m < back_m) {
            expected.either_way = true;
            expected.ways.push(self.on(at));
        }
        if on && back && !expected.either_way {
            expected.spare = Some(self.on(at));
        }
        if back {
            expected.ways.push(self.back(latest, overrun_m));
        } else if !on {
            expected.least_bad_m = Some(self.least_bad_m(at));
        }
        Ok(Some(expected))
    }

    fn starts_inside(&self, at: f64, latest: f64, part: (f64, f64)) -> Result<Expected, Doubt> {
        let mut expected = Expected {
            leaves_zone: true,
            ..Expected::default()
        };
        let back = self.may_go_back(at, latest) && part.0 > 0.0;
        let on = self.may_go_on(at) && part.1 < 1.0;
        let (back, on) = (
            back.then(|| self.back(latest, 0.0)),
            on.then(|| self.on(at)),
        );
        let (way, spare) = match (back, on) {
            (Some(back), Some(on)) => {
                let longer = (latest - part.0) - (part.1 - at);
                if longer.abs() * self.length_m < DOUBT_M {
                    return Err("both ways out are as short");
                }
                match longer < 0.0 {
                    true => (Some(back), Some(on)),
                    false => (Some(on), Some(back)),
                }
            }
            (back, on) => (back.or(on), None),
        };
        expected.spare = spare;
        expected.ways.extend(way);
        if expected.ways.is_empty() {
            let spot = match self.world.place {
                Place::At(spot) => spot,
                Place::AtStart | Place::Unknown => self.ends.0,
            };
            expected.ways = self.straight_ways(spot, true)?;
            expected.off_leg = true;
            if expected.ways.is_empty() {
                expected.least_bad_m = Some(self.least_bad_m(at));
            }
        }
        Ok(expected)
    }

    /// Its place is unknown: at the worse end for each way.
    fn starts_anywhere(&self) -> Expected {
        let has_zones = !self.walk.parts.is_empty();
        let mut expected = Expected::default();
        // What the drone reports itself, and cannot pass, is not behind it.
        if !has_zones && !self.is_closed(self.world.leg.0) {
            expected.ways.push(self.back(1.0, 0.0));
        }
        let is_open = !has_zones && !self.unknown && self.known.is_none();
        if is_open && !self.is_closed(self.world.leg.1) {
            expected.ways.push(self.on(0.0));
        }
        if expected.ways.is_empty() {
            expected.least_bad_m = Some(self.walk.length_m);
        }
        expected
    }

    fn starts_aside(&self, spot: Spot) -> Result<Expected, Doubt> {
        let clearances = self.world.zones.iter().map(|zone| zone.clearance_m(spot));
        let clearance_m = clearances.fold(f64::INFINITY, f64::min);
        if clearance_m.abs() < DOUBT_M {
            return Err("it is at a boundary, or at its cause");
        }
        let mut expected = Expected {
            off_leg: true,
            leaves_zone: clearance_m < 0.0,
            ways: self.straight_ways(spot, false)?,
            ..Expected::default()
        };
        if expected.ways.is_empty() {
            expected.least_bad_m = Some(self.nearest_open_m(spot));
        }
        Ok(expected)
    }

    /// The nearest open nodes to which a straight line enters no zone; for a drone on its leg not along that.
    fn straight_ways(&self, spot: Spot, is_on_leg: bool) -> Result<Vec<PlainWay>, Doubt> {
        let mut ways = Vec::new();
        for (node, &position) in self.world.nodes.iter().enumerate() {
            if self.is_closed(node) {
                continue;
            }
            let walk = self.world.walk(spot, position)?;
            let leads_in = walk.enters(0.0, 1.0) || walk.part_at(1.0).is_some();
            if leads_in || (is_on_leg && self.runs_along((spot, position))?) {
                continue;
            }
            ways.push(PlainWay {
                node,
                length_m: walk.length_m,
                overrun_m: 0.0,
                is_straight: true,
                fraction: None,
            });
        }
        ways.sort_by(|one, other| one.length_m.total_cmp(&other.length_m));
        ways.truncate(STRAIGHT_WAYS);
        Ok(ways)
    }

    /// A line that comes by an end of the leg runs along the leg, on which the drone is shut in.
    fn runs_along(&self, line: (Spot, Spot)) -> Result<bool, Doubt> {
        let mut runs_along = false;
        for end in [self.ends.0, self.ends.1] {
            let off_m = projected(line, end).1;
            let away_m = apart_m(line.0, end);
            if [off_m, away_m]
                .iter()
                .any(|metres| (metres - OFF_LEG_M).abs() < DOUBT_M)
            {
                return Err("a straight line comes just by an end of the leg");
            }
            runs_along |= away_m > OFF_LEG_M && off_m < OFF_LEG_M;
        }
        Ok(runs_along)
    }

    /// How far it is along the leg to the nearest place outside every zone, else to the nearest open node.
    fn least_bad_m(&self, at: f64) -> f64 {
        let Some(part) = self.walk.part_at(at) else {
            return 0.0;
        };
        let outside = [(part.0, part.0 > 0.0), (part.1, part.1 < 1.0)];
        let outside = outside.iter().filter(|(_, is_there)| *is_there);
        let nearest = outside
            .map(|(bound, _)| (bound - at).abs() * self.walk.length_m)
            .fold(f64::INFINITY, f64::min);
        match nearest.is_finite() {
            true => nearest,
            false => self.nearest_open_m(between(self.ends.0, self.ends.1, at)),
        }
    }

    fn nearest_open_m(&self, spot: Spot) -> f64 {
        let nodes = self.world.nodes.iter().enumerate();
        let open = nodes.filter(|(node, _)| !self.is_closed(*node));
        let nearest = open
            .map(|(_, &position)| apart_m(spot, position))
            .fold(f64::INFINITY, f64::min);
        if nearest.is_finite() { nearest } else { 0.0 }
    }
}
