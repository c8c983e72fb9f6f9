//! What lies on a straight line: the parts of it inside active zones, and where a drone is on its leg.

use super::claim::{Drone, Sky, Whereabouts};
use crate::airspace::Zone;
use crate::geo::{AltitudeBand, Point};
use crate::network::SegmentIx;

/// A drone farther from its leg than this, in metres, is off it.
pub(super) const OFF_LEG_M: f64 = 50.0;

/// The leg that a drone is on, and where.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnLeg {
    pub(super) segment: Option<SegmentIx>,
    pub(super) ends: (Point, Point),
    pub(super) length_m: f64,
    /// The fraction flown; `None` where that is unknown.
    pub(super) flown: Option<f64>,
    /// How far the drone is off the leg, in metres.
    pub(super) off_m: f64,
    pub(super) band: AltitudeBand,
}

impl OnLeg {
    pub(super) fn of(drone: &Drone<'_>, sky: &Sky<'_>) -> Self {
        let topology = sky.airspace.topology();
        let (from, to) = drone.leg;
        let segment = topology.segment_between(from, to);
        let ends = (topology.position(from), topology.position(to));
        let (flown, off_m) = match drone.at {
            Whereabouts::LegStart => (Some(0.0), 0.0),
            Whereabouts::Unknown => (None, 0.0),
            Whereabouts::At(place) => {
                let fraction = nearest_fraction(ends, place);
                let off_m = place.distance_m(ends.0.towards(ends.1, fraction));
                (Some(fraction), off_m)
            }
        };
        Self {
            segment,
            ends,
            length_m: match segment {
                Some(segment) => topology.segment(segment).length_m,
                None => ends.0.distance_m(ends.1),
            },
            flown,
            off_m,
            band: segment.map_or(AltitudeBand::UNLIMITED, |segment| {
                topology.segment_band(segment)
            }),
        }
    }

    /// Whether the drone is off it.
    pub(super) fn is_off(&self) -> bool {
        self.off_m > OFF_LEG_M
    }

    /// The parts of the leg inside active zones, by fraction from its start.
    pub(super) fn zones(&self, sky: &Sky<'_>) -> Vec<(f64, f64)> {
        let may_meet = self
            .segment
            .is_none_or(|segment| sky.airspace.closed().closes_segment(segment));
        if may_meet || sky.own.zone.is_some() {
            return zone_parts(sky, self.ends, &self.band);
        }
        Vec::new()
    }
}

/// The fraction of the way from the first end to the second that is nearest to a place.
pub(super) fn nearest_fraction((from, to): (Point, Point), place: Point) -> f64 {
    let (x, y) = (to.x - from.x, to.y - from.y);
    let squared = x * x + y * y;
    if squared <= 0.0 {
        return 0.0;
    }
    (((place.x - from.x) * x + (place.y - from.y) * y) / squared).clamp(0.0, 1.0)
}

fn active_zones<'a>(sky: &'a Sky<'_>) -> impl Iterator<Item = &'a Zone> {
    let standing = sky.airspace.in_force();
    let standing = standing.filter_map(|closure| closure.zone().map(|zone| &**zone));
    standing.chain(sky.own.zone.map(|(zone, _)| zone))
}

/// The parts of a line that lie in zones which reach a band; joined where they overlap, as overlapping zones count as one.
pub(super) fn zone_parts(
    sky: &Sky<'_>,
    (from, to): (Point, Point),
    band: &AltitudeBand,
) -> Vec<(f64, f64)> {
    let reaching = active_zones(sky).filter(|zone| zone.band().may_meet(band));
    let mut parts: Vec<(f64, f64)> = reaching.flat_map(|zone| zone.coverage(from, to)).collect();
    parts.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut joined: Vec<(f64, f64)> = Vec::with_capacity(parts.len());
    for part in parts {
        match joined.last_mut() {
            Some(last) if part.0 <= last.1 => last.1 = last.1.max(part.1),
            _ => joined.push(part),
        }
    }
    joined
}

/// Whether a place is in an active zone that reaches a band.
pub(super) fn is_in_zone(sky: &Sky<'_>, place: Point, band: &AltitudeBand) -> bool {
    let mut zones = active_zones(sky);
    zones
        .any(|zone| zone.band().may_meet(band) && zone.shape().covers_point(place, zone.margin_m()))
}
