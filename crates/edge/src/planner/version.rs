//! A version of a plan: the way that its drone flies, when, and with what.

use super::FlownVersion;
use crate::plans::stretches::Stretch;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::airspace::{Airspace, Closure};
use skyway_engine::compose::{Change, Composition, Migrated, Occupation};
use skyway_engine::flight::{Reservation, ServiceStop};
use skyway_engine::network::NodeIx;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// One version of a plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Version {
    pub(crate) number: u32,
    /// The epoch of the edge that made it: versions are ordered by epoch, then number.
    pub(crate) epoch: u64,
    /// When its drone could first be told of it.
    pub(crate) sent_at: Timestamp,
    /// `None` for a first version; what its drone was told for a recomposed one.
    pub(crate) outcome: Option<skyway_engine::recompose::Outcome>,
    pub(crate) composition: Composition,
    /// How it is flown, where the flight model made it; the composition is derived from that.
    pub(crate) flight: Option<Arc<FlownVersion>>,
    /// How its drone comes to its first node, where it is not there.
    pub(crate) stretch: Option<Stretch>,
    /// Flown before the first node, in metres.
    pub(crate) first_stretch_m: f64,
    pub(crate) departs_at: Timestamp,
    /// Where its delivery was to be served from its beginning on, in order; its flight may make only the first of them.
    pub(crate) stops: Arc<[ServiceStop]>,
    pub(crate) recomposition_id: Option<Arc<str>>,
    /// Until when a proposed version is to be acknowledged.
    pub(crate) acknowledge_by: Option<Timestamp>,
    /// What its drone was told to know of it.
    pub(crate) flags: Vec<wire::Flag>,
    pub(crate) warnings: Vec<(Cow<'static, str>, String)>,
}

impl Version {
    /// These legs of it on another network, at their times, and whether their contingencies hold there too; `None` where any of
    /// them is gone.
    pub(crate) fn carried_over(
        &self,
        airspeed_mps: f64,
        legs: Range<usize>,
        change: &Change<'_>,
    ) -> Option<(Self, bool)> {
        let stretch_m = self.first_stretch_m;
        let composition = &self.composition;
        let Migrated {
            mut composition,
            contingencies_hold,
        } = composition.carried_over(change, legs.clone(), stretch_m, airspeed_mps)?;
        let stops = self.stops_carried(legs.start, change)?;
        let flight = match self.flight.as_deref() {
            Some(flown) => {
                let flown = flown.carried_over(change, legs)?;
                flown.time(&mut composition);
                Some(Arc::new(flown))
            }
            None => None,
        };
        let stretch = self.stretch.as_ref();
        let version = Self {
            composition,
            flight,
            stops,
            stretch: stretch
                .and_then(|it| it.carried_over(change.to, change.from, change.correspondence)),
            ..self.clone()
        };
        Some((version, contingencies_hold))
    }

    /// The stops on another network that are not made before a leg; `None` where one of them is gone.
    fn stops_carried(&self, leg: usize, change: &Change<'_>) -> Option<Arc<[ServiceStop]>> {
        let flight = self.flight.iter();
        let flown = flight.flat_map(|flight| &flight.composition.plan.stops);
        let made = flown.filter(|stop| stop.service_s.is_some() && stop.before_leg < leg);
        let ahead = self.stops.iter().skip(made.count());
        ahead
            .map(|stop| {
                let node = change.correspondence.node(stop.node)?;
                Some(ServiceStop { node, ..*stop })
            })
            .collect()
    }

    /// The same before its contingencies are worked out.
    pub(crate) fn without_contingencies(mut self) -> Self {
        for leg in &mut self.composition.legs {
            leg.if_closed = None;
            leg.safe = None;
        }
        if let Some(flown) = &mut self.flight {
            Arc::make_mut(flown).ends.clear();
        }
        self
    }

    /// Whether its drone surely stands before a leg, so many seconds after the departure: by nominal times nobody knows.
    pub(crate) fn stands_before(&self, leg: usize, elapsed_s: f64) -> bool {
        let leg = self.composition.legs.get(leg);
        self.flight.is_some() && leg.is_some_and(|leg| elapsed_s <= leg.departure_s)
    }

    /// When it is on each of its segments, in seconds of Unix time.
    pub(crate) fn occupations(&self) -> Vec<Occupation> {
        let departs_s = self.departs_s();
        let legs = self.composition.occupations(departs_s);
        let first_s = legs.first().map(|first| first.enters_s);
        let arrives_s = departs_s + self.composition.flight_time_s;
        let stretch = self.stretch.as_ref();
        let stretch = stretch.and_then(|it| it.occupation(departs_s, first_s.unwrap_or(arrives_s)));
        stretch.into_iter().chain(legs).collect()
    }

