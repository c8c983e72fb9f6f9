//! Small random worlds for comparing the search with brute force, each from a seed.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway::flight::{
    Airframe, FlightLegs, FlightPlan, FlightRules, FlightStart, Reservation, SharedCrossings,
    Situation, TimedClosure, TrafficLeg, Vertical, Wind, WindField, WindPatch,
};
use skyway::geo::{Altitude, AltitudeBand};
use skyway::itinerary::{
    FlightAnswer, FlightRequest, FlightWorld, ItineraryScratch, Limits, Objective, Obstacles,
    PadTimes, Potentials, find, find_plainly,
};
use skyway::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology};
use skyway::verify::{FlightFault, FlightPremises, verify_flight};
use std::cell::RefCell;
use std::sync::Arc;

/// Times of the grid worlds are multiples of this, in seconds.
pub(crate) const GRID_S: f64 = 30.0;

thread_local! {
    /// One for all worlds of a test, as many of them have as many nodes and segments: what was asked before must not count.
    static SCRATCH: RefCell<Option<ItineraryScratch>> = const { RefCell::new(None) };
}

/// Random choices from a seed.
pub(crate) struct Draw(ChaCha8Rng);

impl Draw {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, from: f64, until: f64) -> f64 {
        from + (until - from) * self.unit()
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }
}

/// What kind of times a world has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Any times.
    Continuous,
    /// All times on the grid.
    Grid,
    /// All times on the grid, and batteries that are swapped only: the best plan is on the grid too.
    GridSwaps,
}

/// A world and a request in it.
#[derive(Clone, Debug)]
pub(crate) struct World {
    pub(crate) topology: Arc<Topology>,
    pub(crate) airframe: Airframe,
    pub(crate) payload_kg: f64,
    pub(crate) wind: WindField,
    pub(crate) rules: FlightRules,
    pub(crate) situation: Situation,
    pub(crate) starts: Vec<FlightStart>,
    pub(crate) destination: NodeIx,
    pub(crate) began_s: f64,
    pub(crate) deadline_s: f64,
    pub(crate) reserve: f64,
    pub(crate) closed_segments: Vec<SegmentIx>,
}

impl std::fmt::Display for World {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for node in self.topology.nodes() {
            let pads = self.topology.pads(node);
            let arcs = self.topology.arcs(node).iter();
            let arcs: Vec<_> = arcs
                .map(|arc| (arc.to.0, arc.segment.0, arc.length_m))
                .collect();
            writeln!(formatter, "node {} with {pads} pads: {arcs:?}", node.0)?;
        }
        writeln!(formatter, "{:?}\n{:?}", self.situation, self.starts)?;
        writeln!(
            formatter,
            "{:?}\n{:?}\n{:?}",
            self.rules, self.airframe, self.wind
        )?;
        let Self {
            destination,
            began_s,
            deadline_s,
            reserve,
            closed_segments,
            payload_kg,
            ..
        } = self;
        writeln!(
            formatter,
            "to {destination:?}, {began_s}..{deadline_s}, {reserve}, {payload_kg} kg, {closed_segments:?}"
        )
    }
}

