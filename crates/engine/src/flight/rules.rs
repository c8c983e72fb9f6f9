//! What a plan keeps to, whatever the airframe.

use super::figure::{Figure, FigureRange};

/// Margins and overheads of planning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightRules {
    /// No node is reached with less than this fraction of the battery.
    pub reserve: f64,
    /// A recomposition in flight may go down to this fraction, to reach the nearest alternate.
    pub floor: f64,
    /// Handling at a recharging stop, in seconds.
    pub stop_s: f64,
    /// Swapping batteries where a node does so, in seconds.
    pub swap_s: f64,
    /// Windows are widened by this on both sides, in seconds.
    pub time_margin_s: f64,
    /// And by this share of the time since the plan began.
    pub time_margin_growth: f64,
    /// Least time between entries of two plans into a segment in one direction, in seconds; 0 lets plans meet
    /// everywhere.
    pub headway_s: f64,
    /// Least time between two plans that pass a node or land there, in seconds; 0 lets them pass together.
    pub node_headway_s: f64,
    /// Plans are not at the same time where segments come nearer to each other than this, in metres; 0 lets
    /// them.
    pub crossing_m: f64,
    /// Climb to the crossing altitude where altitudes are unknown or cannot be compared, in metres.
    pub unknown_climb_m: f64,
}

impl Default for FlightRules {
    fn default() -> Self {
        Self {
            reserve: 0.2,
            floor: 0.08,
            stop_s: 60.0,
            swap_s: 180.0,
            time_margin_s: 60.0,
            time_margin_growth: 0.05,
            headway_s: 30.0,
            node_headway_s: 5.0,
            crossing_m: 20.0,
            unknown_climb_m: 30.0,
        }
    }
}

impl FlightRules {
    /// What `reserve` may be; the floor too.
    pub const RESERVE: FigureRange = FigureRange::between(0.0, 0.9);
    /// What `stop_s` may be.
    pub const STOP_S: FigureRange = FigureRange::between(0.0, 3_600.0);
    /// What `swap_s` may be.
    pub const SWAP_S: FigureRange = FigureRange::between(1.0, 86_400.0);
    /// What `time_margin_s` may be.
    pub const TIME_MARGIN_S: FigureRange = FigureRange::between(0.0, 3_600.0);
    /// What `time_margin_growth` may be.
    pub const TIME_MARGIN_GROWTH: FigureRange = FigureRange::between(0.0, 1.0);
    /// What `headway_s` may be.
    pub const HEADWAY_S: FigureRange = FigureRange::between(0.0, 3_600.0);
    /// What `node_headway_s` may be.
    pub const NODE_HEADWAY_S: FigureRange = FigureRange::between(0.0, 600.0);
    /// What `crossing_m` may be.
    pub const CROSSING_M: FigureRange = FigureRange::between(0.0, 200.0);
    /// What `unknown_climb_m` may be.
    pub const UNKNOWN_CLIMB_M: FigureRange = FigureRange::between(0.0, 1_000.0);

    /// Every figure with what it may be, by the names that documents have.
    pub fn figures(&self) -> [Figure; 10] {
        [
            Figure::new("reserve_fraction", self.reserve, Self::RESERVE),
            Figure::new("floor_fraction", self.floor, Self::RESERVE),
            Figure::new("stop_s", self.stop_s, Self::STOP_S),
            Figure::new("swap_s", self.swap_s, Self::SWAP_S),
            Figure::new("time_margin_s", self.time_margin_s, Self::TIME_MARGIN_S),
            Figure::new(
                "time_margin_growth",
                self.time_margin_growth,
                Self::TIME_MARGIN_GROWTH,
            ),
            Figure::new("headway_s", self.headway_s, Self::HEADWAY_S),
            Figure::new("node_headway_s", self.node_headway_s, Self::NODE_HEADWAY_S),
            Figure::new("crossing_m", self.crossing_m, Self::CROSSING_M),
            Figure::new(
                "unknown_climb_m",
                self.unknown_climb_m,
                Self::UNKNOWN_CLIMB_M,
            ),
        ]
    }
}
