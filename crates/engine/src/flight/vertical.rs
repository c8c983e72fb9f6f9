//! Where drones change altitude: one crossing altitude at every node, and the climbs of a leg.
//!
//! The crossing altitude of a node is the highest, over its segments, of the altitude in the segment's band that is
//! nearest to the landing site. Every drone that comes by passes it, which makes the climbs of a leg
//! independent of the legs before and after it. Drones take off to it and land from it.

use crate::geo::{Altitude, AltitudeBand};
use crate::network::{NodeIx, SegmentIx, Topology};

/// The vertical metres of a network.
#[derive(Clone, Debug)]
pub struct Vertical {
    /// By node, metres from the landing site up to the crossing altitude.
    crossing_m: Vec<f64>,
    /// By node, the crossing altitude; `None` where it is unknown.
    crossing: Vec<Option<Altitude>>,
}

/// The vertical metres of one direction of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Climbs {
    /// Up, in all.
    pub up_m: f64,
    /// Up and down at the two nodes, on the spot.
    pub at_nodes_m: f64,
    /// Under way, from one end to the other: above 0 where it goes up.
    pub under_way_m: f64,
}

impl Vertical {
    /// Works out the crossing altitudes; `unknown_climb_m` is climbed where altitudes cannot be compared.
    pub fn of(topology: &Topology, unknown_climb_m: f64) -> Self {
        let mut crossing_m = Vec::with_capacity(topology.node_count());
        let mut crossing = Vec::with_capacity(topology.node_count());
        for node in topology.nodes() {
            let site = topology.node_altitude(node);
            let highest = crossing_altitude(topology, node);
            crossing_m.push(match (site, highest) {
                (Some(site), Some(highest)) => highest.value_m - site.value_m,
                _ => unknown_climb_m,
            });
            crossing.push(highest);
        }
        Self {
            crossing_m,
            crossing,
        }
    }

    /// Metres from a node's landing site up to its crossing altitude.
    pub fn crossing_m(&self, node: NodeIx) -> f64 {
        self.crossing_m[node.at()]
    }

    /// The heights that a leg passes over a segment: the crossing altitude, in the band at both ends, the
    /// crossing altitude. `None` where they are unknown or cannot be compared.
    pub(super) fn heights_m(&self, topology: &Topology, segment: SegmentIx) -> Option<[f64; 4]> {
        let ends = topology.segment(segment);
        let crossing = [ends.from, ends.to].map(|node| self.crossing[node.at()]);
        heights_between(crossing[0], crossing[1], &topology.segment_band(segment))
    }

    /// The climbs from the crossing altitude of one end to that of the other; none where altitudes are unknown.
    pub fn climbs(
        &self,
        topology: &Topology,
        segment: SegmentIx,
        from: NodeIx,
        to: NodeIx,
    ) -> Climbs {
        let band = topology.segment_band(segment);
        let ends = (self.crossing[from.at()], self.crossing[to.at()]);
        let Some([start_m, first_m, last_m, end_m]) = heights_between(ends.0, ends.1, &band) else {
            return Climbs::default();
        };
        let steps_m = [first_m - start_m, last_m - first_m, end_m - last_m];
        Climbs {
            up_m: steps_m.iter().map(|step_m| step_m.max(0.0)).sum(),
            at_nodes_m: steps_m[0].abs() + steps_m[2].abs(),
            under_way_m: steps_m[1],
        }
    }
}

/// The crossing altitude of a node; `None` where altitudes are unknown or cannot be compared.
pub(super) fn crossing_altitude(topology: &Topology, node: NodeIx) -> Option<Altitude> {
    let mut highest = topology.node_altitude(node)?;
    let site = highest;
    for arc in topology.arcs(node) {
        let altitude = nearest_in_band(site, &topology.segment_band(arc.segment))?;
        if altitude.value_m > highest.value_m {
            highest = altitude;
        }
    }
    Some(highest)
}

/// The heights that a leg passes between two crossing altitudes: the first one, in its band at both ends, and the last one. `None` where
/// they are unknown or cannot be compared.
pub(super) fn heights_between(
    start: Option<Altitude>,
    end: Option<Altitude>,
    band: &AltitudeBand,
) -> Option<[f64; 4]> {
    let (start, end) = (start?, end?);
    let (first, last) = (nearest_in_band(start, band)?, nearest_in_band(end, band)?);
    let is_comparable = start.reference == end.reference;
    is_comparable.then_some([start.value_m, first.value_m, last.value_m, end.value_m])
}

/// The altitude in a band that is nearest to another one; `None` where the references differ.
fn nearest_in_band(altitude: Altitude, band: &AltitudeBand) -> Option<Altitude> {
    let limits = [band.lower, band.upper];
    let differs = |limit: &Altitude| limit.reference != altitude.reference;
    if limits.iter().flatten().any(differs) {
        return None;
    }
    let lower_m = band.lower.map_or(f64::NEG_INFINITY, |limit| limit.value_m);
    let upper_m = band.upper.map_or(f64::INFINITY, |limit| limit.value_m);
    Some(Altitude {
        value_m: altitude.value_m.min(upper_m).max(lower_m),
        ..altitude
    })
}
