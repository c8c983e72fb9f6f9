//! What an answer says, and what it is held against: plain data, by reference.

use super::timed::ClosedTimes;
use crate::airspace::{Airspace, Hits, Zone};
use crate::flight::{
    Airframe, FlightLegs, FlightPlan, FlightRules, FlightStart, Reservation, ServiceStop,
};
use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx};
use jiff::Timestamp;

/// What the drone is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// To fly a new path to its destination.
    Rerouted,
    /// To fly on.
    Unaffected,
    /// To wait on a pad, then to fly.
    Hold,
    /// To land elsewhere.
    Diverted,
    /// Nothing can be reached.
    NoRoute,
}

/// What an answer says of itself beside its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flag {
    /// The drone is in an active zone and leaves it.
    LeavingZone,
    /// It enters something closed before it can turn.
    CannotStop,
    /// It is unknown what stands on the way to the first node.
    Unverified,
    /// It draws on the reserve of its battery.
    ReserveUsed,
    /// No pad is free where it lands.
    PadOccupied,
    /// It does not keep apart from other plans.
    Unseparated,
}

impl Flag {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::LeavingZone,
        Self::CannotStop,
        Self::Unverified,
        Self::ReserveUsed,
        Self::PadOccupied,
        Self::Unseparated,
    ];

    /// The name on the wire.
    pub fn name(self) -> &'static str {
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

/// A set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(u8);

impl Flags {
    /// Whether a flag is among them.
    pub fn has(self, flag: Flag) -> bool {
        self.0 & (1 << flag as u8) != 0
    }

    /// These with one more.
    #[must_use]
    pub fn with(self, flag: Flag) -> Self {
        Self(self.0 | 1 << flag as u8)
    }
}

impl FromIterator<Flag> for Flags {
    fn from_iter<T: IntoIterator<Item = Flag>>(flags: T) -> Self {
        flags.into_iter().fold(Self::default(), Self::with)
    }
}

/// How the first stretch leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StretchKind {
    /// The drone is at the node already.
    None,
    /// Along the leg that it is on.
    Leg,
    /// Straight, over whatever is there.
    Straight,
}

/// How the drone comes from its place to the first node of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// How it leads.
    pub kind: StretchKind,
    /// The leg that it leads along, from the node behind to the node ahead.
    pub leg: Option<(NodeIx, NodeIx)>,
    /// The node that it leads to.
    pub enters: NodeIx,
    /// Its length, in metres, the overrun counted twice.
    pub length_m: f64,
    /// Metres flown on before the drone can turn.
    pub overrun_m: f64,
}

/// What an answer says.
#[derive(Clone, Copy, Debug)]
pub struct Claim<'a> {
    /// What the drone is to do.
    pub told: Told,
    /// How it comes to the path; `None` without one.
    pub stretch: Option<Stretch>,
    /// The nodes of the path; none for [`Told::NoRoute`].
    pub nodes: &'a [NodeIx],
    /// Its segments, one fewer.
    pub segments: &'a [SegmentIx],
    /// Its length, first stretch included, in metres; `None` without a path.
    pub length_m: Option<f64>,
    /// What the answer says of itself.
    pub flags: Flags,
    /// Whether it also names a way that no drone is to fly.
    pub has_unsafe_way: bool,
    /// Until when it waits before it departs, for [`Told::Hold`] by distance, where it says so.
    pub waits_until: Option<Timestamp>,
    /// How it is flown, where times and battery were computed.
    pub flight: Option<&'a FlightClaim<'a>>,
}

/// What an answer says of times, battery and pads. Seconds are of one clock.
#[derive(Clone, Copy, Debug)]
pub struct FlightClaim<'a> {
    /// Where and when it begins, and with how much battery.
    pub start: FlightStart,
    /// Legs and stays.
    pub plan: &'a FlightPlan,
    /// When the plan began, in seconds.
    pub began_s: f64,
    /// The pad that it lands on, where it diverts and has one.
    pub alternate: Option<Reservation>,
    /// The least battery that it promises at every node, as a fraction.
    pub reserve: f64,
    /// False where it is unknown whether the battery suffices: its levels count from an assumed one then.
    pub is_energy_checked: bool,
}

/// Where the drone is, as far as anybody knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Whereabouts {
    /// At a point of the plane.
    At(Point),
    /// At the node where its leg begins.
    LegStart,
    /// Somewhere on its leg.
    Unknown,
}

