//! What is known of a drone beside its report, and what a report may close.

use crate::geo::Point;
use crate::network::{NodeIx, SegmentIx};
use jiff::Timestamp;

/// What is known of a drone beside its report.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// The plan it flies, or that its report names.
    pub plan: Option<KnownPlan<'a>>,
    /// Where its telemetry last saw it, in metres of the plane.
    pub position: Option<Point>,
    /// How long ago that was, in seconds.
    pub position_age_s: f64,
    /// How fast it was seen to fly just now, in metres per second.
    pub ground_speed_mps: Option<f64>,
    /// The airspeed of its airframe or its plan, in metres per second.
    pub airspeed_mps: Option<f64>,
    /// Whether it was in the air at that position just now, as its telemetry says.
    pub airborne: Option<bool>,
    /// True where it stands by its plan: that has not departed, or a stay on a pad covers now.
    pub is_grounded: bool,
    /// Where the drone is taken to be if its report says nothing of that.
    pub unplaced: Unplaced,
    /// The time, against which the report's is held; `None` believes any time.
    pub now: Option<Timestamp>,
}

/// Where a drone is taken to be whose report names a leg and no place, where telemetry says nothing either.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Unplaced {
    /// The start of the leg: so it is on the command line and in the paper.
    #[default]
    AtStart,
    /// Unknown: so it is over the wire.
    Anywhere,
}

impl Known<'_> {
    /// Nothing is known.
    pub fn nothing() -> Self {
        Self::default()
    }
}

/// A known plan. Its nodes are those of the topology that the report is settled on.
#[derive(Clone, Copy, Debug)]
pub struct KnownPlan<'a> {
    /// The whole path, flown legs included.
    pub nodes: &'a [NodeIx],
    /// Which leg the drone is on by telemetry or time, counted from 0.
    pub leg: Option<usize>,
    /// The leg that it is on before all of these, as it flew that before: its first stretch runs there.
    pub before: Option<(NodeIx, NodeIx)>,
    /// False where the report names another one: the number of a leg that it states is then none of these legs.
    pub is_meant: bool,
}

impl KnownPlan<'_> {
    /// The nodes of a leg.
    pub(crate) fn at(&self, leg: usize) -> Option<(NodeIx, NodeIx)> {
        let to = self.nodes.get(leg.checked_add(1)?)?;
        Some((self.nodes[leg], *to))
    }
}

/// A thing that a line of a requests file closes beforehand, as an operator would.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloseTarget {
    /// A node.
    Node(NodeIx),
    /// A segment.
    Segment(SegmentIx),
}
