//! The network as the load sees it: places on a plane, ways over them, and round zones that meet
//! some of these.

use crate::arrivals::Chance;
use serde_json::{Value, json};
use skyway::wire::{CompactNetwork, Id};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Metres of a degree of latitude, near enough to choose places by.
const METRES_PER_DEGREE: f64 = 111_195.0;
/// How far beside a segment a zone still closes it.
pub(crate) const MARGIN_M: f64 = 10.0;

pub(crate) type Point = [f64; 2];

/// Nodes on a plane.
pub(crate) struct World {
    pub(crate) ids: Vec<Id<'static>>,
    points: Vec<Point>,
    neighbours: Vec<Vec<usize>>,
    numbers: BTreeMap<String, usize>,
    /// The nodes between which deliveries are drawn: the largest part of the network that hangs
    /// together.
    joined: Vec<usize>,
    /// Those of them with a pad.
    landing: Vec<usize>,
    has_pads: Vec<bool>,
    /// Degrees to metres, east and north; none where coordinates are metres.
    scale: Option<Point>,
}

/// A round zone.
#[derive(Clone, Debug)]
pub(crate) struct Disc {
    pub(crate) id: String,
    pub(crate) centre: Point,
    pub(crate) radius_m: f64,
}

impl World {
    pub(crate) fn of(network: CompactNetwork<'static>) -> Self {
        let places = network.coordinates.chunks_exact(2);
        let latitude = network.coordinates.get(1).copied().unwrap_or_default();
        let east = METRES_PER_DEGREE * (latitude * PI / 180.0).cos();
        let scale = network.geographic.then_some([east, METRES_PER_DEGREE]);
        let [x_m, y_m] = scale.unwrap_or([1.0, 1.0]);
        let points = places
            .map(|place| [place[0] * x_m, place[1] * y_m])
            .collect();
        let mut neighbours = vec![Vec::new(); network.ids.len()];
        for ends in network.segments.chunks_exact(2) {
            let (one, other) = (ends[0] as usize, ends[1] as usize);
            neighbours[one].push(other);
            neighbours[other].push(one);
        }
        let ids = network.ids.iter().enumerate();
        let joined = largest_part(&neighbours);
        let has_pads: Vec<bool> = network.pads.iter().map(|&pads| pads > 0).collect();
        let landing = joined.iter().copied().filter(|&node| has_pads[node]);
        Self {
            landing: landing.collect(),
            has_pads,
            numbers: ids
                .map(|(number, id)| (id.text().to_owned(), number))
                .collect(),
            ids: network.ids,
            joined,
            points,
            neighbours,
            scale,
        }
    }

