//! A plan with times and battery: what a search finds and a checker checks.

use super::first_stretch::{FirstStretch, Reentry};
use crate::network::{NodeIx, SegmentIx};
use serde::{Deserialize, Serialize};

/// Where a plan may begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightStart {
    /// The node.
    pub node: NodeIx,
    /// When the drone is there, in seconds.
    pub at_s: f64,
    /// Battery then, as a fraction.
    pub battery: f64,
    /// True for a drone that stands at the node: it takes off, and may wait and charge on a pad that is free.
    /// False for one that comes flying.
    pub on_ground: bool,
    /// The pad that it stands on, counted from 0, where that is known: it waits there, as long as no other drone has that pad.
    pub pad: Option<u16>,
    /// Metres flown before; they count.
    pub flown_m: f64,
    /// Energy drawn before; it counts.
    pub drawn: f64,
    /// How the drone comes there, where it was under way; the metres, the time and the energy are in the figures above.
    pub stretch: Option<FirstStretch>,
}

impl FlightStart {
    /// The way back into the network that it ends, of a drone that was under way.
    pub fn reentry(&self) -> Option<Reentry> {
        let stretch = self.stretch?;
        Some(Reentry {
            node: self.node,
            stretch,
        })
    }
}

/// A leg as it is to be flown. Times are those at the crossing altitudes of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlownLeg {
    /// The node it starts from.
    pub from: NodeIx,
    /// The node it ends at.
    pub to: NodeIx,
    /// Its segment.
    pub segment: SegmentIx,
    /// When it is entered.
    pub enters_s: f64,
    /// When it is left.
    pub leaves_s: f64,
    /// Battery when it is entered, as a fraction.
    pub battery_before: f64,
    /// Battery when it is left.
    pub battery_after: f64,
}

/// What a drone does on a pad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopKind {
    /// It stands there when the plan begins: it charges and waits without having landed.
    Start,
    /// It lands, charges and waits.
    Charge,
    /// It lands, gets another battery and waits.
    Swap,
}

/// A stay on a pad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// What for.
    pub kind: StopKind,
    /// The leg that follows, counted from 0.
    pub before_leg: usize,
    /// The node.
    pub node: NodeIx,
    /// The pad, counted from 0.
    pub pad: u16,
    /// From when the pad is taken: landing, or the plan's beginning.
    pub lands_s: f64,
    /// Until when: take-off.
    pub takes_off_s: f64,
    /// Battery at landing, as a fraction.
    pub battery_before: f64,
    /// Battery at take-off.
    pub battery_after: f64,
    /// How long the delivery is served here at least, in seconds: a pickup, a drop or a visit. `None` where the drone stops for
    /// its battery or to wait.
    pub service_s: Option<f64>,
}

/// A place where a delivery stops on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServiceStop {
    /// The node.
    pub node: NodeIx,
    /// For how long at least, in seconds.
    pub service_s: f64,
}

/// A plan from a start to a destination.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightPlan {
    /// Where it begins: one of the starts of its request, whole, so that its figures cannot be those of another one.
    pub start: FlightStart,
    /// The legs in their order; none where the drone is there already.
    pub legs: Vec<FlownLeg>,
    /// The stays on pads in their order.
    pub stops: Vec<Stop>,
    /// When it has landed at the destination.
    pub arrives_s: f64,
    /// Battery then, as a fraction.
    pub battery_at_arrival: f64,
    /// Metres flown, those before the start included.
    pub distance_m: f64,
    /// Energy drawn, as a multiple of a full battery, that before the start included.
    pub energy: f64,
}
