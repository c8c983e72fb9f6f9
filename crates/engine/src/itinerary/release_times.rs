//! Release times: instants from which something can be flown that could not be just before.
//!
//! Where nothing opens, an earlier arrival can do all that a later one can. So a label that arrives earlier, but cannot
//! wait as long, makes another one needless unless an opening lies between them that the other could
//! still use.

use super::charging_label::ChargingLabel;
use super::obstacles::{Entry, Leaving};
use super::potentials::Potentials;
use super::request::{FlightRequest, FlightWorld, Objective, Value};
use crate::flight::FlightLegs;
use crate::geo::Point;
use crate::network::NodeIx;

/// Lengths are rounded in the table of legs; straight lines are shortened by this, in metres, to stay below them.
const ROUNDING_M: f64 = 1e-3;

/// Something opens at a node: a leg from it, a pad, or everything where the wind changes.
#[derive(Clone, Copy, Debug)]
struct Opening {
    at_s: f64,
    /// `None` for everywhere.
    place: Option<Point>,
    /// Weight left from there at least.
    remaining_weight: f64,
}

/// The openings that a request may use, by time.
#[derive(Debug, Default)]
pub(super) struct ReleaseTimes {
    by_time: Vec<Opening>,
    fastest_mps: f64,
    least_draw_per_s: f64,
    weight_per_m: f64,
    intervals: Vec<(f64, f64)>,
}

impl ReleaseTimes {
    /// Collects what opens, as far as a plan through it could still beat `best`.
    pub(super) fn collect(
        &mut self,
        world: &FlightWorld<'_>,
        request: &FlightRequest<'_>,
        potentials: &Potentials,
        best: Value,
    ) {
        self.by_time.clear();
        self.fastest_mps = world.legs.fastest_mps();
        self.least_draw_per_s = world.legs.least_draw_per_s();
        self.weight_per_m = match request.objective {
            Objective::Distance => world.topology.straight_line_scale(),
            // A second of flight draws at least so much, and covers at most so many metres.
            Objective::Energy => self.least_draw_per_s / self.fastest_mps.max(f64::MIN_POSITIVE),
            Objective::Time => 0.0,
        };
        self.collect_entries(world, request, potentials, best);
        for node in world.pads.nodes_with_stays() {
            for (rises_s, _) in world.pads.rises(node) {
                let at_s = rises_s - world.legs.vertical_s(node);
                self.add(world, request, potentials, best, node, at_s);
            }
        }
        for &at_s in world.legs.changes_s() {
            self.by_time.push(Opening {
                at_s,
                place: None,
                remaining_weight: 0.0,
            });
        }
        self.by_time
            .sort_by(|one, other| one.at_s.total_cmp(&other.at_s));
    }

    fn collect_entries(
        &mut self,
        world: &FlightWorld<'_>,
        request: &FlightRequest<'_>,
        potentials: &Potentials,
        best: Value,
    ) {
        let mut intervals = std::mem::take(&mut self.intervals);
        for segment in world.obstacles.segments() {
            let ends = world.topology.segment(crate::network::SegmentIx(segment));
            for (from, to) in [(ends.from, ends.to), (ends.to, ends.from)] {
                intervals.clear();
                if !self.may_lead_on(world, request, potentials, best, from) {
                    continue;
                }
                for period in 0..=world.legs.changes_s().len() {
                    let Some(time_s) = time_of(world.legs, from, segment, period) else {
                        continue;
                    };
                    let entry = Entry {
                        segment,
                        from,
                        to,
                        time_s,
                        leaving: Leaving::OnItsWay,
                    };
                    world
                        .obstacles
                        .forbidden(world, request.began_s, entry, &mut intervals);
                }
                for &(_, opens_s) in &intervals {
                    self.add(world, request, potentials, best, from, opens_s);
                }
            }
        }
        self.intervals = intervals;
    }

    /// True where something better could come by a node: by the straight line from a start and the tables.
    fn may_lead_on(
        &self,
        world: &FlightWorld<'_>,
        request: &FlightRequest<'_>,
        potentials: &Potentials,
        best: Value,
        node: NodeIx,
    ) -> bool {
        let remaining = potentials.from(node);
        let place = world.topology.position(node);
        request.starts.iter().any(|start| {
            let straight_m = world.topology.position(start.node).distance_m(place) - ROUNDING_M;
            straight_m * self.weight_per_m + remaining.weight <= best.weight
        })
    }

    /// Keeps an opening at a node that can be reached before the deadline and could lead to something better.
    fn add(
        &mut self,
        world: &FlightWorld<'_>,
        request: &FlightRequest<'_>,
        potentials: &Potentials,
        best: Value,
        node: NodeIx,
        at_s: f64,
    ) {
        let remaining = potentials.from(node);
        let place = world.topology.position(node);
        let latest_s = request.deadline_s.min(match request.objective {
            Objective::Time => best.arrives_s,
            Objective::Distance | Objective::Energy => f64::INFINITY,
        });
        if !at_s.is_finite() || at_s + remaining.time_s > latest_s {
            return;
        }
        // Nobody is there earlier than by the straight line.
        let is_reached = request.starts.iter().any(|start| {
            let straight_m = world.topology.position(start.node).distance_m(place) - ROUNDING_M;
            start.at_s + straight_m.max(0.0) / self.fastest_mps <= at_s
        });
        if is_reached && self.may_lead_on(world, request, potentials, best, node) {
            self.by_time.push(Opening {
                at_s,
                place: Some(place),
                remaining_weight: remaining.weight,
            });
        }
    }

    /// True when the later of two families at a place could use an opening that the earlier one could not. Also counts the
    /// openings looked at.
    ///
    /// Flying on from the place for `delta` seconds without a stop, they are there by `earlier.hi + delta` and
    /// `later.hi + delta`. The opening lies between for some `delta` from the straight line's on up to what the
    /// later one's battery lasts.
    pub(super) fn part(
        &self,
        place: Point,
        earlier: &ChargingLabel,
        later: &ChargingLabel,
        reserve: f64,
        best: Value,
        looked_at: &mut usize,
    ) -> bool {
        let spare = (later.battery_most() - reserve).max(0.0);
        let endurance_s = spare / self.least_draw_per_s;
        let first = self
            .by_time
            .partition_point(|opening| opening.at_s <= earlier.hi_s);
        for opening in &self.by_time[first..] {
            if opening.at_s > later.hi_s + endurance_s + 1.0 {
                return false;
            }
            *looked_at += 1;
            let Some(there) = opening.place else {
                return true;
            };
            let straight_m = (place.distance_m(there) - ROUNDING_M).max(0.0);
            let is_missed = opening.at_s > earlier.hi_s + straight_m / self.fastest_mps;
            let weight = later.weight + straight_m * self.weight_per_m + opening.remaining_weight;
            if is_missed && weight <= best.weight {
                return true;
            }
        }
        false
    }
}

/// Seconds on a segment from one of its ends in a period; `None` where it cannot be flown.
fn time_of(legs: &FlightLegs, from: NodeIx, segment: u32, period: usize) -> Option<f64> {
    let leg = legs
        .from(from)
        .find(|&leg| legs.leg(leg).segment.0 == segment)?;
    let cost = legs.cost(leg, period);
    cost.is_flyable().then_some(cost.time_s)
}
