//! Where segments come near each other in the air: drones must not be there at the same time.
//!
//! Two segments cross where their lines are nearer than a horizontal distance and their heights nearer
//! than 10 m. Within 50 m of a node that both have, the headway at the node keeps drones apart instead.
//! That headway also counts where one of them comes near the other at a node of its own.

use super::airframe::Airframe;
use super::vertical::Vertical;
use crate::geo::{Bounds, Point};
use crate::network::{NodeIx, SegmentIx, Topology, outer_box};
use std::sync::{Arc, OnceLock};

/// Drones that are this far apart vertically may be at one place, in metres.
const VERTICAL_M: f64 = 10.0;
/// Within so many metres of a shared node the headway there counts.
const SHARED_NODE_M: f64 = 50.0;
/// A metre of climb at a node takes between one and this many times as long as one under way.
const SLOWEST_CLIMB: f64 = 8.0;

/// Whether the times at which this drone may be near a crossing hold: it is not so fast, with the wind, that a climb takes
/// longer beside its way than is reckoned with.
pub fn keeps_clear_of_crossings(airframe: &Airframe) -> bool {
    let wind_mps = airframe.max_wind_mps / airframe.gust_factor.max(1.0);
    airframe.airspeed_mps + wind_mps <= SLOWEST_CLIMB * airframe.vertical_speed_mps
}

/// Part of a segment, as shares of the time that a leg takes over it from its first node on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// The drone is not there before.
    pub enters: f64,
    /// It is not there after.
    pub leaves: f64,
}

impl Stretch {
    /// Where a leg is entered, whichever end that is.
    pub(crate) const ENTRY: Self = Self {
        enters: 0.0,
        leaves: 0.0,
    };
    /// All of a leg.
    pub const WHOLE: Self = Self {
        enters: 0.0,
        leaves: 1.0,
    };

    /// The same for a leg the other way.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self {
            enters: 1.0 - self.leaves,
            leaves: 1.0 - self.enters,
        }
    }
}

/// A segment that comes near another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The other one.
    pub other: SegmentIx,
    /// Where this one is near it.
    pub own: Stretch,
    /// Where the other one is near this one.
    pub others: Stretch,
    /// Whether it reaches to a node that only one of them has, so that a drone may be near the other segment a while before it
    /// enters its own, or after it has left that.
    pub is_at_node: bool,
}

/// All crossings of a network, by segment.
#[derive(Clone, Debug, Default)]
pub struct Crossings {
    first: Vec<u32>,
    all: Vec<Crossing>,
}

impl Crossings {
    /// Finds what comes nearer than `horizontal_m`; nothing where that is 0.
    pub fn of(topology: &Topology, vertical: &Vertical, horizontal_m: f64) -> Self {
        let mut crossings = Self {
            first: vec![0; topology.segment_count() + 1],
            all: Vec::new(),
        };
        if horizontal_m <= 0.0 {
            return crossings;
        }
        let lines: Vec<Line> = topology
            .segments()
            .map(|segment| Line::of(topology, vertical, segment))
            .collect();
        for (at, line) in lines.iter().enumerate() {
            let around = Bounds::around([line.from, line.to]).map(|it| it.grown(horizontal_m));
            let near = around.into_iter().flat_map(|around| {
                let tree = topology.segment_tree();
                tree.locate_in_envelope_intersecting(&outer_box(around))
            });
            let mut near: Vec<SegmentIx> = near.map(|found| found.segment).collect();
            near.sort_unstable();
            for other in near.into_iter().filter(|other| other.at() != at) {
                let crossing = line.crossing((other, &lines[other.at()]), horizontal_m);
                crossings.all.extend(crossing);
            }
            crossings.first[at + 1] = crossings.all.len() as u32;
        }
        crossings
    }

    /// What crosses a segment, by the index of the other one.
    #[inline]
    pub fn on(&self, segment: SegmentIx) -> &[Crossing] {
        let ends = self.first.get(segment.at()..segment.at() + 2);
        let ends = ends.map_or([0, 0], |ends| [ends[0] as usize, ends[1] as usize]);
        &self.all[ends[0]..ends[1]]
    }
}

