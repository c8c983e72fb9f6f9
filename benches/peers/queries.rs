//! The queries, drawn from a seed, each with the length that petgraph's Dijkstra finds for it.

use crate::networks::SEED;
use crate::oracle::{Peer, assert_same};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway::airspace::{Airspace, Closed, RequestClosures, Zone, ZoneDraft, ZoneGeometry};
use skyway::geo::{AltitudeBand, Point};
use skyway::network::{Components, NodeIx, SegmentIx, Topology, outer_box};
use skyway::recompose::World;
use skyway::routing::{DestinationTree, Path, Searcher, Start, TreeCache};
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// The share of the map that a zone covers.
const ZONE_SHARE: f64 = 0.01;
/// Corners of a zone.
const ZONE_CORNERS: usize = 12;
/// Bytes for the tables of all destinations.
const TABLE_BYTES: usize = 4 << 30;

/// A segment that fails on the way to a destination, under a drone at its start.
pub(crate) struct Failure {
    pub(crate) leg: (NodeIx, NodeIx),
    pub(crate) segment: SegmentIx,
    pub(crate) destination: NodeIx,
    /// The plan from the failed leg on.
    pub(crate) plan: Vec<NodeIx>,
    /// From one end of the leg to the other without it.
    pub(crate) local: Shortest,
    /// From the start of the leg to the destination without it.
    pub(crate) global: Shortest,
    /// The same with nothing closed.
    pub(crate) open_m: f64,
}

/// The length of a shortest way, and how many segments one of that length has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shortest {
    pub(crate) length_m: f64,
    pub(crate) hops: usize,
}

/// A way through a zone, both ends outside.
pub(crate) struct Passage {
    /// The plan while nothing is closed, from the source to the destination.
    pub(crate) plan: Vec<NodeIx>,
    pub(crate) zone: Arc<Zone>,
    /// Corners in metres of the plane, the first one once.
    pub(crate) ring: Vec<Point>,
    pub(crate) closed_nodes: usize,
    pub(crate) around: Shortest,
}

impl Passage {
    pub(crate) fn ends(&self) -> (NodeIx, NodeIx) {
        (self.plan[0], self.plan[self.plan.len() - 1])
    }
}

/// One network with everything that is asked of it.
pub(crate) struct Queries {
    pub(crate) topology: Arc<Topology>,
    pub(crate) open: Airspace,
    pub(crate) trees: TreeCache,
    pub(crate) peer: Peer,
    pub(crate) failures: Vec<Failure>,
    pub(crate) passages: Vec<Passage>,
    pub(crate) destinations: usize,
    /// Failures drawn and left out, as no way leads around them.
    pub(crate) without_detour: usize,
    /// Seconds that one table takes to build.
    pub(crate) table_s: f64,
    /// Seconds that petgraph's graph takes to build.
    pub(crate) petgraph_s: f64,
}

impl Queries {
    /// Draws them: destinations once, sources uniform in the largest component, the failed segment uniform on the
    /// shortest way, the middle of a zone uniform on its nodes.
    pub(crate) fn draw(
        topology: Arc<Topology>,
        destinations: usize,
        failures: usize,
        passages: usize,
    ) -> Self {
        let now = jiff::Timestamp::UNIX_EPOCH;
        let horizon = jiff::SignedDuration::from_mins(60);
        let begun = Instant::now();
        let peer = Peer::new(&topology);
        let petgraph_s = begun.elapsed().as_secs_f64();
        let mut draw = Draw {
            random: ChaCha8Rng::seed_from_u64(SEED),
            connected: Components::of(&topology).largest().collect(),
            destinations: Vec::new(),
            searcher: Searcher::new(&topology),
            closures: RequestClosures::new(&topology),
        };
        let mut queries = Self {
            open: Airspace::open(topology.clone(), 1, now, horizon),
            trees: TreeCache::new(TABLE_BYTES),
            peer,
            failures: Vec::new(),
            passages: Vec::new(),
            destinations,
            without_detour: 0,
            table_s: 0.0,
            petgraph_s,
            topology,
        };
        draw.prepare_tables(&mut queries);
        while queries.failures.len() < failures {
            draw.failure(&mut queries);
        }
        while queries.passages.len() < passages {
            draw.passage(&mut queries);
        }
        queries
    }

