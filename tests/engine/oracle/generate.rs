//! Seeded random networks and closures for property tests, made to meet the corner cases: ties,
//! vertical lines, nodes in one place, bridges, islands, lengths that are not the straight line.
//!
//! The same seed gives the same network everywhere.

use std::collections::BTreeSet;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::network::{OracleNetwork, OracleNode, OracleSegment};

/// The smallest and the largest network that [`generate`] makes, in nodes.
pub(crate) const SIZES: (usize, usize) = (2, 60);

/// The layout of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Nodes anywhere, each joined to a few of the nearest.
    Uniform,
    /// Whole coordinates 100 m apart, some gaps, some diagonals: many ties, vertical and horizontal
    /// legs.
    Grid,
    /// A few dense clusters with much room between.
    Clustered,
    /// A line, upright, level or slanted, with spurs: a neighbour is the only way.
    Line,
    /// As uniform, but some nodes share a place and are joined by a stated length.
    Coincident,
    /// Two parts without a way between them.
    Disconnected,
}

/// Every kind, in the order in which seeds go through them.
pub(crate) const KINDS: [Kind; 6] = [
    Kind::Uniform,
    Kind::Grid,
    Kind::Clustered,
    Kind::Line,
    Kind::Coincident,
    Kind::Disconnected,
];

/// What is closed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Closures {
    pub(crate) nodes: BTreeSet<usize>,
    pub(crate) segments: BTreeSet<usize>,
}

/// A source of random numbers for a seed; property tests may draw their own choices from it.
pub(crate) struct Draw(ChaCha8Rng);

impl Draw {
    pub(crate) fn new(seed: u64) -> Self {
        Draw(ChaCha8Rng::seed_from_u64(seed))
    }

    /// A number in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A whole number in `0..count`; `count` is not 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }
}

/// The network of a seed: its kind goes round with the seed, its size is drawn.
pub(crate) fn generate(seed: u64) -> (Kind, OracleNetwork) {
    let kind = KINDS[(seed % KINDS.len() as u64) as usize];
    let mut draw = Draw::new(seed);
    let size = SIZES.0 + draw.below(SIZES.1 - SIZES.0 + 1);
    (kind, network(&mut draw, kind, size))
}

/// A network of a kind with `size` nodes, at least 2, and at least one segment.
pub(crate) fn network(draw: &mut Draw, kind: Kind, size: usize) -> OracleNetwork {
    let positions = positions(draw, kind, size);
    let pairs = match kind {
        Kind::Grid => grid_pairs(draw, &positions),
        Kind::Line => line_pairs(draw, size),
        Kind::Disconnected => parted_pairs(draw, &positions),
        Kind::Uniform | Kind::Clustered | Kind::Coincident => near_pairs(draw, &positions, 0..size),
    };
    let ids = ids(draw, size);
    let nodes: Vec<OracleNode> = positions
        .iter()
        .zip(ids)
        .map(|(&(x, y), id)| OracleNode {
            id,
            x,
            y,
            pads: draw.below(4) as u32,
        })
        .collect();
    let stated_share = if kind == Kind::Grid { 0.1 } else { 0.25 };
    let segments = pairs
        .into_iter()
        .map(|(a, b)| OracleSegment {
            a,
            b,
            length_m: length_m(draw, positions[a], positions[b], stated_share),
        })
        .collect();
    OracleNetwork::new(nodes, segments)
}

/// Closes each node and each segment with the given probabilities.
pub(crate) fn closures(
    draw: &mut Draw,
    network: &OracleNetwork,
    node_share: f64,
    segment_share: f64,
) -> Closures {
    Closures {
        nodes: (0..network.nodes.len())
            .filter(|_| draw.chance(node_share))
            .collect(),
        segments: (0..network.segments.len())
            .filter(|_| draw.chance(segment_share))
            .collect(),
    }
}

/// A random segment as a failed leg, flown in a random direction.
pub(crate) fn failed_leg(draw: &mut Draw, network: &OracleNetwork) -> (usize, usize) {
    let segment = &network.segments[draw.below(network.segments.len())];
    if draw.chance(0.5) {
        (segment.a, segment.b)
    } else {
        (segment.b, segment.a)
    }
}

