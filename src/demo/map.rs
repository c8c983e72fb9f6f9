//! The network as a pilot sees it: where nodes are, and between which of them deliveries make sense.

use super::client::ClientError;
use crate::geo::{Frame, LocalPlane, Point};
use crate::wire::{CompactNetwork, Id};
use std::collections::BTreeMap;

/// Where nodes are, in metres, and which of them are landed on.
#[derive(Debug)]
pub(super) struct Map {
    frame: Frame,
    ids: Vec<Id<'static>>,
    positions: Vec<Point>,
    index: BTreeMap<Id<'static>, usize>,
    pads: Vec<u16>,
    /// Nodes with pads in the largest connected part, in the order of the network.
    stations: Vec<usize>,
}

impl Map {
    /// The map of a network.
    ///
    /// # Errors
    /// When there are no two connected nodes.
    pub(super) fn of(network: &CompactNetwork<'_>) -> Result<Self, ClientError> {
        let coordinates: Vec<[f64; 2]> = network.coordinates.as_chunks::<2>().0.to_vec();
        let frame = match (network.geographic, coordinates.first()) {
            (true, Some(first)) => Frame::Geographic(LocalPlane::about(first[0], first[1])),
            _ => Frame::Planar,
        };
        let owned = network.ids.iter().map(|id| id.clone().into_owned());
        let ids: Vec<Id<'static>> = owned.take(coordinates.len()).collect();
        let part = largest_part(ids.len(), &network.segments);
        let pads = |node: usize| network.pads.get(node).copied().unwrap_or(0);
        let with_pads: Vec<usize> = part
            .iter()
            .copied()
            .filter(|&node| pads(node) > 0)
            .collect();
        // A network without pads is flown all the same.
        let stations = match with_pads.len() >= 2 {
            true => with_pads,
            false => part,
        };
        if stations.len() < 2 {
            return Err(ClientError::NothingToFly {
                network: network.name.to_string(),
            });
        }
        Ok(Self {
            frame,
            positions: coordinates.iter().map(|&at| frame.to_plane(at)).collect(),
            index: ids.iter().cloned().zip(0..).collect(),
            pads: (0..ids.len()).map(pads).collect(),
            ids,
            stations,
        })
    }

    /// Nodes to fly between: at least two.
    pub(super) fn stations(&self) -> &[usize] {
        &self.stations
    }

    pub(super) fn id(&self, node: usize) -> &Id<'static> {
        &self.ids[node]
    }

    pub(super) fn has_pads(&self, node: usize) -> bool {
        self.pads[node] > 0
    }

    /// The stations with the most pads, where fleets are based.
    pub(super) fn bases(&self) -> Vec<usize> {
        let pads = |node: &usize| self.pads[*node];
        let most = self.stations.iter().map(pads).max().unwrap_or_default();
        let all = self.stations.iter().copied();
        all.filter(|node| pads(node) == most).collect()
    }

    pub(super) fn position(&self, node: usize) -> Point {
        self.positions[node]
    }

    pub(super) fn node(&self, id: &Id<'static>) -> Option<usize> {
        self.index.get(id).copied()
    }

    /// Coordinates as the edge reads and writes them.
    pub(super) fn coordinates(&self, place: Point) -> [f64; 2] {
        self.frame.from_plane(place)
    }
}

/// The nodes of the largest part that hangs together, in ascending order; of equally large ones the first.
fn largest_part(count: usize, segments: &[u32]) -> Vec<usize> {
    let mut neighbours = vec![Vec::new(); count];
    for &[from, to] in segments.as_chunks::<2>().0 {
        let (from, to) = (from as usize, to as usize);
        if from < count && to < count {
            neighbours[from].push(to);
            neighbours[to].push(from);
        }
    }
    let mut is_reached = vec![false; count];
    let mut largest = Vec::new();
    for start in 0..count {
        if is_reached[start] {
            continue;
        }
        is_reached[start] = true;
        let mut part = vec![start];
        let mut next = 0;
        while let Some(&node) = part.get(next) {
            next += 1;
            for &neighbour in &neighbours[node] {
                if !is_reached[neighbour] {
                    is_reached[neighbour] = true;
                    part.push(neighbour);
                }
            }
        }
        if part.len() > largest.len() {
            largest = part;
        }
    }
    largest.sort_unstable();
    largest
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::borrow::Cow;

    /// Two parts: 0-1-2-3 along a line, 100 m each, of which 1 has no pads; and 4-5.
    pub(in crate::demo) fn network() -> CompactNetwork<'static> {
        CompactNetwork {
            name: Cow::Borrowed("line"),
            attribution: Cow::Borrowed(""),
            geographic: false,
            ids: (0..6).map(Id::from).collect(),
            coordinates: vec![
                0.0, 0.0, 100.0, 0.0, 200.0, 0.0, 300.0, 0.0, 0.0, 500.0, 100.0, 500.0,
            ],
            pads: vec![1, 0, 2, 1, 1, 1],
            segments: vec![4, 5, 0, 1, 2, 1, 2, 3],
            segment_ids: Vec::new(),
            topology_revision: 1,
        }
    }

    #[test]
    fn deliveries_go_between_connected_nodes_with_pads() {
        let map = Map::of(&network()).expect("a map");
        assert_eq!(map.stations(), [0, 2, 3]);
        assert_eq!(map.bases(), [2]);
        assert_eq!(map.node(&Id::from(3)), Some(3));
        assert_eq!(map.coordinates(map.position(3)), [300.0, 0.0]);
    }

    #[test]
    fn a_network_with_nothing_to_fly_between_is_refused() {
        let mut network = network();
        network.segments.clear();
        let error = Map::of(&network).expect_err("nothing is connected");
        assert!(error.to_string().contains("line"), "{error}");
    }

    #[test]
    fn a_network_that_makes_no_sense_breaks_nothing() {
        let mut network = network();
        network.segments = vec![0, 99, 1, 2, 7];
        network.pads.clear();
        assert_eq!(Map::of(&network).expect("a map").stations(), [1, 2]);
    }
}
