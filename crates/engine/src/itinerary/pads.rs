//! Which pads are free when: per node the step function `T(t)`, until when a drone that lands at `t` may stay.

use super::grouped::Grouped;
use crate::airspace::Bits;
use crate::flight::Situation;
use crate::network::{NodeIx, Topology};
use crate::planted::{self, Bug};

/// A stretch of `T`: landing from here on, a drone may stay until then.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    from_s: f64,
    /// Minus infinity where no pad is free.
    until_s: f64,
    /// True where `T` is higher than just before.
    rises: bool,
}

/// A pad that is taken.
#[derive(Clone, Copy, Debug)]
struct Taken {
    /// `None` for all pads of the node.
    pad: Option<u16>,
    /// Which closure of the situation took them, counted from 0.
    closure: Option<u32>,
    from_s: f64,
    until_s: f64,
}

impl Taken {
    fn is_on(&self, pad: u16) -> bool {
        self.pad.is_none_or(|taken| taken == pad)
    }
}

/// The pads of a network, by when they are free.
#[derive(Clone, Debug)]
pub struct PadTimes {
    pads: Vec<u16>,
    swaps: Bits,
    has_swaps: bool,
    taken: Grouped<Taken>,
    stretches: Grouped<Stretch>,
}

impl PadTimes {
    /// Compiles reservations and closed pads of a situation.
    pub fn of(topology: &Topology, situation: &Situation) -> Self {
        let mut taken = Vec::new();
        let reservations = situation.reservations.iter();
        for reservation in reservations.filter(|_| !planted::is(Bug::PadTwice)) {
            let stay = Taken {
                pad: Some(reservation.pad),
                closure: None,
                from_s: reservation.from_s,
                until_s: reservation.until_s,
            };
            taken.push((reservation.node.0, stay));
        }
        for (number, closure) in situation.closures.iter().enumerate() {
            let closed = Taken {
                pad: None,
                closure: Some(number as u32),
                from_s: closure.from_s,
                until_s: closure.until_s,
            };
            taken.extend(closure.pads.iter().map(|node| (node.0, closed)));
        }
        let pads: Vec<u16> = topology.nodes().map(|node| topology.pads(node)).collect();
        let taken = Grouped::of(topology.node_count(), taken);
        let mut stretches = Vec::new();
        for node in taken.indices() {
            let of_node = stretches_of(pads[node as usize], taken.of_index(node));
            stretches.extend(of_node.into_iter().map(|stretch| (node, stretch)));
        }
        let mut swaps = Bits::empty(topology.node_count());
        for node in &situation.swap_stations {
            swaps.insert(node.0);
        }
        Self {
            pads,
            swaps,
            has_swaps: !situation.swap_stations.is_empty(),
            stretches: Grouped::of(topology.node_count(), stretches),
            taken,
        }
    }

    /// True when a node has pads.
    #[inline]
    pub fn is_station(&self, node: NodeIx) -> bool {
        self.pads[node.at()] > 0
    }

    /// True when a node swaps batteries instead of charging them.
    #[inline]
    pub fn swaps(&self, node: NodeIx) -> bool {
        self.swaps.contains(node.0)
    }

    /// True when any node swaps batteries.
    pub(super) fn has_swaps(&self) -> bool {
        self.has_swaps
    }

    /// `T(t)`: until when a drone that lands at `t_s` may stay; minus infinity where no pad is free.
    pub fn stay_until_s(&self, node: NodeIx, t_s: f64) -> f64 {
        if !self.is_station(node) {
            return f64::NEG_INFINITY;
        }
        let stretches = self.stretches.of_index(node.0);
        let begun = stretches.partition_point(|stretch| stretch.from_s <= t_s);
        match begun.checked_sub(1) {
            Some(place) => stretches[place].until_s,
            None => f64::INFINITY,
        }
    }

