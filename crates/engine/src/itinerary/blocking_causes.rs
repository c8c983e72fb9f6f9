//! What cuts a drone off: the causes along the boundary of all that it can reach in time, with this battery, in this wind.

use super::closed_windows::ClosedWindows;
use super::entry::{Entry, Leaving};
use super::expander::Expander;
use super::label::How;
use super::memory::ItineraryScratch;
use super::potentials::Potentials;
use super::request::{Effort, FlightRequest, Objective, Value, close, reopen};
use super::run::{Goal, Mode, Run};
use super::setting::FlightSetting;
use crate::flight::{TrafficLeg, Unflyable};
use crate::network::{NodeIx, SegmentIx};
use std::collections::BTreeSet;

/// Something that cuts a drone off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlightCause {
    /// A closure: its number, which is its place in a situation that was compiled.
    Closure(usize),
    /// Another plan's leg.
    Traffic(TrafficLeg),
    /// A segment that the request itself closes.
    Request(SegmentIx),
    /// Wind or payload: the first leg that cannot be flown, and how many there are for the same kind of reason.
    Unflyable {
        /// Where the leg starts.
        from: NodeIx,
        /// Its segment; `None` for a way beside the network.
        segment: Option<SegmentIx>,
        /// Why.
        why: Unflyable,
        /// Legs on the boundary.
        legs: usize,
    },
    /// The battery does not last: the leg that lacks least, and how many there are.
    Energy {
        /// Where the leg starts.
        from: NodeIx,
        /// Its segment.
        segment: SegmentIx,
        /// What is missing to end it with the reserve, as a fraction of the battery.
        missing: f64,
        /// Legs on the boundary.
        legs: usize,
    },
    /// All pads of a node are reserved when the drone is there.
    Pads(NodeIx),
    /// The drone comes flying with less than the reserve wherever it can begin.
    BelowReserve,
    /// The deadline is too early for a leg.
    Deadline,
    /// The network ends there.
    Network,
}

/// What a drone can have at a node.
#[derive(Clone, Copy, Debug)]
struct Reached {
    earliest_s: f64,
    battery: f64,
    /// It has stopped there, or cannot.
    has_stopped: bool,
    leaving: Leaving,
}

/// What cuts a drone off from a destination that it cannot reach: closures and taken pads first, then wind, energy and the
/// deadline. Past a bound of the request, those that are known by then. Where the search has found ways on which the drone
/// would meet others, these are what is in its way, and the closures on the best way of all.
pub(super) fn causes(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    (potentials, met): (&Potentials, Vec<TrafficLeg>),
    scratch: &mut ItineraryScratch,
) -> Vec<FlightCause> {
    if request.starts.is_empty() {
        return vec![FlightCause::BelowReserve];
    }
    if !met.is_empty() {
        return causes_among_others(setting, request, potentials, met);
    }
    let world = setting.world();
    let request = FlightRequest {
        objective: Objective::Time,
        ..request.clone()
    };
    scratch.begin(world.topology);
    close(&mut scratch.closed, request.closed_segments);
    let potentials = Potentials::nowhere(world.topology.node_count(), Objective::Time);
    let terms = Expander::new(&world, &request, &potentials);
    let mut effort = Effort::default();
    let mut run = Run {
        terms,
        mode: Mode::Earlier,
        goal: Goal::Nowhere,
        scratch,
        effort: &mut effort,
        best: Value::NONE,
        improved: false,
        doubt: Value::NONE,
        may_tie: false,
        target: Value::LEAST,
        most_labels: request.limits.labels,
        most_checks: request.limits.checks,
        walks: false,
    };
    let is_whole = run.search().stopped_by.is_none();
    let reached = reached(&terms, scratch);
    // Beyond a label that was not taken nothing has been looked at.
    let mut looked_beyond = vec![true; reached.len()];
    let waiting = scratch.queue.iter().filter(|_| !is_whole);
    for queued in waiting {
        let node = scratch.labels[queued.label as usize].node;
        looked_beyond[node.at()] = false;
    }
    let mut boundary = ReachableBoundary {
        setting,
        terms: &terms,
        found: Found::default(),
    };
    for (at, there) in reached.iter().enumerate() {
        if let Some(there) = there
            && looked_beyond[at]
        {
            boundary.look_around(NodeIx(at as u32), there, &reached, scratch);
        }
    }
    let found = boundary.found;
    reopen(&mut scratch.closed, request.closed_segments);
    found.into_causes(world.obstacles.closed(), is_whole)
}

