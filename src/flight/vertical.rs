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
    /// Up or down under way.
    pub under_way_m: f64,
}

impl Vertical {
    /// Works out the crossing altitudes; `unknown_climb_m` is climbed where altitudes cannot be compared.
    pub fn of(topology: &Topology, unknown_climb_m: f64) -> Self {
        let mut crossing_m = Vec::with_capacity(topology.node_count());
        let mut crossing = Vec::with_capacity(topology.node_count());
        for node in topology.nodes() {
            let site = topology.node_altitude(node);
            let in_bands = topology.arcs(node).iter().map(|arc| {
                let band = topology.segment_band(arc.segment);
                site.and_then(|site| nearest_in_band(site, &band))
            });
            let mut highest = site;
            for altitude in in_bands {
                highest = match (highest, altitude) {
                    (Some(one), Some(other)) if other.value_m > one.value_m => Some(other),
                    (Some(one), Some(_)) => Some(one),
                    _ => None,
                };
            }
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
        let (Some(start), Some(end)) = ends else {
            return Climbs::default();
        };
        let in_band = (nearest_in_band(start, &band), nearest_in_band(end, &band));
        let (Some(first), Some(last)) = in_band else {
            return Climbs::default();
        };
        if start.reference != end.reference {
            return Climbs::default();
        }
        let steps_m = [
            first.value_m - start.value_m,
            last.value_m - first.value_m,
            end.value_m - last.value_m,
        ];
        Climbs {
            up_m: steps_m.iter().map(|step_m| step_m.max(0.0)).sum(),
            at_nodes_m: steps_m[0].abs() + steps_m[2].abs(),
            under_way_m: steps_m[1].abs(),
        }
    }
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
