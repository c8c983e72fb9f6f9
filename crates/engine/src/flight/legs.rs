//! What every leg of a network takes with one airframe, payload and wind: the table that a search reads.
//!
//! Where the wind changes with time there is one list of costs for each period between two changes; the wind
//! at the entry of a leg counts for all of it.

use super::airframe::{Airframe, LegCost, Unflyable};
use super::rules::FlightRules;
use super::vertical::Vertical;
use super::wind::WindField;
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx, Topology};

/// Lengths are rounded to this part of a metre, 2^-20, so that equally long ways have equal sums.
const LENGTH_STEPS_PER_M: f64 = 1_048_576.0;

/// One direction of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightLeg {
    /// The node it leads to.
    pub to: NodeIx,
    /// The segment it is a direction of.
    pub segment: SegmentIx,
    /// The other direction of the segment, as an index of the table.
    pub twin: u32,
    /// Length, in metres, rounded to 2^-20 m.
    pub length_m: f64,
    /// The least that it takes in any period; exact where there is one period.
    pub least: LegCost,
}

/// The legs of a network by the node they start from, with what they take.
#[derive(Clone, Debug)]
pub struct FlightLegs {
    first: Vec<u32>,
    legs: Vec<FlightLeg>,
    /// By segment, one of its two directions.
    of_segment: Vec<u32>,
    /// By leg, the least that the other direction takes: a search backwards reads legs in their order.
    least_back: Vec<LegCost>,
    /// By period and leg; empty where there is one period.
    by_period: Vec<Vec<LegCost>>,
    changes_s: Vec<f64>,
    vertical_s: Vec<f64>,
    climb_energy: Vec<f64>,
    fastest_mps: f64,
    slowest_mps: f64,
    least_draw_per_s: f64,
    least_vertical_s: f64,
}

impl FlightLegs {
    /// A length as the table has it, rounded to 2^-20 m.
    pub fn rounded_m(length_m: f64) -> f64 {
        (length_m * LENGTH_STEPS_PER_M).round() / LENGTH_STEPS_PER_M
    }

    /// Works out all legs. What the airframe's limits forbid is in the table as [`LegCost::UNFLYABLE`].
    pub fn of(
        topology: &Topology,
        airframe: &Airframe,
        payload_kg: f64,
        wind: &WindField,
        rules: &FlightRules,
    ) -> Self {
        let vertical = Vertical::of(topology, rules.unknown_climb_m);
        let changes_s = wind.changes_s();
        let model = LegModel {
            topology,
            airframe,
            payload_kg,
            wind,
            vertical: &vertical,
        };
        let mut periods: Vec<Vec<LegCost>> = Vec::with_capacity(changes_s.len() + 1);
        for period in 0..=changes_s.len() {
            let entered_s = match period {
                0 => f64::NEG_INFINITY,
                _ => changes_s[period - 1],
            };
            periods.push(model.costs(entered_s));
        }
        let (first, mut legs, of_segment) = adjacency(topology);
        for (place, leg) in legs.iter_mut().enumerate() {
            for costs in &periods {
                leg.least.time_s = leg.least.time_s.min(costs[place].time_s);
                leg.least.energy = leg.least.energy.min(costs[place].energy);
            }
        }
        let least_back = legs.iter().map(|leg| legs[leg.twin as usize].least);
        let least_back = least_back.collect();
        let (mut fastest_mps, mut slowest_mps) = (0.0_f64, f64::INFINITY);
        let mut least_draw_per_s = f64::INFINITY;
        for (leg, cost) in periods.iter().flat_map(|costs| legs.iter().zip(costs)) {
            if cost.is_flyable() {
                let ends = topology.segment_ends(leg.segment);
                fastest_mps = fastest_mps.max(ends.0.distance_m(ends.1) / cost.time_s);
                slowest_mps = slowest_mps.min(leg.length_m / cost.time_s);
                least_draw_per_s = least_draw_per_s.min(cost.energy / cost.time_s);
            }
        }
        if periods.len() == 1 {
            periods.clear();
        }
        let crossing = |node| vertical.crossing_m(node);
        let lowest_crossing_m = topology.nodes().map(crossing).fold(f64::INFINITY, f64::min);
        Self {
            first,
            legs,
            of_segment,
            least_back,
            by_period: periods,
            changes_s,
            vertical_s: topology
                .nodes()
                .map(|node| crossing(node) / airframe.vertical_speed_mps)
                .collect(),
            climb_energy: topology
                .nodes()
                .map(|node| airframe.climb_energy(payload_kg, crossing(node)))
                .collect(),
            fastest_mps,
            slowest_mps,
            least_draw_per_s,
            least_vertical_s: lowest_crossing_m / airframe.vertical_speed_mps,
        }
    }

    /// The legs from a node, as indices of the table.
    #[inline]
    pub fn from(&self, node: NodeIx) -> std::ops::Range<u32> {
        self.first[node.at()]..self.first[node.at() + 1]
    }

    /// A leg.
    #[inline]
    pub fn leg(&self, leg: u32) -> &FlightLeg {
        &self.legs[leg as usize]
    }

    /// Both directions of a segment.
    pub fn of_segment(&self, segment: SegmentIx) -> [u32; 2] {
        let leg = self.of_segment[segment.at()];
        [leg, self.legs[leg as usize].twin]
    }

    /// The least that the other direction of a leg takes in any period.
    #[inline]
    pub fn least_back(&self, leg: u32) -> LegCost {
        self.least_back[leg as usize]
    }

    /// How many legs there are: two to a segment.
    pub fn len(&self) -> usize {
        self.legs.len()
    }

