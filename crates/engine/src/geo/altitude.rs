//! Altitudes, which mean nothing without their reference, and the bands between two of them.

use serde::{Deserialize, Serialize};

/// What an altitude is measured from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum AltitudeReference {
    /// Above ground level.
    #[default]
    Agl,
    /// Above mean sea level.
    Amsl,
    /// Above the WGS 84 ellipsoid.
    Wgs84,
}

impl AltitudeReference {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Agl => "agl",
            Self::Amsl => "amsl",
            Self::Wgs84 => "wgs84",
        }
    }
}

/// An altitude with its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Altitude {
    /// Metres above the reference.
    pub value_m: f64,
    /// What `value_m` is measured from.
    pub reference: AltitudeReference,
}

impl Altitude {
    /// An altitude above ground level.
    pub const fn agl(value_m: f64) -> Self {
        Self {
            value_m,
            reference: AltitudeReference::Agl,
        }
    }

    /// True only when this altitude is known to lie above the other: both have the same reference.
    ///
    /// Without the elevation of the ground, altitudes of different references cannot be compared, and
    /// what cannot be compared must not be taken for safe.
    fn surely_above(self, other: Self) -> bool {
        self.reference == other.reference && self.value_m > other.value_m
    }
}

/// A range of altitudes, ends included; a missing end is unlimited.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct AltitudeBand {
    /// The lowest altitude; `None` reaches down without limit.
    pub lower: Option<Altitude>,
    /// The highest altitude; `None` reaches up without limit.
    pub upper: Option<Altitude>,
}

impl AltitudeBand {
    /// The band that holds every altitude.
    pub const UNLIMITED: Self = Self {
        lower: None,
        upper: None,
    };

    /// The band of a single altitude; unlimited when the altitude is unknown.
    pub fn at(altitude: Option<Altitude>) -> Self {
        Self {
            lower: altitude,
            upper: altitude,
        }
    }

    /// True unless the two bands are known to be apart; bands that cannot be compared meet.
    pub fn may_meet(&self, other: &Self) -> bool {
        let apart = |low: Option<Altitude>, high: Option<Altitude>| match (low, high) {
            (Some(low), Some(high)) => low.surely_above(high),
            _ => false,
        };
        !apart(self.lower, other.upper) && !apart(other.lower, self.upper)
    }
}
