//! Random networks after the paper's experiments (section 4, Table 1).
//!
//! Nodes lie uniformly in a square; the table's "max connectivity between nodes" is read as a hard limit, so
//! no node has more than K segments. The paper does not say which pairs within reach are joined, and that decides
//! more than any other reading of it: see [`Joining`], and the module `neighbours` for which pairs are taken.
//!
//! Nor does it say whether its networks are connected. Joined to the nearest, they nearly are where the reach
//! allows it: of 5,000 nodes with a reach of 0.3, all but 24 are in one component with K = 5 and
//! all of them with K = 10. With few nodes and a short reach (100 nodes, 0.05 of the map: less than
//! one other node within reach on average) no rule can join them all.

use super::draft::{Coordinates, NetworkDraft, NodeDraft, Role, SegmentDraft};
use super::neighbours::{join_at_random, join_delaunay, join_nearest};
use super::seeded::Seeded;
use crate::geo::Point;
use thiserror::Error;

/// More nodes than this are refused.
pub const MAX_GENERATED_NODES: usize = 10_000_000;
/// More neighbours than this are refused.
pub const MAX_GENERATED_NEIGHBOURS: usize = 100;
/// Larger maps are refused: planar coordinates keep their precision up to here.
const MAX_MAP_SIZE_M: f64 = 1e9;
/// Every generated node has from one to this many pads: a node of the paper has a finite number,
/// and none is given.
const MAX_PADS: u16 = 4;

/// Which nodes within reach are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Joining {
    /// Each with its nearest: short segments, so that the reach seldom binds.
    #[default]
    Nearest,
    /// Any, drawn at random while both have room: segments as long as the reach allows.
    Random,
    /// Edges of a Delaunay triangulation, shortest first: no two cross.
    Delaunay,
}

/// The variables of the paper's Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Generated {
    /// How many nodes; 100 to 5,000 in the paper.
    pub nodes: usize,
    /// Largest number of segments at a node; 5 to 20 in the paper.
    pub max_neighbours: usize,
    /// Side of the square map, in metres.
    pub map_size_m: f64,
    /// Longest segment as a fraction of the map size; 0.05 to 0.3 in the paper.
    pub reach_fraction: f64,
    /// Which nodes within reach are joined.
    pub joining: Joining,
    /// The same seed gives the same network.
    pub seed: u64,
}

/// Why a network cannot be generated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GenerateError {
    /// The number of nodes is out of range.
    #[error("nodes is {nodes}; give 1 to {limit}")]
    Nodes {
        /// The number asked for.
        nodes: usize,
        /// The largest number.
        limit: usize,
    },
    /// The number of neighbours is out of range.
    #[error("max_neighbours is {max_neighbours}; give 1 to {limit}")]
    Neighbours {
        /// The number asked for.
        max_neighbours: usize,
        /// The largest number.
        limit: usize,
    },
    /// The map size is out of range.
    #[error("map_size_m is {map_size_m}; give a number above 0 and up to {limit_m}")]
    MapSize {
        /// The size asked for, in metres.
        map_size_m: f64,
        /// The largest size, in metres.
        limit_m: f64,
    },
    /// The reach is out of range.
    #[error("reach_fraction is {reach_fraction}; give a finite number above 0, such as 0.1")]
    Reach {
        /// The fraction asked for.
        reach_fraction: f64,
    },
}

impl Generated {
    /// Generates the network: planar, with ids from `0` on and straight segments.
    ///
    /// # Errors
    /// [`GenerateError`] where a variable is out of range.
    pub fn network(&self) -> Result<NetworkDraft, GenerateError> {
        self.check()?;
        let mut seeded = Seeded::new(self.seed);
        let points: Vec<Point> = (0..self.nodes)
            .map(|_| {
                let x = seeded.between(0.0, self.map_size_m);
                Point::new(x, seeded.between(0.0, self.map_size_m))
            })
            .collect();
        let nodes = points.iter().enumerate().map(|(place, point)| NodeDraft {
            id: place.to_string(),
            position: [point.x, point.y],
            altitude: None,
            pads: 1 + seeded.below(MAX_PADS),
            role: Role::Both,
            name: None,
        });
        let nodes: Vec<NodeDraft> = nodes.collect();
        let reach_m = self.map_size_m * self.reach_fraction;
        let (most, points) = (self.max_neighbours, &points[..]);
        let (joined, how) = match self.joining {
            Joining::Nearest => (join_nearest(points, most, reach_m, &[]), ""),
            Joining::Random => (join_at_random(points, most, reach_m, &mut seeded), " drawn"),
            Joining::Delaunay => (join_delaunay(points, most, reach_m), " by Delaunay"),
        };
        let segments = joined
            .into_iter()
            .map(|(from, to)| SegmentDraft {
                from: nodes[from as usize].id.clone(),
                to: nodes[to as usize].id.clone(),
                ..SegmentDraft::default()
            })
            .collect();
        Ok(NetworkDraft {
            name: format!(
                "generated: {} nodes, up to {} neighbours{how} within {} of {} m, seed {}",
                self.nodes, self.max_neighbours, self.reach_fraction, self.map_size_m, self.seed
            ),
            attribution: String::new(),
            coordinates: Coordinates::Planar,
            integer_ids: true,
            nodes,
            segments,
            aliases: Vec::new(),
        })
    }

