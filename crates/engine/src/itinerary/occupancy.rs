//! Who takes which segment and which pad when, in maps that successive states of an edge share.
//!
//! A change costs what it changes: the entries of the segments and nodes of one version of a plan. A
//! search borrows the maps, leaves out its own plan, and copies nothing.

use super::owner::Owner;
use super::pad_stays::PadStays;
use crate::airspace::Bits;
use crate::flight::{Reservation, TrafficLeg};
use crate::network::{NodeIx, SegmentIx};
use imbl::{OrdMap, Vector};
use std::sync::Arc;

/// A leg of a plan on a segment, on the clock of the occupancy.
#[derive(Clone, Debug, PartialEq)]
pub struct OccupiedLeg {
    /// Whose it is.
    pub plan: Owner,
    /// Which version of the plan.
    pub version: u32,
    /// Which leg of the version, counted from 0.
    pub leg: u32,
    /// The node it is entered from.
    pub from: NodeIx,
    /// When it is entered.
    pub enters_s: f64,
    /// When it is left.
    pub leaves_s: f64,
    /// Whether it is known no more than that its drone is on the segment between these times, if at all.
    pub is_uncertain: bool,
}

/// A stay of a plan on a pad, on the clock of the occupancy.
#[derive(Clone, Debug, PartialEq)]
pub struct OccupiedPad {
    /// Whose it is.
    pub plan: Arc<str>,
    /// Which version of the plan.
    pub version: u32,
    /// Which stay of the version, counted from 0.
    pub number: u32,
    /// The pad, counted from 0.
    pub pad: u16,
    /// From when.
    pub from_s: f64,
    /// Until when; another drone may land then.
    pub until_s: f64,
}

/// The legs on one segment.
#[derive(Clone, Debug, Default)]
pub(super) struct SegmentLegs {
    /// By when they are entered.
    by_entry: Vec<OccupiedLeg>,
    /// None of them takes longer, in seconds.
    longest_s: f64,
}

impl SegmentLegs {
    fn retain(&mut self, mut stays: impl FnMut(&OccupiedLeg) -> bool) {
        self.by_entry.retain(|leg| stays(leg));
        let times_s = self.by_entry.iter().map(|leg| leg.leaves_s - leg.enters_s);
        self.longest_s = times_s.fold(0.0, f64::max);
    }

    /// By when they are entered.
    pub(super) fn by_entry(&self) -> &[OccupiedLeg] {
        &self.by_entry
    }

    /// Those of which part may lie between two instants.
    fn between(&self, from_s: f64, until_s: f64) -> impl Iterator<Item = &OccupiedLeg> {
        let earliest_s = from_s - self.longest_s;
        let first = self
            .by_entry
            .partition_point(|leg| leg.enters_s < earliest_s);
        let begun = self.by_entry[first..].iter();
        begun
            .take_while(move |leg| leg.enters_s <= until_s)
            .filter(move |leg| leg.leaves_s >= from_s)
    }
}

/// What the plans of an edge take. Cheap to clone.
#[derive(Clone, Debug, Default)]
pub struct Occupancy {
    /// By segment, as far as any has had legs.
    legs: Vector<Option<Arc<SegmentLegs>>>,
    /// How many segments have some.
    taken_segments: usize,
    /// Another one whenever any leg changes.
    state_of_legs: Arc<()>,
    stays: OrdMap<u32, Arc<PadStays>>,
    /// The segments that have legs, as searches ask for each leg they look at.
    busy: Arc<Bits>,
    /// The nodes on whose pads a plan stays.
    nodes_of: OrdMap<Arc<str>, Arc<Vec<NodeIx>>>,
}

impl Occupancy {
    /// Adds a leg on a segment, in place of the one that this version has under its number.
    pub fn put_leg(&mut self, segment: SegmentIx, leg: OccupiedLeg) {
        self.state_of_legs = Arc::default();
        while self.legs.len() <= segment.at() {
            self.legs.push_back(None);
        }
        let Some(there) = self.legs.get_mut(segment.at()) else {
            return;
        };
        let there = Arc::make_mut(there.get_or_insert_default());
        there.by_entry.retain(|other| !other.is_same(&leg));
        let after = |other: &OccupiedLeg| other.enters_s <= leg.enters_s;
        let place = there.by_entry.partition_point(after);
        there.longest_s = there.longest_s.max(leg.leaves_s - leg.enters_s);
        there.by_entry.insert(place, leg);
        if !self.is_busy(segment) {
            Arc::make_mut(&mut self.busy).insert_growing(segment.0);
            self.taken_segments += 1;
        }
    }

