//! Whether a drone can be where it says it is: one judgement for failure reports and for telemetry.

use crate::geo::{Bounds, Point};
use crate::network::{NodeIx, Topology};
use std::fmt;

/// No drone of these networks flies faster, in metres per second, a wind behind it included.
pub const FASTEST_MPS: f64 = 40.0;
/// A place may be so much farther from the last one than a drone can have flown, in metres.
const SLACK_M: f64 = 200.0;
/// Without a last place, so near to its leg a drone may be anywhere, in metres.
const NEAR_LEG_M: f64 = 2_000.0;
/// And so far around the network's box, as a share of it, on every side: the box is widened by half.
const AROUND_NETWORK: f64 = 0.25;

/// The last place of a drone that was accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LastPlace {
    /// Where.
    pub point: Point,
    /// How long before the place that is judged, in seconds.
    pub before_s: f64,
}

/// Why a drone cannot be where it says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImpossiblePlace {
    /// It is farther from the last accepted place than a drone can have flown.
    TooFar {
        /// How far, in metres.
        off_m: f64,
        /// How far it can be, in metres.
        reach_m: f64,
    },
    /// It is far from the leg and far outside the network.
    Elsewhere {
        /// How far from the leg, or else from the network, in metres.
        off_m: f64,
    },
}

impl fmt::Display for ImpossiblePlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFar { off_m, reach_m } => write!(
                formatter,
                "is {off_m:.0} m from the last place known, and a drone can have come {reach_m:.0} m"
            ),
            Self::Elsewhere { off_m } => {
                let off_km = off_m / 1_000.0;
                write!(formatter, "is {off_km:.0} km away, beyond the network")
            }
        }
    }
}

/// Judges a place: against the last accepted one, or without one against the leg and the network.
///
/// # Errors
/// Why the drone cannot be there: its place is unknown then.
pub fn check_place(
    topology: &Topology,
    place: Point,
    last: Option<LastPlace>,
    leg: Option<(NodeIx, NodeIx)>,
) -> Result<(), ImpossiblePlace> {
    if let Some(last) = last {
        let off_m = place.distance_m(last.point);
        let reach_m = FASTEST_MPS * last.before_s.max(0.0) + SLACK_M;
        return match off_m <= reach_m {
            true => Ok(()),
            false => Err(ImpossiblePlace::TooFar { off_m, reach_m }),
        };
    }
    let bounds = topology.bounds();
    let widened = Bounds {
        min: Point::new(
            bounds.min.x - AROUND_NETWORK * bounds.width_m(),
            bounds.min.y - AROUND_NETWORK * bounds.height_m(),
        ),
        max: Point::new(
            bounds.max.x + AROUND_NETWORK * bounds.width_m(),
            bounds.max.y + AROUND_NETWORK * bounds.height_m(),
        ),
    };
    let off_m = match leg {
        Some((from, to)) => {
            place.distance_to_line_m(topology.position(from), topology.position(to))
        }
        None => distance_to_box_m(bounds, place),
    };
    match widened.contains(place) || off_m <= NEAR_LEG_M {
        true => Ok(()),
        false => Err(ImpossiblePlace::Elsewhere { off_m }),
    }
}

fn distance_to_box_m(bounds: Bounds, point: Point) -> f64 {
    let inside = Point::new(
        point.x.max(bounds.min.x).min(bounds.max.x),
        point.y.max(bounds.min.y).min(bounds.max.y),
    );
    inside.distance_m(point)
}
