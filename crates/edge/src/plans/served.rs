//! How far the delivery of a plan is: at which of its stops its drone has been served.
//!
//! No stop is served by the clock alone. What tells it is telemetry: the drone has stayed at the stop for its service, or
//! has rested there and left. Where nothing was seen of the visit, the drone has to be seen beyond the stop after a time
//! in which it could have flown there, been served and flown on; one that turns back before its stop is seen to do so.

use super::entry::{FlownFor, PlanEntry};
use super::stops::onward;
use crate::drones::progress::{FlownSoFar, Progress};
use crate::drones::{AtStop, Flown, Sighting};
use crate::planner::{Version, later};
use jiff::Timestamp;
use skyway_contract::EndedAs;
use skyway_engine::flight::{ServiceStop, Stop};
use skyway_engine::network::{NodeIx, Topology};
use std::sync::Arc;

/// So near to the node of a stop, in metres, a drone is at it.
const AT_STOP_M: f64 = 30.0;
/// So far from it, in metres, a drone has left.
const LEFT_M: f64 = 50.0;
/// The highest speed over ground of a drone, as a multiple of its airspeed: with the wind behind it.
const FASTEST: f64 = 2.0;

/// How far a drone had come when.
#[derive(Clone, Copy, Debug)]
struct Come {
    at_m: f64,
    at: Timestamp,
}

impl FlownFor {
    /// A delivery that begins.
    pub(crate) fn new(delivery: &str, version: &Version) -> Self {
        Self {
            delivery: Arc::from(delivery),
            stops: count(version.stops.len()),
            served: 0,
            landed_on: None,
        }
    }

    /// How many of its stops are not among those of a version, as they were served before it begins. One without stops
    /// may also lead elsewhere.
    fn before(&self, version: &Version) -> u32 {
        self.stops.saturating_sub(count(version.stops.len()))
    }

    /// At how many stops it has been served where its drone flies a version.
    fn served_on(&self, version: &Version) -> u32 {
        match version.stops.is_empty() {
            true => self.served,
            false => self.served.max(self.before(version)),
        }
    }

    /// The place of a stop among those of a version; `None` where that does not have it.
    fn place_in(&self, version: &Version, stop: u32) -> Option<usize> {
        let place = stop.checked_sub(self.before(version))?;
        let place = usize::try_from(place).ok()?;
        (place < version.stops.len()).then_some(place)
    }

    /// When the drone arrives by a version at the last stop; at its end where all are served, or it does not lead there.
    pub(crate) fn expected_at(&self, version: &Version) -> Timestamp {
        let last = self.stops.checked_sub(1);
        let last = last.filter(|last| self.served_on(version) <= *last);
        let place = last.and_then(|last| self.place_in(version, last));
        let stop = place.and_then(|place| stop_of(version, place));
        stop.map_or_else(
            || version.arrives_at(),
            |stop| later(version.departs_at, stop.lands_s),
        )
    }
}

/// How far a leg of a version begins from where that begins, in metres.
pub(crate) fn begins_m(topology: &Topology, version: &Version, leg: usize) -> f64 {
    let stretch = version.stretch.as_ref();
    let stretch_m = stretch.map_or(0.0, |stretch| {
        let node = topology.position(stretch.reentry.node);
        stretch.begin().distance_m(node)
    });
    let before = version.composition.legs.iter().take(leg);
    let lengths_m = before.map(|leg| {
        let [from, to] = [leg.from, leg.to].map(|node| topology.position(node));
        from.distance_m(to)
    });
    stretch_m + lengths_m.sum::<f64>()
}

fn count(stops: usize) -> u32 {
    u32::try_from(stops).unwrap_or(u32::MAX)
}

/// How a version makes one of its stops; `None` where its flight ends before.
fn stop_of(version: &Version, place: usize) -> Option<&Stop> {
    stops_of(version).nth(place)
}

/// How it makes all of them.
fn stops_of(version: &Version) -> impl Iterator<Item = &Stop> {
    let flight = version.flight.iter();
    let stops = flight.flat_map(|flight| &flight.composition.plan.stops);
    stops.filter(|stop| stop.service_s.is_some())
}

impl PlanEntry {
    /// The next stop of its delivery, by the version that its drone reported.
    fn next_stop(&self) -> Option<(u32, &ServiceStop)> {
        let flown_for = self.flown_for.as_ref()?;
        let next = flown_for.served_on(&self.reported);
        let place = flown_for.place_in(&self.reported, next)?;
        Some((next, &self.reported.stops[place]))
    }

    /// Before which leg of the version that its drone reported its next stop is: the first at which it was not served. Where that is
    /// not kept, it is the first that lies beyond the distance flown, in metres from where the version begins.
    pub(crate) fn stops_before(&self, topology: &Topology, flown_m: f64) -> Option<usize> {
        let version = &self.reported;
        let stop = match &self.flown_for {
            Some(flown_for) => {
                let next = flown_for.served_on(version);
                stop_of(version, flown_for.place_in(version, next)?)
            }
            None => stops_of(version)
                .find(|stop| begins_m(topology, version, stop.before_leg) > flown_m),
        };
        stop.map(|stop| stop.before_leg)
    }