    /// Removes a leg.
    pub fn remove_leg(&mut self, segment: SegmentIx, plan: &str, version: u32, leg: u32) {
        let Some(place) = self.legs.get_mut(segment.at()) else {
            return;
        };
        let Some(there) = place else {
            return;
        };
        let is_it = |other: &OccupiedLeg| {
            other.version == version && other.leg == leg && *other.plan == *plan
        };
        self.state_of_legs = Arc::default();
        if there.by_entry.iter().any(is_it) {
            Arc::make_mut(there).retain(|other| !is_it(other));
        }
        if there.by_entry.is_empty() {
            *place = None;
            Arc::make_mut(&mut self.busy).remove(segment.0);
            self.taken_segments -= 1;
        }
    }

    /// Adds a stay at a node, in place of the one that this version has under its number.
    pub fn put_stay(&mut self, node: NodeIx, stay: OccupiedPad) {
        let nodes = Arc::make_mut(self.nodes_of.entry(stay.plan.clone()).or_default());
        if !nodes.contains(&node) {
            nodes.push(node);
        }
        Arc::make_mut(self.stays.entry(node.0).or_default()).put(stay);
    }

    /// Removes a stay.
    pub fn remove_stay(&mut self, node: NodeIx, plan: &str, version: u32, number: u32) {
        let Some(there) = self.stays.get_mut(&node.0) else {
            return;
        };
        let is_it = |other: &OccupiedPad| {
            other.version == version && other.number == number && *other.plan == *plan
        };
        if there.all().iter().any(is_it) {
            Arc::make_mut(there).retain(|other| !is_it(other));
        }
        let is_gone = !there.all().iter().any(|other| *other.plan == *plan);
        if there.all().is_empty() {
            self.stays.remove(&node.0);
        }
        if is_gone {
            self.forget_node(plan, node);
        }
    }

    fn forget_node(&mut self, plan: &str, node: NodeIx) {
        let Some(nodes) = self.nodes_of.get_mut(plan) else {
            return;
        };
        Arc::make_mut(nodes).retain(|other| *other != node);
        if nodes.is_empty() {
            self.nodes_of.remove(plan);
        }
    }

    /// The legs on a segment, by when they are entered.
    pub fn legs_on(&self, segment: SegmentIx) -> &[OccupiedLeg] {
        self.legs_of(segment).map_or(&[], |legs| &legs.by_entry)
    }

    /// The stays at a node, in no order.
    pub fn stays_at(&self, node: NodeIx) -> &[OccupiedPad] {
        self.stays.get(&node.0).map_or(&[], |stays| stays.all())
    }

    fn legs_of(&self, segment: SegmentIx) -> Option<&Arc<SegmentLegs>> {
        let is_busy = self.is_busy(segment);
        is_busy.then(|| self.legs.get(segment.at())?.as_ref())?
    }

    /// Whether a segment has legs.
    #[inline]
    fn is_busy(&self, segment: SegmentIx) -> bool {
        self.busy.holds(segment.0)
    }

    /// The nodes on whose pads a plan stays.
    fn nodes_of(&self, plan: &str) -> &[NodeIx] {
        self.nodes_of.get(plan).map_or(&[], |nodes| nodes)
    }
}

impl OccupiedLeg {
    /// In seconds from an instant.
    pub(super) fn since(&self, segment: SegmentIx, zero_s: f64) -> TrafficLeg {
        TrafficLeg {
            segment,
            from: self.from,
            enters_s: self.enters_s - zero_s,
            leaves_s: self.leaves_s - zero_s,
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        (self.version, self.leg) == (other.version, other.leg) && self.plan == other.plan
    }
}

/// What all plans take but a drone's own, in the seconds of a search. Cheap to clone.
#[derive(Clone, Debug, Default)]
pub struct OthersOccupancy {
    occupancy: Occupancy,
    own: [Option<Owner>; 2],
    /// Second 0 of the search on the clock of the occupancy.
    zero_s: f64,
}

impl OthersOccupancy {
    /// An occupancy without the drone's own plans, in seconds from `zero_s` on its clock.
    pub fn of(occupancy: Occupancy, own: [Option<Arc<str>>; 2], zero_s: f64) -> Self {
        Self {
            occupancy,
            own: own.map(|plan| plan.map(Owner::from)),
            zero_s,
        }
    }

