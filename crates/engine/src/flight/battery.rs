//! Recharging: `t = tau ln((1 - s0) / (1 - s1))` and its inverse.

/// How a battery charges; levels are fractions of its energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Charging {
    /// Time constant, in seconds.
    pub tau_s: f64,
    /// Charging ends here.
    pub full: f64,
}

impl Charging {
    /// Seconds from one level to another; `None` where charging does not lead there.
    pub fn time_s(&self, from: f64, to: f64) -> Option<f64> {
        if to <= from {
            return Some(0.0);
        }
        let is_reached = to <= self.full && from < 1.0;
        is_reached.then(|| self.tau_s * ((1.0 - from) / (1.0 - to)).ln())
    }

    /// The level after charging for a time; a battery that came fuller than full stays as it was.
    pub fn level_after(&self, from: f64, time_s: f64) -> f64 {
        let charged = 1.0 - (1.0 - from) * (-time_s / self.tau_s).exp();
        charged.min(self.full).max(from)
    }
}