/// The crossings of a network, found when they are first asked for and then shared. Cheap to clone.
#[derive(Clone, Debug, Default)]
pub struct SharedCrossings(Arc<OnceLock<Crossings>>);

impl SharedCrossings {
    /// The crossings of the one network that these are for, by one distance.
    pub fn of(&self, topology: &Topology, vertical: &Vertical, horizontal_m: f64) -> &Crossings {
        let find = || Crossings::of(topology, vertical, horizontal_m);
        self.0.get_or_init(find)
    }

    /// Whether both are those of one network.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A segment as it is flown from its first node to its last.
#[derive(Clone, Copy, Debug)]
struct Line {
    ends: [NodeIx; 2],
    from: Point,
    to: Point,
    length_m: f64,
    /// Crossing altitude, in the band at both ends, crossing altitude; unknown where they cannot be
    /// compared.
    heights_m: Option<[f64; 4]>,
}

impl Line {
    fn of(topology: &Topology, vertical: &Vertical, segment: SegmentIx) -> Self {
        let (from, to) = topology.segment_ends(segment);
        let ends = topology.segment(segment);
        Self {
            ends: [ends.from, ends.to],
            from,
            to,
            length_m: from.distance_m(to),
            heights_m: vertical.heights_m(topology, segment),
        }
    }

    /// Where two lines are too near each other, on each of them.
    fn crossing(
        &self,
        (segment, other): (SegmentIx, &Self),
        horizontal_m: f64,
    ) -> Option<Crossing> {
        let own = self.part_near(other, horizontal_m)?;
        let others = other.part_near(self, horizontal_m)?;
        let is_apart = match (self.heights_on(own), other.heights_on(others)) {
            (Some(own), Some(others)) => {
                own.0 >= others.1 + VERTICAL_M || others.0 >= own.1 + VERTICAL_M
            }
            _ => false,
        };
        (!is_apart).then(|| Crossing {
            other: segment,
            own: self.stretch(own),
            others: other.stretch(others),
            is_at_node: self.reaches_end(own, other) || other.reaches_end(others, self),
        })
    }

    /// Whether a part reaches to a node that another line does not have.
    fn reaches_end(&self, (first, last): (f64, f64), other: &Self) -> bool {
        let is_reached = [first <= 0.0, last >= 1.0];
        let mut ends = self.ends.iter().zip(is_reached);
        ends.any(|(node, is_reached)| is_reached && !other.ends.contains(node))
    }

    /// The part that is near another line, from 0 at the first node to 1 at the last, without what lies
    /// near a shared node.
    fn part_near(&self, other: &Self, horizontal_m: f64) -> Option<(f64, f64)> {
        let (mut first, mut last) = within(self.from, self.to, other, horizontal_m)?;
        // Of two drones that are nearer to each other than this distance, one beyond the reach of the node, both are
        // at least so far from it.
        let beside_m = (SHARED_NODE_M - horizontal_m).max(0.0);
        let beside_node = match self.length_m > 0.0 {
            true => beside_m / self.length_m,
            false => 1.0,
        };
        if other.ends.contains(&self.ends[0]) {
            first = first.max(beside_node);
        }
        if other.ends.contains(&self.ends[1]) {
            last = last.min(1.0 - beside_node);
        }
        (first <= last).then_some((first, last))
    }

    /// The lowest and the highest that a drone is on a part.
    fn heights_on(&self, (first, last): (f64, f64)) -> Option<(f64, f64)> {
        let [start_m, first_m, last_m, end_m] = self.heights_m?;
        let at = |share: f64| first_m + (last_m - first_m) * share;
        let under_way = [at(first), at(last)];
        let at_ends = [(first <= 0.0, start_m), (last >= 1.0, end_m)];
        let at_ends = at_ends.iter().filter(|(is_there, _)| *is_there);
        let all = under_way.into_iter().chain(at_ends.map(|end| end.1));
        Some(
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |most, height_m| {
                (most.0.min(height_m), most.1.max(height_m))
            }),
        )
    }

