//! The networks and queries that are measured: seeded, and the same in every run.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway::airspace::{
    Airspace, Change, Closed, Closure, RequestClosures, Zone, ZoneDraft, ZoneGeometry,
};
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::geo::{AltitudeBand, Point};
use skyway::network::{Components, Generated, Joining, NodeIx, Topology};
use skyway::recompose::{Request, Scratch, World};
use skyway::routing::{ClosureEpoch, Path, Start, TreeCache};
use std::sync::Arc;

const SEED: u64 = 1;
const MAP_SIZE_M: f64 = 10_000.0;
const MAX_NEIGHBOURS: usize = 10;
const QUERIES: usize = 1_000;
/// The share of the map that a zone covers.
const ZONE_SHARE: f64 = 0.01;
const ZONES: usize = 20;

/// A failure on the way from a source to a destination.
pub(crate) struct Failure {
    pub(crate) request: Request,
    pub(crate) leg: (NodeIx, NodeIx),
}

/// A way through a zone that has just been declared.
pub(crate) struct Passage {
    pub(crate) source: NodeIx,
    pub(crate) destination: NodeIx,
    pub(crate) zone: usize,
}

/// One network with everything that is asked of it.
pub(crate) struct Workload {
    pub(crate) topology: Arc<Topology>,
    pub(crate) open: Airspace,
    pub(crate) trees: TreeCache,
    pub(crate) failures: Vec<Failure>,
    pub(crate) zones: Vec<Arc<Closure>>,
    pub(crate) airspaces: Vec<Airspace>,
    pub(crate) passages: Vec<Passage>,
    pub(crate) destinations: Vec<NodeIx>,
}

impl Workload {
    pub(crate) fn new(nodes: usize, destination_count: usize) -> Self {
        let draft = Generated {
            nodes,
            max_neighbours: MAX_NEIGHBOURS,
            map_size_m: MAP_SIZE_M,
            reach_fraction: 0.3,
            joining: Joining::Nearest,
            seed: SEED,
        };
        let draft = draft.network().expect("the parameters are Table 1's");
        let topology =
            Arc::new(Topology::build(draft, [0; 32]).expect("a generated network is valid"));
        let now = jiff::Timestamp::UNIX_EPOCH;
        let open = Airspace::open(
            topology.clone(),
            1,
            now,
            jiff::SignedDuration::from_mins(60),
        );
        let mut random = Random(ChaCha8Rng::seed_from_u64(SEED));
        let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
        let destinations: Vec<NodeIx> = (0..destination_count)
            .map(|_| random.pick(&connected))
            .collect();
        let mut scratch = Scratch::new(&topology);
        let trees = TreeCache::new(4 << 30);
        for &destination in &destinations {
            let tree = scratch.searcher().tree(&topology, destination);
            trees.insert(Arc::new(tree), 1);
        }
        let mut workload = Self {
            topology,
            open,
            trees,
            failures: Vec::new(),
            zones: Vec::new(),
            airspaces: Vec::new(),
            passages: Vec::new(),
            destinations,
        };
        workload.draw_failures(&mut random, &connected, &mut scratch);
        workload.draw_zones(&mut random);
        workload.draw_passages(&mut random, &connected, &mut scratch);
        workload
    }

    pub(crate) fn describe(&self) {
        println!(
            "\n# {} nodes, {} segments, K = {MAX_NEIGHBOURS}, {MAP_SIZE_M} m map, seed {SEED}; {} failures to {} destinations, {ZONES} zones of {ZONE_SHARE} of the map; profile {}",
            self.topology.node_count(),
            self.topology.segment_count(),
            self.failures.len(),
            self.destinations.len(),
            if cfg!(debug_assertions) {
                "with debug assertions"
            } else {
                "without debug assertions"
            },
        );
    }