impl World {
    pub(crate) fn premises(&self) -> FlightPremises<'_> {
        FlightPremises {
            topology: &self.topology,
            airframe: &self.airframe,
            payload_kg: self.payload_kg,
            wind: &self.wind,
            rules: &self.rules,
            situation: &self.situation,
            starts: &self.starts,
            destination: self.destination,
            began_s: self.began_s,
            deadline_s: self.deadline_s,
            reserve: self.reserve,
            closed_segments: &self.closed_segments,
        }
    }

    /// Whether a plan holds; what does, the checker of answers lets pass.
    pub(crate) fn check(&self, plan: &FlightPlan) -> Result<(), FlightFault> {
        let verdict = verify_flight(plan, &self.premises());
        if verdict.is_ok() && self.reserve >= self.rules.reserve {
            assert_eq!(self.check_before_sending(plan), Ok(()), "{plan:?}\n{self}");
        }
        verdict
    }

    pub(crate) fn request(&self, objective: Objective) -> FlightRequest<'_> {
        FlightRequest {
            starts: &self.starts,
            destination: self.destination,
            objective,
            began_s: self.began_s,
            deadline_s: self.deadline_s,
            reserve: self.reserve,
            closed_segments: &self.closed_segments,
            limits: Limits::THOROUGH,
        }
    }

    /// The answer of the search, by its three steps or plainly.
    pub(crate) fn answer(&self, objective: Objective, plainly: bool) -> FlightAnswer {
        self.answer_within(objective, plainly, Limits::THOROUGH)
    }

    pub(crate) fn answer_within(
        &self,
        objective: Objective,
        plainly: bool,
        limits: Limits<'_>,
    ) -> FlightAnswer {
        let legs = FlightLegs::of(
            &self.topology,
            &self.airframe,
            self.payload_kg,
            &self.wind,
            &self.rules,
        );
        let obstacles = Obstacles::of(&self.topology, &self.situation);
        let pads = PadTimes::of(&self.topology, &self.situation);
        let world = FlightWorld {
            topology: &self.topology,
            legs: &legs,
            obstacles: &obstacles,
            pads: &pads,
            vertical: &Vertical::of(&self.topology, self.rules.unknown_climb_m),
            crossings: &SharedCrossings::default(),
            rules: &self.rules,
            charging: self.airframe.charging(),
        };
        let nodes = self.topology.node_count();
        let potentials = Potentials::of(&legs, nodes, self.destination, objective);
        let request = FlightRequest {
            limits,
            ..self.request(objective)
        };
        SCRATCH.with_borrow_mut(|scratch| {
            let scratch = scratch.get_or_insert_with(|| ItineraryScratch::new(&self.topology));
            match plainly {
                true => find_plainly(&world, &request, &potentials, scratch),
                false => find(&world, &request, &potentials, scratch),
            }
        })
    }
}

/// The small world of a seed, of four to six nodes.
pub(crate) fn world(seed: u64, kind: Kind) -> World {
    let mut draw = Draw::new(seed);
    let nodes = 4 + draw.below(3);
    world_of(seed, kind, nodes, draw)
}

/// A world where a drone comes flying and the segments at the destination are full of others. In half of these worlds no pad is
/// free, so that it has to come later by flying more.
pub(crate) fn crowded(seed: u64, mut world: World) -> World {
    let mut draw = Draw::new(!seed);
    world.rules.headway_s = draw.between(5.0, 40.0);
    // With every change of wind brute force takes many times as long.
    world.wind.patches.clear();
    world.starts.truncate(1);
    world.starts[0].on_ground = false;
    world.starts[0].battery = draw.between(0.6, 1.0);
    let topology = world.topology.clone();
    if draw.chance(0.5) {
        world.situation.closures.push(TimedClosure {
            from_s: f64::NEG_INFINITY,
            until_s: f64::INFINITY,
            segments: Vec::new(),
            nodes: Vec::new(),
            pads: topology.nodes().collect(),
            widened: false,
        });
    }
    for arc in topology.arcs(world.destination) {
        let mut enters_s = world.began_s;
        while enters_s < world.deadline_s {
            enters_s += draw.between(5.0, 4.0 * world.rules.headway_s);
            world.situation.traffic.push(TrafficLeg {
                segment: arc.segment,
                from: match draw.chance(0.05) {
                    true => world.destination,
                    false => arc.to,
                },
                enters_s,
                leaves_s: enters_s + arc.length_m / 14.0,
            });
        }
    }
    world
}

/// The world of a seed with a number of nodes.
pub(crate) fn large_world(seed: u64, kind: Kind, nodes: usize) -> World {
    world_of(seed, kind, nodes, Draw::new(seed))
}