    /// At how many of the stops of the version that its drone reported its delivery was served.
    pub(crate) fn served_of_reported(&self) -> usize {
        let flown_for = self.flown_for.as_ref();
        let served = flown_for.map_or(0, |flown_for| {
            flown_for
                .served
                .saturating_sub(flown_for.before(&self.reported))
        });
        usize::try_from(served).unwrap_or(usize::MAX)
    }

    /// The stop of the version that its drone reported at which its delivery was served last, if at any of them.
    pub(crate) fn last_served(&self) -> Option<&Stop> {
        let flown_for = self.flown_for.as_ref()?;
        let last = flown_for.served.checked_sub(1)?;
        let place = flown_for.place_in(&self.reported, last)?;
        stop_of(&self.reported, place)
    }

    /// How far its drone has come on the version that it reported, in metres: as far as it was seen to, and to the last stop at
    /// which its delivery was served. After a restart only that tells a way out from the way back.
    pub(crate) fn come_m(&self, topology: &Topology, sighting: Option<&Sighting>) -> f64 {
        let version = &self.reported;
        let seen_m = sighting.map_or(0.0, |it| it.flown_m(&self.id, version.number));
        self.last_served().map_or(seen_m, |stop| {
            // It may be served as soon as it is near.
            seen_m.max(begins_m(topology, version, stop.before_leg) - AT_STOP_M)
        })
    }

    /// What a sighting says of how far its drone has come by an instant, and where its delivery was served. From a sighting at
    /// that instant nothing but what it says itself follows.
    pub(crate) fn known_by(
        &self,
        topology: &Topology,
        sighting: Option<&Sighting>,
        at: Timestamp,
    ) -> FlownSoFar {
        let flown_m = self.come_m(topology, sighting);
        let last = self.come_by(topology, sighting);
        let since_s = at.duration_since(last.at).as_secs_f64().max(0.0);
        FlownSoFar {
            flown_m,
            reach_m: flown_m.max(last.at_m) + FASTEST * self.airspeed_mps.max(0.1) * since_s,
            stops_before: self.stops_before(topology, flown_m),
        }
    }

    /// How far its drone had come on what it reported by a sighting. One that was seen on another version has begun this one
    /// since.
    fn come_by(&self, topology: &Topology, sighting: Option<&Sighting>) -> Come {
        let flown = sighting.and_then(|sighting| sighting.flown.as_ref());
        let come = self.come_before(topology, flown);
        let is_of_another =
            flown.is_some_and(|it| it.plan == self.id && it.version != self.reported.number);
        match sighting {
            Some(sighting) if is_of_another => Come {
                at: come.at.max(sighting.seen_at),
                ..come
            },
            _ => come,
        }
    }

    /// This plan with this number of stops served; `None` if no more than are known.
    pub(crate) fn with_served(&self, served: u32) -> Option<Self> {
        let flown_for = self.flown_for.as_ref()?;
        let served = served.min(flown_for.stops);
        (served > flown_for.served).then(|| Self {
            flown_for: Some(FlownFor {
                served,
                ..flown_for.clone()
            }),
            ..self.clone()
        })
    }

    /// How far its delivery is once its drone flies another version: what that leaves out was served before it.
    pub(crate) fn taken_up(
        &self,
        taken: &Version,
        topology: &Topology,
        progress: Option<&Progress>,
        now: Timestamp,
    ) -> Option<FlownFor> {
        let flown_for = self.flown_for.clone()?;
        let by_version = match taken.stops.is_empty() {
            false => flown_for.served_on(taken),
            // It was served everywhere, or is led elsewhere.
            true => {
                let ahead = onward(topology, self, progress, now).len();
                let ahead = count(ahead.saturating_sub(1));
                flown_for.stops.saturating_sub(ahead)
            }
        };
        Some(FlownFor {
            served: flown_for.served.max(by_version),
            ..flown_for
        })
    }

    /// How far its delivery is at its end: a drone that has landed where the way ends, after a time in which all stops could be
    /// made, has made them.
    pub(crate) fn ended(
        &self,
        topology: &Topology,
        (how, node): (EndedAs, Option<NodeIx>),
        flown: Option<&Flown>,
        now: Timestamp,
    ) -> Option<FlownFor> {
        let mut flown_for = self.flown_for.clone()?;
        if let Some(node) = node {
            flown_for.landed_on = Some(Arc::from(topology.node_id(node)));
        }
        if how != EndedAs::Delivered || self.reported.is_diversion() {
            return Some(flown_for);
        }
        let at_end = Come {
            at_m: f64::INFINITY,
            at: now,
        };
        let spell = (self.come_before(topology, flown), at_end);
        flown_for.served = self.made_in(topology, &flown_for, spell, |_| true);
        Some(flown_for)
    }