    pub(crate) fn open_world(&self) -> World<'_> {
        World {
            airspace: &self.open,
            trees: Some(&self.trees),
        }
    }

    /// The shortest way from a node to a destination with nothing closed.
    fn way(&self, source: NodeIx, destination: NodeIx, scratch: &mut Scratch) -> Option<Path> {
        let standing = self.open_world().standing();
        let tree = self.trees.get(destination, standing)?;
        let nothing = RequestClosures::new(&self.topology);
        let closed = Closed::new(&self.topology, self.open.closed(), &nothing);
        let arrival = scratch.searcher().exact(&closed, &[at(source)], &tree)?;
        let mut way = Path::default();
        scratch
            .searcher()
            .append_way(arrival, Some(&tree), &mut way);
        Some(way)
    }

    /// Sources and destinations uniform in the largest component, the failed leg uniform on the shortest path.
    fn draw_failures(&mut self, random: &mut Random, connected: &[NodeIx], scratch: &mut Scratch) {
        while self.failures.len() < QUERIES {
            let destination = self.destinations[self.failures.len() % self.destinations.len()];
            let source = random.pick(connected);
            let Some(way) = self.way(source, destination, scratch) else {
                continue;
            };
            if way.segments.is_empty() {
                continue;
            }
            let place = random.below(way.segments.len());
            let leg = (way.nodes[place], way.nodes[place + 1]);
            let request = Request::exact(FailureReport {
                failure: FailureType::Navigational,
                leg,
                location: Location::LegStart,
                cause_location: None,
                destination,
                remaining_path: Some(way.nodes[place..].to_vec()),
            });
            self.failures.push(Failure { request, leg });
        }
    }

    /// Squares of 1 % of the map, anywhere on it, each standing by itself in an airspace.
    fn draw_zones(&mut self, random: &mut Random) {
        let half_side_m = ZONE_SHARE.sqrt() * MAP_SIZE_M / 2.0;
        for index in 0..ZONES {
            let centre = Point::new(random.share(), random.share());
            let within = |share: f64| half_side_m + share * (MAP_SIZE_M - 2.0 * half_side_m);
            let (x, y) = (within(centre.x), within(centre.y));
            let ring = [
                (-1.0, -1.0),
                (1.0, -1.0),
                (1.0, 1.0),
                (-1.0, 1.0),
                (-1.0, -1.0),
            ]
            .map(|(east, north)| [x + east * half_side_m, y + north * half_side_m]);
            let zone = zone(&format!("zone-{index}"), ring.to_vec(), &self.topology);
            let closure = Arc::new(Closure::of_zone(&self.topology, Arc::new(zone)));
            let airspace = self
                .open
                .apply(&[Change::Put(closure.clone())], self.open.as_of());
            self.zones.push(closure);
            self.airspaces.push(airspace);
        }
    }

    /// Ways whose shortest path on the open network runs through a zone, both ends outside.
    fn draw_passages(&mut self, random: &mut Random, connected: &[NodeIx], scratch: &mut Scratch) {
        let mut tries = 0;
        while self.passages.len() < QUERIES && tries < 400 * QUERIES {
            tries += 1;
            let zone = self.passages.len() % self.zones.len();
            let closed = self.airspaces[zone].closed();
            let destination = random.pick(&self.destinations);
            let source = random.pick(connected);
            if closed.closes_node(source) || closed.closes_node(destination) {
                continue;
            }
            let Some(way) = self.way(source, destination, scratch) else {
                continue;
            };
            if way.segments.iter().any(|&segment| closed.blocks(segment)) {
                self.passages.push(Passage {
                    source,
                    destination,
                    zone,
                });
            }
        }
    }
}

/// A start at a node itself.
pub(crate) fn at(node: NodeIx) -> Start {
    Start {
        node,
        offset_m: 0.0,
    }
}

/// Which standing closures an airspace has.
pub(crate) fn standing(airspace: &Airspace) -> ClosureEpoch {
    World {
        airspace,
        trees: None,
    }
    .standing()
}

/// A zone without margin, band or windows.
pub(crate) fn zone(id: &str, ring: Vec<[f64; 2]>, topology: &Topology) -> Zone {
    let draft = ZoneDraft {
        id: id.to_owned(),
        name: None,
        reason: None,
        authority: None,
        geometry: ZoneGeometry::Polygon(vec![ring]),
        band: AltitudeBand::UNLIMITED,
        windows: Vec::new(),
        margin_m: 0.0,
        terms: Default::default(),
    };
    Zone::new(draft, topology.frame()).expect("the ring is a simple polygon")
}

/// Random choices from a seed, the same on every machine.
pub(crate) struct Random(pub(crate) ChaCha8Rng);

impl Random {
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, things: &[T]) -> T {
        things[self.below(things.len())]
    }

    pub(crate) fn share(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}
