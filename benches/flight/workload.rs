//! The workload: network, zones, reserved pads and requests, all from one seed.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway::airspace::{Hits, Zone, ZoneDraft, ZoneGeometry};
use skyway::flight::{
    Airframe, FlightLegs, FlightRules, FlightStart, Reservation, SharedCrossings, Situation,
    TimedClosure, Vertical, Wind, WindField,
};
use skyway::geo::AltitudeBand;
use skyway::itinerary::{
    FlightRequest, FlightWorld, ItineraryScratch, Limits, Objective, Obstacles, PadTimes,
    Potentials, find,
};
use skyway::network::{Components, Generated, Joining, NodeIx, SegmentIx, Topology};
use std::sync::Arc;

pub(crate) const SEED: u64 = 1;
const MAP_SIZE_M: f64 = 40_000.0;
pub(crate) const PAYLOAD_KG: f64 = 0.5;
const STATION_SHARE: f64 = 0.3;
const ZONES: usize = 50;
const ZONE_SHARE: f64 = 0.003;
const ZONE_S: f64 = 1_800.0;
const ZONES_WITHIN_S: f64 = 4.0 * 3_600.0;
const RESERVATIONS: usize = 2_000;
const STARTS_WITHIN_S: f64 = 90.0 * 60.0;
const DEADLINE_S: f64 = 2.5 * 3_600.0;
const DESTINATIONS: usize = 100;
/// More draws than this for one list of requests, and the network has none of them.
const MAX_TRIES: usize = 400;

/// A request of the workload.
#[derive(Clone, Debug)]
pub(crate) struct Query {
    pub(crate) start: [FlightStart; 1],
    pub(crate) destination: usize,
    pub(crate) closed: Vec<SegmentIx>,
}

/// Network, world and requests.
pub(crate) struct Workload {
    pub(crate) topology: Arc<Topology>,
    pub(crate) airframe: Airframe,
    pub(crate) wind: WindField,
    pub(crate) rules: FlightRules,
    pub(crate) situation: Situation,
    pub(crate) legs: FlightLegs,
    pub(crate) obstacles: Obstacles,
    pub(crate) pads: PadTimes,
    vertical: Vertical,
    crossings: SharedCrossings,
    pub(crate) destinations: Vec<NodeIx>,
    /// By objective and destination; none for objectives that are not measured.
    pub(crate) potentials: Vec<Vec<Potentials>>,
    /// Shortest way of 1.6 to 2.4 batteries.
    pub(crate) two: Vec<Query>,
    /// Under one.
    pub(crate) easy: Vec<Query>,
    /// Under way at 45 to 70 %, the first leg closed.
    pub(crate) reroute: Vec<Query>,
}

impl Workload {
    /// With tables for some objectives; distance has to be among them.
    pub(crate) fn new(nodes: usize, requests: usize, objectives: &[Objective]) -> Self {
        let mut random = Random::of(SEED);
        let topology = network(nodes, &mut random);
        let airframe = Airframe::phantom3();
        let wind = WindField::uniform(Wind::coming_from(270.0, 5.0));
        let rules = FlightRules::default();
        let situation = situation(&topology, nodes, &mut random);
        let legs = FlightLegs::of(&topology, &airframe, PAYLOAD_KG, &wind, &rules);
        let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
        let destinations: Vec<NodeIx> =
            (0..DESTINATIONS).map(|_| random.pick(&connected)).collect();
        let potentials = Objective::ALL.map(|objective| {
            let tables = destinations.iter();
            let tables = tables.filter(|_| objectives.contains(&objective));
            let count = topology.node_count();
            tables
                .map(|&destination| Potentials::of(&legs, count, destination, objective))
                .collect()
        });
        let mut workload = Self {
            obstacles: Obstacles::of(&topology, &situation),
            pads: PadTimes::of(&topology, &situation),
            vertical: Vertical::of(&topology, rules.unknown_climb_m),
            crossings: SharedCrossings::default(),
            potentials: potentials.into_iter().collect(),
            topology,
            airframe,
            wind,
            rules,
            situation,
            legs,
            destinations,
            two: Vec::new(),
            easy: Vec::new(),
            reroute: Vec::new(),
        };
        workload.two = workload.draw(requests, 1.6..2.4, false, &connected, &mut random);
        workload.easy = workload.draw(requests, 0.05..0.75, false, &connected, &mut random);
        workload.reroute = workload.draw(requests, 0.3..1.5, true, &connected, &mut random);
        workload
    }

    pub(crate) fn describe(&self) {
        println!(
            "\n# {} nodes, {} segments, K = 10, {MAP_SIZE_M} m map, seed {SEED}; {} / {} / {} requests to {DESTINATIONS} destinations, {ZONES} zones, {RESERVATIONS} reservations; profile {}",
            self.topology.node_count(),
            self.topology.segment_count(),
            self.two.len(),
            self.easy.len(),
            self.reroute.len(),
            match cfg!(debug_assertions) {
                true => "with debug assertions",
                false => "without debug assertions",
            },
        );
    }

