//! The answer to a failure report.

use super::explanation::{Stage, StageRecord};
use super::request::Strategy;
use super::safety::{Flag, Near, UnsafeWay};
use crate::flight::Reentry;
use crate::network::NodeIx;
use crate::routing::Path;
use serde::{Deserialize, Serialize};

/// What the drone is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Fly the new remaining path.
    Rerouted,
    /// Fly on: nothing ahead is touched.
    Unaffected,
    /// Wait on a pad at the first node until the way opens, then fly the path.
    Hold,
    /// The destination cannot be reached: fly to the alternate at the end of the path.
    Diverted,
    /// Nothing can be reached.
    NoRoute,
}

impl Outcome {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rerouted => "rerouted",
            Self::Unaffected => "unaffected",
            Self::Hold => "hold",
            Self::Diverted => "diverted",
            Self::NoRoute => "no_route",
        }
    }
}

/// Why another strategy answered than the one asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "code")]
pub enum Fallback {
    /// The failure type closes no segment, so there is nothing to reconnect.
    NothingClosed,
    /// The leg has no straight extent, or the network has none: no area can be built on it.
    NoExtent,
    /// The drone is off its leg, so the old plan does not begin where it is.
    OffLeg,
    /// No repair reconnects the old plan.
    RepairFailed,
    /// This drone, with its battery, cannot fly what the strategy finds.
    NotFlyable,
    /// The checker did not let its answer pass.
    Checker,
    /// A parameter makes the strategy impossible.
    Parameter {
        /// What is wrong with it.
        message: String,
    },
}

impl std::fmt::Display for Fallback {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::NothingClosed => "the failure closes no segment",
            Self::NoExtent => "the nodes to reconnect coincide, or the network has no extent",
            Self::OffLeg => "the drone is off its leg",
            Self::RepairFailed => "no repair reconnects the old plan",
            Self::NotFlyable => "this drone cannot fly what the strategy finds",
            Self::Checker => "checker",
            Self::Parameter { message } => message,
        })
    }
}

/// Something the receiver should know beside the path.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// The node at which the path begins is closed; the drone can only leave it.
    StartClosed {
        /// The node.
        node: NodeIx,
    },
    /// The drone is inside an active zone and has to leave it.
    InsideZone,
    /// Causes lie before and behind the drone.
    BetweenCauses,
    /// The drone is off its leg; buildings on the straight line to the first node are unknown.
    Unverified {
        /// Metres off the leg.
        off_leg_m: f64,
    },
    /// The drone is off its leg and every straight line to a near node crosses an active zone.
    Unsafe {
        /// Metres off the leg.
        off_leg_m: f64,
    },
    /// The network has no segment between the ends of the leg reported.
    UnknownSegment,
    /// The path comes to a node twice: repairs keep the old plan between them.
    Loop {
        /// The first node that the path comes to again.
        node: NodeIx,
    },
    /// The drone stands at a node inside an active zone, and waits there until the zones over it end.
    HoldsUntil {
        /// The node.
        node: NodeIx,
        /// When the last of them ends.
        until: jiff::Timestamp,
    },
    /// The same, but their end is unknown.
    HoldsWithoutEnd {
        /// The node.
        node: NodeIx,
    },
    /// The plan ends at a stop of the delivery, as none leads on from there yet.
    EndsAtStop {
        /// The stop.
        node: NodeIx,
    },
    /// No node with pads can be reached, which this outcome would have led to.
    NoAlternate,
    /// Until reservations exist, a node with pads counts as having one free.
    PadAssumedFree {
        /// The node.
        node: NodeIx,
    },
}

/// One attempt to reconnect the old plan over a run of closed legs.
#[derive(Clone, Debug, PartialEq)]
pub struct Repair {
    /// The last open node before the run.
    pub from: NodeIx,
    /// The next open node after it, or a later one where that could not be reached.
    pub to: NodeIx,
    /// Length of the new part in metres; `None` when this attempt found none.
    pub length_m: Option<f64>,
    /// Where the last search looked.
    pub stage: Stage,
    /// Areas examined.
    pub searches: u32,
    /// Nodes of the last area.
    pub area_nodes: usize,
    /// Open segments with both ends in the last area.
    pub area_segments: usize,
    /// Nodes settled by all searches.
    pub settled_nodes: usize,
}