    /// With the tables of all destinations in memory.
    pub(crate) fn warm_world(&self) -> World<'_> {
        World {
            airspace: &self.open,
            trees: Some(&self.trees),
        }
    }

    /// With no table at all.
    pub(crate) fn cold_world(&self) -> World<'_> {
        World {
            airspace: &self.open,
            trees: None,
        }
    }

    /// The table of a destination, as a request looks it up.
    pub(crate) fn table(&self, destination: NodeIx) -> Option<Arc<DestinationTree>> {
        let standing = self.warm_world().standing();
        self.trees.get(destination, standing)
    }

    /// Closes every node in a zone: the box by the R-tree, then the polygon.
    pub(crate) fn close_nodes(&self, zone: &Zone, mut close: impl FnMut(NodeIx)) {
        let topology = &self.topology;
        let around = outer_box(zone.shape().bounds());
        let _ = topology
            .node_tree()
            .locate_in_envelope_intersecting_int(&around, |boxed| {
                if zone.closes_point(topology.position(boxed.node), None) {
                    close(boxed.node);
                }
                ControlFlow::<()>::Continue(())
            });
    }
}

/// A start at a node itself.
pub(crate) fn at(node: NodeIx) -> Start {
    Start {
        node,
        offset_m: 0.0,
    }
}

/// What draws: random choices from a seed, the same on every machine, and the means to judge them.
struct Draw {
    random: ChaCha8Rng,
    connected: Vec<NodeIx>,
    destinations: Vec<NodeIx>,
    searcher: Searcher,
    closures: RequestClosures,
}

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        (self.random.next_u64() % count as u64) as usize
    }

    fn prepare_tables(&mut self, queries: &mut Queries) {
        for _ in 0..queries.destinations {
            let place = self.below(self.connected.len());
            self.destinations.push(self.connected[place]);
        }
        let begun = Instant::now();
        for &destination in &self.destinations {
            let tree = self.searcher.tree(&queries.topology, destination);
            queries.trees.insert(Arc::new(tree), 1);
        }
        queries.table_s = begun.elapsed().as_secs_f64() / self.destinations.len() as f64;
    }

    /// The shortest way from a random source to one of the destinations, with nothing closed.
    fn plan(&mut self, queries: &Queries, turn: usize) -> Option<Path> {
        let destination = self.destinations[turn % self.destinations.len()];
        let place = self.below(self.connected.len());
        let source = self.connected[place];
        self.closures.reset();
        let closed = Closed::new(&queries.topology, queries.open.closed(), &self.closures);
        let tree = queries.table(destination)?;
        let arrival = self.searcher.exact(&closed, &[at(source)], &tree)?;
        let mut way = Path::default();
        self.searcher.append_way(arrival, Some(&tree), &mut way);
        Some(way)
    }

    /// The shortest way around what is closed now, checked against petgraph's Dijkstra.
    fn shortest(&mut self, queries: &Queries, from: NodeIx, to: NodeIx) -> Option<Shortest> {
        let closed = Closed::new(&queries.topology, queries.open.closed(), &self.closures);
        let astar = skyway::routing::Baseline::AStar;
        let arrival = self
            .searcher
            .shortest(&closed, &[at(from)], to, astar, None);
        let oracle_m = queries.peer.dijkstra_m(&closed, from, to);
        assert_same("a query", arrival.map(|arrival| arrival.length_m), oracle_m);
        let mut way = Path::default();
        self.searcher.append_way(arrival?, None, &mut way);
        Some(Shortest {
            length_m: oracle_m?,
            hops: way.segments.len(),
        })
    }

    fn failure(&mut self, queries: &mut Queries) {
        let Some(way) = self.plan(queries, queries.failures.len()) else {
            return;
        };
        if way.segments.is_empty() {
            return;
        }
        let place = self.below(way.segments.len());
        let (from, to, segment) = (way.nodes[place], way.nodes[place + 1], way.segments[place]);
        let destination = way.nodes[way.nodes.len() - 1];
        self.closures.reset();
        self.closures.close_segment(segment, queries.open.closed());
        let Some(local) = self.shortest(queries, from, to) else {
            queries.without_detour += 1;
            return;
        };
        let Some(global) = self.shortest(queries, from, destination) else {
            queries.without_detour += 1;
            return;
        };
        let tree = queries.table(destination);
        queries.failures.push(Failure {
            leg: (from, to),
            segment,
            destination,
            plan: way.nodes[place..].to_vec(),
            local,
            global,
            open_m: tree.map_or(f64::NAN, |tree| tree.distance_m(from)),
        });
    }

    fn passage(&mut self, queries: &mut Queries) {
        let Some(way) = self.plan(queries, queries.passages.len()) else {
            return;
        };
        if way.nodes.len() < 3 {
            return;
        }
        let middle = way.nodes[1 + self.below(way.nodes.len() - 2)];
        let turn = self.below(1 << 16) as f64 / f64::from(1 << 16);
        let (zone, ring) = zone_about(&queries.topology, queries.topology.position(middle), turn);
        let (source, destination) = (way.nodes[0], way.nodes[way.nodes.len() - 1]);
        let is_inside = |node: NodeIx| zone.closes_point(queries.topology.position(node), None);
        if is_inside(source) || is_inside(destination) {
            return;
        }
        self.closures.reset();
        let (closures, standing) = (&mut self.closures, queries.open.closed());
        queries.close_nodes(&zone, |node| {
            closures.close_node(node, &queries.topology, standing);
        });
        let closed_nodes = self.closures.nodes().len();
        let Some(around) = self.shortest(queries, source, destination) else {
            return;
        };
        queries.passages.push(Passage {
            plan: way.nodes,
            zone: Arc::new(zone),
            ring,
            closed_nodes,
            around,
        });
    }
}

