//! One search: labels from the queue, nearest to the best possible value first, until nothing left can be better.
//!
//! The three steps differ in how families go on, real or relaxed, and in when a label makes another one needless;
//! `docs/flight-search.md` argues why.

use super::charging_label::ChargingLabel;
use super::expander::{Departure, Expander};
use super::label::{How, Label, NO_LABEL};
use super::memory::{ItineraryScratch, Queued};
use super::request::{Effort, Unproved, Value};
use super::walk::{Along, From, append_steps, walk};
use crate::network::NodeIx;

/// How often [`Limits::is_over`](super::Limits::is_over) is asked: once in so many labels.
const LABELS_BETWEEN_QUESTIONS: usize = 64;

/// What a search takes for granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Hovering is free: what is found is a bound.
    Hovering,
    /// Earlier is better: what is found is a plan.
    Earlier,
    /// Neither.
    Exact,
}

/// Where a search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// At the request's destination.
    Destination,
    /// At the first node that has a pad free for so many seconds from the landing on. There is no stop on the way: it would
    /// be such a node.
    Alternate { stay_s: f64 },
    /// At the first node where landing is not forbidden, whatever its pads. There is no stop on the way.
    AnyNode,
    /// When all that can be reached has been.
    Nowhere,
    /// When all that can be reached without a stop has been.
    Near,
}

impl Goal {
    /// Whether who is under way may stop and recharge.
    fn allows_stops(self) -> bool {
        match self {
            Self::Destination | Self::Nowhere => true,
            Self::Alternate { .. } | Self::AnyNode | Self::Near => false,
        }
    }
}

/// A search within a request.
pub(super) struct Run<'a, 's> {
    pub(super) terms: Expander<'a>,
    pub(super) mode: Mode,
    pub(super) goal: Goal,
    pub(super) scratch: &'s mut ItineraryScratch,
    pub(super) effort: &'s mut Effort,
    /// The value to beat; what beats it is in the scratch's `best`, or `relaxed`.
    pub(super) best: Value,
    /// True where this run found it.
    pub(super) improved: bool,
    /// The least key of a label that was dropped though it might have led to something better.
    pub(super) doubt: Value,
    /// True where another way may have the same weight as the one found.
    pub(super) may_tie: bool,
    /// No plan is better than this: one that meets it ends the search.
    pub(super) target: Value,
    /// Labels that may be taken, in all runs together.
    pub(super) most_labels: usize,
    /// Checks, likewise.
    pub(super) most_checks: usize,
    /// Whether ways are walked down the tree.
    pub(super) walks: bool,
}

/// How a run ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunEnd {
    /// Nothing that the run has not seen is better than this.
    pub(super) bound: Value,
    /// The limit that was reached.
    pub(super) stopped_by: Option<Unproved>,
}

impl Run<'_, '_> {
    /// Searches from all starts of the request.
    pub(super) fn search(&mut self) -> RunEnd {
        self.scratch.clear();
        self.push_starts();
        while let Some(Queued { key, label }) = self.scratch.queue.pop() {
            if !self.is_worth(key) || !self.target.beats(self.best) {
                break;
            }
            let taken = self.scratch.labels[label as usize];
            if taken.is_dead {
                continue;
            }
            if let Some(limit) = self.limit_reached() {
                self.scratch.queue.push(Queued { key, label });
                return RunEnd {
                    bound: key,
                    stopped_by: Some(limit),
                };
            }
            self.effort.labels += 1;
            if let Some(value) = self.goal_value(&taken) {
                self.arrive(label, &taken, value);
                continue;
            }
            let is_settled = self.mode != Mode::Hovering
                && self.walks
                && self.leaves_tree(&taken)
                && self.walk_on(label, &taken, key);
            if !is_settled {
                self.expand(label, &taken);
            }
        }
        RunEnd {
            bound: self.best,
            stopped_by: None,
        }
    }

    /// True where a plan with this key at the best could be an improvement.
    #[inline]
    pub(super) fn is_worth(&self, key: Value) -> bool {
        if key.arrives_s > self.terms.request.deadline_s + super::request::TIME_TOLERANCE_S {
            return false;
        }
        match self.mode {
            // All ways of the least weight are looked at, to know whether there is only one.
            Mode::Hovering if key.weight == self.best.weight => {
                self.terms.is_weighed() || key.beats(self.best)
            }
            Mode::Hovering | Mode::Earlier | Mode::Exact => key.beats(self.best),
        }
    }

