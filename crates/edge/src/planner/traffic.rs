//! What plans take of the air and of the pads, and whether one more would meet them.

use super::Version;
use crate::plans::entry::PlanEntry;
use imbl::OrdMap;
use jiff::Timestamp;
use skyway_engine::compose::{Occupation, conflicts};
use skyway_engine::flight::Reservation;
use skyway_engine::itinerary::{Occupancy, OccupiedLeg, OccupiedPad, OthersOccupancy, Owner};
use skyway_engine::network::{NodeIx, SegmentIx};
use std::sync::Arc;

/// Stays on a pad that overlap by less, in seconds, are one behind the other: instants are rounded.
const OVERLAP_S: f64 = 1e-3;

/// A version's legs on segments, in seconds of Unix time.
pub(crate) fn legs(
    plan: &Arc<str>,
    version: &Version,
) -> impl Iterator<Item = (SegmentIx, OccupiedLeg)> {
    let (plan, number) = (Owner::from(plan.clone()), version.number);
    let all = version.occupations().into_iter();
    all.map(move |leg| (leg.segment, occupied(&leg, plan.clone(), number)))
}

/// A leg as plans take it.
pub(crate) fn occupied(leg: &Occupation, plan: Owner, version: u32) -> OccupiedLeg {
    OccupiedLeg {
        plan,
        version,
        leg: u32::try_from(leg.leg).unwrap_or(u32::MAX),
        from: leg.from,
        enters_s: leg.enters_s,
        leaves_s: leg.leaves_s,
        is_uncertain: false,
    }
}

/// A version's stays on pads, in seconds of Unix time.
pub(crate) fn stays(
    plan: &Arc<str>,
    version: &Version,
) -> impl Iterator<Item = (NodeIx, OccupiedPad)> {
    let (plan, number_of_version) = (plan.clone(), version.number);
    let all = version.reservations().into_iter().zip(0..);
    all.map(move |(stay, number)| {
        let occupied = OccupiedPad {
            plan: plan.clone(),
            version: number_of_version,
            number,
            pad: stay.pad,
            from_s: stay.from_s,
            until_s: stay.until_s,
        };
        (stay.node, occupied)
    })
}

/// What a drone takes itself, so that it is not in its own way: its plan, and the pad on which it
/// stands since the plan before.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Own<'a> {
    plan: Option<&'a str>,
    /// The plan with which it came to the pad on which it stands.
    pub(super) landed: Option<&'a str>,
}

impl Own<'_> {
    /// Whether what is taken for this plan is its own.
    pub(crate) fn has(self, plan: &str) -> bool {
        self.plan == Some(plan) || self.landed == Some(plan)
    }
}

/// What all plans take of the air and of the pads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Traffic<'a> {
    /// Who is on which segment and on which pad when, in seconds of Unix time.
    pub(crate) occupancy: &'a Occupancy,
    /// The ended plan with which each drone has landed that still stands on its pad.
    pub(crate) landed: &'a OrdMap<Arc<str>, Arc<str>>,
}

impl<'a> Traffic<'a> {
    /// What a drone takes itself, and its plan.
    pub(crate) fn own(self, plan: Option<&'a str>, drone: Option<&str>) -> Own<'a> {
        let landed = drone.and_then(|drone| self.landed.get(drone));
        Own {
            plan,
            landed: landed.map(|plan| &**plan),
        }
    }

    /// What the drone of a plan takes itself.
    pub(crate) fn own_of_plan(self, plan: &'a PlanEntry) -> Own<'a> {
        self.own(Some(&plan.id), plan.drone_id.as_deref())
    }

    /// All stays at a node.
    pub(crate) fn stays_at(self, node: NodeIx) -> &'a [OccupiedPad] {
        self.occupancy.stays_at(node)
    }

    /// All legs on a segment.
    pub(crate) fn on(self, segment: SegmentIx) -> &'a [OccupiedLeg] {
        self.occupancy.legs_on(segment)
    }

    /// What all plans take but the drone's own, in seconds from an instant.
    pub(super) fn others(self, own: Own<'_>, zero: Timestamp) -> OthersOccupancy {
        let own = [own.plan, own.landed].map(|plan| plan.map(Arc::from));
        OthersOccupancy::of(self.occupancy.clone(), own, unix_s(zero))
    }

    /// The plan that has a pad at a time at which this version of a plan would take it too.
    pub(crate) fn shares_pad(
        self,
        own: Own<'_>,
        version: &Version,
    ) -> Option<(Reservation, Arc<str>)> {
        self.shares_pad_with(own, version, &|_| true)
    }

    pub(super) fn shares_pad_with(
        self,
        own: Own<'_>,
        version: &Version,
        counts: &dyn Fn(&str) -> bool,
    ) -> Option<(Reservation, Arc<str>)> {
        version.reservations().into_iter().find_map(|wanted| {
            let mut others = self.stays_at(wanted.node).iter();
            let met = others.find(|stay| {
                !own.has(&stay.plan)
                    && counts(&stay.plan)
                    && stay.pad == wanted.pad
                    && wanted.from_s + OVERLAP_S < stay.until_s
                    && stay.from_s + OVERLAP_S < wanted.until_s
            });
            met.map(|stay| (wanted, stay.plan.clone()))
        })
    }

    /// Whether a version of a plan would meet another one that counts on a segment, or on a pad.
    pub(super) fn meets(
        self,
        own: Own<'_>,
        version: &Version,
        headway_s: f64,
        counts: &dyn Fn(&str) -> bool,
    ) -> bool {
        let meets_in_the_air = |leg: &Occupation| {
            let others = self.on(leg.segment).iter();
            let mut others = others.filter(|other| !own.has(&other.plan) && counts(&other.plan));
            others.any(|other| {
                let other = occupation(leg.segment, other);
                let [leg, other] = [std::slice::from_ref(leg), std::slice::from_ref(&other)];
                !conflicts(leg, other, headway_s).is_empty()
            })
        };
        let is_apart = headway_s <= 0.0 || !version.occupations().iter().any(meets_in_the_air);
        !is_apart || self.shares_pad_with(own, version, counts).is_some()
    }
}

/// A leg that a plan takes, as conflicts are looked for.
pub(crate) fn occupation(segment: SegmentIx, leg: &OccupiedLeg) -> Occupation {
    Occupation {
        segment,
        from: leg.from,
        leg: leg.leg as usize,
        enters_s: leg.enters_s,
        leaves_s: leg.leaves_s,
    }
}

fn unix_s(instant: Timestamp) -> f64 {
    instant.as_microsecond() as f64 / 1e6
}
