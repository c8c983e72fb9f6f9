//! The oracle's network and the world of one request: plain vectors, and sets of what is closed.

use std::cmp::Ordering;
use std::collections::BTreeSet;

/// Tolerance of every "inside", metres.
pub(super) const E_M: f64 = 1e-6;

/// A landing site.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OracleNode {
    pub(crate) id: String,
    /// Metres.
    pub(crate) x: f64,
    /// Metres.
    pub(crate) y: f64,
    /// Recharging pads, 0 for none.
    pub(crate) pads: u32,
}

/// An undirected corridor between the nodes at two indices.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OracleSegment {
    pub(crate) a: usize,
    pub(crate) b: usize,
    /// The stated length, or the straight line where none is stated; metres.
    pub(crate) length_m: f64,
}

/// A skyway network.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OracleNetwork {
    pub(crate) nodes: Vec<OracleNode>,
    pub(crate) segments: Vec<OracleSegment>,
    /// Per node its place in the node order.
    pub(crate) rank: Vec<usize>,
}

impl OracleNetwork {
    /// Ranks the nodes: by number when every id is an integer, else by the bytes of the ids.
    pub(crate) fn new(nodes: Vec<OracleNode>, segments: Vec<OracleSegment>) -> Self {
        let all_integers = nodes.iter().all(|node| integer(&node.id).is_some());
        let precedes = |one: &OracleNode, other: &OracleNode| -> Ordering {
            let by_bytes = one.id.as_bytes().cmp(other.id.as_bytes());
            if all_integers {
                integer(&one.id).cmp(&integer(&other.id)).then(by_bytes)
            } else {
                by_bytes
            }
        };
        let rank = nodes
            .iter()
            .map(|node| {
                nodes
                    .iter()
                    .filter(|other| precedes(other, node) == Ordering::Less)
                    .count()
            })
            .collect();
        OracleNetwork {
            nodes,
            segments,
            rank,
        }
    }

    /// The straight line between two nodes, metres.
    pub(crate) fn straight_m(&self, a: usize, b: usize) -> f64 {
        let dx = self.nodes[a].x - self.nodes[b].x;
        let dy = self.nodes[a].y - self.nodes[b].y;
        (dx * dx + dy * dy).sqrt()
    }

    /// The smallest and the largest coordinates: `(min_x, min_y, max_x, max_y)`.
    pub(crate) fn bounding_box(&self) -> (f64, f64, f64, f64) {
        let mut bounds = (
            f64::INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
        );
        for node in &self.nodes {
            bounds.0 = bounds.0.min(node.x);
            bounds.1 = bounds.1.min(node.y);
            bounds.2 = bounds.2.max(node.x);
            bounds.3 = bounds.3.max(node.y);
        }
        bounds
    }

    /// The network size: the longer side of the bounding box of all nodes, closed or not.
    pub(crate) fn size_m(&self) -> f64 {
        let (min_x, min_y, max_x, max_y) = self.bounding_box();
        (max_x - min_x).max(max_y - min_y)
    }

    /// The segments between two nodes, in either direction.
    pub(crate) fn segments_between(&self, a: usize, b: usize) -> Vec<usize> {
        (0..self.segments.len())
            .filter(|&index| {
                let segment = &self.segments[index];
                (segment.a, segment.b) == (a, b) || (segment.a, segment.b) == (b, a)
            })
            .collect()
    }

    /// The other ends of the segments at a node, with the segments.
    pub(super) fn neighbours(&self, node: usize) -> Vec<(usize, usize)> {
        let mut found = Vec::new();
        for (index, segment) in self.segments.iter().enumerate() {
            if segment.a == node {
                found.push((segment.b, index));
            }
            if segment.b == node {
                found.push((segment.a, index));
            }
        }
        found
    }
}

/// An id that is an integer: digits, after a minus sign at most.
fn integer(id: &str) -> Option<i128> {
    let digits = id.strip_prefix('-').unwrap_or(id);
    let is_integer = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    if is_integer { id.parse().ok() } else { None }
}

/// A network and what is closed on it for one request, zones already resolved by the caller.
#[derive(Clone, Debug)]
pub(crate) struct World<'a> {
    pub(crate) network: &'a OracleNetwork,
    pub(crate) closed_nodes: BTreeSet<usize>,
    pub(crate) closed_segments: BTreeSet<usize>,
}

impl<'a> World<'a> {
    /// A world in which nothing is closed.
    pub(crate) fn open(network: &'a OracleNetwork) -> Self {
        World {
            network,
            closed_nodes: BTreeSet::new(),
            closed_segments: BTreeSet::new(),
        }
    }

    pub(crate) fn node_is_open(&self, node: usize) -> bool {
        !self.closed_nodes.contains(&node)
    }

    /// Whether a drone that starts at `start` may use the segment: not closed, both ends open,
    /// where a closed start counts as open because it can be left.
    pub(crate) fn segment_is_open(&self, segment: usize, start: usize) -> bool {
        let OracleSegment { a, b, .. } = self.network.segments[segment];
        let usable = |node: usize| node == start || self.node_is_open(node);
        !self.closed_segments.contains(&segment) && usable(a) && usable(b)
    }

    /// The `N` nodes that count: the open ones, and `a` and `b` closed or not.
    pub(crate) fn counted_nodes(&self, a: usize, b: usize) -> BTreeSet<usize> {
        (0..self.network.nodes.len())
            .filter(|&node| node == a || node == b || self.node_is_open(node))
            .collect()
    }

    /// How many segments are open with both ends in the area, those of a closed start included.
    pub(crate) fn count_area_segments(&self, area: &BTreeSet<usize>, start: usize) -> usize {
        (0..self.network.segments.len())
            .filter(|&index| {
                let segment = &self.network.segments[index];
                area.contains(&segment.a)
                    && area.contains(&segment.b)
                    && self.segment_is_open(index, start)
            })
            .count()
    }

    /// The length of a path by its shortest open segments, its first node closed or not; `None`
    /// when it runs through something closed or along no segment, metres.
    pub(crate) fn path_length_m(&self, path: &[usize]) -> Option<f64> {
        let mut length_m = 0.0;
        for (index, pair) in path.windows(2).enumerate() {
            let arrives_open = self.node_is_open(pair[1]);
            let leaves_open = index == 0 || self.node_is_open(pair[0]);
            if !arrives_open || !leaves_open {
                return None;
            }
            let lengths = self.network.segments_between(pair[0], pair[1]).into_iter();
            let open = lengths.filter(|segment| !self.closed_segments.contains(segment));
            length_m += open
                .map(|segment| self.network.segments[segment].length_m)
                .min_by(f64::total_cmp)?;
        }
        Some(length_m)
    }
}
