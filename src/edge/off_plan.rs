//! Telemetry that shows a drone early, late or with less battery than planned: a `service_level` failure by itself.

use super::Edge;
use super::drones::Sighting;
use super::failures::Manner;
use super::plan_entry::PlanEntry;
use super::planner::FlownVersion;
use super::progress;
use super::records::AnswerRecord;
use super::snapshot::Snapshot;
use crate::access::Caller;
use crate::flight::Location;
use crate::formats::ParsedReport;
use crate::geo::Point;
use crate::network::Topology;
use crate::wire;
use jiff::{SignedDuration, Timestamp};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A plan is answered so often at most.
const APART: SignedDuration = SignedDuration::from_mins(1);
/// So near to a node, in metres, a drone is at it.
const AT_NODE_M: f64 = 50.0;
/// So many plans are remembered before those answered long ago are forgotten.
const REMEMBERED: usize = 1_000;

/// When the drone of a plan was answered last for being off it.
#[derive(Debug, Default)]
pub(super) struct OffPlan(Mutex<BTreeMap<Arc<str>, Timestamp>>);

impl OffPlan {
    /// Whether a plan may be answered now; then it counts as answered.
    fn begins(&self, plan: &Arc<str>, now: Timestamp) -> bool {
        // The map is whole after every call, so a panic elsewhere cannot spoil it.
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_recent = |at: &Timestamp| now.duration_since(*at) < APART;
        if last.get(plan).is_some_and(is_recent) {
            return false;
        }
        if last.len() >= REMEMBERED {
            last.retain(|_, at| is_recent(at));
        }
        last.insert(plan.clone(), now);
        true
    }
}

/// What a plan has of a drone where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Expected {
    /// From when until when it is there, in seconds from the departure.
    from_s: f64,
    until_s: f64,
    /// The least battery that it has there.
    battery: f64,
}

impl Edge {
    /// Answers a drone that was seen off its plan, at most once a minute; `None` where it is on it.
    pub(super) fn answer_off_plan(
        &self,
        caller: &Caller,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        entry: &wire::TelemetryEntry,
        now: Timestamp,
    ) -> Option<Arc<AnswerRecord>> {
        let flights = self.flights.as_deref()?;
        let is_waiting = !plan.is_as_planned() || plan.wanted.is_some();
        let version = &plan.reported;
        let flown = version.flight.as_deref().filter(|_| !is_waiting)?;
        let sighting = self.drones.last(&entry.drone_id)?;
        let topology = snapshot.topology();
        let progress = progress::progress(topology, plan, &self.drones, now)?;
        let Location::At(place) = progress.location else {
            return None;
        };
        let expected = expected(topology, flown, progress.leg, place)?;
        let seen_s = sighting
            .seen_at
            .duration_since(version.departs_at)
            .as_secs_f64();
        let tolerances = (
            flights.settings.late_tolerance_s,
            flights.settings.battery_tolerance,
        );
        let is_off = is_off(expected, seen_s, &sighting, tolerances);
        if !is_off || !self.off_plan.begins(&plan.id, now) {
            return None;
        }
        let leg = u32::try_from(progress.leg).ok();
        let report = wire::FailureReport {
            failure: Some(wire::FailureType::ServiceLevel),
            service: Some(wire::Service {
                plan_id: Some(plan.id.to_string()),
                leg,
                ..wire::Service::default()
            }),
            location: Some(entry.location.clone()),
            timestamp: Some(sighting.seen_at.to_string()),
            drone: Some(wire::DroneFacts {
                id: Some(entry.drone_id.clone()),
                battery_fraction: sighting.battery_fraction,
                ..wire::DroneFacts::default()
            }),
            ..wire::FailureReport::default()
        };
        let parsed = ParsedReport {
            report,
            warnings: Vec::new(),
        };
        let answered = self.answer_in_place(caller, parsed, Manner::First).ok()?;
        answered.record().cloned()
    }
}

/// Whether a drone is earlier, later or emptier than its plan has it, beyond what is tolerated.
fn is_off(
    expected: Expected,
    seen_s: f64,
    sighting: &Sighting,
    (late_s, battery): (f64, f64),
) -> bool {
    let is_early = seen_s < expected.from_s - late_s;
    let is_late = seen_s > expected.until_s + late_s;
    let seen = sighting.battery_fraction;
    let is_low = seen.is_some_and(|seen| seen < expected.battery - battery);
    is_early || is_late || is_low
}

/// What a plan has of its drone at a place of a leg: on the way over it, or at one of its ends.
fn expected(
    topology: &Topology,
    flown: &FlownVersion,
    leg: usize,
    place: Point,
) -> Option<Expected> {
    let legs = &flown.composition.plan.legs;
    let on = legs.get(leg)?;
    let [from, to] = [on.from, on.to].map(|node| topology.position(node));
    let [to_from_m, to_end_m] = [from, to].map(|end| place.distance_m(end));
    if to_end_m <= AT_NODE_M && to_end_m <= to_from_m {
        // It stays until the next leg begins; at the end for ever.
        let next = legs.get(leg + 1);
        return Some(Expected {
            from_s: on.leaves_s,
            until_s: next.map_or(f64::INFINITY, |next| next.enters_s),
            battery: on.battery_after,
        });
    }
    if to_from_m <= AT_NODE_M {
        let before = leg.checked_sub(1).and_then(|before| legs.get(before));
        return Some(Expected {
            from_s: before.map_or(f64::NEG_INFINITY, |before| before.leaves_s),
            until_s: on.enters_s,
            battery: before.map_or(on.battery_before, |before| before.battery_after),
        });
    }
    let share = to_from_m / (to_from_m + to_end_m);
    let at_s = on.enters_s + share * (on.leaves_s - on.enters_s);
    Some(Expected {
        from_s: at_s,
        until_s: at_s,
        battery: on.battery_before - share * (on.battery_before - on.battery_after),
    })
}
