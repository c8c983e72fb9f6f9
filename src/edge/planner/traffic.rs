//! What plans take of the air and of the pads, and whether one more would meet them.

use super::Version;
use crate::compose::{Occupation, conflicts};
use crate::edge::plan_entry::PlanEntry;
use crate::flight::{Reservation, TrafficLeg};
use crate::network::{NodeIx, SegmentIx};
use imbl::OrdMap;
use jiff::Timestamp;
use std::sync::Arc;

/// What ended so long ago, in seconds, is in nobody's way any more.
const OVER_S: f64 = 600.0;
/// Stays on a pad that overlap by less, in seconds, are one behind the other: instants are rounded.
const OVERLAP_S: f64 = 1e-3;

/// Where a plan is on a segment: ordered by segment, then plan, version and leg.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::edge) struct OccupationKey {
    pub(in crate::edge) segment: u32,
    pub(in crate::edge) plan: Arc<str>,
    pub(in crate::edge) version: u32,
    pub(in crate::edge) leg: u32,
}

impl OccupationKey {
    /// Before all that are on a segment.
    pub(in crate::edge) fn first_of(segment: SegmentIx) -> Self {
        Self {
            segment: segment.0,
            plan: Arc::from(""),
            version: 0,
            leg: 0,
        }
    }
}

/// A plan's stay on a pad: ordered by node, then plan, version and number.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::edge) struct PadKey {
    pub(in crate::edge) node: u32,
    pub(in crate::edge) plan: Arc<str>,
    pub(in crate::edge) version: u32,
    pub(in crate::edge) number: u32,
}

impl PadKey {
    /// Before all stays at a node.
    pub(in crate::edge) fn first_of(node: u32) -> Self {
        Self {
            node,
            plan: Arc::from(""),
            version: 0,
            number: 0,
        }
    }
}

/// A version's stays on pads, in seconds of Unix time.
pub(in crate::edge) fn stays(
    plan: &Arc<str>,
    version: &Version,
) -> impl Iterator<Item = (PadKey, Reservation)> {
    let (plan, number_of_version) = (plan.clone(), version.number);
    let all = version.reservations().into_iter().zip(0..);
    all.map(move |(stay, number)| {
        let key = PadKey {
            node: stay.node.0,
            plan: plan.clone(),
            version: number_of_version,
            number,
        };
        (key, stay)
    })
}

/// What a drone takes itself, so that it is not in its own way: its plan, and the pad on which it
/// stands since the plan before.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::edge) struct Own<'a> {
    plan: Option<&'a str>,
    landed: Option<&'a str>,
}

impl Own<'_> {
    /// Whether what is taken for this plan is its own.
    pub(in crate::edge) fn has(self, plan: &str) -> bool {
        self.plan == Some(plan) || self.landed == Some(plan)
    }
}

/// What all plans take of the air and of the pads.
#[derive(Clone, Copy, Debug)]
pub(in crate::edge) struct Traffic<'a> {
    /// Who is on which segment when.
    pub(in crate::edge) occupations: &'a OrdMap<OccupationKey, Occupation>,
    /// Who has which pad when, in seconds of Unix time.
    pub(in crate::edge) reservations: &'a OrdMap<PadKey, Reservation>,
    /// The ended plan with which each drone has landed that still stands on its pad.
    pub(in crate::edge) landed: &'a OrdMap<Arc<str>, Arc<str>>,
}