/// The others that were met, and the closures that have led the drone there: those on the way that the tables have.
fn causes_among_others(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    potentials: &Potentials,
    met: Vec<TrafficLeg>,
) -> Vec<FlightCause> {
    let world = setting.world();
    let terms = Expander::new(&world, request, potentials);
    let mut found = Found {
        traffic: met,
        ..Found::default()
    };
    for (number, start) in request.starts.iter().enumerate() {
        let (mut node, mut earliest_s) = (start.node, start.at_s);
        let mut leaving = terms.leaving(How::Start(number as u8));
        while let Some(leg) = potentials.next(node) {
            let flight = world.legs.leg(leg);
            if request.closed_segments.contains(&flight.segment) {
                found.segments.insert(flight.segment);
            }
            let entry = Entry {
                segment: flight.segment.0,
                from: node,
                to: flight.to,
                time_s: flight.least.time_s,
                leaving,
                takes_off: false,
            };
            found.add_closures(&terms, entry, earliest_s);
            earliest_s += flight.least.time_s;
            node = flight.to;
            leaving = Leaving::OnItsWay;
        }
    }
    found.into_causes(world.obstacles.closed(), false)
}

/// By node, what the labels of a search amount to.
fn reached(terms: &Expander<'_>, scratch: &ItineraryScratch) -> Vec<Option<Reached>> {
    let mut reached: Vec<Option<Reached>> = vec![None; terms.world.topology.node_count()];
    for label in &scratch.labels {
        let battery = label.family.battery(f64::INFINITY, terms.tau_s);
        let there = reached[label.node.at()].get_or_insert(Reached {
            earliest_s: f64::INFINITY,
            battery: f64::NEG_INFINITY,
            has_stopped: false,
            leaving: terms.leaving(label.how),
        });
        there.earliest_s = there.earliest_s.min(label.family.lo_s);
        there.battery = there.battery.max(battery);
        there.has_stopped |= !terms.may_stop(label.how);
        let leaving = terms.leaving(label.how);
        if leaving != there.leaving {
            there.leaving = Leaving::OnItsWay;
        }
    }
    reached
}

/// The causes found so far.
#[derive(Debug, Default)]
struct Found {
    closures: BTreeSet<usize>,
    traffic: Vec<TrafficLeg>,
    segments: BTreeSet<SegmentIx>,
    pads: BTreeSet<NodeIx>,
    unflyable: Vec<FlightCause>,
    energy: Option<FlightCause>,
    deadline: bool,
}

struct ReachableBoundary<'r> {
    setting: &'r FlightSetting,
    terms: &'r Expander<'r>,
    found: Found,
}

