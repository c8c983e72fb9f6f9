//! What a plan keeps to, whatever the airframe.

/// Margins and overheads of planning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightRules {
    /// No node is reached with less than this fraction of the battery.
    pub reserve: f64,
    /// A recomposition in flight may go down to this fraction, to reach the nearest safe node.
    pub floor: f64,
    /// Handling at a recharging stop, in seconds.
    pub stop_s: f64,
    /// Swapping batteries where a node does so, in seconds.
    pub swap_s: f64,
    /// Windows are widened by this on both sides, in seconds.
    pub time_margin_s: f64,
    /// And by this share of the time since the plan began.
    pub time_margin_growth: f64,
    /// Least time between entries of two plans into a segment in one direction, in seconds; 0 lets plans meet.
    pub headway_s: f64,
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
            unknown_climb_m: 30.0,
        }
    }
}
