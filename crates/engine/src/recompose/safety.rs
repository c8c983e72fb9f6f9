//! What an answer says of the safety of its way: flags, the least bad way where none is safe, and what is near.

use crate::flight::{Reentry, StretchKind};
use crate::geo::Point;
use crate::network::{NodeIx, Topology};

/// A property of the way told that holds and that the drone, and the checker of the way, should know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flag {
    /// The first stretch begins inside an active zone and leads out of it.
    LeavingZone,
    /// What is closed lies nearer than the drone needs to turn: it flies on into it before it does.
    CannotStop,
    /// The first stretch is a straight line off the network: obstacles there are unknown.
    Unverified,
    /// The plan draws on the reserve of the battery.
    ReserveUsed,
    /// The pad at the end of the way is taken.
    PadOccupied,
    /// Other plans are too near to every way: this one does not keep apart from them.
    Unseparated,
}

impl Flag {
    /// All flags, in the order in which answers tell them.
    pub const ALL: [Self; 6] = [
        Self::LeavingZone,
        Self::CannotStop,
        Self::Unverified,
        Self::ReserveUsed,
        Self::PadOccupied,
        Self::Unseparated,
    ];

    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LeavingZone => "leaving_zone",
            Self::CannotStop => "cannot_stop",
            Self::Unverified => "unverified",
            Self::ReserveUsed => "reserve_used",
            Self::PadOccupied => "pad_occupied",
            Self::Unseparated => "unseparated",
        }
    }
}

/// Why a way is not told as the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnsafeCode {
    /// Causes lie before and behind the drone.
    BetweenCauses,
    /// Both ends of the leg may not be entered.
    EndsClosed,
    /// The drone is off its leg, and every straight line to a near node crosses an active zone.
    Unverified,
    /// The drone's place is unknown, and something lies on its leg.
    PlaceUnknown,
    /// No open node with a free pad can be reached from there.
    NoAlternate,
    /// The battery would fall below the reserve or the floor.
    BelowReserve,
    /// No answer passed the checker; this is the nearer end of the leg.
    Checker,
}

impl UnsafeCode {
    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::BetweenCauses => "between_causes",
            Self::EndsClosed => "ends_closed",
            Self::Unverified => "unverified",
            Self::PlaceUnknown => "place_unknown",
            Self::NoAlternate => "no_alternate",
            Self::BelowReserve => "below_reserve",
            Self::Checker => "checker",
        }
    }

    /// In words.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::BetweenCauses => {
                "something lies before and behind the drone; this is the nearest place on its leg outside all of it"
            }
            Self::EndsClosed => {
                "neither end of the leg may be entered; this is the nearest place on it outside every zone and cause"
            }
            Self::Unverified => {
                "the drone is off its leg, and every straight line to a near node crosses an active zone"
            }
            Self::PlaceUnknown => {
                "the drone's place on its leg is unknown, and something lies on it: the way back may lead through that"
            }
            Self::NoAlternate => "from there no open node with a free pad can be reached",
            Self::BelowReserve => "the battery does not last for it",
            Self::Checker => "no answer passed the checker; this is the nearer end of the leg",
        }
    }
}

/// The least bad way of a drone that has no safe one; it is never a path.
#[derive(Clone, Debug, PartialEq)]
pub struct UnsafeWay {
    /// Why it is not safe.
    pub code: UnsafeCode,
    /// The nodes that it comes to; none where it ends on a leg.
    pub nodes: Vec<NodeIx>,
    /// The line flown, from where the drone is.
    pub line: Vec<Point>,
    /// Its length in metres.
    pub length_m: f64,
    /// Battery at its end as a fraction, with the flight model; it may be below 0.
    pub battery: Option<f64>,
}

impl UnsafeWay {
    /// Back into the network, from where no alternate can be reached.
    pub(crate) fn along(topology: &Topology, way: &Reentry) -> Self {
        let mut line = vec![way.stretch.begin];
        if way.stretch.kind != StretchKind::None {
            line.push(topology.position(way.node));
        }
        Self {
            code: UnsafeCode::NoAlternate,
            nodes: vec![way.node],
            line,
            length_m: way.stretch.length_m,
            battery: None,
        }
    }
}

/// Why a near node is not told as the end of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhyNot {
    /// It is closed.
    Closed,
    /// What keeps the drone on its leg lies before it.
    CutOff,
    /// It has no pads that are open.
    NoPads,
    /// All of its pads are taken when the drone could land.
    PadsTaken,
    /// The battery at it would be below the reserve.
    BelowReserve,
    /// The battery at it would be below the floor.
    BelowFloor,
    /// This drone cannot fly there in this wind.
    Unflyable,
}

impl WhyNot {
    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::CutOff => "cut_off",
            Self::NoPads => "no_pads",
            Self::PadsTaken => "pads_taken",
            Self::BelowReserve => "below_reserve",
            Self::BelowFloor => "below_floor",
            Self::Unflyable => "unflyable",
        }
    }
}

/// A node near a drone that has no way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// The node.
    pub node: NodeIx,
    /// How far it is in metres: over the network, or straight where that has no way.
    pub length_m: f64,
    /// How many pads it has.
    pub pads: u16,
    /// Battery there as a fraction, with the flight model.
    pub battery: Option<f64>,
    /// Why it is not the end of the path.
    pub why_not: WhyNot,
}
