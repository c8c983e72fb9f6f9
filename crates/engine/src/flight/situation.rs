//! What stands in the way of a flight, in time: closures, reserved pads and other plans. Plain facts, in seconds
//! of one clock; a search compiles them, a checker reads them as they are.

use crate::network::{NodeIx, SegmentIx};

/// Segments, nodes and pads that are closed for a time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedClosure {
    /// From when; minus infinity where it has no beginning.
    pub from_s: f64,
    /// Until when; infinity where it has no end.
    pub until_s: f64,
    /// Segments that may not be flown.
    pub segments: Vec<SegmentIx>,
    /// Nodes that may not be passed, landed at or left.
    pub nodes: Vec<NodeIx>,
    /// Nodes whose pads may not be used, though they can be overflown.
    pub pads: Vec<NodeIx>,
    /// True where both ends are widened by the margins of [`FlightRules`](super::FlightRules).
    pub widened: bool,
}

/// A pad that another plan has reserved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reservation {
    /// The node.
    pub node: NodeIx,
    /// The pad, counted from 0.
    pub pad: u16,
    /// From when.
    pub from_s: f64,
    /// Until when; another drone may land then.
    pub until_s: f64,
}

/// Another plan on a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrafficLeg {
    /// The segment.
    pub segment: SegmentIx,
    /// The node it is entered from.
    pub from: NodeIx,
    /// When it is entered.
    pub enters_s: f64,
    /// When it is left.
    pub leaves_s: f64,
}

/// Everything in the way, and what nodes offer beside recharging pads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Situation {
    /// Zones, closures from reports, closures of operators.
    pub closures: Vec<TimedClosure>,
    /// Reserved pads.
    pub reservations: Vec<Reservation>,
    /// Legs of other plans.
    pub traffic: Vec<TrafficLeg>,
    /// Nodes that swap batteries on their pads instead of charging them.
    pub swap_stations: Vec<NodeIx>,
}