    /// The instants at which `T` rises, rising, each with its value from then on.
    pub(super) fn rises(&self, node: NodeIx) -> impl Iterator<Item = (f64, f64)> + '_ {
        let stretches = self.stretches.of_index(node.0).iter();
        stretches
            .filter(|stretch| stretch.rises)
            .map(|stretch| (stretch.from_s, stretch.until_s))
    }

    /// True when `T` of a node rises after one instant and not after another one.
    pub(super) fn rises_within(&self, node: NodeIx, after_s: f64, until_s: f64) -> bool {
        self.rises(node)
            .any(|(at_s, _)| after_s < at_s && at_s <= until_s)
    }

    /// The nodes at which `T` is not always infinite.
    pub(super) fn nodes_with_stays(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.stretches.indices().map(NodeIx)
    }

    /// The closures that take all pads of a node some time between two instants.
    pub(super) fn closures(
        &self,
        node: NodeIx,
        from_s: f64,
        until_s: f64,
    ) -> impl Iterator<Item = usize> + '_ {
        let taken = self.taken.of_index(node.0).iter();
        taken
            .filter(move |stay| stay.from_s < until_s && stay.until_s > from_s)
            .filter_map(|stay| stay.closure.map(|closure| closure as usize))
    }

    /// The first pad of a node that is free from one instant to another.
    pub fn free_pad(&self, node: NodeIx, from_s: f64, until_s: f64) -> Option<u16> {
        // What a search takes from `T` may be off by rounding.
        let slack_s = super::request::TIME_TOLERANCE_S;
        let taken = self.taken.of_index(node.0);
        let overlaps =
            |stay: &Taken| stay.from_s < until_s - slack_s && stay.until_s > from_s + slack_s;
        (0..self.pads[node.at()])
            .find(|&pad| !taken.iter().any(|stay| stay.is_on(pad) && overlaps(stay)))
    }
}

/// `T` of a node that has `pads` pads, from the times at which they are taken.
fn stretches_of(pads: u16, taken: &[Taken]) -> Vec<Stretch> {
    let mut gaps: Vec<(f64, f64)> = Vec::new();
    for pad in 0..pads {
        let mut stays: Vec<&Taken> = taken.iter().filter(|stay| stay.is_on(pad)).collect();
        stays.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
        let mut free_from_s = f64::NEG_INFINITY;
        for stay in stays {
            if stay.from_s > free_from_s {
                gaps.push((free_from_s, stay.from_s));
            }
            free_from_s = free_from_s.max(stay.until_s);
        }
        if free_from_s < f64::INFINITY {
            gaps.push((free_from_s, f64::INFINITY));
        }
    }
    let mut instants_s: Vec<f64> = vec![f64::NEG_INFINITY];
    instants_s.extend(gaps.iter().flat_map(|&(from_s, until_s)| [from_s, until_s]));
    instants_s.retain(|instant_s| *instant_s < f64::INFINITY);
    instants_s.sort_by(f64::total_cmp);
    instants_s.dedup();
    let mut stretches: Vec<Stretch> = Vec::new();
    for from_s in instants_s {
        let free = gaps.iter().filter(|gap| gap.0 <= from_s && from_s < gap.1);
        let until_s = free.map(|gap| gap.1).fold(f64::NEG_INFINITY, f64::max);
        let before_s = stretches.last().map(|stretch| stretch.until_s);
        if before_s != Some(until_s) {
            stretches.push(Stretch {
                from_s,
                until_s,
                rises: before_s.is_some_and(|before_s| before_s < until_s),
            });
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stay(pad: u16, from_s: f64, until_s: f64) -> Taken {
        Taken {
            pad: Some(pad),
            closure: None,
            from_s,
            until_s,
        }
    }

    #[test]
    fn two_pads_give_the_later_end_of_their_gaps() {
        let taken = [stay(0, 100.0, 200.0), stay(1, 150.0, 300.0)];
        let steps: Vec<(f64, f64, bool)> = stretches_of(2, &taken)
            .iter()
            .map(|stretch| (stretch.from_s, stretch.until_s, stretch.rises))
            .collect();
        let never = f64::NEG_INFINITY;
        assert_eq!(
            steps,
            [
                (never, 150.0, false),
                (150.0, never, false),
                (200.0, f64::INFINITY, true),
            ]
        );
        let closed = Taken {
            pad: None,
            closure: Some(0),
            from_s: 0.0,
            until_s: f64::INFINITY,
        };
        assert_eq!(stretches_of(1, &[closed]).len(), 2);
        assert_eq!(
            stretches_of(0, &taken),
            [Stretch {
                from_s: never,
                until_s: never,
                rises: false
            }]
        );
    }
}