/// A cause that cut the drone off.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severance {
    /// The failed leg itself, or what the report brought.
    Report,
    /// A standing closure, by id.
    Closure(String),
    /// The network has no way, whatever is open.
    Network,
}

/// A recomposition: outcome, path, and everything that tells how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Recomposition {
    /// What the drone is to do.
    pub outcome: Outcome,
    /// The whole remaining path; empty for [`Outcome::NoRoute`].
    pub path: Path,
    /// The new part without the drone's first stretch, in metres: from the leg's start to its end for a
    /// local strategy, the whole new path otherwise; `None` without a path.
    pub recomposed_length_m: Option<f64>,
    /// The whole remaining route, first stretch included, in metres; `None` without a path.
    pub remaining_length_m: Option<f64>,
    /// From where the drone is to the first node of the path, in metres.
    pub first_stretch_m: f64,
    /// The same way with all that is known of it; `None` without a path.
    pub reentry: Option<Reentry>,
    /// What holds of the way told; rising.
    pub flags: Vec<Flag>,
    /// For [`Outcome::NoRoute`]: the least bad way.
    pub unsafe_way: Option<UnsafeWay>,
    /// For [`Outcome::NoRoute`] in flight: what is near, the nearest first.
    pub near: Vec<Near>,
    /// Where it is unknown whether the drone is in the air: the answer to one that is, where it is another.
    pub if_airborne: Option<Box<Recomposition>>,
    /// The strategy asked for.
    pub strategy: Strategy,
    /// The strategy that answered.
    pub strategy_used: Strategy,
    /// Why they differ.
    pub fallback: Option<Fallback>,
    /// Where the last search looked.
    pub stage: Stage,
    /// Areas examined.
    pub searches: u32,
    /// Nodes of the area searched last; of the union where several legs were repaired.
    pub area_nodes: usize,
    /// Open segments with both ends in that area, those from a closed start to open nodes included.
    pub area_segments: usize,
    /// Nodes settled by all searches.
    pub settled_nodes: usize,
    /// Optimum from the leg's start to its end in metres, when asked for and there is a way.
    pub local_optimum_m: Option<f64>,
    /// Optimum from the leg's start to the destination in metres, when asked for and there is a way.
    pub global_optimum_m: Option<f64>,
    /// Optimum from the drone to the destination, first stretch included, in metres, when asked for.
    pub remaining_optimum_m: Option<f64>,
    /// Every attempt to repair the old plan, where there was more than one.
    pub repairs: Vec<Repair>,
    /// What the receiver should know.
    pub warnings: Vec<Warning>,
    /// Where there is no way to the destination: what cut the drone off.
    pub severed_by: Vec<Severance>,
    /// The stages in order, when asked for.
    pub stages: Vec<StageRecord>,
}

impl Recomposition {
    /// An answer with nothing filled in yet.
    pub fn without_path(strategy: Strategy) -> Self {
        Self {
            outcome: Outcome::NoRoute,
            path: Path::default(),
            recomposed_length_m: None,
            remaining_length_m: None,
            first_stretch_m: 0.0,
            reentry: None,
            flags: Vec::new(),
            unsafe_way: None,
            near: Vec::new(),
            if_airborne: None,
            strategy,
            strategy_used: strategy,
            fallback: None,
            stage: Stage::Global,
            searches: 0,
            area_nodes: 0,
            area_segments: 0,
            settled_nodes: 0,
            local_optimum_m: None,
            global_optimum_m: None,
            remaining_optimum_m: None,
            repairs: Vec::new(),
            warnings: Vec::new(),
            severed_by: Vec::new(),
            stages: Vec::new(),
        }
    }
}