    fn check(&self) -> Result<(), GenerateError> {
        let Self {
            nodes,
            max_neighbours,
            map_size_m,
            reach_fraction,
            ..
        } = *self;
        if !(1..=MAX_GENERATED_NODES).contains(&nodes) {
            return Err(GenerateError::Nodes {
                nodes,
                limit: MAX_GENERATED_NODES,
            });
        }
        if !(1..=MAX_GENERATED_NEIGHBOURS).contains(&max_neighbours) {
            let limit = MAX_GENERATED_NEIGHBOURS;
            return Err(GenerateError::Neighbours {
                max_neighbours,
                limit,
            });
        }
        if !(map_size_m > 0.0 && map_size_m <= MAX_MAP_SIZE_M) {
            return Err(GenerateError::MapSize {
                map_size_m,
                limit_m: MAX_MAP_SIZE_M,
            });
        }
        if !(reach_fraction > 0.0 && reach_fraction.is_finite()) {
            return Err(GenerateError::Reach { reach_fraction });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(nodes: usize, max_neighbours: usize, reach_fraction: f64, seed: u64) -> Generated {
        Generated {
            nodes,
            max_neighbours,
            map_size_m: 10_000.0,
            reach_fraction,
            joining: Joining::Nearest,
            seed,
        }
    }

    #[test]
    fn no_node_has_more_than_k_segments_and_none_is_longer_than_the_reach() {
        let joinings = [Joining::Nearest, Joining::Random, Joining::Delaunay];
        for (seed, max_neighbours, reach_fraction, joining) in
            [(1, 5, 0.05), (2, 10, 0.1), (3, 20, 0.3)]
                .into_iter()
                .flat_map(|(seed, most, reach)| {
                    joinings.map(|joining| (seed, most, reach, joining))
                })
        {
            let plain = paper(700, max_neighbours, reach_fraction, seed);
            let network = Generated { joining, ..plain }.network().expect("in range");
            let mut degrees = vec![0; network.nodes.len()];
            for segment in &network.segments {
                let [from, to] = [&segment.from, &segment.to]
                    .map(|id| id.parse::<usize>().expect("an integer id"));
                assert!(from < to, "seed {seed}");
                degrees[from] += 1;
                degrees[to] += 1;
                let [start, end] = [from, to].map(|node| {
                    Point::new(
                        network.nodes[node].position[0],
                        network.nodes[node].position[1],
                    )
                });
                assert!(
                    start.distance_m(end) <= reach_fraction * 10_000.0,
                    "seed {seed}"
                );
            }
            assert!(
                degrees.iter().all(|&degree| degree <= max_neighbours),
                "seed {seed}"
            );
            // A triangulation has six edges at a node on average.
            let is_full = degrees.contains(&max_neighbours);
            assert!(is_full || joining == Joining::Delaunay, "seed {seed}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_network_and_another_another() {
        let one = paper(300, 8, 0.2, 7).network().expect("in range");
        assert_eq!(one, paper(300, 8, 0.2, 7).network().expect("in range"));
        assert_ne!(
            one.nodes,
            paper(300, 8, 0.2, 8).network().expect("in range").nodes
        );
    }

    #[test]
    fn variables_out_of_range_are_refused() {
        let refused =
            |generated: Generated| generated.network().expect_err("out of range").to_string();
        assert_eq!(
            refused(paper(0, 5, 0.1, 1)),
            "nodes is 0; give 1 to 10000000"
        );
        assert_eq!(
            refused(paper(9, 0, 0.1, 1)),
            "max_neighbours is 0; give 1 to 100"
        );
        assert_eq!(
            refused(paper(9, 5, f64::NAN, 1)),
            "reach_fraction is NaN; give a finite number above 0, such as 0.1"
        );
        let endless = Generated {
            map_size_m: f64::INFINITY,
            ..paper(9, 5, 0.1, 1)
        };
        assert_eq!(
            refused(endless),
            "map_size_m is inf; give a number above 0 and up to 1000000000"
        );
    }
}