    /// True for a network without segments.
    pub fn is_empty(&self) -> bool {
        self.legs.is_empty()
    }

    /// The instants at which costs change, rising; a period begins at each of them.
    #[inline]
    pub fn changes_s(&self) -> &[f64] {
        &self.changes_s
    }

    /// What a leg takes when it is entered in a period, counted from 0.
    #[inline]
    pub fn cost(&self, leg: u32, period: usize) -> LegCost {
        match self.by_period.get(period) {
            Some(costs) => costs[leg as usize],
            None => self.legs[leg as usize].least,
        }
    }

    /// Seconds between a node's pads and its crossing altitude, up or down.
    #[inline]
    pub fn vertical_s(&self, node: NodeIx) -> f64 {
        self.vertical_s[node.at()]
    }

    /// Energy of taking off at a node, up to its crossing altitude, as a fraction of the battery.
    #[inline]
    pub fn climb_energy(&self, node: NodeIx) -> f64 {
        self.climb_energy[node.at()]
    }

    /// Nowhere are the pads nearer to the crossing altitude than this, in seconds of climb; infinite without nodes.
    pub fn least_vertical_s(&self) -> f64 {
        self.least_vertical_s
    }

    /// No leg brings a drone nearer to anything faster than this, in metres of straight line per second.
    pub fn fastest_mps(&self) -> f64 {
        self.fastest_mps
    }

    /// No leg takes longer for its metres than at this ground speed, in any wind, changes of altitude included; infinite where
    /// nothing can be flown.
    pub fn slowest_mps(&self) -> f64 {
        self.slowest_mps
    }

    /// No leg draws less than this fraction of the battery per second; infinite where nothing can be flown.
    pub fn least_draw_per_s(&self) -> f64 {
        self.least_draw_per_s
    }
}

/// The legs without costs: where each node's part begins, a compact array, and one leg of each segment.
fn adjacency(topology: &Topology) -> (Vec<u32>, Vec<FlightLeg>, Vec<u32>) {
    let mut first = Vec::with_capacity(topology.node_count() + 1);
    let mut legs: Vec<FlightLeg> = Vec::with_capacity(2 * topology.segment_count());
    let mut of_segment = vec![u32::MAX; topology.segment_count()];
    for node in topology.nodes() {
        first.push(legs.len() as u32);
        for arc in topology.arcs(node) {
            let here = legs.len() as u32;
            let twin = std::mem::replace(&mut of_segment[arc.segment.at()], here);
            if let Some(other) = legs.get_mut(twin as usize) {
                other.twin = here;
            }
            legs.push(FlightLeg {
                to: arc.to,
                segment: arc.segment,
                twin,
                length_m: FlightLegs::rounded_m(arc.length_m),
                least: LegCost::UNFLYABLE,
            });
        }
    }
    first.push(legs.len() as u32);
    (first, legs, of_segment)
}

/// What costs are worked out from.
struct LegModel<'a> {
    topology: &'a Topology,
    airframe: &'a Airframe,
    payload_kg: f64,
    wind: &'a WindField,
    vertical: &'a Vertical,
}

impl LegModel<'_> {
    fn costs(&self, entered_s: f64) -> Vec<LegCost> {
        let nodes = self.topology.nodes();
        let legs = nodes.flat_map(|node| {
            let arcs = self.topology.arcs(node).iter();
            arcs.map(move |arc| (node, arc.to, arc.segment))
        });
        legs.map(|(from, to, segment)| {
            self.airframe
                .leg(
                    self.topology,
                    self.vertical,
                    self.wind,
                    self.payload_kg,
                    (from, to, segment),
                    entered_s,
                )
                .unwrap_or(LegCost::UNFLYABLE)
        })
        .collect()
    }
}

impl Airframe {
    /// What one leg takes, climbs included, when it is entered at an instant.
    ///
    /// # Errors
    /// [`Unflyable`] where the limits of the airframe or the wind triangle forbid it.
    pub fn leg(
        &self,
        topology: &Topology,
        vertical: &Vertical,
        wind: &WindField,
        payload_kg: f64,
        (from, to, segment): (NodeIx, NodeIx, SegmentIx),
        entered_s: f64,
    ) -> Result<LegCost, Unflyable> {
        let (start, end) = (topology.position(from), topology.position(to));
        let straight_m = start.distance_m(end);
        // Coincident nodes have no course; the stated length is flown whichever way, which the wind of the east-west
        // axis stands for.
        let course = match straight_m > 0.0 {
            true => Point::new(
                (end.x - start.x) / straight_m,
                (end.y - start.y) / straight_m,
            ),
            false => Point::new(1.0, 0.0),
        };
        let length_m = topology.segment(segment).length_m;
        let limit_mps = topology.speed_limit_mps(segment);
        let mut worst: Option<LegCost> = None;
        for wind in wind.on_leg(start, end, entered_s) {
            self.within_limits(payload_kg, wind)?;
            let level = self.level_leg(payload_kg, length_m, course, wind, limit_mps)?;
            let draws_more = |worst: LegCost| level.energy > worst.energy;
            if worst.is_none_or(draws_more) {
                worst = Some(level);
            }
        }
        let climbs = vertical.climbs(topology, segment, from, to);
        let level = worst.unwrap_or(LegCost::UNFLYABLE);
        let under_way_s = self.slope_s(climbs.under_way_m);
        Ok(LegCost {
            time_s: level.time_s.max(under_way_s) + climbs.at_nodes_m / self.vertical_speed_mps,
            energy: level.energy + self.climb_energy(payload_kg, climbs.up_m),
        })
    }
}
