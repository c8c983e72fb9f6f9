//! What lies on a leg, by the fraction flown: each cause that closes it by itself.
//!
//! A zone lies where it meets the leg, a report where it says that the cause is. An operator's closure, a report that
//! does not say, and a leg that the network does not have lie somewhere ahead: the place is unknown. Once all of the leg
//! is flown they lie behind: nothing of it is ahead.

use super::request::Request;
use super::starts::Leg;
use crate::airspace::{Airspace, Cause, Zone};
use crate::geo::Point;
use crate::network::SegmentIx;
use crate::planted::{self, Bug};

/// Parts of a line as fractions of it, rising and disjoint.
pub(super) type Parts = Vec<(f64, f64)>;

/// What lies on the leg.
#[derive(Debug, Default)]
pub(super) struct Causes {
    /// Parts of the leg inside active zones, margins included; zones that overlap are one.
    zones: Parts,
    /// Where the drone says that the cause is.
    known: Option<f64>,
    /// Something at an unknown place closes the leg.
    unknown: bool,
}

impl Causes {
    pub(super) fn found(request: &Request, airspace: &Airspace, leg: &Leg) -> Self {
        let topology = &**airspace.topology();
        let ends = (topology.position(leg.from), topology.position(leg.to));
        if planted::is(Bug::DroppedCause) {
            return Self::default();
        }
        let is_assumed_open = planted::is(Bug::RemovedLegOpen);
        let mut causes = Self {
            unknown: leg.segment.is_none() && !is_assumed_open,
            ..Self::default()
        };
        match leg.segment {
            Some(segment) => {
                // Most requests close the leg themselves, without a zone: then there is none to look for.
                if airspace.closed().closes_segment(segment) || request.zone.is_some() {
                    causes.zones = zone_parts(zones_on(request, airspace, segment), ends);
                }
                causes.unknown |= has_closure_without_place(airspace, segment);
            }
            // Its altitudes are unknown, so that every zone reaches it.
            None => causes.zones = zone_parts(all_zones(request, airspace), ends),
        }
        if request.report.failure.closes_leg() {
            let place = request.report.cause_location;
            causes.known = place.map(|place| fraction_along(ends, place).0);
            causes.unknown |= place.is_none();
        }
        causes
    }

    /// Nothing at all closes the leg.
    pub(super) fn are_none(&self) -> bool {
        self.zones.is_empty() && self.known.is_none() && !self.unknown
    }

    /// True when the way back from `flown` to the start of the leg passes a cause or enters a zone.
    pub(super) fn lie_behind(&self, flown: f64) -> bool {
        (self.unknown && flown >= 1.0)
            || self.known.is_some_and(|cause| cause < flown)
            || self.zones.iter().any(|&(_, until)| until < flown)
    }

    /// The same for the way on to the end of the leg.
    pub(super) fn lie_ahead(&self, flown: f64) -> bool {
        (self.unknown && flown < 1.0)
            || self.known.is_some_and(|cause| cause >= flown)
            || self.zones.iter().any(|&(from, _)| from > flown)
    }

    /// True when a zone lies on the leg.
    pub(super) fn have_zones(&self) -> bool {
        !self.zones.is_empty()
    }

    /// The part of the leg inside zones that a place on it is in.
    pub(super) fn around(&self, flown: f64) -> Option<(f64, f64)> {
        let mut zones = self.zones.iter();
        zones
            .find(|part| part.0 <= flown && flown <= part.1)
            .copied()
    }

    /// The same for the way on but for one zone, which the drone comes into.
    pub(super) fn lie_ahead_but(&self, flown: f64, zone: (f64, f64)) -> bool {
        (self.unknown && flown < 1.0)
            || self.known.is_some_and(|cause| cause >= flown)
            || self
                .zones
                .iter()
                .any(|&part| part.0 > flown && part != zone)
    }

    /// The part of the leg in the next zone ahead.
    pub(super) fn next_zone(&self, flown: f64) -> Option<(f64, f64)> {
        let mut zones = self.zones.iter();
        zones.find(|&&(from, _)| from > flown).copied()
    }
}

/// True when an operator or a report of before has closed a segment.
fn has_closure_without_place(airspace: &Airspace, segment: SegmentIx) -> bool {
    airspace.closed().closes_segment(segment)
        && airspace.in_force().any(|closure| {
            let has_shape = matches!(closure.cause, Cause::Zone(_));
            !has_shape && closure.hits.segments.binary_search(&segment).is_ok()
        })
}

/// The zones that close a segment, standing and brought.
fn zones_on<'a>(
    request: &'a Request,
    airspace: &'a Airspace,
    segment: SegmentIx,
) -> impl Iterator<Item = &'a Zone> {
    let closes = move |segments: &[SegmentIx]| segments.binary_search(&segment).is_ok();
    let standing = airspace
        .in_force()
        .filter(move |closure| closes(&closure.hits.segments))
        .filter_map(|closure| closure.zone().map(|zone| &**zone));
    let brought = request
        .zone
        .iter()
        .filter(move |brought| closes(&brought.hits.segments))
        .map(|brought| &*brought.zone);
    standing.chain(brought)
}

/// All active zones, standing and brought.
pub(super) fn all_zones<'a>(
    request: &'a Request,
    airspace: &'a Airspace,
) -> impl Iterator<Item = &'a Zone> {
    let standing = airspace
        .in_force()
        .filter_map(|closure| closure.zone().map(|zone| &**zone));
    standing.chain(request.zone.iter().map(|brought| &*brought.zone))
}

/// The parts of a line that lie in zones: those that overlap are one.
pub(super) fn zone_parts<'a>(
    zones: impl Iterator<Item = &'a Zone>,
    (from, to): (Point, Point),
) -> Parts {
    let mut parts: Parts = zones.flat_map(|zone| zone.coverage(from, to)).collect();
    parts.sort_by(|one, other| one.0.total_cmp(&other.0));
    parts.dedup_by(|next, before| {
        let overlaps = next.0 <= before.1;
        if overlaps {
            before.1 = before.1.max(next.1);
        }
        overlaps
    });
    parts
}

/// How far a line that begins inside zones goes on in them, as a fraction; 0 where it meets none.
///
/// `None` where it enters a zone, or never leaves the one that it begins in.
pub(super) fn way_out(parts: &Parts) -> Option<f64> {
    match parts.as_slice() {
        [] => Some(0.0),
        &[(from, until)] if from <= 0.0 && until < 1.0 => Some(until),
        _ => None,
    }
}

/// The fraction of the way from the first end to the second that is nearest to a point, and how far off it is in metres.
pub(super) fn fraction_along(ends: (Point, Point), point: Point) -> (f64, f64) {
    let (from, to) = ends;
    let fraction = point.fraction_along(from, to);
    (fraction, from.towards(to, fraction).distance_m(point))
}