/// What has failed of the drone itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Nothing that forbids the way on.
    Nothing,
    /// A free pad: its battery or its payload failed.
    Pad {
        /// Whether a figure in the report itself can show that it is able to fly on.
        shown: bool,
    },
    /// Any node that is not closed: it has to come down.
    Ground,
}

/// The drone that is answered. It is nothing of the answer, and comes from the report, the plan and the telemetry.
#[derive(Clone, Copy, Debug)]
pub struct Drone<'a> {
    /// The leg that it is on, from the node behind to the node ahead.
    pub leg: (NodeIx, NodeIx),
    /// Where it is.
    pub at: Whereabouts,
    /// How far it may have flown since, in metres.
    pub drift_m: f64,
    /// How far it flies before it can turn, in metres.
    pub stopping_m: f64,
    /// The node on whose pad it stands; `None` in the air.
    pub stands_at: Option<NodeIx>,
    /// Where its delivery goes.
    pub destination: NodeIx,
    /// Where it goes from there on, that first, for how long it has to be served there, and its end last; none without stops.
    pub onward: &'a [ServiceStop],
    /// What it was going to fly, its leg first, where that is stated.
    pub planned: Option<&'a [NodeIx]>,
    /// What has failed of it.
    pub need: Need,
    /// When that is, in seconds of the clock of the flight.
    pub at_s: f64,
    /// Its battery then, as a fraction, where it or its telemetry said so.
    pub battery: Option<f64>,
}

/// What the report itself closes, for this drone alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct OwnClosures<'a> {
    /// The failed leg, where its failure closes it.
    pub segment: Option<SegmentIx>,
    /// Whether the failure closes the leg, which the network may not have.
    pub closes_leg: bool,
    /// Where the drone saw the cause.
    pub cause: Option<Point>,
    /// A zone that it brought, with what that closes.
    pub zone: Option<(&'a Zone, &'a Hits)>,
    /// The node whose pads it says are out of use.
    pub pads: Option<NodeIx>,
}

/// The world that an answer is held against: the snapshot that is current, and what the drone itself reported.
#[derive(Clone, Copy, Debug)]
pub struct Sky<'a> {
    /// The snapshot.
    pub airspace: &'a Airspace,
    /// What the report closes.
    pub own: OwnClosures<'a>,
    /// What flights are held against; `None` by distance.
    pub flight: Option<&'a FlightSky<'a>>,
}

/// Whether a pad is taken by somebody else at some time between two instants, in seconds.
type PadTaken<'a> = &'a dyn Fn(NodeIx, u16, f64, f64) -> bool;

/// What times, battery and pads are held against.
#[derive(Clone, Copy)]
pub struct FlightSky<'a> {
    /// What every leg takes, in the wind.
    pub legs: &'a FlightLegs,
    /// What flies.
    pub airframe: &'a Airframe,
    /// Margins and overheads.
    pub rules: &'a FlightRules,
    /// What is closed when.
    pub closed: &'a ClosedTimes,
    /// Whether a node swaps batteries.
    pub swaps: &'a dyn Fn(NodeIx) -> bool,
    /// Whether another drone has a pad.
    pub is_taken: PadTaken<'a>,
    /// For how long a pad has to be free for a drone that lands elsewhere than at its destination, in seconds.
    pub refuge_stay_s: f64,
}

impl std::fmt::Debug for FlightSky<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("FlightSky").finish_non_exhaustive()
    }
}

impl Sky<'_> {
    /// Whether a segment is closed itself.
    pub(super) fn closes_segment(&self, segment: SegmentIx) -> bool {
        let brought = self.own.zone;
        self.airspace.closed().closes_segment(segment)
            || self.own.segment == Some(segment)
            || brought.is_some_and(|(_, hits)| hits.segments.binary_search(&segment).is_ok())
    }

    /// Whether a node is closed.
    pub(super) fn closes_node(&self, node: NodeIx) -> bool {
        let brought = self.own.zone;
        self.airspace.closed().closes_node(node)
            || brought.is_some_and(|(_, hits)| hits.nodes.binary_search(&node).is_ok())
    }

    /// Whether a drone may land on a pad of a node, as far as closures go.
    pub(super) fn has_open_pads(&self, node: NodeIx) -> bool {
        self.has_pads(node) && !self.airspace.closes_pads(node) && !self.closes_node(node)
    }

    /// Whether a node has pads that the drone does not report as failed.
    pub(super) fn has_pads(&self, node: NodeIx) -> bool {
        self.airspace.topology().pads(node) > 0 && self.own.pads != Some(node)
    }
}
