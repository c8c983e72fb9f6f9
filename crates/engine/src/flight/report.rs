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
    /// Unknown: the worst is assumed for every way back into the network.
    Unknown,
}

/// Whether a drone is in the air.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Aloft {
    /// It flies, or hovers.
    #[default]
    Airborne,
    /// It stands at a node.
    Grounded,
    /// It is at a node, and that is unknown: both are answered where they differ.
    Unknown,
}

/// What an operational failure is about, as far as the drone can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OperationalDetail {
    /// Less battery than planned.
    Battery,
    /// More payload than planned.
    Payload,
    /// A motor or a propeller: any node that is not closed will do.
    Propulsion,
    /// It has to land: likewise.
    LandNow,
}

impl OperationalDetail {
    /// True when the drone goes to the nearest node that is not closed, with pads or without.
    pub fn lands_anywhere(self) -> bool {
        matches!(self, Self::Propulsion | Self::LandNow)
    }
}

/// Pads that have failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FailedPads {
    /// Where.
    pub node: NodeIx,
    /// How many; `None` for all.
    pub count: Option<u16>,
}

/// Airspeed where nothing tells one, in metres per second.
pub const DEFAULT_AIRSPEED_MPS: f64 = 16.0;
/// How long a drone takes to begin to brake where its airframe does not say, in seconds.
pub const DEFAULT_REACTION_S: f64 = 2.0;
/// How hard it brakes then, in metres per second squared.
pub const DEFAULT_BRAKING_MPS2: f64 = 3.5;

/// What a report says of its drone beside where it is, as far as that changes where a path starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circumstances {
    /// Whether it is in the air.
    pub aloft: Aloft,
    /// How fast it flies, in metres per second.
    pub speed_mps: f64,
    /// How long ago it was where it was, in seconds.
    pub place_age_s: f64,
    /// How long it takes to begin to brake, in seconds.
    pub reaction_s: f64,
    /// How hard it brakes, in metres per second squared; above 0.
    pub braking_mps2: f64,
    /// For [`FailureType::Operational`]: what it is about.
    pub detail: Option<OperationalDetail>,
    /// For [`FailureType::Infrastructure`]: the pads; `None` for all of the leg's end.
    pub failed_pads: Option<FailedPads>,
}

impl Default for Circumstances {
    fn default() -> Self {
        Self {
            aloft: Aloft::default(),
            speed_mps: DEFAULT_AIRSPEED_MPS,
            place_age_s: 0.0,
            reaction_s: DEFAULT_REACTION_S,
            braking_mps2: DEFAULT_BRAKING_MPS2,
            detail: None,
            failed_pads: None,
        }
    }
}

impl Circumstances {
    /// How far the drone flies on before it can turn, in metres: `v t + v^2 / 2a`.
    pub fn stopping_m(&self) -> f64 {
        let speed_mps = self.speed_mps;
        speed_mps * self.reaction_s + speed_mps * speed_mps / (2.0 * self.braking_mps2)
    }
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