/// A round zone with a wavy outline, of its share of the map; also its corners in metres.
fn zone_about(topology: &Topology, centre: Point, turn: f64) -> (Zone, Vec<Point>) {
    let bounds = topology.bounds();
    let area_m2 = ZONE_SHARE * bounds.width_m() * bounds.height_m();
    let corner = |place: usize, radius_m: f64| {
        let angle = TAU * (turn + place as f64 / ZONE_CORNERS as f64);
        let reach_m = radius_m * if place.is_multiple_of(2) { 1.1 } else { 0.9 };
        Point::new(
            centre.x + reach_m * angle.cos(),
            centre.y + reach_m * angle.sin(),
        )
    };
    // Between neighbouring corners lies a triangle of `reach * next reach * sin(angle) / 2`.
    let unit_area_m2 = ZONE_CORNERS as f64 * 1.1 * 0.9 * (TAU / ZONE_CORNERS as f64).sin() / 2.0;
    let radius_m = (area_m2 / unit_area_m2).sqrt();
    let frame = topology.frame();
    let mut written: Vec<[f64; 2]> = (0..ZONE_CORNERS)
        .map(|place| frame.from_plane(corner(place, radius_m)))
        .collect();
    let ring = written.iter().map(|&place| frame.to_plane(place)).collect();
    written.push(written[0]);
    let draft = ZoneDraft {
        id: "closed for one query".to_owned(),
        name: None,
        reason: None,
        authority: None,
        geometry: ZoneGeometry::Polygon(vec![written]),
        band: AltitudeBand::UNLIMITED,
        windows: Vec::new(),
        margin_m: 0.0,
        terms: Default::default(),
    };
    let zone = Zone::new(draft, frame).expect("the ring is a simple polygon");
    (zone, ring)
}