    /// Plain facts, none of them the drone's own, in the seconds of the search.
    pub fn from_facts(reservations: &[Reservation], traffic: &[TrafficLeg]) -> Self {
        let mut occupancy = Occupancy::default();
        let plan = Owner::from(Arc::from(""));
        for (number, leg) in (0..).zip(traffic) {
            let occupied = OccupiedLeg {
                plan: plan.clone(),
                version: 0,
                leg: number,
                from: leg.from,
                enters_s: leg.enters_s,
                leaves_s: leg.leaves_s,
                is_uncertain: false,
            };
            occupancy.put_leg(leg.segment, occupied);
        }
        let mut others = Self::of(occupancy, [None, None], 0.0);
        for (number, stay) in (0..).zip(reservations) {
            others.take_pad(stay, number);
        }
        others
    }

    /// The same with pads that are taken beside them.
    #[must_use]
    pub fn with_taken(mut self, taken: &[Reservation]) -> Self {
        // Of no plan, and numbered from the other end than what `from_facts` numbers.
        for (number, stay) in (0..).zip(taken) {
            self.take_pad(stay, u32::MAX - number);
        }
        self
    }

    fn take_pad(&mut self, stay: &Reservation, number: u32) {
        let occupied = OccupiedPad {
            plan: Arc::from(""),
            version: 0,
            number,
            pad: stay.pad,
            from_s: stay.from_s + self.zero_s,
            until_s: stay.until_s + self.zero_s,
        };
        self.occupancy.put_stay(stay.node, occupied);
    }

    /// Second 0 of the search on the clock of the occupancy.
    pub fn zero_s(&self) -> f64 {
        self.zero_s
    }

    /// Whether a plan is the drone's own.
    #[inline]
    pub fn is_own(&self, plan: &str) -> bool {
        self.own.iter().flatten().any(|own| **own == *plan)
    }

    /// False where no plan of the drone's own has this hash.
    #[inline]
    pub(super) fn may_be_own(&self, hash: u64) -> bool {
        self.own.iter().flatten().any(|own| own.hash() == hash)
    }

    /// Whether a leg is of a plan of the drone's own.
    #[inline]
    fn owns(&self, leg: &OccupiedLeg) -> bool {
        self.own.iter().flatten().any(|own| *own == leg.plan)
    }

    /// Whether any plan is in the air at some time, be it the drone's own.
    #[inline]
    pub fn is_in_the_air(&self) -> bool {
        self.occupancy.taken_segments > 0
    }

    /// The segments that have legs, be they the drone's own; rising.
    fn busy_segments(&self) -> impl Iterator<Item = u32> + '_ {
        self.occupancy.busy.iter()
    }