    /// The pads that it takes, in seconds of Unix time.
    pub(crate) fn reservations(&self) -> Vec<Reservation> {
        let departs_s = self.departs_s();
        let flight = self.flight.iter();
        let stays = flight.flat_map(|flight| flight.reservations());
        stays
            .map(|stay| Reservation {
                from_s: departs_s + stay.from_s,
                until_s: departs_s + stay.until_s,
                ..stay
            })
            .collect()
    }

    /// The pad that it has at a node at an instant, counted from 0.
    pub(crate) fn pad_at(&self, node: NodeIx, now: Timestamp) -> Option<u16> {
        let now_s = now.as_microsecond() as f64 / 1e6;
        let mut stays = self.reservations().into_iter();
        let is_there = |stay: &Reservation| stay.from_s <= now_s && now_s <= stay.until_s;
        let there = stays.find(|stay| stay.node == node && is_there(stay));
        there.map(|stay| stay.pad)
    }

    fn departs_s(&self) -> f64 {
        self.departs_at.as_microsecond() as f64 / 1e6
    }

    /// When it ends.
    pub(crate) fn arrives_at(&self) -> Timestamp {
        later(self.departs_at, self.composition.flight_time_s)
    }

    /// Where it ends.
    pub(crate) fn last_node(&self) -> Option<NodeIx> {
        self.composition.way.nodes.last().copied()
    }

    /// Whether its drone was told to land where it was not to go.
    pub(crate) fn is_diversion(&self) -> bool {
        self.outcome == Some(skyway_engine::recompose::Outcome::Diverted)
    }

    /// The closures in force that close the pads on which a diversion ends.
    pub(crate) fn ends_on_closed_pads(&self, airspace: &Airspace) -> Vec<String> {
        let end = self.last_node().filter(|_| self.is_diversion());
        let Some(end) = end.filter(|&end| airspace.closes_pads(end)) else {
            return Vec::new();
        };
        let closing = airspace.in_force().filter(|it| it.pads.contains(&end));
        closing.map(|closure| closure.id.clone()).collect()
    }

    /// Whether a closure closes pads on which it stops, or on which a diversion ends.
    pub(crate) fn lands_on_pads_of(&self, closure: &Closure) -> bool {
        let stops = self.flight.iter().flat_map(|flight| flight.stop_nodes());
        let end = self.last_node().filter(|_| self.is_diversion());
        let mut lands_on = stops.chain(end);
        lands_on.any(|node| closure.pads.contains(&node))
    }

    /// The node at which its drone holds on the ground until there is a way.
    pub(crate) fn holds_at(&self) -> Option<NodeIx> {
        let waits = self.outcome == Some(skyway_engine::recompose::Outcome::Hold);
        self.last_node()
            .filter(|_| waits && self.composition.legs.is_empty())
    }

    /// Until when its drone waits on a pad before it flies; the end of time where there is no way yet, `None` where it does not
    /// hold.
    pub(crate) fn holds_until(&self) -> Option<Timestamp> {
        if self.outcome != Some(skyway_engine::recompose::Outcome::Hold) {
            return None;
        }
        if self.composition.legs.is_empty() {
            return Some(Timestamp::MAX);
        }
        let stops = self
            .flight
            .iter()
            .flat_map(|flight| &flight.composition.plan.stops);
        let first = stops.take(1).find(|stop| stop.before_leg == 0);
        Some(first.map_or(self.departs_at, |stop| {
            later(self.departs_at, stop.takes_off_s)
        }))
    }

    /// When the drone leaves the last pad on its way, in flight for the last time.
    pub(crate) fn takes_off_last_at(&self) -> Timestamp {
        let flight = self.flight.as_deref();
        let stop = flight.and_then(|flight| flight.composition.plan.stops.last());
        stop.map_or(self.departs_at, |stop| {
            later(self.departs_at, stop.takes_off_s)
        })
    }
}

/// An instant some seconds later; the end of time where that is beyond it.
pub(crate) fn later(instant: Timestamp, seconds: f64) -> Timestamp {
    let span = jiff::SignedDuration::try_from_secs_f64(seconds);
    span.ok()
        .and_then(|span| instant.checked_add(span).ok())
        .unwrap_or(Timestamp::MAX)
}