    fn limit_reached(&self) -> Option<Unproved> {
        let limits = self.terms.request.limits;
        if self.effort.labels >= self.most_labels {
            return Some(Unproved::Labels);
        }
        if self.effort.checks >= self.most_checks {
            return Some(Unproved::Checks);
        }
        let is_time_to_ask = self.effort.labels.is_multiple_of(LABELS_BETWEEN_QUESTIONS);
        let is_over = limits
            .is_over
            .is_some_and(|is_over| is_time_to_ask && is_over());
        is_over.then_some(Unproved::Time)
    }

    fn push_starts(&mut self) {
        let starts = self.terms.request.starts;
        for (number, start) in starts.iter().take(super::MAX_STARTS).enumerate() {
            let (family, swapped) = self.terms.start(start);
            let how = How::Start(number as u8);
            let label = Label::new(family, start.node, how, NO_LABEL, number as u64);
            self.offer(label);
            if let Some(family) = swapped {
                let arrived_s = start.at_s - self.terms.world.legs.vertical_s(start.node);
                let parent = self.scratch.labels.len() as u32;
                let origin = Label::new(family, start.node, how, NO_LABEL, number as u64);
                self.scratch.keep_aside(origin);
                let how = How::Stop { arrived_s };
                self.offer(Label::new(family, start.node, how, parent, number as u64));
            }
        }
    }

    /// The value of a label that is where the search leads.
    fn goal_value(&self, taken: &Label) -> Option<Value> {
        let arrived = self.terms.value(&taken.family);
        match self.goal {
            Goal::Destination => (taken.node == self.terms.request.destination).then_some(arrived),
            Goal::Alternate { stay_s } => {
                let lands_s = self.lands_safely_s(taken, stay_s)?;
                Some(Value {
                    arrives_s: lands_s,
                    ..arrived
                })
            }
            Goal::AnyNode => {
                let arrives_s = taken.family.lo_s + self.terms.world.legs.vertical_s(taken.node);
                self.may_land(taken).then_some(Value {
                    arrives_s,
                    ..arrived
                })
            }
            Goal::Nowhere | Goal::Near => None,
        }
    }

    /// A label that has come by a leg had to be let in. Who would take off only to land at the same node stays on its pad instead.
    fn may_land(&self, taken: &Label) -> bool {
        let Expander { world, request, .. } = self.terms;
        match taken.how {
            How::Leg { .. } => return true,
            How::Stop { .. } => return false,
            How::Start(number) if request.starts[usize::from(number)].on_ground => return false,
            How::Start(_) => {}
        }
        let (began_s, at_s) = (request.began_s, taken.family.lo_s);
        let obstacles = world.obstacles;
        !obstacles.forbids_landing(world, began_s, taken.node, at_s)
    }

    /// The earliest landing of a label on a pad that is free for so many seconds from then on.
    fn lands_safely_s(&self, taken: &Label, stay_s: f64) -> Option<f64> {
        let Expander { world, .. } = self.terms;
        let (node, family) = (taken.node, &taken.family);
        if !self.may_land(taken) {
            return None;
        }
        let vertical_s = world.legs.vertical_s(node);
        let lands_s = family.lo_s + vertical_s;
        let suffices = |&lands_s: &f64| world.pads.stay_until_s(node, lands_s) >= lands_s + stay_s;
        let later = world.pads.rises(node).map(|(rises_s, _)| rises_s);
        let later =
            later.filter(|&rises_s| lands_s < rises_s && rises_s <= family.hi_s + vertical_s);
        std::iter::once(lands_s).chain(later).find(suffices)
    }

    /// A label at the goal.
    fn arrive(&mut self, label: u32, taken: &Label, value: Value) {
        if value.weight == self.best.weight && self.improved && self.mode == Mode::Hovering {
            // The first one had the earliest arrival of this weight; this one came by another way, or stopped elsewhere.
            self.may_tie |= self.scratch.labels[label as usize].way != self.way_found();
        }
        if !value.beats(self.best) {
            return;
        }
        self.best = value;
        self.improved = true;
        let steps = match self.mode {
            Mode::Hovering => &mut self.scratch.relaxed,
            Mode::Earlier | Mode::Exact => &mut self.scratch.best,
        };
        ItineraryScratch::history(&self.scratch.labels, label, steps);
        self.scratch.way_found = taken.way;
    }

    fn way_found(&self) -> u64 {
        self.scratch.way_found
    }