fn world_of(seed: u64, kind: Kind, nodes: usize, mut draw: Draw) -> World {
    let on_grid = kind != Kind::Continuous;
    let (draft, size_m) = network(&mut draw, nodes, on_grid);
    let draft = with_altitudes(seed, draft, on_grid);
    let topology = Topology::build(draft, [0; 32]).expect("a valid network");
    let payload_kg = [0.0, 0.5][draw.below(2)];
    let mut airframe = Airframe {
        // Some batteries last two legs, some ten.
        battery_wh: draw.between(14.0, 60.0),
        charge_tau_s: draw.between(100.0, 600.0),
        max_wind_mps: 30.0,
        ..Airframe::phantom3()
    };
    if on_grid {
        // A step draws a whole number of 1024ths, so that ways that are equally long draw equally much.
        let step_wh = airframe.cruise_w(payload_kg, airframe.airspeed_mps) * GRID_S / 3600.0;
        let parts = (1024.0 * step_wh / airframe.battery_wh).round();
        airframe.battery_wh = 1024.0 * step_wh / parts;
    }
    let instant_s = |draw: &mut Draw, until_s: f64| match on_grid {
        true => GRID_S * draw.below((until_s / GRID_S) as usize) as f64,
        false => draw.between(0.0, until_s),
    };
    let began_s = instant_s(&mut draw, 600.0);
    let span_s = size_m / 16.0 * draw.between(2.0, 4.0) + 600.0;
    let horizon_s = began_s + span_s;
    let rules = match on_grid {
        true => FlightRules {
            time_margin_s: 0.0,
            time_margin_growth: 0.0,
            headway_s: 0.0,
            unknown_climb_m: 0.0,
            ..FlightRules::default()
        },
        false => FlightRules {
            time_margin_s: draw.between(0.0, 40.0),
            time_margin_growth: draw.between(0.0, 0.1),
            headway_s: draw.between(0.0, 40.0),
            unknown_climb_m: draw.between(0.0, 60.0),
            ..FlightRules::default()
        },
    };
    let mut situation = Situation::default();
    for _ in 0..draw.below(5) {
        let from_s = instant_s(&mut draw, horizon_s);
        let long_s = instant_s(&mut draw, span_s * 0.6) + GRID_S;
        situation
            .closures
            .push(closure(&mut draw, &topology, from_s, from_s + long_s));
    }
    for node in topology.nodes() {
        for pad in 0..topology.pads(node) {
            let mut free_from_s = 0.0;
            while draw.chance(0.5) {
                let from_s = free_from_s + instant_s(&mut draw, span_s * 0.5);
                let until_s = from_s + instant_s(&mut draw, span_s * 0.4) + GRID_S;
                free_from_s = until_s;
                situation.reservations.push(Reservation {
                    node,
                    pad,
                    from_s,
                    until_s,
                });
            }
        }
    }
    for node in topology.nodes() {
        let share = if kind == Kind::GridSwaps { 1.0 } else { 0.15 };
        if draw.chance(share) {
            situation.swap_stations.push(node);
        }
    }
    if !on_grid {
        add_traffic(&mut draw, &topology, horizon_s, &mut situation);
    }
    let starts = starts(&mut draw, &topology, began_s, on_grid);
    let wind = match on_grid {
        true => WindField::default(),
        false => winds(&mut draw, horizon_s),
    };
    let closed_segments = match draw.chance(0.3) {
        true => vec![SegmentIx(draw.below(topology.segment_count()) as u32)],
        false => Vec::new(),
    };
    World {
        destination: NodeIx(draw.below(nodes) as u32),
        payload_kg,
        reserve: [0.0, 0.2][draw.below(2)],
        deadline_s: (horizon_s / GRID_S).floor() * GRID_S,
        topology: Arc::new(topology),
        airframe,
        wind,
        rules,
        situation,
        starts,
        began_s,
        closed_segments,
    }
}

fn network(draw: &mut Draw, nodes: usize, on_grid: bool) -> (NetworkDraft, f64) {
    let size_m = draw.between(3_000.0, 9_000.0);
    let mut draft = NetworkDraft {
        name: "random".to_owned(),
        ..NetworkDraft::default()
    };
    for number in 0..nodes {
        let pads = if draw.chance(0.6) {
            1 + draw.below(2)
        } else {
            0
        };
        draft.nodes.push(NodeDraft {
            id: format!("n{number}"),
            position: [draw.between(0.0, size_m), draw.between(0.0, size_m)],
            pads: pads as u16,
            ..NodeDraft::default()
        });
    }
    let mut join = |draw: &mut Draw, one: usize, other: usize| {
        let [from, to] = [one, other].map(|node| draft.nodes[node].position);
        let straight_m = (from[0] - to[0]).hypot(from[1] - to[1]);
        let (from, to) = (format!("n{one}"), format!("n{other}"));
        let ends = |segment: &SegmentDraft| [segment.from.clone(), segment.to.clone()];
        let is_there = draft.segments.iter().any(|segment| {
            let ends = ends(segment);
            ends.contains(&from) && ends.contains(&to)
        });
        // Ties are what the grid is good for: few different lengths.
        let steps = (straight_m / 480.0).ceil() + draw.below(2) as f64;
        if !is_there {
            draft.segments.push(SegmentDraft {
                from,
                to,
                length_m: on_grid.then_some(480.0 * steps),
                ..SegmentDraft::default()
            });
        }
    };
    for node in 1..nodes {
        let other = draw.below(node);
        join(draw, node, other);
    }
    for _ in 0..1 + draw.below(nodes) {
        let (one, other) = (draw.below(nodes), draw.below(nodes));
        if one != other {
            join(draw, one, other);
        }
    }
    (draft, size_m)
}

