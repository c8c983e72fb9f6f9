//! A network, and what is drawn over it from one seed.

use crate::Result;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::{Value, json};
use skyway::edge::NewNetwork;
use skyway::formats::{load_network, write_network};
use skyway::geo::Point;
use skyway::network::{Components, Generated, Joining, NodeIx, Topology, bundled};
use std::f64::consts::TAU;
use std::sync::Arc;

const SEED: u64 = 1;
const MAP_SIZE_M: f64 = 40_000.0;
/// How far beside a segment a zone still closes it.
const MARGIN_M: f64 = 10.0;
/// Vertices of each zone of a feed.
const VERTICES: usize = 40;

/// A network, its nodes that hang together, and the seed's next draws.
pub(crate) struct World {
    pub(crate) topology: Arc<Topology>,
    pub(crate) text: Arc<str>,
    joined: Vec<NodeIx>,
    random: ChaCha8Rng,
}

impl World {
    /// So many nodes on a square, joined with those that are near.
    pub(crate) fn generated(nodes: usize) -> Result<Self> {
        let generated = Generated {
            nodes,
            max_neighbours: 10,
            map_size_m: MAP_SIZE_M,
            reach_fraction: 0.3,
            joining: Joining::Nearest,
            seed: SEED,
        };
        Self::of(write_network(&generated.network()?))
    }

    /// The rooftops of Sydney.
    pub(crate) fn sydney() -> Result<Self> {
        Self::of(bundled::SYDNEY_CBD.to_owned())
    }

    fn of(text: String) -> Result<Self> {
        let topology = Arc::new(load_network(&text)?.topology);
        Ok(Self {
            joined: Components::of(&topology).largest().collect(),
            topology,
            text: text.into(),
            random: ChaCha8Rng::seed_from_u64(SEED),
        })
    }

    pub(crate) fn network(&self) -> NewNetwork {
        NewNetwork::new(self.topology.clone(), self.text.as_bytes().to_vec().into())
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.random.next_u64() % count as u64) as usize
    }

    pub(crate) fn share(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The ids of two different nodes.
    pub(crate) fn ends(&mut self) -> [String; 2] {
        let source = self.below(self.joined.len());
        let beside = self.below(self.joined.len() - 1);
        let destination = beside + usize::from(beside >= source);
        [source, destination].map(|place| self.topology.node_id(self.joined[place]).to_owned())
    }

    /// The zone over the middle of a leg.
    pub(crate) fn over_leg(&self, leg: &[NodeIx]) -> Value {
        let ends = [leg[0], leg[leg.len() - 1]].map(|node| self.topology.position(node));
        let middle = Point::new((ends[0].x + ends[1].x) / 2.0, (ends[0].y + ends[1].y) / 2.0);
        self.circle(middle, 10.0)
    }

    /// The zone about a place near the middle that half of these ways come into.
    pub(crate) fn over_half<'w>(&mut self, ways: impl Iterator<Item = &'w [NodeIx]>) -> Value {
        let centre = self.place(0.4, 0.6);
        let distance = |way: &[NodeIx]| {
            let nodes = way.iter().map(|&node| self.topology.position(node));
            let distances = nodes.map(|at| at.distance_m(centre));
            distances.fold(f64::INFINITY, f64::min)
        };
        let mut distances: Vec<f64> = ways.map(distance).collect();
        distances.sort_by(f64::total_cmp);
        self.circle(centre, distances[distances.len() / 2].max(1.0))
    }

    /// The text of a feed of polygons about places that are drawn.
    pub(crate) fn feed(&mut self, zones: usize) -> String {
        let features: Vec<Value> = (0..zones).map(|number| self.polygon(number)).collect();
        json!({"type": "FeatureCollection", "features": features}).to_string()
    }

    fn polygon(&mut self, number: usize) -> Value {
        let centre = self.place(0.0, 1.0);
        let radius_m = 50.0 + 250.0 * self.share();
        let mut ring: Vec<[f64; 2]> = (0..VERTICES)
            .map(|corner| {
                let (sine, cosine) = (TAU * corner as f64 / VERTICES as f64).sin_cos();
                let distance_m = radius_m * (0.8 + 0.2 * self.share());
                let corner =
                    Point::new(centre.x + distance_m * cosine, centre.y + distance_m * sine);
                self.topology.frame().from_plane(corner)
            })
            .collect();
        ring.push(ring[0]);
        json!({
            "type": "Feature", "id": format!("feed-{number}"),
            "geometry": {"type": "Polygon", "coordinates": [ring]},
            "properties": {"margin_m": MARGIN_M, "upper_m": 120},
        })
    }

    /// A place between two parts of the width and the height.
    fn place(&mut self, from: f64, until: f64) -> Point {
        let bounds = self.topology.bounds();
        let [x, y] = [0, 1].map(|_| from + (until - from) * self.share());
        let (width_m, height_m) = (bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y);
        Point::new(bounds.min.x + x * width_m, bounds.min.y + y * height_m)
    }

    fn circle(&self, centre: Point, radius_m: f64) -> Value {
        json!({
            "type": "Feature", "id": "z",
            "geometry": {"type": "Point", "coordinates": self.topology.frame().from_plane(centre)},
            "properties": {"radius_m": radius_m, "margin_m": MARGIN_M},
        })
    }
}