impl<'a> Traffic<'a> {
    /// What a drone takes itself, and its plan.
    pub(in crate::edge) fn own(self, plan: Option<&'a str>, drone: Option<&str>) -> Own<'a> {
        let landed = drone.and_then(|drone| self.landed.get(drone));
        Own {
            plan,
            landed: landed.map(|plan| &**plan),
        }
    }

    /// What the drone of a plan takes itself.
    pub(in crate::edge) fn own_of_plan(self, plan: &'a PlanEntry) -> Own<'a> {
        self.own(Some(&plan.id), plan.drone_id.as_deref())
    }

    /// All stays at a node.
    pub(in crate::edge) fn stays_at(
        self,
        node: NodeIx,
    ) -> impl Iterator<Item = (&'a PadKey, &'a Reservation)> {
        let there = self.reservations.range(PadKey::first_of(node.0)..);
        there.take_while(move |(key, _)| key.node == node.0)
    }

    /// All that are on a segment.
    pub(in crate::edge) fn on(
        self,
        segment: SegmentIx,
    ) -> impl Iterator<Item = (&'a OccupationKey, &'a Occupation)> {
        let there = self.occupations.range(OccupationKey::first_of(segment)..);
        there.take_while(move |(key, _)| key.segment == segment.0)
    }

    /// The plan that has a pad at a time at which this version of a plan would take it too.
    pub(in crate::edge) fn shares_pad(
        self,
        own: Own<'_>,
        version: &Version,
    ) -> Option<(Reservation, Arc<str>)> {
        version.reservations().into_iter().find_map(|wanted| {
            let mut others = self.stays_at(wanted.node);
            let met = others.find(|(key, stay)| {
                !own.has(&key.plan)
                    && stay.pad == wanted.pad
                    && wanted.from_s + OVERLAP_S < stay.until_s
                    && stay.from_s + OVERLAP_S < wanted.until_s
            });
            met.map(|(key, _)| (wanted, key.plan.clone()))
        })
    }

    /// Whether a version of a plan would meet another one in the air, or on a pad.
    pub(in crate::edge) fn meets(self, own: Own<'_>, version: &Version, headway_s: f64) -> bool {
        let meets_in_the_air = |leg: &Occupation| {
            let mut others = self.on(leg.segment).filter(|(key, _)| !own.has(&key.plan));
            others.any(|(_, other)| {
                let [leg, other] = [std::slice::from_ref(leg), std::slice::from_ref(other)];
                !conflicts(leg, other, headway_s).is_empty()
            })
        };
        let is_apart = headway_s <= 0.0 || !version.occupations().iter().any(meets_in_the_air);
        !is_apart || self.shares_pad(own, version).is_some()
    }
}

/// The same for a drone, in the seconds of the flight model.
pub(super) struct Others {
    pub(super) reservations: Vec<Reservation>,
    pub(super) traffic: Vec<TrafficLeg>,
    /// The plans that the traffic is of, one for each leg.
    pub(super) traffic_of: Vec<Arc<str>>,
}

impl Others {
    /// In seconds from `zero`, as far as it is not long over and not a drone's own.
    pub(super) fn of(traffic: Traffic<'_>, own: Own<'_>, zero: Timestamp, now: Timestamp) -> Self {
        let unix_s = |instant: Timestamp| instant.as_microsecond() as f64 / 1e6;
        let (zero_s, over_s) = (unix_s(zero), unix_s(now) - OVER_S);
        let reserved = traffic.reservations.iter();
        let reserved = reserved.filter(|(key, stay)| !own.has(&key.plan) && stay.until_s > over_s);
        let reservations = reserved.map(|(_, stay)| Reservation {
            from_s: stay.from_s - zero_s,
            until_s: stay.until_s - zero_s,
            ..*stay
        });
        let flown = traffic.occupations.iter();
        let flown = flown.filter(|(key, leg)| !own.has(&key.plan) && leg.leaves_s > over_s);
        let (traffic, traffic_of) = flown
            .map(|(key, leg)| {
                let traffic = TrafficLeg {
                    segment: leg.segment,
                    from: leg.from,
                    enters_s: leg.enters_s - zero_s,
                    leaves_s: leg.leaves_s - zero_s,
                };
                (traffic, key.plan.clone())
            })
            .unzip();
        Self {
            reservations: reservations.collect(),
            traffic,
            traffic_of,
        }
    }
}
