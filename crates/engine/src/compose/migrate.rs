//! A composition on another network: what of its way is flown there as it was.

use super::composition::{Alternate, Composition, Contingency, Leg, leg_time_s};
use crate::geo::total_m;
use crate::network::{Correspondence, NodeIx, Topology};
use crate::routing::Path;
use std::ops::Range;

/// What is left of a composition on another network.
#[derive(Clone, Debug, PartialEq)]
pub struct Migrated {
    /// The legs that are left.
    pub composition: Composition,
    /// Whether their contingencies can all be flown still.
    pub contingencies_hold: bool,
}

/// Two networks, and what they have in common.
#[derive(Clone, Copy, Debug)]
pub struct Change<'a> {
    /// The network that compositions are on.
    pub from: &'a Topology,
    /// The network that they are carried over to.
    pub to: &'a Topology,
    /// What of the first is what of the second.
    pub correspondence: &'a Correspondence,
}

impl Composition {
    /// The longest run of legs around `leg` that are flown on the other network as they were; empty where that leg
    /// itself is not.
    pub fn legs_left(&self, correspondence: &Correspondence, leg: usize) -> Range<usize> {
        let is_left = |leg: &Leg| correspondence.unchanged(leg.segment).is_some();
        let (Some(before), Some(after)) = (self.legs.get(..leg), self.legs.get(leg..)) else {
            return leg..leg;
        };
        let ahead = after.iter().take_while(|leg| is_left(leg)).count();
        if ahead == 0 {
            return leg..leg;
        }
        let behind = before.iter().rev().take_while(|leg| is_left(leg)).count();
        leg - behind..leg + ahead
    }

    /// These legs on the other network, at the same times as far as their lengths are the same.
    ///
    /// `first_stretch_m` is flown before its first leg. `None` when one of the legs, or a way without legs, is not
    /// there any more.
    pub fn carried_over(
        &self,
        change: &Change<'_>,
        legs: Range<usize>,
        first_stretch_m: f64,
        airspeed_mps: f64,
    ) -> Option<Migrated> {
        let nodes = self.way.nodes.get(legs.start..=legs.end)?;
        let node = |&node: &NodeIx| change.correspondence.node(node);
        let nodes: Option<Vec<NodeIx>> = nodes.iter().map(node).collect();
        let mut contingencies_hold = true;
        let first = self.legs.get(legs.start);
        let mut time_s = first.map_or(self.flight_time_s, |leg| leg.departure_s);
        let mut carried = Vec::with_capacity(legs.len());
        for leg in self.legs.get(legs.clone())? {
            let segment = change.correspondence.unchanged(leg.segment)?;
            let departure_s = time_s;
            time_s += leg_time_s(change.to, segment, airspeed_mps);
            let if_closed = leg.if_closed.as_ref();
            let if_closed = if_closed.and_then(|detour| contingency(detour, change));
            let safe = leg.safe.as_ref().map(|safe| alternate(safe, change));
            contingencies_hold &= if_closed.is_some() && safe != Some(None);
            carried.push(Leg {
                from: change.correspondence.node(leg.from)?,
                to: change.correspondence.node(leg.to)?,
                segment,
                length_m: change.to.segment(segment).length_m,
                departure_s,
                arrival_s: time_s,
                if_closed,
                safe: safe.flatten(),
            });
        }
        let segments = carried.iter().map(|leg| leg.segment).collect();
        let flown_m = total_m(carried.iter().map(|leg| leg.length_m));
        let stretch_m = match legs.start {
            0 => first_stretch_m,
            _ => 0.0,
        };
        Some(Migrated {
            composition: Composition {
                way: Path {
                    nodes: nodes?,
                    segments,
                },
                length_m: stretch_m + flown_m,
                flight_time_s: time_s,
                legs: carried,
            },
            contingencies_hold,
        })
    }
}

/// A contingency on the other network; `None` when it cannot be flown there.
fn contingency(old: &Contingency, change: &Change<'_>) -> Option<Contingency> {
    Some(Contingency {
        nodes: path(&old.nodes, change)?,
        rejoins: match old.rejoins {
            Some(node) => Some(change.correspondence.node(node)?),
            None => None,
        },
        ..old.clone()
    })
}

fn alternate(old: &Alternate, change: &Change<'_>) -> Option<Alternate> {
    let node = change.correspondence.node(old.node)?;
    let still_has_pads = change.to.pads(node) > 0;
    Some(Alternate {
        node: still_has_pads.then_some(node)?,
        nodes: path(&old.nodes, change)?,
        length_m: old.length_m,
    })
}

/// A path by its nodes, each step flown as it was.
fn path(nodes: &[NodeIx], change: &Change<'_>) -> Option<Vec<NodeIx>> {
    let is_left = |step: &[NodeIx]| {
        let segment = change.from.segment_between(step[0], step[1]);
        segment.is_some_and(|segment| change.correspondence.unchanged(segment).is_some())
    };
    if !nodes.windows(2).all(is_left) {
        return None;
    }
    let node = |&node: &NodeIx| change.correspondence.node(node);
    nodes.iter().map(node).collect()
}