    /// When a drone is on a part, however long the climbs at the nodes take.
    fn stretch(&self, (first, last): (f64, f64)) -> Stretch {
        let (before_m, under_way_m, after_m) = match self.heights_m {
            Some([start_m, first_m, last_m, end_m]) => (
                (first_m - start_m).abs(),
                self.length_m.hypot(last_m - first_m),
                (end_m - last_m).abs(),
            ),
            None => (0.0, self.length_m, 0.0),
        };
        let time_share = |part: f64, climb: f64| {
            let all = climb * (before_m + after_m) + under_way_m;
            match all > 0.0 {
                true => (climb * before_m + part * under_way_m) / all,
                false => part,
            }
        };
        let shares = |part: f64| [time_share(part, 1.0), time_share(part, SLOWEST_CLIMB)];
        let [soon, late] = [shares(first), shares(last)];
        Stretch {
            enters: match first <= 0.0 {
                true => 0.0,
                false => soon[0].min(soon[1]),
            },
            leaves: match last >= 1.0 {
                true => 1.0,
                false => late[0].max(late[1]),
            },
        }
    }
}

/// The part of a straight way on which it is nearer than a distance to a line, as shares of the way. What
/// is near a line is convex, so this is one part: from the first to the last of the parts near its ends
/// and beside it.
fn within(from: Point, to: Point, line: &Line, distance_m: f64) -> Option<(f64, f64)> {
    let discs = [line.from, line.to].map(|centre| in_disc(from, to, centre, distance_m));
    let beside = beside(from, to, line, distance_m);
    let parts = discs.into_iter().chain([beside]).flatten();
    let part = parts.reduce(|one, other| (one.0.min(other.0), one.1.max(other.1)))?;
    let part = (part.0.max(0.0), part.1.min(1.0));
    (part.0 <= part.1).then_some(part)
}

/// The part of the straight line through two points that lies in a disc.
fn in_disc(from: Point, to: Point, centre: Point, radius_m: f64) -> Option<(f64, f64)> {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let (cx, cy) = (from.x - centre.x, from.y - centre.y);
    let (a, b, c) = (
        dx * dx + dy * dy,
        cx * dx + cy * dy,
        cx * cx + cy * cy - radius_m * radius_m,
    );
    if a <= 0.0 {
        return (c < 0.0).then_some((0.0, 1.0));
    }
    let root = (b * b - a * c).max(0.0).sqrt();
    let meets = b * b > a * c;
    meets.then(|| ((-b - root) / a, (-b + root) / a))
}

/// The part that lies beside a line, between its ends.
fn beside(from: Point, to: Point, line: &Line, distance_m: f64) -> Option<(f64, f64)> {
    if line.length_m <= 0.0 {
        return None;
    }
    let (ux, uy) = (
        (line.to.x - line.from.x) / line.length_m,
        (line.to.y - line.from.y) / line.length_m,
    );
    let along = |point: Point| (point.x - line.from.x) * ux + (point.y - line.from.y) * uy;
    let across = |point: Point| (point.y - line.from.y) * ux - (point.x - line.from.x) * uy;
    let between = between((along(from), along(to)), (0.0, line.length_m))?;
    let near = self::between((across(from), across(to)), (-distance_m, distance_m))?;
    let part = (between.0.max(near.0), between.1.min(near.1));
    (part.0 <= part.1).then_some(part)
}

/// Where a figure that goes evenly from one value to another lies within limits; everywhere or nowhere
/// where it does not change.
fn between((begin, end): (f64, f64), (least, most): (f64, f64)) -> Option<(f64, f64)> {
    if begin == end {
        let is_within = least <= begin && begin <= most;
        return is_within.then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let at = |value: f64| (value - begin) / (end - begin);
    Some((at(least).min(at(most)), at(least).max(at(most))))
}