/// In every other world off the grid the roofs have heights and the segments bands, so that nodes differ in their climbs.
fn with_altitudes(seed: u64, mut draft: NetworkDraft, on_grid: bool) -> NetworkDraft {
    let mut draw = Draw::new(!seed);
    if on_grid || draw.chance(0.5) {
        return draft;
    }
    for node in &mut draft.nodes {
        node.altitude = Some(Altitude::agl(draw.between(0.0, 60.0)));
    }
    for segment in &mut draft.segments {
        let lower_m = draw.between(50.0, 90.0);
        segment.band = AltitudeBand {
            lower: Some(Altitude::agl(lower_m)),
            upper: Some(Altitude::agl(lower_m + 30.0)),
        };
    }
    draft
}

fn closure(draw: &mut Draw, topology: &Topology, from_s: f64, until_s: f64) -> TimedClosure {
    let mut closure = TimedClosure {
        from_s,
        until_s: if draw.chance(0.1) {
            f64::INFINITY
        } else {
            until_s
        },
        segments: Vec::new(),
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: draw.chance(0.7),
    };
    for _ in 0..1 + draw.below(2) {
        let node = NodeIx(draw.below(topology.node_count()) as u32);
        match draw.below(4) {
            0 => closure.nodes.push(node),
            1 => closure.pads.push(node),
            _ => closure
                .segments
                .push(SegmentIx(draw.below(topology.segment_count()) as u32)),
        }
    }
    closure
}

fn add_traffic(draw: &mut Draw, topology: &Topology, horizon_s: f64, situation: &mut Situation) {
    for _ in 0..draw.below(6) {
        let segment = SegmentIx(draw.below(topology.segment_count()) as u32);
        let ends = topology.segment(segment);
        let from = [ends.from, ends.to][draw.below(2)];
        let enters_s = draw.between(0.0, horizon_s);
        situation.traffic.push(TrafficLeg {
            segment,
            from,
            enters_s,
            leaves_s: enters_s + ends.length_m / 14.0,
        });
    }
}

fn starts(draw: &mut Draw, topology: &Topology, began_s: f64, on_grid: bool) -> Vec<FlightStart> {
    let count = if on_grid || draw.chance(0.7) { 1 } else { 2 };
    let on_ground = count == 1 && draw.chance(0.6);
    (0..count)
        .map(|_| FlightStart {
            node: NodeIx(draw.below(topology.node_count()) as u32),
            at_s: match on_ground || on_grid {
                true => began_s,
                false => began_s + draw.between(0.0, 60.0),
            },
            battery: draw.between(0.3, 1.0),
            on_ground,
            pad: None,
            flown_m: match on_ground {
                true => 0.0,
                false => 512.0 * draw.below(4) as f64,
            },
            drawn: 0.0,
            stretch: None,
        })
        .collect()
}

fn winds(draw: &mut Draw, horizon_s: f64) -> WindField {
    let wind = |draw: &mut Draw| {
        let speed_mps = draw.between(0.0, 7.0);
        Wind::coming_from(draw.between(0.0, 360.0), speed_mps)
    };
    let mut field = WindField::uniform(wind(draw));
    for _ in 0..draw.below(3) {
        let from_s = draw.between(0.0, horizon_s);
        field.patches.push(WindPatch {
            area: None,
            from_s,
            until_s: from_s + draw.between(60.0, horizon_s),
            wind: wind(draw),
        });
    }
    field
}
