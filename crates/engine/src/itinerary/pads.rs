//! Which pads are free when: per node the step function `T(t)`, until when a drone that lands at `t` may stay.

use super::closed_windows::ClosedWindows;
use super::occupancy::OthersOccupancy;
use super::pad_stays::{FreeUntil, TakenPad, free_until};
use crate::airspace::Bits;
use crate::flight::Situation;
use crate::network::{NodeIx, Topology};
use crate::planted::{self, Bug};
use std::sync::Arc;

/// The pads of a network, and which of them swap batteries.
#[derive(Debug)]
struct Stations {
    pads: Vec<u16>,
    swaps: Bits,
    has_swaps: bool,
}

/// The pads of a network, by when they are free. Cheap to clone.
#[derive(Clone, Debug)]
pub struct PadTimes {
    stations: Arc<Stations>,
    closed: Arc<ClosedWindows>,
    others: OthersOccupancy,
    /// `T` of the nodes whose stays alone do not tell it, in seconds of the search: closures take their pads, or the drone
    /// itself does. Rising.
    own: Vec<(NodeIx, Vec<FreeUntil>)>,
}

impl PadTimes {
    /// Compiles reservations and closed pads of a situation.
    pub fn of(topology: &Topology, situation: &Situation) -> Self {
        let mut swaps = Bits::empty(topology.node_count());
        for node in &situation.swap_stations {
            swaps.insert(node.0);
        }
        let stations = Stations {
            pads: topology.nodes().map(|node| topology.pads(node)).collect(),
            swaps,
            has_swaps: !situation.swap_stations.is_empty(),
        };
        let others = OthersOccupancy::from_facts(&situation.reservations, &[]);
        let closed = ClosedWindows::of(topology, &situation.closures);
        Self::among_others(Arc::new(stations), Arc::new(closed), others)
    }

    /// The same pads with these closures among what other plans take.
    #[must_use]
    pub(super) fn among(&self, closed: Arc<ClosedWindows>, others: OthersOccupancy) -> Self {
        Self::among_others(self.stations.clone(), closed, others)
    }

    fn among_others(
        stations: Arc<Stations>,
        closed: Arc<ClosedWindows>,
        others: OthersOccupancy,
    ) -> Self {
        let others = match planted::is(Bug::PadTwice) {
            true => OthersOccupancy::default(),
            false => others,
        };
        let mut nodes: Vec<NodeIx> = closed.nodes_with_closed_pads().collect();
        nodes.extend(others.own_nodes());
        nodes.sort_unstable();
        nodes.dedup();
        let own = nodes.into_iter().map(|node| {
            let taken: Vec<TakenPad> = taken_at(&closed, &others, node).collect();
            (node, free_until(stations.pads[node.at()], &taken))
        });
        Self {
            own: own.collect(),
            stations,
            closed,
            others,
        }
    }

    /// `T` of a node by its stretches, and second 0 of the search on their clock; none where no pad is ever taken.
    fn free_until(&self, node: NodeIx) -> (&[FreeUntil], f64) {
        if let Ok(place) = self.own.binary_search_by_key(&node, |&(node, _)| node) {
            return (&self.own[place].1, 0.0);
        }
        let stays = self.others.pad_stays(node);
        let pads = self.stations.pads[node.at()];
        let stretches = stays.map_or(&[][..], |stays| stays.free_until(pads));
        (stretches, self.others.zero_s())
    }

    /// True when a node has pads.
    #[inline]
    pub fn is_station(&self, node: NodeIx) -> bool {
        self.stations.pads[node.at()] > 0
    }

    /// True when a node swaps batteries instead of charging them.
    #[inline]
    pub fn swaps(&self, node: NodeIx) -> bool {
        self.stations.swaps.contains(node.0)
    }

    /// True when any node swaps batteries.
    pub(super) fn has_swaps(&self) -> bool {
        self.stations.has_swaps
    }

    /// `T(t)`: until when a drone that lands at `t_s` may stay; minus infinity where no pad is free.
    pub fn stay_until_s(&self, node: NodeIx, t_s: f64) -> f64 {
        if !self.is_station(node) {
            return f64::NEG_INFINITY;
        }
        let (stretches, zero_s) = self.free_until(node);
        let begun = stretches.partition_point(|stretch| stretch.from_s - zero_s <= t_s);
        match begun.checked_sub(1) {
            Some(place) => stretches[place].until_s - zero_s,
            None => f64::INFINITY,
        }
    }

    /// The instants at which `T` rises, rising, each with its value from then on.
    pub(super) fn rises(&self, node: NodeIx) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (stretches, zero_s) = self.free_until(node);
        let rises = stretches.iter().filter(|stretch| stretch.rises);
        rises.map(move |stretch| (stretch.from_s - zero_s, stretch.until_s - zero_s))
    }

    /// True when `T` of a node rises after one instant and not after another one.
    pub(super) fn rises_within(&self, node: NodeIx, after_s: f64, until_s: f64) -> bool {
        self.rises(node)
            .any(|(at_s, _)| after_s < at_s && at_s <= until_s)
    }

    /// The nodes at which `T` is not always infinite.
    pub(super) fn nodes_with_stays(&self) -> impl Iterator<Item = NodeIx> + '_ {
        let closed = self.closed.nodes_with_closed_pads();
        let closed = closed.filter(|&node| self.others.pad_stays(node).is_none());
        self.others.nodes_with_stays().chain(closed)
    }

    /// The closures that take all pads of a node some time between two instants.
    pub(super) fn closures(
        &self,
        node: NodeIx,
        from_s: f64,
        until_s: f64,
    ) -> impl Iterator<Item = usize> + '_ {
        let closed = self.closed.of_pads(node).iter();
        closed
            .filter(move |window| window.from_s < until_s && window.until_s > from_s)
            .map(|window| window.closure as usize)
    }

    /// The first pad of a node that is free from one instant to another.
    pub fn free_pad(&self, node: NodeIx, from_s: f64, until_s: f64) -> Option<u16> {
        let mut pads = 0..self.stations.pads[node.at()];
        pads.find(|&pad| self.is_free((node, pad), from_s, until_s))
    }

    /// Whether a pad of a node is free from one instant to another.
    pub(super) fn is_free(&self, (node, pad): (NodeIx, u16), from_s: f64, until_s: f64) -> bool {
        // What a search takes from `T` may be off by rounding.
        let slack_s = super::request::TIME_TOLERANCE_S;
        let mut taken = taken_at(&self.closed, &self.others, node);
        let is_taken = taken.any(|stay| {
            let overlaps = stay.from_s < until_s - slack_s && stay.until_s > from_s + slack_s;
            overlaps && stay.pad.is_none_or(|taken| taken == pad)
        });
        pad < self.stations.pads[node.at()] && !is_taken
    }
}

/// What closures and others take of the pads of a node, in seconds of the search.
fn taken_at<'a>(
    closed: &'a ClosedWindows,
    others: &'a OthersOccupancy,
    node: NodeIx,
) -> impl Iterator<Item = TakenPad> + 'a {
    let closed = closed.of_pads(node).iter().map(|window| TakenPad {
        pad: None,
        from_s: window.from_s,
        until_s: window.until_s,
    });
    let stays = others.stays_at(node).map(|stay| TakenPad {
        pad: Some(stay.pad),
        from_s: stay.from_s,
        until_s: stay.until_s,
    });
    closed.chain(stays)
}