    /// True where the walk down the tree from a label is not part of its parent's.
    fn leaves_tree(&self, label: &Label) -> bool {
        match label.how {
            How::Start(_) => true,
            How::Stop { .. } => false,
            How::Leg { leg, .. } => {
                let twin = self.terms.world.legs.leg(leg).twin;
                let from = self.terms.world.legs.leg(twin).to;
                self.terms.potentials.next(from) != Some(leg)
            }
        }
    }

    /// Walks down the tree; true where nothing else can come of the label.
    fn walk_on(&mut self, label: u32, taken: &Label, key: Value) -> bool {
        self.effort.walks += 1;
        let from = From {
            family: &taken.family,
            node: taken.node,
            how: taken.how,
        };
        let checks = &mut self.effort.checks;
        let end = walk(
            &self.terms,
            from,
            Along::Tree,
            self.best,
            self.scratch,
            checks,
        );
        let Some(end) = end else {
            return false;
        };
        if end.value.beats(self.best) {
            self.best = end.value;
            self.improved = true;
            let ItineraryScratch {
                labels,
                walked,
                best,
                ..
            } = &mut *self.scratch;
            ItineraryScratch::history(labels, label, best);
            append_steps(walked, end.last, best);
        }
        let is_lightest = end.value.weight == key.weight && end.is_complete;
        is_lightest && self.terms.potentials.is_only_way(taken.node)
    }

    /// Offers all that can follow a label.
    fn expand(&mut self, label: u32, taken: &Label) {
        let mut offers = std::mem::take(&mut self.scratch.offers);
        let node = taken.node;
        let departure = Departure {
            family: &taken.family,
            from: node,
            leaving: self.terms.leaving(taken.how),
            takes_off: self.terms.takes_off(taken.how),
        };
        for leg in self.terms.world.legs.from(node) {
            let way = next_way(taken.way, leg);
            if self.is_in_vain(departure, leg, (label, way)) {
                continue;
            }
            offers.clear();
            let mut room = self.scratch.buffers(&mut offers);
            match self.mode {
                Mode::Hovering => self.terms.fly_relaxed(departure, leg, &mut room),
                Mode::Earlier | Mode::Exact => self.terms.fly(departure, leg, &mut room),
            }
            self.effort.checks += room.checks_of_flight();
            let to = self.terms.world.legs.leg(leg).to;
            self.offer_all(&offers, to, label, way);
        }
        // Where hovering is free, who stands there may also land there: so nothing that comes back later can do more.
        let may_stop = self.terms.may_stop(taken.how)
            || (self.mode == Mode::Hovering && matches!(taken.how, How::Start(_)));
        let stops_here = may_stop && self.goal.allows_stops();
        if self.terms.world.pads.is_station(node) && stops_here {
            offers.clear();
            let mut room = self.scratch.buffers(&mut offers);
            match self.mode {
                Mode::Hovering => self.terms.stop_relaxed(&taken.family, node, &mut room),
                Mode::Earlier | Mode::Exact => self.terms.stop(&taken.family, node, &mut room),
            }
            self.offer_all(&offers, node, label, taken.way);
        }
        self.scratch.offers = offers;
    }

    fn offer_all(&mut self, offers: &[(ChargingLabel, How)], node: NodeIx, parent: u32, way: u64) {
        for &(family, how) in offers {
            self.offer(Label::new(family, node, how, parent, way));
        }
    }

    /// True where even what would come of a leg that nothing forbids is needless: so that nobody has to look up what does.
    fn is_in_vain(
        &mut self,
        departure: Departure<'_>,
        leg: u32,
        (parent, way): (u32, u64),
    ) -> bool {
        let Expander { world, .. } = self.terms;
        let flight = world.legs.leg(leg);
        let is_clear = world.obstacles.is_clear(
            &self.scratch.active,
            flight.segment,
            departure.from,
            flight.to,
        );
        if is_clear || !world.legs.changes_s().is_empty() {
            return false;
        }
        let unhindered = self.terms.fly_unhindered(departure.family, leg);
        let how = How::Leg { leg, period: 0 };
        unhindered
            .is_none_or(|family| self.is_needless(&Label::new(family, flight.to, how, parent, way)))
    }
}

/// Tells ways apart: a hash of the legs flown.
fn next_way(way: u64, leg: u32) -> u64 {
    let mixed = (way ^ u64::from(leg)).wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed ^ (mixed >> 27)
}
