//! What telemetry shows of a drone's plan: that it has departed, that it is where it is to be, and that it has landed at
//! its end.

use super::agreement::{Agreement, Conformance};
use super::deviation::deviation;
use super::progress::{self, spot_on};
use super::{Drones, Flown, Rest, Sighting};
use crate::Edge;
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use crate::state::ends::LANDED_WITHIN_M;
use crate::writer::commands::{Command, Seen};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::PlanState;
use skyway_engine::network::{NodeIx, Topology};
use std::sync::Arc;

/// What is farther off its way, in metres, says nothing of how far a drone has come.
const OFF_WAY_M: f64 = 50.0;
/// So near to the last node, in metres, a drone is at it.
const AT_END_M: f64 = 15.0;
/// A drone that is less above a node, in metres, stands on it.
const STANDS_BELOW_M: f64 = 3.0;
/// So long a drone has to rest at the last node before it counts as landed.
const RESTS_FOR: SignedDuration = SignedDuration::from_secs(5);

impl Edge {
    /// Tells the writer what a sighting shows that it does not know.
    pub(crate) fn tell_seen(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        (sighting, before): (&Sighting, Option<&Sighting>),
        now: Timestamp,
    ) {
        if let Some(stops) = plan.served_by(snapshot.topology(), sighting, before) {
            let version = plan.reported.number;
            self.tell_writer(plan, Seen::Served { version, stops });
        }
        if let Some(seen) = self.shown(snapshot, plan, sighting, now) {
            self.tell_writer(plan, seen);
        }
    }

    fn tell_writer(&self, plan: &PlanEntry, seen: Seen) {
        let id = plan.id.clone();
        if let Err(refusal) = self.writer.tell(Command::SeePlan { id, seen }) {
            // The next position shows it again.
            tracing::warn!(%refusal, plan = %plan.id, "what telemetry shows of a plan could not be noted");
        }
    }

    /// Tells the writer that a drone has left the pad on which it landed.
    pub(crate) fn tell_left(&self, snapshot: &Snapshot, drone: &str, sighting: &Sighting) {
        let Some((plan, landed)) = snapshot.landed_plan(drone) else {
            return;
        };
        let topology = snapshot.topology();
        let place = sighting.position(topology.frame());
        let is_away = place.distance_m(topology.position(landed.node)) > LANDED_WITHIN_M;
        let has_left = is_away || sighting.airborne == Some(true);
        if has_left && sighting.seen_at >= landed.since {
            self.tell_writer(plan, Seen::LeftItsPad);
        }
    }

    fn shown(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        sighting: &Sighting,
        now: Timestamp,
    ) -> Option<Seen> {
        if let Some(rest) = &sighting.rests
            && sighting.seen_at.duration_since(rest.since) >= RESTS_FOR
            && is_last_leg(snapshot.topology(), plan, &self.drones, now)
        {
            return Some(Seen::Landed(rest.version));
        }
        if plan.flags.silent {
            return Some(Seen::Heard);
        }
        let agreement = sighting.agreement.as_ref();
        let conformance = agreement.map(|agreement| agreement.conformance(sighting.seen_at));
        match (plan.state, conformance) {
            (PlanState::Accepted, _) => (sighting.airborne == Some(true)).then_some(Seen::Departed),
            (PlanState::Activated, Some(Conformance::Deviates)) => Some(Seen::Deviates),
            (PlanState::Nonconforming, Some(Conformance::Conforms)) => Some(Seen::Conforms),
            _ => None,
        }
    }

    /// A sighting of the drone of a plan, with how far it has come, and how it agrees with that plan.
    pub(crate) fn held_against(
        &self,
        snapshot: &Snapshot,
        plan: &Arc<PlanEntry>,
        sighting: Sighting,
        before: Option<&Sighting>,
    ) -> Sighting {
        let topology = snapshot.topology();
        // One in the air has departed, though the writer may not have come to it yet.
        let has_departed = plan.state != PlanState::Accepted || sighting.airborne == Some(true);
        let is_in_flight =
            plan.is_active() && has_departed && sighting.seen_at >= plan.reported.departs_at;
        let agreement = is_in_flight.then(|| {
            let newest = deviation(topology, plan, &sighting, &*self.planner);
            let before = before.and_then(|before| before.agreement.as_ref());
            Agreement::after(before, &plan.id, sighting.seen_at, newest)
        });
        Sighting {
            flown: flown(topology, plan, &sighting, before),
            rests: rests(topology, plan, &sighting, before),
            at_stop: plan.at_stop(topology, &sighting, before),
            agreement,
            ..sighting
        }
    }
}

/// Whether the drone of a plan has only the last leg before it.
fn is_last_leg(topology: &Topology, plan: &PlanEntry, drones: &Drones, now: Timestamp) -> bool {
    let version = &plan.reported;
    let legs = version.composition.legs.len();
    match progress::progress(topology, plan, drones, now).filter(|_| legs > 0) {
        Some(progress) => progress.leg + 1 == legs,
        // Nothing is left to be flown but a first stretch, unless it waits at its end for a way.
        None => {
            let has_stops_ahead = version.stops_flown() < version.stops.len();
            let is_at_end = version.last_node() == Some(plan.destination) && !has_stops_ahead;
            version.is_diversion() || is_at_end
        }
    }
}

/// How far a drone has come on what it reported to fly.
fn flown(
    topology: &Topology,
    plan: &PlanEntry,
    sighting: &Sighting,
    before: Option<&Sighting>,
) -> Option<Flown> {
    let version = &plan.reported;
    let place = sighting.position(topology.frame());
    let has_departed = sighting.seen_at >= version.departs_at;
    let known = plan.known_by(topology, before, sighting.seen_at);
    let spot = spot_on(topology, version, place, known).filter(|_| has_departed)?;
    // What is far off says nothing of how far it has come.
    let at_m = if spot.off_m <= OFF_WAY_M {
        spot.at_m.max(known.flown_m)
    } else {
        known.flown_m
    };
    Some(Flown {
        plan: plan.id.clone(),
        version: version.number,
        at_m,
        at: sighting.seen_at,
    })
}

/// Since when a drone rests at the end of what it reported to fly.
fn rests(
    topology: &Topology,
    plan: &PlanEntry,
    sighting: &Sighting,
    before: Option<&Sighting>,
) -> Option<Rest> {
    let version = &plan.reported;
    let end = version.last_node()?;
    let place = sighting.position(topology.frame());
    let is_there = place.distance_m(topology.position(end)) <= AT_END_M;
    let has_departed = sighting.seen_at >= version.takes_off_last_at();
    let rests = is_there && has_departed && sighting.is_slow(topology.frame(), before);
    if !rests || !stands_on(topology, end, sighting) {
        return None;
    }
    let is_same = |rest: &&Rest| rest.plan == plan.id && rest.version == version.number;
    let since = before
        .and_then(|before| before.rests.as_ref())
        .filter(is_same);
    Some(Rest {
        plan: plan.id.clone(),
        version: version.number,
        since: since.map_or(sighting.seen_at, |rest| rest.since),
    })
}

/// By what it says, else by its height where that can be compared with the node's.
fn stands_on(topology: &Topology, node: NodeIx, sighting: &Sighting) -> bool {
    if let Some(airborne) = sighting.airborne {
        return !airborne;
    }
    let ground = topology.node_altitude(node);
    let height = sighting
        .altitude_m
        .zip(sighting.altitude_reference)
        .zip(ground);
    height.is_some_and(|((altitude_m, reference), ground)| {
        reference == ground.reference && altitude_m < ground.value_m + STANDS_BELOW_M
    })
}