    /// The nodes of a way, by their numbers; those that are not known are left out.
    pub(crate) fn way<'a>(&self, nodes: impl IntoIterator<Item = &'a str>) -> Vec<usize> {
        let known = nodes.into_iter().filter_map(|id| self.numbers.get(id));
        known.copied().collect()
    }

    /// Two different nodes that some way joins.
    pub(crate) fn ends(&self, chance: &mut Chance) -> (usize, usize) {
        let source = chance.below(self.joined.len());
        let beside = chance.below(self.joined.len() - 1);
        let destination = beside + usize::from(beside >= source);
        (self.joined[source], self.joined[destination])
    }

    /// A node where a drone stands.
    pub(crate) fn home(&self, chance: &mut Chance) -> usize {
        self.landing[chance.below(self.landing.len())]
    }

    /// Two different nodes with pads: a walk of `steps` segments from the first passes the second, where it passes any.
    pub(crate) fn walk(&self, steps: usize, chance: &mut Chance) -> (usize, usize) {
        let start = chance.below(self.landing.len());
        let source = self.landing[start];
        let mut destination = self.landing[(start + 1) % self.landing.len()];
        let mut node = source;
        for _ in 0..steps {
            let neighbours = &self.neighbours[node];
            node = neighbours[chance.below(neighbours.len())];
            if node != source && self.has_pads[node] {
                destination = node;
            }
        }
        (source, destination)
    }

    /// A neighbour of a node that a way does not go to.
    pub(crate) fn off_the_way(&self, node: usize, way: &[usize]) -> Option<usize> {
        let mut neighbours = self.neighbours[node].iter();
        neighbours.find(|other| !way.contains(other)).copied()
    }

    /// How near a way comes to a point, in metres.
    pub(crate) fn distance(&self, way: &[usize], point: Point) -> f64 {
        let points: Vec<Point> = way.iter().map(|node| self.points[*node]).collect();
        let alone = points.first().map(|only| length(minus(*only, point)));
        let legs = points.windows(2).map(|leg| beside(leg[0], leg[1], point));
        legs.chain(alone).fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn middle(&self, one: usize, other: usize) -> Point {
        let (one, other) = (self.points[one], self.points[other]);
        [(one[0] + other[0]) / 2.0, (one[1] + other[1]) / 2.0]
    }

    /// A place about the middle of the network, off it by up to this part of its width and height.
    pub(crate) fn about_the_middle(&self, part: f64, chance: &mut Chance) -> Point {
        let mut place = [0.0; 2];
        for (axis, at) in place.iter_mut().enumerate() {
            let values = self.points.iter().map(|point| point[axis]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            let high = values.fold(f64::NEG_INFINITY, f64::max);
            *at = (low + high) / 2.0 + (2.0 * chance.unit() - 1.0) * part * (high - low);
        }
        place
    }

    /// The zone about a point that meets this part of some ways.
    pub(crate) fn disc_over(
        &self,
        id: String,
        centre: Point,
        part: f64,
        ways: &[&[usize]],
    ) -> Disc {
        let distances = ways.iter().map(|way| self.distance(way, centre));
        let mut distances: Vec<f64> = distances.collect();
        distances.sort_by(f64::total_cmp);
        let place = (part * distances.len() as f64) as usize;
        let reach_m = distances.get(place).copied().unwrap_or(MARGIN_M);
        Disc {
            id,
            centre,
            radius_m: (reach_m - MARGIN_M).max(1.0),
        }
    }

    /// As it goes over the wire.
    pub(crate) fn feature(&self, disc: &Disc) -> Value {
        let [x_m, y_m] = self.scale.unwrap_or([1.0, 1.0]);
        json!({
            "type": "Feature",
            "id": disc.id,
            "geometry": {"type": "Point", "coordinates": [disc.centre[0] / x_m, disc.centre[1] / y_m]},
            "properties": {"radius_m": disc.radius_m, "margin_m": MARGIN_M, "reason": "load test"},
        })
    }
}

impl Disc {
    /// Whether a way surely leads through it: well within, so that no rounding decides.
    pub(crate) fn is_entered(&self, world: &World, way: &[usize]) -> bool {
        world.distance(way, self.centre) < self.radius_m
    }

    /// Whether a node is far enough outside for a drone to start or land there.
    pub(crate) fn is_clear_of(&self, world: &World, node: usize) -> bool {
        world.distance(&[node], self.centre) > self.radius_m + 2.0 * MARGIN_M
    }
}

/// The nodes of the largest part of a network in which every node can be reached.
fn largest_part(neighbours: &[Vec<usize>]) -> Vec<usize> {
    let mut largest = Vec::new();
    let mut is_seen = vec![false; neighbours.len()];
    for start in 0..neighbours.len() {
        if std::mem::replace(&mut is_seen[start], true) {
            continue;
        }
        let mut part = vec![start];
        let mut looked_at = 0;
        while let Some(node) = part.get(looked_at).copied() {
            looked_at += 1;
            for other in &neighbours[node] {
                if !std::mem::replace(&mut is_seen[*other], true) {
                    part.push(*other);
                }
            }
        }
        if part.len() > largest.len() {
            largest = part;
        }
    }
    largest
}

fn minus(one: Point, other: Point) -> Point {
    [one[0] - other[0], one[1] - other[1]]
}

fn length(vector: Point) -> f64 {
    vector[0].hypot(vector[1])
}

/// How far a point is from a straight leg.
fn beside(start: Point, end: Point, point: Point) -> f64 {
    let (leg, to_point) = (minus(end, start), minus(point, start));
    let squared = leg[0] * leg[0] + leg[1] * leg[1];
    let along = leg[0] * to_point[0] + leg[1] * to_point[1];
    let part = if squared > 0.0 {
        (along / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    length(minus(to_point, [leg[0] * part, leg[1] * part]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    /// Nodes at (0, 0), (100, 0), (200, 0) and so on, each joined with the next.
    fn line(count: usize) -> World {
        World::of(CompactNetwork {
            name: Cow::Borrowed("line"),
            attribution: Cow::Borrowed(""),
            geographic: false,
            ids: (0..count as i64).map(Id::from).collect(),
            coordinates: (0..count)
                .flat_map(|node| [100.0 * node as f64, 0.0])
                .collect(),
            pads: vec![1; count],
            segments: (1..count as u32)
                .flat_map(|node| [node - 1, node])
                .collect(),
            segment_ids: Vec::new(),
            topology_revision: 1,
        })
    }

    #[test]
    fn a_zone_over_half_of_the_ways_meets_half_of_them() {
        let world = line(101);
        let ways: Vec<Vec<usize>> = (0..100).map(|node| vec![node, node + 1]).collect();
        let ways: Vec<&[usize]> = ways.iter().map(Vec::as_slice).collect();
        let disc = world.disc_over("z".to_owned(), [0.0, 0.0], 0.5, &ways);
        assert!((disc.radius_m - 4990.0).abs() < 1e-6, "{disc:?}");
        let met = ways.iter().filter(|way| disc.is_entered(&world, way));
        assert_eq!(met.count(), 50);
    }

    #[test]
    fn deliveries_are_drawn_where_ways_lead() {
        let parts = [vec![1], vec![0], vec![3], vec![2, 4], vec![3], vec![]];
        assert_eq!(largest_part(&parts), [2, 3, 4]);
        let mut chance = Chance::of(1);
        let world = line(3);
        let draws: Vec<_> = (0..50).map(|_| world.ends(&mut chance)).collect();
        assert!(
            draws
                .iter()
                .all(|(source, destination)| source != destination)
        );
        assert!((0..3).all(|node| draws.iter().any(|(_, destination)| *destination == node)));
        let walks: Vec<_> = (0..50).map(|_| world.walk(2, &mut chance)).collect();
        assert!(
            walks
                .iter()
                .all(|(source, destination)| source != destination)
        );
    }

    #[test]
    fn distances_are_those_to_legs_and_not_to_nodes() {
        let world = line(3);
        assert!((world.distance(&[0, 1, 2], [150.0, 30.0]) - 30.0).abs() < 1e-9);
        assert!((world.distance(&[0], [30.0, 40.0]) - 50.0).abs() < 1e-9);
        assert_eq!(world.off_the_way(1, &[1, 2]), Some(0));
        assert_eq!(world.off_the_way(1, &[0, 1, 2]), None);
    }
}