    pub(crate) fn world(&self) -> FlightWorld<'_> {
        FlightWorld {
            topology: &self.topology,
            legs: &self.legs,
            obstacles: &self.obstacles,
            pads: &self.pads,
            vertical: &self.vertical,
            crossings: &self.crossings,
            rules: &self.rules,
            charging: self.airframe.charging(),
        }
    }

    pub(crate) fn request<'a>(&self, query: &'a Query, objective: Objective) -> FlightRequest<'a> {
        let began_s = query.start[0].at_s;
        FlightRequest {
            starts: &query.start,
            destination: self.destinations[query.destination],
            objective,
            began_s,
            deadline_s: began_s + DEADLINE_S,
            reserve: self.rules.reserve,
            closed_segments: &query.closed,
            limits: Limits::THOROUGH,
        }
    }

    pub(crate) fn payload_kg(&self) -> f64 {
        PAYLOAD_KG
    }

    /// The shortest way where nothing is in the way and the battery does not matter: its energy and its first leg.
    fn static_way(
        &self,
        open: &FlightWorld<'_>,
        source: NodeIx,
        destination: usize,
        scratch: &mut ItineraryScratch,
    ) -> Option<(f64, SegmentIx)> {
        let start = FlightStart {
            node: source,
            at_s: 0.0,
            battery: 1e3,
            on_ground: false,
            pad: None,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        };
        let query = Query {
            start: [start],
            destination,
            closed: Vec::new(),
        };
        let request = self.request(&query, Objective::Distance);
        let tables = &self.potentials[Objective::Distance as usize];
        let plan = find(open, &request, &tables[destination], scratch).plan?;
        Some((plan.energy, plan.legs.first()?.segment))
    }

    fn draw(
        &self,
        requests: usize,
        batteries: std::ops::Range<f64>,
        under_way: bool,
        connected: &[NodeIx],
        random: &mut Random,
    ) -> Vec<Query> {
        let nothing = Situation::default();
        let (obstacles, pads) = (
            Obstacles::of(&self.topology, &nothing),
            PadTimes::of(&self.topology, &nothing),
        );
        let open = FlightWorld {
            obstacles: &obstacles,
            pads: &pads,
            ..self.world()
        };
        let mut scratch = ItineraryScratch::new(&self.topology);
        let mut queries = Vec::with_capacity(requests);
        for _ in 0..MAX_TRIES * requests {
            if queries.len() == requests {
                break;
            }
            let source = random.pick(connected);
            let destination = queries.len() % DESTINATIONS;
            let way = self.static_way(&open, source, destination, &mut scratch);
            let Some((energy, first_leg)) = way else {
                continue;
            };
            if !batteries.contains(&energy) {
                continue;
            }
            let start = FlightStart {
                node: source,
                at_s: random.share() * STARTS_WITHIN_S,
                battery: match under_way {
                    true => 0.45 + 0.25 * random.share(),
                    false => self.airframe.full_charge,
                },
                on_ground: !under_way,
                pad: None,
                flown_m: 0.0,
                drawn: 0.0,
                stretch: None,
            };
            queries.push(Query {
                start: [start],
                destination,
                closed: if under_way {
                    vec![first_leg]
                } else {
                    Vec::new()
                },
            });
        }
        queries
    }
}

fn network(nodes: usize, random: &mut Random) -> Arc<Topology> {
    let generated = Generated {
        nodes,
        max_neighbours: 10,
        map_size_m: MAP_SIZE_M,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed: SEED,
    };
    let mut draft = generated.network().expect("the parameters are in range");
    for node in &mut draft.nodes {
        node.pads = if random.share() < STATION_SHARE { 2 } else { 0 };
    }
    let topology = Topology::build(draft, [0; 32]).expect("a generated network is valid");
    Arc::new(topology)
}

fn situation(topology: &Topology, nodes: usize, random: &mut Random) -> Situation {
    let mut situation = Situation::default();
    let half_m = ZONE_SHARE.sqrt() * MAP_SIZE_M / 2.0;
    for index in 0..ZONES {
        let (x, y) = (random.share() * MAP_SIZE_M, random.share() * MAP_SIZE_M);
        let corners = [
            (-1.0, -1.0),
            (1.0, -1.0),
            (1.0, 1.0),
            (-1.0, 1.0),
            (-1.0, -1.0),
        ];
        let ring = corners.map(|(east, north)| [x + east * half_m, y + north * half_m]);
        let draft = ZoneDraft {
            id: format!("zone-{index}"),
            name: None,
            reason: None,
            authority: None,
            geometry: ZoneGeometry::Polygon(vec![ring.to_vec()]),
            band: AltitudeBand::UNLIMITED,
            windows: Vec::new(),
            margin_m: 0.0,
            terms: Default::default(),
        };
        let zone = Zone::new(draft, topology.frame()).expect("a square");
        let hits = Hits::of(topology, &zone);
        let from_s = random.share() * (ZONES_WITHIN_S - ZONE_S);
        situation.closures.push(TimedClosure {
            from_s,
            until_s: from_s + ZONE_S,
            segments: hits.segments,
            nodes: hits.nodes,
            pads: Vec::new(),
            widened: true,
        });
    }
    let stations: Vec<NodeIx> = topology
        .nodes()
        .filter(|&node| topology.pads(node) > 0)
        .collect();
    // As dense on a larger network as on the small one.
    for _ in 0..RESERVATIONS * nodes / 5_000 {
        let from_s = random.share() * ZONES_WITHIN_S;
        situation.reservations.push(Reservation {
            node: random.pick(&stations),
            pad: u16::from(random.share() < 0.5),
            from_s,
            until_s: from_s + 1_200.0 + 1_200.0 * random.share(),
        });
    }
    situation
}

/// Random choices from a seed, the same on every machine.
pub(crate) struct Random(ChaCha8Rng);

impl Random {
    pub(crate) fn of(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(crate) fn pick<T: Copy>(&mut self, things: &[T]) -> T {
        things[(self.0.next_u64() % things.len() as u64) as usize]
    }

    pub(crate) fn share(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
