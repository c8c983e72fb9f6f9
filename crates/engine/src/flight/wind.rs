//! Wind: everywhere, or over an area for a time.

use crate::geo::{Point, PreparedShape};
use std::sync::Arc;

/// Mean wind as the vector it blows along, in metres per second.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Wind {
    /// Towards the east.
    pub east_mps: f64,
    /// Towards the north.
    pub north_mps: f64,
}

impl Wind {
    /// No wind.
    pub const CALM: Self = Self {
        east_mps: 0.0,
        north_mps: 0.0,
    };

    /// Wind as weather reports tell it: a speed and where it comes from, in degrees from north, clockwise.
    pub fn coming_from(from_deg: f64, speed_mps: f64) -> Self {
        let (sine, cosine) = from_deg.to_radians().sin_cos();
        Self {
            east_mps: -speed_mps * sine,
            north_mps: -speed_mps * cosine,
        }
    }

    /// Its speed, in metres per second.
    pub fn speed_mps(self) -> f64 {
        self.east_mps.hypot(self.north_mps)
    }
}

/// Wind that is stated for a time, and maybe an area.
#[derive(Clone, Debug)]
pub struct WindPatch {
    /// Where; everywhere where there is none.
    pub area: Option<Arc<PreparedShape>>,
    /// From when, in seconds.
    pub from_s: f64,
    /// Until when, in seconds; not itself.
    pub until_s: f64,
    /// The wind.
    pub wind: Wind,
}

/// The wind over a network.
///
/// On a leg the statements that hold when it is entered and whose area meets it count. Those with an area go before those
/// without. Of several the leg takes the one that draws most energy, so that the order in which they are stated means
/// nothing. Where nothing is stated the base wind blows.
#[derive(Clone, Debug, Default)]
pub struct WindField {
    /// Where nothing else is stated.
    pub base: Wind,
    /// Statements.
    pub patches: Vec<WindPatch>,
}

impl WindField {
    /// The same wind everywhere, always.
    pub fn uniform(base: Wind) -> Self {
        Self {
            base,
            patches: Vec::new(),
        }
    }

    /// The instants at which a statement begins or ends, rising, each once.
    pub fn changes_s(&self) -> Vec<f64> {
        let ends = self.patches.iter();
        let mut changes_s: Vec<f64> = ends
            .flat_map(|patch| [patch.from_s, patch.until_s])
            .filter(|instant_s| instant_s.is_finite())
            .collect();
        changes_s.sort_by(f64::total_cmp);
        changes_s.dedup();
        changes_s
    }

    /// The winds that a leg entered at an instant has to reckon with; never none.
    pub fn on_leg(&self, from: Point, to: Point, entered_s: f64) -> Vec<Wind> {
        let holds = |patch: &&WindPatch| patch.from_s <= entered_s && entered_s < patch.until_s;
        let local: Vec<Wind> = self
            .patches
            .iter()
            .filter(holds)
            .filter(|patch| {
                let area = patch.area.as_ref();
                area.is_some_and(|area| area.meets_segment(from, to, 0.0))
            })
            .map(|patch| patch.wind)
            .collect();
        if !local.is_empty() {
            return local;
        }
        let network_wide = self.patches.iter().filter(holds);
        let winds: Vec<Wind> = network_wide
            .filter(|patch| patch.area.is_none())
            .map(|patch| patch.wind)
            .collect();
        match winds.is_empty() {
            true => vec![self.base],
            false => winds,
        }
    }
}
