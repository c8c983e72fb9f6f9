//! The course of a leg through the air: its corners with their heights, and how long it is there.
//!
//! A leg begins at the crossing altitude of its first node, goes up or down into its segment's band there, slants over the
//! segment, and goes to the crossing altitude of its last node. An [`Airframe`](super::Airframe) makes time and energy of the same metres.

use super::vertical::{crossing_altitude, heights_between};
use crate::geo::{AltitudeReference, Point};
use crate::network::{NodeIx, SegmentIx, Topology};

/// A corner of a course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Where.
    pub place: Point,
    /// How high, in metres above the course's reference; `None` where that is unknown.
    pub height_m: Option<f64>,
}

/// A leg through the air.
#[derive(Clone, Debug, PartialEq)]
pub struct LegCourse {
    /// Its corners, the first at its first node and the last at its last; two at one node where heights change on the spot.
    pub corners: Vec<Corner>,
    /// What heights are measured from; `None` where they are unknown.
    pub reference: Option<AltitudeReference>,
    /// Metres up, in all.
    pub climb_m: f64,
    /// Metres through the air: along the slope, and up and down on the spot.
    pub length_air_m: f64,
    /// Heights over the segment, at its first node and at its last.
    slope_m: Option<[f64; 2]>,
}

/// The height at which a node is passed, in metres above the reference of its altitude; `None` where that is unknown.
pub fn crossing_height(topology: &Topology, node: NodeIx) -> Option<f64> {
    crossing_altitude(topology, node).map(|altitude| altitude.value_m)
}

impl LegCourse {
    /// The course of a segment in one direction.
    pub fn of(topology: &Topology, from: NodeIx, to: NodeIx, segment: SegmentIx) -> Self {
        let ends = (topology.position(from), topology.position(to));
        let length_m = topology.segment(segment).length_m;
        let crossings = (
            crossing_altitude(topology, from),
            crossing_altitude(topology, to),
        );
        let band = topology.segment_band(segment);
        let reference = crossings.0.map(|crossing| crossing.reference);
        let Some(heights_m) = heights_between(crossings.0, crossings.1, &band) else {
            let corner = |place| Corner {
                place,
                height_m: None,
            };
            return Self {
                corners: vec![corner(ends.0), corner(ends.1)],
                reference: None,
                climb_m: 0.0,
                length_air_m: length_m,
                slope_m: None,
            };
        };
        let [start_m, first_m, last_m, end_m] = heights_m;
        let corner = |place, height_m| Corner {
            place,
            height_m: Some(height_m),
        };
        let mut corners = vec![
            corner(ends.0, start_m),
            corner(ends.0, first_m),
            corner(ends.1, last_m),
            corner(ends.1, end_m),
        ];
        corners.dedup();
        let steps_m = heights_m.windows(2).map(|pair| pair[1] - pair[0]);
        Self {
            corners,
            reference,
            climb_m: steps_m.map(|step_m| step_m.max(0.0)).sum(),
            length_air_m: (first_m - start_m).abs()
                + length_m.hypot(last_m - first_m)
                + (end_m - last_m).abs(),
            slope_m: Some([first_m, last_m]),
        }
    }

    /// The height over the segment after a fraction of it, in metres above the course's reference.
    pub fn height_m(&self, fraction: f64) -> Option<f64> {
        let [first_m, last_m] = self.slope_m?;
        Some(first_m + fraction * (last_m - first_m))
    }
}