fn positions(draw: &mut Draw, kind: Kind, size: usize) -> Vec<(f64, f64)> {
    match kind {
        Kind::Uniform => (0..size)
            .map(|_| (draw.unit() * 5000.0, draw.unit() * 4000.0))
            .collect(),
        Kind::Grid => {
            let columns = 1 + draw.below(size.min(9));
            (0..size)
                .map(|index| {
                    (
                        (index % columns) as f64 * 100.0,
                        (index / columns) as f64 * 100.0,
                    )
                })
                .collect()
        }
        Kind::Clustered => {
            let centres: Vec<(f64, f64)> = (0..1 + draw.below(4))
                .map(|_| (draw.unit() * 5000.0, draw.unit() * 5000.0))
                .collect();
            let place = |draw: &mut Draw| {
                let (x, y) = centres[draw.below(centres.len())];
                (
                    x + draw.unit() * 400.0 - 200.0,
                    y + draw.unit() * 400.0 - 200.0,
                )
            };
            (0..size).map(|_| place(draw)).collect()
        }
        Kind::Line => {
            let (step_x, step_y) = [(0.0, 150.0), (150.0, 0.0), (120.0, 90.0)][draw.below(3)];
            (0..size)
                .map(|index| (index as f64 * step_x, index as f64 * step_y))
                .collect()
        }
        Kind::Coincident => {
            let mut places: Vec<(f64, f64)> = Vec::new();
            for _ in 0..size {
                let repeats = !places.is_empty() && draw.chance(0.3);
                let anew = (draw.unit() * 2000.0, draw.unit() * 2000.0);
                places.push(if repeats {
                    places[draw.below(places.len())]
                } else {
                    anew
                });
            }
            places
        }
        Kind::Disconnected => (0..size)
            .map(|index| {
                let offset = if index % 2 == 0 { 0.0 } else { 1500.0 };
                (offset + draw.unit() * 2000.0, draw.unit() * 2000.0)
            })
            .collect(),
    }
}

/// Joins each of the nodes to one to four of its nearest among them, and now and then to a far one.
fn near_pairs(
    draw: &mut Draw,
    positions: &[(f64, f64)],
    among: impl Iterator<Item = usize> + Clone,
) -> BTreeSet<(usize, usize)> {
    let members: Vec<usize> = among.collect();
    let mut pairs = BTreeSet::new();
    for &node in &members {
        let mut others: Vec<usize> = members
            .iter()
            .copied()
            .filter(|&other| other != node)
            .collect();
        others.sort_by(|&one, &other| {
            straight_m(positions[node], positions[one])
                .total_cmp(&straight_m(positions[node], positions[other]))
        });
        let wanted = 1 + draw.below(4);
        for &other in others.iter().take(wanted) {
            pairs.insert(ordered(node, other));
        }
        if !others.is_empty() && draw.chance(0.05) {
            pairs.insert(ordered(node, others[draw.below(others.len())]));
        }
    }
    pairs
}

fn grid_pairs(draw: &mut Draw, positions: &[(f64, f64)]) -> BTreeSet<(usize, usize)> {
    let mut pairs = BTreeSet::new();
    for one in 0..positions.len() {
        for other in one + 1..positions.len() {
            let dx = (positions[one].0 - positions[other].0).abs();
            let dy = (positions[one].1 - positions[other].1).abs();
            let beside = dx + dy == 100.0;
            let across = dx == 100.0 && dy == 100.0;
            if beside && draw.chance(0.85) || across && draw.chance(0.1) {
                pairs.insert((one, other));
            }
        }
    }
    if pairs.is_empty() {
        pairs.insert((0, 1));
    }
    pairs
}

/// Each node to the next, now and then to the one after instead, which leaves a spur.
fn line_pairs(draw: &mut Draw, size: usize) -> BTreeSet<(usize, usize)> {
    let mut pairs = BTreeSet::new();
    for node in 1..size {
        let before = if node >= 2 && draw.chance(0.15) {
            node - 2
        } else {
            node - 1
        };
        pairs.insert((before, node));
        if node >= 3 && draw.chance(0.1) {
            pairs.insert((node - 3, node));
        }
    }
    pairs
}

/// Even and odd nodes are parts of their own.
fn parted_pairs(draw: &mut Draw, positions: &[(f64, f64)]) -> BTreeSet<(usize, usize)> {
    let size = positions.len();
    let mut pairs = near_pairs(draw, positions, (0..size).step_by(2));
    pairs.extend(near_pairs(draw, positions, (1..size).step_by(2)));
    if pairs.is_empty() {
        pairs.insert((0, 1));
    }
    pairs
}

/// The straight line, or a stated length: a little shorter, longer, or anything where the ends
/// share a place.
fn length_m(draw: &mut Draw, one: (f64, f64), other: (f64, f64), stated_share: f64) -> f64 {
    let straight_m = straight_m(one, other);
    if straight_m == 0.0 {
        return 1.0 + draw.unit() * 50.0;
    }
    if !draw.chance(stated_share) {
        return straight_m;
    }
    let factor = if draw.chance(0.4) {
        0.9 + 0.1 * draw.unit()
    } else {
        1.0 + 0.6 * draw.unit()
    };
    straight_m * factor
}

/// Shuffled ids: whole numbers, or names whose order by bytes is not that of their numbers.
fn ids(draw: &mut Draw, size: usize) -> Vec<String> {
    let prefix = if draw.chance(0.5) { "" } else { "n" };
    let mut numbers: Vec<usize> = (1..=size).collect();
    for last in (1..size).rev() {
        numbers.swap(last, draw.below(last + 1));
    }
    numbers
        .into_iter()
        .map(|number| format!("{prefix}{number}"))
        .collect()
}

fn straight_m(one: (f64, f64), other: (f64, f64)) -> f64 {
    let (dx, dy) = (one.0 - other.0, one.1 - other.1);
    (dx * dx + dy * dy).sqrt()
}

fn ordered(one: usize, other: usize) -> (usize, usize) {
    (one.min(other), one.max(other))
}
