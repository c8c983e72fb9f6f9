//! A failure report, in the network's own terms.

use crate::geo::Point;
use crate::network::NodeIx;
use serde::{Deserialize, Serialize};

/// The failure types of the paper's Definition 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureType {
    /// Adverse weather on the leg.
    Environmental,
    /// An obstacle in the way.
    Navigational,
    /// A no-fly zone or airspace restriction.
    Regulatory,
    /// No recharging pad at the node ahead.
    Infrastructure,
    /// Battery or payload limits of this drone.
    Operational,
    /// Early, late or off the plan.
    ServiceLevel,
}

impl FailureType {
    /// All types, in the paper's order.
    pub const ALL: [Self; 6] = [
        Self::Environmental,
        Self::Operational,
        Self::Navigational,
        Self::Regulatory,
        Self::Infrastructure,
        Self::ServiceLevel,
    ];

    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Environmental => "environmental",
            Self::Navigational => "navigational",
            Self::Regulatory => "regulatory",
            Self::Infrastructure => "infrastructure",
            Self::Operational => "operational",
            Self::ServiceLevel => "service_level",
        }
    }

    /// True when the failed leg is closed for the request.
    pub fn closes_leg(self) -> bool {
        match self {
            Self::Environmental | Self::Navigational | Self::Regulatory => true,
            Self::Infrastructure | Self::Operational | Self::ServiceLevel => false,
        }
    }
}

/// Where the drone was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Location {
    /// At the start of the leg: what a report by segment alone means.
    LegStart,
    /// At a position of the plane.
    At(Point),
    /// Nobody knows: the worst is assumed for every way back into the network.
    Unknown,
}

/// A failure report whose names have been found in the network.
#[derive(Clone, Debug, PartialEq)]
pub struct FailureReport {
    /// What failed.
    pub failure: FailureType,
    /// The failed leg, from the node behind the drone to the node ahead.
    pub leg: (NodeIx, NodeIx),
    /// Where the drone was.
    pub location: Location,
    /// Where the cause is, if the drone could tell.
    pub cause_location: Option<Point>,
    /// Where the delivery goes.
    pub destination: NodeIx,
    /// The plan from the leg's start on, the leg first; `None` takes the leg and then the shortest way
    /// over what was open before the report.
    pub remaining_path: Option<Vec<NodeIx>>,
}
