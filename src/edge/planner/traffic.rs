//! What the plans of a snapshot take of the air and of the pads, and whether one more would meet them.

use super::Version;
use crate::compose::{Occupation, conflicts};
use crate::edge::snapshot::Snapshot;
use crate::flight::{Reservation, TrafficLeg};
use crate::network::{NodeIx, SegmentIx};
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

/// What a drone takes itself, so that it is not in its own way: its plan, and the pad on which it
/// stands since the plan before.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::edge) struct Own<'a> {
    plan: Option<&'a str>,
    landed: Option<&'a str>,
}

impl<'a> Own<'a> {
    /// What is taken for a plan, and for the one with which its drone has landed.
    pub(in crate::edge) fn of(plan: Option<&'a str>, landed: Option<&'a str>) -> Self {
        Self { plan, landed }
    }

    /// Whether what is taken for this plan is its own.
    pub(in crate::edge) fn has(self, plan: &str) -> bool {
        self.plan == Some(plan) || self.landed == Some(plan)
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

/// What the plans of a snapshot take.
pub(in crate::edge) struct Others {
    pub(in crate::edge) reservations: Vec<Reservation>,
    pub(in crate::edge) traffic: Vec<TrafficLeg>,
    /// The plans that the traffic is of, one for each leg.
    pub(in crate::edge) traffic_of: Vec<Arc<str>>,
}

impl Others {
    /// In seconds from `zero`, as far as it is not long over and not a drone's own.
    pub(in crate::edge) fn of(
        snapshot: &Snapshot,
        own: Own<'_>,
        zero: Timestamp,
        now: Timestamp,
    ) -> Self {
        let unix_s = |instant: Timestamp| instant.as_microsecond() as f64 / 1e6;
        let (zero_s, over_s) = (unix_s(zero), unix_s(now) - OVER_S);
        let reserved = snapshot.reservations.iter();
        let reserved = reserved.filter(|(key, stay)| !own.has(&key.plan) && stay.until_s > over_s);
        let reservations = reserved.map(|(_, stay)| Reservation {
            from_s: stay.from_s - zero_s,
            until_s: stay.until_s - zero_s,
            ..*stay
        });
        let flown = snapshot.occupations.iter();
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

/// All stays at a node.
pub(in crate::edge) fn stays_at(
    snapshot: &Snapshot,
    node: NodeIx,
) -> impl Iterator<Item = (&PadKey, &Reservation)> {
    let there = snapshot.reservations.range(PadKey::first_of(node.0)..);
    there.take_while(move |(key, _)| key.node == node.0)
}

/// The plan that has a pad at a time at which this version of a plan would take it too.
pub(in crate::edge) fn shares_pad(
    snapshot: &Snapshot,
    own: Own<'_>,
    version: &Version,
) -> Option<(Reservation, Arc<str>)> {
    version.reservations().into_iter().find_map(|wanted| {
        let there = stays_at(snapshot, wanted.node);
        let mut others = there.filter(|(key, _)| !own.has(&key.plan));
        let met = others.find(|(_, stay)| {
            stay.pad == wanted.pad
                && wanted.from_s + OVERLAP_S < stay.until_s
                && stay.from_s + OVERLAP_S < wanted.until_s
        });
        met.map(|(key, _)| (wanted, key.plan.clone()))
    })
}

/// Whether a version of a plan would meet another one in the air, or on a pad.
pub(in crate::edge) fn meets_others(
    snapshot: &Snapshot,
    own: Own<'_>,
    version: &Version,
    headway_s: f64,
) -> bool {
    let meets_in_the_air = |leg: &Occupation| {
        let there = snapshot
            .occupations
            .range(OccupationKey::first_of(leg.segment)..);
        let there = there.take_while(|(key, _)| key.segment == leg.segment.0);
        let mut others = there.filter(|(key, _)| !own.has(&key.plan));
        others.any(|(_, other)| {
            let [leg, other] = [std::slice::from_ref(leg), std::slice::from_ref(other)];
            !conflicts(leg, other, headway_s).is_empty()
        })
    };
    let is_apart = headway_s <= 0.0 || !version.occupations().iter().any(meets_in_the_air);
    !is_apart || shares_pad(snapshot, own, version).is_some()
}