impl ReachableBoundary<'_> {
    fn look_around(
        &mut self,
        node: NodeIx,
        there: &Reached,
        reached: &[Option<Reached>],
        scratch: &ItineraryScratch,
    ) {
        let world = self.terms.world;
        let mut is_on_rim = false;
        for leg in world.legs.from(node) {
            let flight = world.legs.leg(leg);
            if reached[flight.to.at()].is_some() {
                continue;
            }
            is_on_rim = true;
            if scratch.closed.contains(flight.segment.0) {
                self.found.segments.insert(flight.segment);
            } else if !flight.least.is_flyable() {
                self.cannot_be_flown(node, leg, there.earliest_s);
            } else {
                self.is_forbidden(node, leg, there);
            }
        }
        // Pads matter where the battery or a window asks for a stop.
        if is_on_rim && world.pads.is_station(node) && !there.has_stopped {
            self.could_not_stop(node, there.earliest_s);
        }
    }

    fn could_not_stop(&mut self, node: NodeIx, earliest_s: f64) {
        let world = self.terms.world;
        let vertical_s = world.legs.vertical_s(node);
        let lands_s = earliest_s + vertical_s;
        let handling_s = match world.pads.swaps(node) {
            true => world.rules.swap_s,
            false => world.rules.stop_s,
        };
        let takes_off_s = lands_s + handling_s;
        let deadline_s = self.terms.request.deadline_s;
        if world.pads.stay_until_s(node, lands_s) >= takes_off_s {
            // A pad is free; time may not be.
            self.found.deadline |= takes_off_s + vertical_s > deadline_s;
            return;
        }
        let closures = world.pads.closures(node, lands_s, deadline_s);
        let before = self.found.closures.len();
        self.found.closures.extend(closures);
        if self.found.closures.len() == before {
            self.found.pads.insert(node);
        }
    }

    fn cannot_be_flown(&mut self, from: NodeIx, leg: u32, at_s: f64) {
        let segment = self.terms.world.legs.leg(leg).segment;
        let direction = (from, self.terms.world.legs.leg(leg).to, segment);
        let setting = self.setting;
        let cost = setting.airframe().leg(
            setting.topology(),
            setting.vertical(),
            setting.wind(),
            setting.payload_kg(),
            direction,
            at_s,
        );
        let Err(why) = cost else {
            return;
        };
        let is_same_kind = |cause: &&mut FlightCause| match cause {
            FlightCause::Unflyable { why: other, .. } => {
                std::mem::discriminant(other) == std::mem::discriminant(&why)
            }
            _ => false,
        };
        match self.found.unflyable.iter_mut().find(is_same_kind) {
            Some(FlightCause::Unflyable { legs, .. }) => *legs += 1,
            _ => self.found.unflyable.push(FlightCause::Unflyable {
                from,
                segment: Some(segment),
                why,
                legs: 1,
            }),
        }
    }

    fn is_forbidden(&mut self, from: NodeIx, leg: u32, there: &Reached) {
        let Expander { world, request, .. } = *self.terms;
        let flight = world.legs.leg(leg);
        let missing = request.reserve + flight.least.energy - there.battery;
        if missing > super::charging_label::BATTERY_TOLERANCE {
            self.lacks(from, flight.segment, missing);
            return;
        }
        let deadline_s = request.deadline_s;
        if there.earliest_s + flight.least.time_s > deadline_s {
            self.found.deadline = true;
            return;
        }
        let entry = Entry {
            segment: flight.segment.0,
            from,
            to: flight.to,
            time_s: flight.least.time_s,
            leaving: there.leaving,
            takes_off: there.leaving == Leaving::FromTheGround,
        };
        self.found.add_closures(self.terms, entry, there.earliest_s);
    }

    fn lacks(&mut self, from: NodeIx, segment: SegmentIx, lacking: f64) {
        let (least, count) = match self.found.energy {
            Some(FlightCause::Energy { missing, legs, .. }) => (missing, legs),
            _ => (f64::INFINITY, 0),
        };
        if lacking < least {
            self.found.energy = Some(FlightCause::Energy {
                from,
                segment,
                missing: lacking,
                legs: count + 1,
            });
        } else if let Some(FlightCause::Energy { legs, .. }) = &mut self.found.energy {
            *legs += 1;
        }
    }
}

impl Found {
    /// Adds the closures that forbid entries of a leg between an instant and the deadline.
    fn add_closures(&mut self, terms: &Expander<'_>, entry: Entry, earliest_s: f64) {
        let Expander { world, request, .. } = *terms;
        let take = |closure, from_s, until_s| {
            if from_s < request.deadline_s && until_s > earliest_s {
                self.closures.insert(closure);
            }
        };
        let obstacles = world.obstacles;
        obstacles.each_closed(world, request.began_s, entry, take);
    }

    /// The causes; none at all where none is known because a bound was reached.
    fn into_causes(self, closed: &ClosedWindows, is_whole: bool) -> Vec<FlightCause> {
        let mut causes: Vec<FlightCause> = Vec::new();
        let closures = closed.in_order(self.closures).into_iter();
        causes.extend(closures.map(FlightCause::Closure));
        causes.extend(self.segments.into_iter().map(FlightCause::Request));
        let mut traffic = self.traffic;
        traffic.sort_by(|one, other| {
            let by_segment = one.segment.cmp(&other.segment);
            by_segment.then(one.enters_s.total_cmp(&other.enters_s))
        });
        traffic.dedup();
        causes.extend(traffic.into_iter().map(FlightCause::Traffic));
        causes.extend(self.pads.into_iter().map(FlightCause::Pads));
        causes.extend(self.unflyable);
        causes.extend(self.energy);
        if self.deadline {
            causes.push(FlightCause::Deadline);
        }
        if causes.is_empty() && is_whole {
            causes.push(FlightCause::Network);
        }
        causes
    }
}