    /// How far its drone had come on what it reported: where nothing says so, to the stop at which it was served last, which it
    /// has left by its times, or not at all.
    fn come_before(&self, topology: &Topology, flown: Option<&Flown>) -> Come {
        let version = &self.reported;
        let flown = flown.filter(|it| it.plan == self.id && it.version == version.number);
        match (flown, self.last_served()) {
            (Some(flown), _) => Come {
                at_m: flown.at_m,
                at: flown.at,
            },
            (None, Some(stop)) => Come {
                at_m: begins_m(topology, version, stop.before_leg),
                at: later(version.departs_at, stop.takes_off_s),
            },
            (None, None) => Come {
                at_m: 0.0,
                at: version.departs_at,
            },
        }
    }

    /// At how many stops its drone was served once it has come from one place to another: at those that lie between, which
    /// it has left, and for which it had the time.
    fn made_in(
        &self,
        topology: &Topology,
        flown_for: &FlownFor,
        spell: (Come, Come),
        has_left: impl Fn(&ServiceStop) -> bool,
    ) -> u32 {
        let version = &self.reported;
        let mut served = flown_for.served_on(version);
        let mut service_s = 0.0;
        while let Some(place) = flown_for.place_in(version, served) {
            let stop = &version.stops[place];
            service_s += stop.service_s;
            let could = stop_of(version, place)
                .is_some_and(|flown| self.could_make(topology, flown, service_s, spell));
            if !could || !has_left(stop) {
                break;
            }
            served += 1;
        }
        served
    }

    /// Whether its drone, which was before a stop and is beyond it now, had the time to fly there and on, and to be served
    /// for so long.
    fn could_make(
        &self,
        topology: &Topology,
        stop: &Stop,
        service_s: f64,
        (before, now): (Come, Come),
    ) -> bool {
        let version = &self.reported;
        let stop_m = begins_m(topology, version, stop.before_leg);
        let legs = version.composition.legs.len();
        let now_m = now.at_m.min(begins_m(topology, version, legs));
        let flying_s = (now_m - before.at_m).max(0.0) / (FASTEST * self.airspeed_mps.max(0.1));
        let spent_s = now.at.duration_since(before.at).as_secs_f64();
        before.at_m <= stop_m && stop_m <= now_m && spent_s >= service_s + flying_s
    }

    /// Where its drone is served, by where it is and was.
    pub(crate) fn at_stop(
        &self,
        topology: &Topology,
        sighting: &Sighting,
        before: Option<&Sighting>,
    ) -> Option<AtStop> {
        let (number, stop) = self.next_stop()?;
        let known = before.and_then(|before| before.at_stop.clone());
        let known = known.filter(|it| it.plan == self.id && it.stop == number);
        let off_m = distance_m(topology, stop.node, sighting);
        let has_departed = sighting.seen_at >= self.reported.departs_at;
        let is_there = off_m <= AT_STOP_M && has_departed;
        if !is_there && known.as_ref().is_none_or(|known| !known.rested) {
            // It has only flown by.
            return None;
        }
        let rests = is_there && sighting.is_slow(topology.frame(), before);
        let known = known.unwrap_or_else(|| AtStop {
            plan: self.id.clone(),
            stop: number,
            since: sighting.seen_at,
            rested: false,
        });
        // Its service begins once it rests.
        let begins = rests && !known.rested;
        Some(AtStop {
            rested: known.rested || rests,
            since: if begins {
                sighting.seen_at
            } else {
                known.since
            },
            ..known
        })
    }

    /// At how many stops the delivery was served by now, where a sighting shows that these are more than known.
    pub(crate) fn served_by(
        &self,
        topology: &Topology,
        sighting: &Sighting,
        before: Option<&Sighting>,
    ) -> Option<u32> {
        let (number, stop) = self.next_stop()?;
        let off_m = distance_m(topology, stop.node, sighting);
        let is_here = |at: &&AtStop| at.plan == self.id && at.stop == number;
        if let Some(at) = sighting.at_stop.as_ref().filter(is_here) {
            let stayed_s = sighting.seen_at.duration_since(at.since).as_secs_f64();
            let has_stayed = off_m <= AT_STOP_M && stayed_s >= stop.service_s;
            let has_left = at.rested && off_m > LEFT_M;
            return (has_stayed || has_left).then_some(number + 1);
        }
        let flown_for = self.flown_for.as_ref()?;
        let come = sighting.flown.as_ref()?;
        let now = Come {
            at_m: come.at_m,
            at: come.at,
        };
        let last = self.come_by(topology, before);
        let has_left = |stop: &ServiceStop| distance_m(topology, stop.node, sighting) > LEFT_M;
        let served = self.made_in(topology, flown_for, (last, now), has_left);
        (served > number).then_some(served)
    }
}

fn distance_m(topology: &Topology, node: NodeIx, sighting: &Sighting) -> f64 {
    let place = sighting.position(topology.frame());
    place.distance_m(topology.position(node))
}
