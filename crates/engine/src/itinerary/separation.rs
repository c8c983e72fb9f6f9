//! How plans keep apart: when a leg may not be entered because another plan is near.
//!
//! - On one segment entries in the same direction are more than the headway apart; in opposite directions
//!   only one is on it.
//! - At a node two plans pass or land at least the headway of nodes apart.
//! - Where two segments cross only one plan is near the crossing; where that is at a node, plans are there at
//!   least the headway of nodes apart.

use super::active_traffic::ActiveTraffic;
use super::entry::{Entry, Leaving};
use super::occupancy::{OccupiedLeg, OthersOccupancy};
use crate::flight::{Crossing, Crossings, FlightPlan, FlightRules, Stretch, TrafficLeg};
use crate::network::{NodeIx, SegmentIx, Topology};

/// Entries within the headway of another plan's, the headway itself included, conflict; this much more, in
/// seconds, does not.
const HEADWAY_STEP_S: f64 = 1e-3;
/// Plans that are nearer by less, in seconds, touch: instants that were stored are rounded.
const TOUCH_S: f64 = 1e-3;

/// By what plans on a network keep apart.
#[derive(Clone, Copy, Debug)]
pub struct Separation<'a> {
    /// The network.
    pub topology: &'a Topology,
    /// Where its segments come near each other.
    pub crossings: &'a Crossings,
    /// How far apart.
    pub rules: &'a FlightRules,
}

/// From which end of its segment a leg is entered that another plan is in the way of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entered {
    Either,
    First,
    Last,
}

/// How another plan comes near a leg: it forbids entries between two instants, ends excluded, which are the earlier the longer
/// the leg takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Approach {
    /// When the other plan enters its leg, on the clock of that, in seconds.
    entered_s: f64,
    /// What it forbids, from then on, of a leg that takes no time. Apart from the instant, which has few digits after the point
    /// on the clock of plans: so it is the same to the last bit in the seconds of a search.
    from_s: f64,
    until_s: f64,
    /// Where the leg is near the other plan: from its first node on, or as it is entered where that tells which entries it is of.
    own: Stretch,
    entered: Entered,
}

impl Approach {
    /// When it begins at the latest, on the clock of the other plan, but for rounding.
    #[inline]
    pub(super) fn begins_s(&self) -> f64 {
        self.entered_s + self.from_s
    }

    /// How long it lasts, where the leg takes no time.
    pub(super) fn lasts_s(&self) -> f64 {
        self.until_s - self.from_s
    }

    /// What it forbids of entries from the first node of the segment, or from the last, in seconds from an instant on the clock
    /// of the other plan, where the leg takes so long; `None` for none.
    #[inline]
    pub(super) fn of_entry(
        &self,
        from_first: bool,
        time_s: f64,
        zero_s: f64,
    ) -> Option<(f64, f64)> {
        let own = match (self.entered, from_first) {
            (Entered::Either, false) => self.own.reversed(),
            (Entered::Either, true) | (Entered::First, true) | (Entered::Last, false) => self.own,
            (Entered::First, false) | (Entered::Last, true) => return None,
        };
        let entered_s = self.entered_s - zero_s;
        Some((
            entered_s + self.from_s - own.leaves * time_s,
            entered_s + self.until_s - own.enters * time_s,
        ))
    }
}

/// Another plan that forbids an entry between two instants, ends excluded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearness<'o> {
    pub(super) other: &'o OccupiedLeg,
    /// Its leg in the seconds of the search.
    pub(super) leg: TrafficLeg,
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    /// How long after the entry it forbids the drone is past the place, in seconds.
    passed_s: f64,
}

impl Nearness<'_> {
    fn forbids(&self, enters_s: f64) -> bool {
        self.from_s + TOUCH_S < enters_s && enters_s < self.until_s - TOUCH_S
    }
}

