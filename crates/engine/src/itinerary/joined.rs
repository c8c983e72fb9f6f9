//! Whether any way leads from the starts of a request to its destination, whatever batteries, pads and other plans allow.
//!
//! Where closures part the two for as long as the request lasts there is no plan, and no search has to find that out.

use super::entry::{Entry, Leaving};
use super::expander::Expander;
use super::memory::{Queued, ReachedFromBothEnds};
use super::potentials::Potentials;
use crate::airspace::Bits;
use crate::flight::FlightStart;
use crate::network::{NodeIx, SegmentIx};

impl ReachedFromBothEnds {
    /// False where no leg that is open at some time leads on from any start, or to the destination: most often that is what
    /// parts them.
    pub(super) fn have_open_legs(&mut self, terms: &Expander<'_>, closed: &Bits) -> bool {
        let legs = terms.world.legs;
        let destination = terms.request.destination;
        if starts(terms).any(|start| start.node == destination) {
            return true;
        }
        let intervals = &mut self.intervals;
        let mut is_open = |leg: u32| {
            may_be_flown(terms, closed, leg) && is_ever_open(terms, leg, &mut *intervals)
        };
        let leads_on = starts(terms).any(|start| legs.from(start.node).any(&mut is_open));
        leads_on
            && legs
                .from(destination)
                .any(|leg| is_open(legs.leg(leg).twin))
    }

    /// False where no leg that is open at some time leads on from what can be reached from the starts, or to what the
    /// destination can be reached from. Counts the legs looked at.
    pub(super) fn meet(
        &mut self,
        terms: &Expander<'_>,
        closed: &Bits,
        looked_at: &mut usize,
    ) -> bool {
        self.onwards.clear();
        self.backwards.clear();
        let destination = terms.request.destination;
        self.backwards.add(destination, 0.0);
        for start in starts(terms) {
            if start.node == destination {
                return true;
            }
            self.onwards
                .add(start.node, terms.potentials.from(start.node).time_s);
        }
        loop {
            for is_onwards in [true, false] {
                match self.look_on(terms, closed, is_onwards, looked_at) {
                    Look::HaveMet => return true,
                    Look::IsComplete => return false,
                    Look::GoesOn => {}
                }
            }
        }
    }

    fn look_on(
        &mut self,
        terms: &Expander<'_>,
        closed: &Bits,
        is_onwards: bool,
        looked_at: &mut usize,
    ) -> Look {
        let (own, other) = match is_onwards {
            true => (&mut self.onwards, &self.backwards),
            false => (&mut self.backwards, &self.onwards),
        };
        let Some(Queued { label, .. }) = own.queue.pop() else {
            return Look::IsComplete;
        };
        let legs = terms.world.legs;
        for leg in legs.from(NodeIx(label)) {
            *looked_at += 1;
            let next = legs.leg(leg).to;
            if own.nodes.contains(next.0) {
                continue;
            }
            let flown = match is_onwards {
                true => leg,
                false => legs.leg(leg).twin,
            };
            let is_open = may_be_flown(terms, closed, flown)
                && is_ever_open(terms, flown, &mut self.intervals);
            if !is_open {
                continue;
            }
            if other.nodes.contains(next.0) {
                return Look::HaveMet;
            }
            let left = match is_onwards {
                true => terms.potentials.from(next).time_s,
                false => straight_m(terms, next),
            };
            own.add(next, left);
        }
        Look::GoesOn
    }
}

enum Look {
    HaveMet,
    IsComplete,
    GoesOn,
}

fn starts<'a>(terms: &Expander<'a>) -> impl Iterator<Item = &'a FlightStart> {
    terms.request.starts.iter().take(super::MAX_STARTS)
}

/// From the nearest start, in metres.
fn straight_m(terms: &Expander<'_>, node: NodeIx) -> f64 {
    let topology = terms.world.topology;
    let place = topology.position(node);
    let from_each = starts(terms).map(|start| topology.position(start.node).distance_m(place));
    from_each.fold(f64::INFINITY, f64::min)
}

/// The tables on the legs that closures leave open at some time; `None` where that is all of them but for segments that
/// the request itself closes.
pub(super) fn tables_of_open_legs(terms: &Expander<'_>, closed: &Bits) -> Option<Potentials> {
    let Expander { world, request, .. } = *terms;
    let mut shut = Vec::new();
    let mut intervals = Vec::new();
    for segment in world.obstacles.closed().segments().iter().map(SegmentIx) {
        let is_for_good = is_shut_for_good(terms, segment);
        for leg in world.legs.of_segment(segment) {
            let is_shut = may_be_flown(terms, closed, leg)
                && (is_for_good || !is_ever_open(terms, leg, &mut intervals));
            if is_shut {
                shut.push(leg);
            }
        }
    }
    (!shut.is_empty()).then(|| {
        let own = request.closed_segments.iter();
        shut.extend(own.flat_map(|&segment| world.legs.of_segment(segment)));
        terms.potentials.without(world.legs, &shut)
    })
}

fn may_be_flown(terms: &Expander<'_>, closed: &Bits, leg: u32) -> bool {
    let flight = terms.world.legs.leg(leg);
    flight.least.is_flyable() && !closed.contains(flight.segment.0)
}

/// Whether closures without an end close a segment that begins at no start: most of those in a large zone.
fn is_shut_for_good(terms: &Expander<'_>, segment: SegmentIx) -> bool {
    let Expander { world, request, .. } = *terms;
    let ends = world.topology.segment(segment);
    let begins = starts(terms).any(|start| start.node == ends.from || start.node == ends.to);
    let obstacles = world.obstacles;
    !begins && obstacles.is_shut_for_good(world, request.began_s, segment, first_s(terms))
}

/// When the first start begins.
fn first_s(terms: &Expander<'_>) -> f64 {
    let begins_s = starts(terms).map(|start| start.at_s);
    begins_s.fold(f64::INFINITY, f64::min)
}

/// Whether a leg can be entered at some time while the request lasts, as far as closures go.
fn is_ever_open(terms: &Expander<'_>, leg: u32, intervals: &mut Vec<(f64, f64)>) -> bool {
    let Expander { world, request, .. } = *terms;
    let flight = world.legs.leg(leg);
    let from = world.legs.leg(flight.twin).to;
    let begins_here = |on_ground: bool| {
        let mut here = starts(terms).filter(|start| start.node == from);
        here.any(|start| start.on_ground == on_ground)
    };
    let leaving = match (begins_here(false), begins_here(true)) {
        (true, _) => Leaving::FromTheAir,
        (false, true) => Leaving::FromTheGround,
        (false, false) => Leaving::OnItsWay,
    };
    let entry = Entry {
        segment: flight.segment.0,
        from,
        to: flight.to,
        // What takes less is forbidden at fewer instants.
        time_s: flight.least.time_s,
        leaving,
        takes_off: false,
    };
    let within_s = (first_s(terms), request.deadline_s);
    world
        .obstacles
        .opens_within(world, request.began_s, entry, within_s, intervals)
}
