//! A given way, walked with all stops and windows: the best plan on it, in a few microseconds.
//!
//! First without a stop; where the battery or a window forbids that, with every stop that no other on the same
//! way makes needless.

use super::charging_label::ChargingLabel;
use super::expander::{Departure, Expander, SearchBuffers};
use super::label::{How, NO_LABEL};
use super::memory::{Descent, ItineraryScratch};
use super::request::Value;
use crate::network::NodeIx;

/// More families side by side than this are not followed.
const MAX_ABREAST: usize = 64;
/// And on a first, quick pass.
const FEW_ABREAST: usize = 4;

/// Where a walk begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct From<'f> {
    pub(super) family: &'f ChargingLabel,
    pub(super) node: NodeIx,
    pub(super) how: How,
}

/// Which way is walked.
#[derive(Clone, Copy, Debug)]
pub(super) enum Along<'r> {
    /// Down the destination's tree.
    Tree,
    /// These legs.
    Legs(&'r [u32]),
}

impl Along<'_> {
    #[inline]
    fn leg(self, terms: &Expander<'_>, node: NodeIx, place: usize) -> Option<u32> {
        match self {
            Self::Tree => terms.potentials.next(node),
            Self::Legs(legs) => legs.get(place).copied(),
        }
    }
}

/// The best plan on a way.
#[derive(Clone, Copy, Debug)]
pub(super) struct WalkEnd {
    pub(super) value: Value,
    /// Its last step, in the walked ones.
    pub(super) last: u32,
    /// True when no family was left out.
    pub(super) is_complete: bool,
}

/// Walks a way; `None` where it cannot be flown. Families that cannot beat `best` are left out.
pub(super) fn walk(
    terms: &Expander<'_>,
    from: From<'_>,
    along: Along<'_>,
    best: Value,
    scratch: &mut ItineraryScratch,
    checks: &mut usize,
) -> Option<WalkEnd> {
    let ItineraryScratch {
        walked,
        offers,
        intervals,
        forbidden,
        closed,
        active,
        ..
    } = scratch;
    let mut room = SearchBuffers {
        closed,
        active,
        intervals,
        forbidden,
        offers,
    };
    if let Some(end) = without_stops(terms, from, along, walked, &mut room, checks) {
        return Some(end);
    }
    with_stops(terms, from, along, best, walked, &mut room, checks)
}

/// Flies on as early as possible; `None` where that takes a stop, or anything is in the way.
fn without_stops(
    terms: &Expander<'_>,
    from: From<'_>,
    along: Along<'_>,
    walked: &mut Vec<Descent>,
    room: &mut SearchBuffers<'_>,
    checks: &mut usize,
) -> Option<WalkEnd> {
    let reserve = terms.request.reserve;
    if let Along::Tree = along {
        let needed = reserve + terms.potentials.from(from.node).energy;
        if from.family.battery_lo() < needed - 1e-9 {
            return None;
        }
    }
    walked.clear();
    walked.push(Descent {
        family: *from.family,
        how: from.how,
        parent: NO_LABEL,
    });
    let (mut node, mut place) = (from.node, 0);
    while let Some(leg) = along.leg(terms, node, place) {
        let parent = walked.len() as u32 - 1;
        let Descent { family, how, .. } = walked[parent as usize];
        room.offers.clear();
        let departure = Departure {
            family: &family,
            from: node,
            leaving: terms.leaving(how),
            takes_off: terms.takes_off(how),
        };
        terms.fly(departure, leg, room);
        *checks += room.checks_of_flight();
        let &[(flown, how)] = room.offers.as_slice() else {
            return None;
        };
        let is_delayed = flown.lo_s > family.lo_s + terms.time_s(how) + 1e-9;
        if is_delayed {
            return None;
        }
        walked.push(Descent {
            family: flown,
            how,
            parent,
        });
        node = terms.world.legs.leg(leg).to;
        place += 1;
    }
    let last = walked.len() as u32 - 1;
    let value = terms.value(&walked[last as usize].family);
    // Who waits for another wind may be faster.
    let changes_s = terms.world.legs.changes_s().iter();
    let is_one_wind = !changes_s
        .into_iter()
        .any(|&at_s| from.family.lo_s < at_s && at_s <= value.arrives_s);
    (node == terms.request.destination).then_some(WalkEnd {
        value,
        last,
        is_complete: is_one_wind,
    })
}

/// With stops: quickly with a few families abreast, whose value then lets the thorough pass leave most of them out.
fn with_stops(
    terms: &Expander<'_>,
    from: From<'_>,
    along: Along<'_>,
    best: Value,
    walked: &mut Vec<Descent>,
    room: &mut SearchBuffers<'_>,
    checks: &mut usize,
) -> Option<WalkEnd> {
    walked.clear();
    let mut pass = Pass {
        terms,
        from,
        along,
        best,
        most: FEW_ABREAST,
        is_complete: true,
        checks,
    };
    let quick = pass.fly_on(walked, room);
    if pass.is_complete {
        return quick.map(|end| pass.end(end));
    }
    if let Some((value, _)) = quick {
        pass.best = value;
    }
    pass.most = MAX_ABREAST;
    pass.is_complete = true;
    let thorough = pass.fly_on(walked, room);
    thorough.or(quick).map(|end| pass.end(end))
}

/// One pass over a way.
struct Pass<'a, 't, 'c> {
    terms: &'a Expander<'t>,
    from: From<'a>,
    along: Along<'a>,
    /// Families that cannot beat this are left out.
    best: Value,
    /// So many families are followed side by side.
    most: usize,
    /// False once others have been left out.
    is_complete: bool,
    checks: &'c mut usize,
}