impl Separation<'_> {
    /// Whether plans keep apart at all.
    fn is_kept(&self) -> bool {
        self.rules.headway_s > 0.0
    }

    /// The legs that could be too near to one that is entered at some time of a stretch.
    fn reach_s(&self, entry: Entry, (first_s, last_s): (f64, f64)) -> (f64, f64) {
        let rules = self.rules;
        let headway_s = rules.headway_s.max(rules.node_headway_s) + HEADWAY_STEP_S;
        (first_s - headway_s, last_s + entry.time_s + headway_s)
    }

    /// Tells `take` what forbids entries of a leg within a stretch of time, on its segment and where others
    /// cross it.
    pub(super) fn on_segment<'o>(
        &self,
        others: &'o OthersOccupancy,
        entry: Entry,
        within_s: (f64, f64),
        take: &mut dyn FnMut(Nearness<'o>),
    ) {
        let segment = SegmentIx(entry.segment);
        let reach_s = self.reach_s(entry, within_s);
        let first_node = self.topology.segment(segment).from;
        let from_first = first_node == entry.from;
        for (other, leg) in others.legs_between(segment, reach_s) {
            let approaches = self.along(first_node, &leg, other.is_uncertain);
            for approach in approaches {
                if let Some((from_s, until_s)) = approach.of_entry(from_first, entry.time_s, 0.0) {
                    take(Nearness {
                        other,
                        leg,
                        from_s,
                        until_s,
                        passed_s: entry.time_s,
                    });
                }
            }
        }
        for crossing in self.crossings.on(segment) {
            let own = match from_first {
                true => crossing.own,
                false => crossing.own.reversed(),
            };
            let passed_s = own.leaves * entry.time_s + self.apart_s(crossing);
            for (other, leg) in others.legs_between(crossing.other, reach_s) {
                let approach = self.across(crossing, &leg, other.is_uncertain);
                if let Some((from_s, until_s)) = approach.of_entry(from_first, entry.time_s, 0.0) {
                    take(Nearness {
                        other,
                        leg,
                        from_s,
                        until_s,
                        passed_s,
                    });
                }
            }
        }
    }

    /// How a leg comes near others on its segment, whose first node this is: near those from the same end, and near those from
    /// the other.
    pub(super) fn along(
        &self,
        first_node: NodeIx,
        leg: &TrafficLeg,
        is_uncertain: bool,
    ) -> [Approach; 2] {
        let apart_s = self.rules.headway_s + HEADWAY_STEP_S;
        let (same, opposite) = match leg.from == first_node {
            true => (Entered::First, Entered::Last),
            false => (Entered::Last, Entered::First),
        };
        let time_s = leg.leaves_s - leg.enters_s;
        let behind = match is_uncertain {
            true => Approach {
                entered_s: leg.enters_s,
                from_s: -apart_s,
                until_s: time_s + apart_s,
                own: Stretch::WHOLE,
                entered: same,
            },
            false => Approach {
                entered_s: leg.enters_s,
                from_s: -apart_s,
                until_s: apart_s,
                own: Stretch::ENTRY,
                entered: same,
            },
        };
        let head_on = Approach {
            entered_s: leg.enters_s,
            from_s: 0.0,
            until_s: time_s,
            own: Stretch::WHOLE,
            entered: opposite,
        };
        [behind, head_on]
    }

    /// How a leg comes near those on a segment that crosses its own.
    pub(super) fn across(
        &self,
        crossing: &Crossing,
        leg: &TrafficLeg,
        is_uncertain: bool,
    ) -> Approach {
        let near = match self.topology.segment(crossing.other).from == leg.from {
            _ if is_uncertain => Stretch::WHOLE,
            true => crossing.others,
            false => crossing.others.reversed(),
        };
        let time_s = leg.leaves_s - leg.enters_s;
        let apart_s = self.apart_s(crossing);
        Approach {
            entered_s: leg.enters_s,
            from_s: near.enters * time_s - apart_s,
            until_s: near.leaves * time_s + apart_s,
            own: crossing.own,
            entered: Entered::Either,
        }
    }

    /// How much later or earlier a drone keeps off a crossing, in seconds.
    fn apart_s(&self, crossing: &Crossing) -> f64 {
        match crossing.is_at_node {
            true => self.rules.node_headway_s,
            false => 0.0,
        }
    }

    /// How a leg that begins or ends at a node comes near those who pass it.
    pub(super) fn above(&self, node: NodeIx, leg: &TrafficLeg, is_uncertain: bool) -> Approach {
        let time_s = leg.leaves_s - leg.enters_s;
        let passes_s = match leg.from == node {
            _ if is_uncertain => (0.0, time_s),
            true => (0.0, 0.0),
            false => (time_s, time_s),
        };
        Approach {
            entered_s: leg.enters_s,
            from_s: passes_s.0 - self.rules.node_headway_s,
            until_s: passes_s.1 + self.rules.node_headway_s,
            own: Stretch::ENTRY,
            entered: Entered::Either,
        }
    }

    /// Tells `take` what forbids being above a node `after_s` after the entry of a leg.
    pub(super) fn at_node<'o>(
        &self,
        others: &'o OthersOccupancy,
        (node, after_s): (NodeIx, f64),
        within_s: (f64, f64),
        take: &mut dyn FnMut(Nearness<'o>),
    ) {
        let headway_s = self.rules.node_headway_s;
        if headway_s <= 0.0 {
            return;
        }
        let reach_s = (
            within_s.0 + after_s - headway_s - HEADWAY_STEP_S,
            within_s.1 + after_s + headway_s + HEADWAY_STEP_S,
        );
        for arc in self.topology.arcs(node) {
            for (other, leg) in others.legs_between(arc.segment, reach_s) {
                let approach = self.above(node, &leg, other.is_uncertain);
                if let Some((from_s, until_s)) = approach.of_entry(true, 0.0, 0.0) {
                    take(Nearness {
                        other,
                        leg,
                        from_s: from_s - after_s,
                        until_s: until_s - after_s,
                        passed_s: after_s + headway_s,
                    });
                }
            }
        }
    }

    /// The legs of others that a drone comes too near to from an instant on, each once: on its way back into the
    /// network, and on its plan.
    pub fn met_by(
        &self,
        plan: &FlightPlan,
        since_s: f64,
        others: &OthersOccupancy,
        counts: &dyn Fn(&str) -> bool,
    ) -> Vec<TrafficLeg> {
        let mut met: Vec<TrafficLeg> = Vec::new();
        if !self.is_kept() {
            return met;
        }
        let way_back = plan.start.reentry();
        let way_back = way_back.and_then(|way| way.leg(since_s, plan.start.at_s));
        let way_back = way_back.map(|leg| (leg.enters_s, self.entry_of(&leg)));
        let everywhere = ActiveTraffic::everywhere();
        for (enters_s, entry) in way_back.into_iter().chain(Entry::all_of(plan)) {
            let mut take = |near: Nearness<'_>| {
                let is_ahead = enters_s + near.passed_s > since_s && near.leg.leaves_s > since_s;
                let is_met = is_ahead && near.forbids(enters_s) && counts(&near.other.plan);
                if is_met && !met.contains(&near.leg) {
                    met.push(near.leg);
                }
            };
            self.each(others, &everywhere, entry, (enters_s, enters_s), &mut take);
        }
        met
    }

    /// A leg that is flown through from where a drone is.
    fn entry_of(&self, leg: &TrafficLeg) -> Entry {
        let ends = self.topology.segment(leg.segment);
        Entry {
            segment: leg.segment.0,
            from: leg.from,
            to: match ends.from == leg.from {
                true => ends.to,
                false => ends.from,
            },
            time_s: leg.leaves_s - leg.enters_s,
            leaving: Leaving::FromTheAir,
            takes_off: false,
        }
    }

    /// Tells `take` what forbids entries of a leg within a stretch of time, where others count.
    pub(super) fn each<'o>(
        &self,
        others: &'o OthersOccupancy,
        active: &ActiveTraffic,
        entry: Entry,
        within_s: (f64, f64),
        take: &mut dyn FnMut(Nearness<'o>),
    ) {
        if active.has_segment(SegmentIx(entry.segment)) {
            self.on_segment(others, entry, within_s, take);
        }
        if active.has_node(entry.to) {
            self.at_node(others, (entry.to, entry.time_s), within_s, take);
        }
        if entry.takes_off && active.has_node(entry.from) {
            self.at_node(others, (entry.from, 0.0), within_s, take);
        }
    }

    /// Where a plan meets others that do not count yet, lets them count on all of its way; false where it does not.
    pub(super) fn activate_met(
        &self,
        others: &OthersOccupancy,
        active: &mut ActiveTraffic,
        plan: &FlightPlan,
    ) -> bool {
        if active.is_everywhere() {
            return false;
        }
        let mut met = Vec::new();
        for (enters_s, entry) in Entry::all_of(plan) {
            self.add_met_inactive(others, active, (enters_s, entry), &mut met);
        }
        if !met.is_empty() {
            active.add_way(plan, &met);
        }
        !met.is_empty()
    }

    /// Adds the legs that forbid an entry where others do not count.
    fn add_met_inactive(
        &self,
        others: &OthersOccupancy,
        active: &ActiveTraffic,
        (enters_s, entry): (f64, Entry),
        met: &mut Vec<TrafficLeg>,
    ) {
        let within_s = (enters_s, enters_s);
        let mut take = |near: Nearness<'_>| {
            if near.forbids(enters_s) {
                met.push(near.leg);
            }
        };
        if !active.has_segment(SegmentIx(entry.segment)) {
            self.on_segment(others, entry, within_s, &mut take);
        }
        if !active.has_node(entry.to) {
            self.at_node(others, (entry.to, entry.time_s), within_s, &mut take);
        }
        if entry.takes_off && !active.has_node(entry.from) {
            self.at_node(others, (entry.from, 0.0), within_s, &mut take);
        }
    }
}