    /// The legs of others on a segment, by when they are entered.
    pub fn legs_on(&self, segment: SegmentIx) -> impl Iterator<Item = TrafficLeg> + '_ {
        let there = self.occupancy.legs_on(segment).iter();
        let others = there.filter(|leg| !self.owns(leg));
        others.map(move |leg| self.in_seconds(segment, leg))
    }

    /// The legs of others on a segment of which part may lie between two instants of the search, with whose
    /// they are.
    pub(super) fn legs_between(
        &self,
        segment: SegmentIx,
        (from_s, until_s): (f64, f64),
    ) -> impl Iterator<Item = (&OccupiedLeg, TrafficLeg)> {
        let there = self.occupancy.legs_of(segment);
        let (from_s, until_s) = (from_s + self.zero_s, until_s + self.zero_s);
        let near = there
            .into_iter()
            .flat_map(move |there| there.between(from_s, until_s));
        let others = near.filter(|leg| !self.owns(leg));
        others.map(move |leg| (leg, self.in_seconds(segment, leg)))
    }

    /// The same one as long as no leg of any plan has changed.
    pub(super) fn state_of_legs(&self) -> &Arc<()> {
        &self.occupancy.state_of_legs
    }

    /// The legs of all plans on a segment, the drone's own included, on the clock of the occupancy.
    pub(super) fn all_on(&self, segment: SegmentIx) -> Option<&Arc<SegmentLegs>> {
        self.occupancy.legs_of(segment)
    }

    fn in_seconds(&self, segment: SegmentIx, leg: &OccupiedLeg) -> TrafficLeg {
        leg.since(segment, self.zero_s)
    }

    /// The plan that flies a leg.
    pub fn plan_of(&self, leg: &TrafficLeg) -> Option<&Arc<str>> {
        let mut there = self.occupancy.legs_on(leg.segment).iter();
        let found =
            there.find(|other| !self.owns(other) && self.in_seconds(leg.segment, other) == *leg);
        found.map(|other| other.plan.id())
    }

    /// The stays of others at a node.
    pub fn stays_at(&self, node: NodeIx) -> impl Iterator<Item = Reservation> + '_ {
        let there = self.occupancy.stays_at(node).iter();
        let others = there.filter(|stay| !self.is_own(&stay.plan));
        others.map(move |stay| Reservation {
            node,
            pad: stay.pad,
            from_s: stay.from_s - self.zero_s,
            until_s: stay.until_s - self.zero_s,
        })
    }

    /// All stays at a node on the clock of the occupancy, with what follows from them.
    pub(super) fn pad_stays(&self, node: NodeIx) -> Option<&PadStays> {
        self.occupancy.stays.get(&node.0).map(|stays| &**stays)
    }

    /// The nodes on whose pads any plan stays, rising.
    pub(super) fn nodes_with_stays(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.occupancy.stays.keys().map(|&node| NodeIx(node))
    }

    /// The nodes on whose pads the drone's own plans stay.
    pub(super) fn own_nodes(&self) -> impl Iterator<Item = NodeIx> + '_ {
        let own = self.own.iter().flatten();
        own.flat_map(|plan| self.occupancy.nodes_of(plan)).copied()
    }

    /// All legs of others, as plain facts.
    pub fn traffic(&self) -> Vec<TrafficLeg> {
        let segments = self.busy_segments().map(SegmentIx);
        segments.flat_map(|segment| self.legs_on(segment)).collect()
    }

    /// All stays of others, as plain facts.
    pub fn reservations(&self) -> Vec<Reservation> {
        let nodes = self.nodes_with_stays();
        nodes.flat_map(|node| self.stays_at(node)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leg(plan: &str, version: u32, enters_s: f64) -> OccupiedLeg {
        OccupiedLeg {
            plan: Owner::from(Arc::from(plan)),
            version,
            leg: 0,
            from: NodeIx(0),
            enters_s,
            leaves_s: enters_s + 10.0,
            is_uncertain: false,
        }
    }

    fn stay(plan: &str, pad: u16, from_s: f64) -> OccupiedPad {
        OccupiedPad {
            plan: Arc::from(plan),
            version: 1,
            number: 0,
            pad,
            from_s,
            until_s: from_s + 60.0,
        }
    }

    #[test]
    fn what_a_plan_took_is_free_again_and_earlier_states_keep_it() {
        let mut occupancy = Occupancy::default();
        occupancy.put_leg(SegmentIx(7), leg("a", 1, 100.0));
        occupancy.put_leg(SegmentIx(7), leg("b", 1, 200.0));
        occupancy.put_stay(NodeIx(3), stay("a", 0, 100.0));
        let before = occupancy.clone();
        occupancy.remove_leg(SegmentIx(7), "a", 1, 0);
        occupancy.remove_leg(SegmentIx(7), "b", 1, 0);
        occupancy.remove_stay(NodeIx(3), "a", 1, 0);
        assert!(!occupancy.is_busy(SegmentIx(7)));
        assert!(occupancy.stays_at(NodeIx(3)).is_empty());
        assert!(occupancy.nodes_of("a").is_empty());
        assert_eq!(before.legs_on(SegmentIx(7)).len(), 2);
        assert_eq!(before.nodes_of("a"), [NodeIx(3)]);
    }

    #[test]
    fn a_leg_put_again_replaces_itself() {
        let mut occupancy = Occupancy::default();
        occupancy.put_leg(SegmentIx(7), leg("a", 1, 100.0));
        occupancy.put_leg(SegmentIx(7), leg("a", 1, 150.0));
        occupancy.put_leg(SegmentIx(7), leg("a", 2, 150.0));
        assert_eq!(occupancy.legs_on(SegmentIx(7)).len(), 2);
    }

    #[test]
    fn a_drone_is_not_in_its_own_way() {
        let mut occupancy = Occupancy::default();
        occupancy.put_leg(SegmentIx(7), leg("a", 1, 1_100.0));
        occupancy.put_leg(SegmentIx(7), leg("b", 1, 1_200.0));
        occupancy.put_stay(NodeIx(3), stay("a", 0, 1_100.0));
        occupancy.put_stay(NodeIx(3), stay("b", 1, 1_100.0));
        let others = OthersOccupancy::of(occupancy, [Some(Arc::from("a")), None], 1_000.0);
        let legs = others.traffic();
        assert_eq!(legs.len(), 1);
        assert_eq!(legs[0].enters_s, 200.0);
        assert_eq!(others.plan_of(&legs[0]).map(|plan| &**plan), Some("b"));
        assert_eq!(others.reservations().len(), 1);
        assert_eq!(others.reservations()[0].pad, 1);
    }
}
