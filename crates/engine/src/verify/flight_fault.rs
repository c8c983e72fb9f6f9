//! Why a plan cannot be flown as it says.

use crate::flight::{Figure, FigureRange};
use std::fmt::{Display, Formatter};
use thiserror::Error;

/// A leg of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct LegAt {
    /// Counted from 0.
    pub leg: usize,
    /// Id of the node it starts from.
    pub from: String,
    /// Id of the node it ends at.
    pub to: String,
    /// When it is entered, in seconds.
    pub enters_s: f64,
}

impl Display for LegAt {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let Self {
            leg,
            from,
            to,
            enters_s,
        } = self;
        write!(
            formatter,
            "leg {leg} from {from} to {to}, entered at {enters_s:.3} s"
        )
    }
}

/// A stay of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct StayAt {
    /// Id of the node.
    pub node: String,
    /// The pad, counted from 0.
    pub pad: u16,
    /// When it begins, in seconds.
    pub lands_s: f64,
}

impl Display for StayAt {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let Self { node, pad, lands_s } = self;
        write!(
            formatter,
            "the stay at {node} on pad {pad} from {lands_s:.3} s"
        )
    }
}

/// The first thing found that does not hold.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FlightFault {
    /// A premise is what no world has.
    #[error("{}, and has to be {range}; ask the maker of the plan for another", Figure::said(path, *value))]
    Premise {
        /// Its place in the document.
        path: String,
        /// What it says.
        value: f64,
        /// What it may be.
        range: FigureRange,
    },
    /// There is no such start.
    #[error(
        "the plan begins at {node}, at {at_s:.3} s with {level:.6} of a battery, where the request has no start"
    )]
    Start {
        /// Id of the node.
        node: String,
        /// When, in seconds.
        at_s: f64,
        /// The battery then, as a fraction.
        level: f64,
    },
    /// A leg does not start where the drone is, or is not its segment.
    #[error("{place}: the drone is at {drone}, or the segment joins other nodes")]
    LegElsewhere {
        /// The leg.
        place: LegAt,
        /// Id of the node where the drone is.
        drone: String,
    },
    /// A stay is not where the drone is.
    #[error("{place}: the drone is at {drone}, or does not stand there")]
    StayElsewhere {
        /// The stay.
        place: StayAt,
        /// Id of the node where the drone is.
        drone: String,
    },
    /// A stay belongs to no leg.
    #[error("a stay is said to be before leg {before_leg}, where none is possible")]
    StayOutOfPlace {
        /// The leg, counted from 0.
        before_leg: usize,
    },
    /// A leg is not entered when the drone gets there.
    #[error("{place}: the drone is there at {drone_s:.3} s")]
    Entry {
        /// The leg.
        place: LegAt,
        /// When the drone is there, in seconds.
        drone_s: f64,
    },
    /// A leg is not left when it would be.
    #[error("{place}: it would be left at {leaves_s:.3} s")]
    Exit {
        /// The leg.
        place: LegAt,
        /// When it would be left, in seconds.
        leaves_s: f64,
    },
    /// The drone lands at another time.
    #[error("{place}: the drone lands at {lands_s:.3} s")]
    Landing {
        /// The stay.
        place: StayAt,
        /// When the drone lands, in seconds.
        lands_s: f64,
    },
    /// Wind or payload forbid a leg.
    #[error("{place}: it cannot be flown in this wind with this payload")]
    Unflyable {
        /// The leg.
        place: LegAt,
    },
    /// The battery on a leg is another.
    #[error("{place}: the plan says {stated:.6} of a battery where {level:.6} are left")]
    LegBattery {
        /// The leg.
        place: LegAt,
        /// What the plan says.
        stated: f64,
        /// What is left.
        level: f64,
    },
    /// The battery on a stay is another.
    #[error("{place}: the plan says {stated:.6} of a battery where there are {level:.6}")]
    StayBattery {
        /// The stay.
        place: StayAt,
        /// What the plan says.
        stated: f64,
        /// What there is.
        level: f64,
    },
    /// The battery falls below the reserve.
    #[error("{place}: {level:.6} of a battery are left at its end, less than {reserve}")]
    BelowReserve {
        /// The leg.
        place: LegAt,
        /// What is left.
        level: f64,
        /// The least allowed.
        reserve: f64,
    },
    /// A leg meets a closure.
    #[error("{place}: it is closed from {from_s:.3} to {until_s:.3} s, margins included")]
    Closed {
        /// The leg.
        place: LegAt,
        /// From when, in seconds.
        from_s: f64,
        /// Until when, in seconds.
        until_s: f64,
    },
    /// A leg comes too near to another plan.
    #[error("{place}: another plan is on it from {other_enters_s:.3} to {other_leaves_s:.3} s")]
    Traffic {
        /// The leg.
        place: LegAt,
        /// When the other plan enters the segment, in seconds.
        other_enters_s: f64,
        /// When it leaves it, in seconds.
        other_leaves_s: f64,
    },
    /// The node has no such pad.
    #[error("{place}: the node has {pads} pads")]
    NoSuchPad {
        /// The stay.
        place: StayAt,
        /// How many there are.
        pads: u16,
    },
    /// The pad is another's, or closed.
    #[error("{place}: the pad is taken from {from_s:.3} to {until_s:.3} s")]
    PadTaken {
        /// The stay.
        place: StayAt,
        /// From when, in seconds.
        from_s: f64,
        /// Until when, in seconds.
        until_s: f64,
    },
    /// A battery is charged where they are swapped, or the other way round.
    #[error("{place}: the node does not offer this kind of stop")]
    WrongKind {
        /// The stay.
        place: StayAt,
    },
    /// A stay leaves no time for what has to be done.
    #[error("{place}: {stay_s:.3} s are less than the {handling_s} s that it takes")]
    StayTooShort {
        /// The stay.
        place: StayAt,
        /// How long it is, in seconds.
        stay_s: f64,
        /// How long it has to be at least, in seconds.
        handling_s: f64,
    },
    /// The plan ends elsewhere.
    #[error("the plan ends at {ends}, not at {destination}")]
    Destination {
        /// Id of the node where it ends.
        ends: String,
        /// Id of the destination.
        destination: String,
    },
    /// The plan is late.
    #[error("the plan lands at {arrives_s:.3} s, after the deadline of {deadline_s:.3} s")]
    Late {
        /// When it lands, in seconds.
        arrives_s: f64,
        /// The deadline, in seconds.
        deadline_s: f64,
    },
    /// A total of the plan is not that of its parts.
    #[error("{field} is {stated}, and {flown} when it is flown")]
    Total {
        /// The field.
        field: &'static str,
        /// What the plan says.
        stated: f64,
        /// What flying it gives.
        flown: f64,
    },
}