impl Pass<'_, '_, '_> {
    fn end(&self, (value, last): (Value, u32)) -> WalkEnd {
        WalkEnd {
            value,
            last,
            is_complete: self.is_complete,
        }
    }

    /// The best value on the way and its last step, added to the steps walked.
    fn fly_on(
        &mut self,
        walked: &mut Vec<Descent>,
        room: &mut SearchBuffers<'_>,
    ) -> Option<(Value, u32)> {
        let Self {
            terms, from, along, ..
        } = *self;
        let (mut node, mut place, mut first) = (from.node, 0, walked.len());
        walked.push(Descent {
            family: *from.family,
            how: from.how,
            parent: NO_LABEL,
        });
        while let Some(leg) = along.leg(terms, node, place) {
            if terms.world.pads.is_station(node) && !leaves_start_on_pad(terms, from, place) {
                self.add_stops(node, first, walked, room);
            }
            let end = walked.len();
            self.fly_all(node, leg, first, walked, room);
            if walked.len() == end {
                return None;
            }
            first = end;
            node = terms.world.legs.leg(leg).to;
            place += 1;
        }
        match node == terms.request.destination {
            true => best_from(terms, first, walked),
            false => None,
        }
    }

    /// Flies a leg with every family from `first` on.
    fn fly_all(
        &mut self,
        from: NodeIx,
        leg: u32,
        first: usize,
        walked: &mut Vec<Descent>,
        room: &mut SearchBuffers<'_>,
    ) {
        let terms = self.terms;
        let end = walked.len();
        let to = terms.world.legs.leg(leg).to;
        for parent in first..end {
            if self.is_spent() {
                break;
            }
            let Descent { family, how, .. } = walked[parent];
            room.offers.clear();
            let departure = Departure {
                family: &family,
                from,
                leaving: terms.leaving(how),
                takes_off: terms.takes_off(how),
            };
            terms.fly(departure, leg, room);
            *self.checks += room.checks_of_flight();
            for &(flown, how) in room.offers.iter() {
                if terms.key(&flown, to).beats(self.best) {
                    let parent = parent as u32;
                    let candidate = Descent {
                        family: flown,
                        how,
                        parent,
                    };
                    self.admit(candidate, end, walked);
                }
            }
        }
        if walked.len() - end > self.most {
            self.is_complete = false;
            let bound_s = |step: &Descent| terms.key(&step.family, to).arrives_s;
            walked[end..].sort_unstable_by(|one, other| bound_s(one).total_cmp(&bound_s(other)));
            walked.truncate(end + self.most);
        }
    }

    /// Adds the stops at a node of all families that are there.
    fn add_stops(
        &mut self,
        node: NodeIx,
        first: usize,
        walked: &mut Vec<Descent>,
        room: &mut SearchBuffers<'_>,
    ) {
        let end = walked.len();
        for parent in first..end {
            if self.is_spent() {
                break;
            }
            let family = walked[parent].family;
            room.offers.clear();
            self.terms.stop(&family, node, room);
            for &(stopped, how) in room.offers.iter() {
                if self.terms.key(&stopped, node).beats(self.best) {
                    let parent = parent as u32;
                    let candidate = Descent {
                        family: stopped,
                        how,
                        parent,
                    };
                    self.admit(candidate, end, walked);
                }
            }
        }
    }

    /// True once the bound on checks is reached; then families are left out.
    fn is_spent(&mut self) -> bool {
        let is_spent = *self.checks >= self.terms.request.limits.checks;
        self.is_complete &= !is_spent;
        is_spent
    }

    /// Adds a family unless one from `first` on can do all that it can, in place of those that it can stand for. All have
    /// flown the same way, and all have just stopped here, or none.
    fn admit(&mut self, candidate: Descent, first: usize, walked: &mut Vec<Descent>) {
        let tau_s = self.terms.tau_s;
        let stands_for = |one: &ChargingLabel, other: &ChargingLabel| {
            one.weight <= other.weight
                && one.lo_s <= other.lo_s
                && one.hi_s >= other.hi_s
                && one.has_battery_of(other, tau_s)
        };
        let mut place = first;
        while let Some(there) = walked.get(place) {
            *self.checks += 1;
            if stands_for(&there.family, &candidate.family) {
                return;
            }
            if stands_for(&candidate.family, &there.family) {
                walked.swap_remove(place);
            } else {
                place += 1;
            }
        }
        walked.push(candidate);
    }
}

/// The best of the families from `first` on, which are at the destination, and its place.
fn best_from(terms: &Expander<'_>, first: usize, walked: &[Descent]) -> Option<(Value, u32)> {
    let mut found: Option<(Value, u32)> = None;
    for (last, step) in walked.iter().enumerate().skip(first) {
        let value = terms.value(&step.family);
        if found.is_none_or(|(best, _)| value.beats(best)) {
            found = Some((value, last as u32));
        }
    }
    found
}

/// True at the first node of a walk from where the drone stands or has just stopped.
fn leaves_start_on_pad(terms: &Expander<'_>, from: From<'_>, place: usize) -> bool {
    place == 0 && !terms.may_stop(from.how)
}

/// The steps of a walk up to its last one, without the one it began with, added to `steps`.
pub(super) fn append_steps(walked: &[Descent], last: u32, steps: &mut Vec<How>) {
    let first_new = steps.len();
    let mut at = last;
    while let Some(step) = walked.get(at as usize) {
        if step.parent != NO_LABEL {
            steps.push(step.how);
        }
        at = step.parent;
    }
    steps[first_new..].reverse();
}
