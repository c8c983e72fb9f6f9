//! From where a drone in flight is to the node where it re-enters the network.
//!
//! A [`Reentry`] is one value from beginning to end: searches are handed it, and answers carry it, so that a node
//! and the stretch that leads to it can never be of two starts.

use super::situation::TrafficLeg;
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx};

/// A drone that has less than this share of a segment left is taken to have this much.
const LEAST_SHARE: f64 = 0.05;

/// A drone within this, in metres, is at a node: places are no more exact.
const AT_NODE_M: f64 = 1e-3;

/// How a first stretch runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StretchKind {
    /// Along the leg that the drone is on.
    Leg,
    /// In a straight line off every leg: obstacles there are unknown.
    Straight,
    /// Nowhere: the drone is at the node.
    None,
}

impl StretchKind {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leg => "leg",
            Self::Straight => "straight",
            Self::None => "none",
        }
    }
}

/// Where on a leg a first stretch begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StretchLeg {
    /// The node behind the drone, as it flew before.
    pub from: NodeIx,
    /// The node ahead of it.
    pub to: NodeIx,
    /// `None` where the network has no such segment.
    pub segment: Option<SegmentIx>,
    /// Where the stretch begins, as a fraction of the way from `from` to `to`.
    pub fraction: f64,
}

/// A first stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstStretch {
    /// How it runs.
    pub kind: StretchKind,
    /// The leg that it begins on; `None` for a straight one.
    pub leg: Option<StretchLeg>,
    /// Metres flown until the node is reached, an overrun there and back included.
    pub length_m: f64,
    /// Metres flown on before the drone can turn.
    pub overrun_m: f64,
    /// Where it begins.
    pub begin: Point,
}

/// A way back into the network: a node, and what it takes to get there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reentry {
    /// The node.
    pub node: NodeIx,
    /// The way to it.
    pub stretch: FirstStretch,
}

impl Reentry {
    /// A drone that is at a node already, at an end of its leg or beside any.
    pub fn at_node(node: NodeIx, place: Point, leg: Option<StretchLeg>) -> Self {
        Self {
            node,
            stretch: FirstStretch {
                kind: StretchKind::None,
                leg,
                length_m: 0.0,
                overrun_m: 0.0,
                begin: place,
            },
        }
    }

    /// Along its leg from a place, over a length in metres that includes an overrun there and back; at the node where it is 0.
    pub fn along(
        node: NodeIx,
        leg: StretchLeg,
        begin: Point,
        (length_m, overrun_m): (f64, f64),
    ) -> Self {
        if length_m <= AT_NODE_M {
            return Self::at_node(node, begin, Some(leg));
        }
        Self {
            node,
            stretch: FirstStretch {
                kind: StretchKind::Leg,
                leg: Some(leg),
                length_m,
                overrun_m,
                begin,
            },
        }
    }

    /// Whether it leads on along its leg, and not back.
    pub fn leads_on(&self) -> bool {
        self.stretch.leg.is_some_and(|leg| leg.to == self.node)
    }

    /// When its segment is flown, from the instants at which the drone begins and at which it is at the node: as if the
    /// whole of it were, so that where the drone is in between follows from the times at the ends. `None` beside
    /// the network.
    pub fn leg(&self, begins_s: f64, leaves_s: f64) -> Option<TrafficLeg> {
        let leg = self
            .stretch
            .leg
            .filter(|_| self.stretch.kind == StretchKind::Leg)?;
        let (from, share) = match self.leads_on() {
            true => (leg.from, 1.0 - leg.fraction),
            false => (leg.to, leg.fraction),
        };
        let whole_s = (leaves_s - begins_s) / share.clamp(LEAST_SHARE, 1.0);
        Some(TrafficLeg {
            segment: leg.segment?,
            from,
            enters_s: leaves_s - whole_s,
            leaves_s,
        })
    }
}
