//! A drone on the ground inside an active zone, or without a way on: it holds on its pad, and never leaves through a zone.

use super::brought::OwnWorld;
use super::composition::{DeliveryRequest, FlightComposition, Proof, with_contingencies};
use super::flight_failure::{FlightFailure, FlightRecomposition};
use super::in_flight::battery_now;
use super::standing::answer_standing;
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::airspace::{Window, counts_until};
use crate::flight::{FlightPlan, Reentry, StretchLeg};
use crate::itinerary::{Effort, Step, Value};
use crate::network::NodeIx;
use crate::recompose::{Flag, Outcome, Request, Warning};
use jiff::Timestamp;

/// Tells a drone that stands at a node in an active zone to wait there, and what it flies then as far as that is known.
pub(super) fn hold_on_the_ground(
    world: &DeliveryWorld<'_>,
    failure: &FlightFailure<'_>,
    node: NodeIx,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let own = OwnWorld::of(world, failure.request, true);
    let world = &own.world(world);
    let request = DeliveryRequest {
        pad: None,
        source: node,
        destination: failure.request.report.destination,
        start_s: failure.at_s,
        began_s: failure.at_s,
        battery: battery_now(world.setting.topology(), failure),
        objective: failure.objective,
        deadline_s: failure.deadline_s,
    };
    let mut answer = answer_standing(world, &request, None, scratch);
    // One that has to land goes nowhere else than where it stands.
    let flies_on =
        matches!(answer.outcome, Outcome::Hold | Outcome::Rerouted) && failure.landing.is_none();
    answer.is_energy_checked = failure.is_energy_known();
    match flies_on {
        true => hold(world, failure.request, node, &mut answer),
        // No way on is known: it stays, until it is told more.
        false => stay(world, failure.request, &request, &mut answer, scratch),
    }
    let (from, to) = failure.request.report.leg;
    let topology = world.setting.topology();
    let leg = StretchLeg {
        from,
        to,
        segment: topology.segment_between(from, to),
        fraction: if node == to { 1.0 } else { 0.0 },
    };
    let stands = Reentry::at_node(node, topology.position(node), Some(leg));
    if let Some(composition) = &mut answer.composition {
        composition.plan.start.stretch = Some(stands.stretch);
    }
    answer
}

/// Lets a drone hold that stands where it would be diverted to: it has to go nowhere, and on a diversion its plan would end.
pub(super) fn hold_instead(failure: &FlightFailure<'_>, answer: &mut FlightRecomposition) {
    let composition = answer.composition.as_ref();
    let stays =
        composition.is_some_and(|it| it.plan.legs.is_empty() && it.plan.start.flown_m == 0.0);
    if answer.outcome == Outcome::Diverted && stays && failure.landing.is_none() {
        answer.outcome = Outcome::Hold;
        // What it would draw on to fly elsewhere it keeps.
        answer.reserve_used = false;
        answer.flags.retain(|flag| *flag != Flag::ReserveUsed);
    }
}

/// Makes an answer one that lets a drone stand where it is, until it is told more.
pub(super) fn stay(
    world: &DeliveryWorld<'_>,
    request: &Request,
    stands: &DeliveryRequest,
    answer: &mut FlightRecomposition,
    scratch: &mut DeliveryScratch,
) {
    answer.composition = Some(staying(world, stands, scratch));
    answer.hold = None;
    answer.reserve_used = false;
    answer.flags.clear();
    answer.unsafe_way = None;
    hold(world, request, stands.source, answer);
}

fn hold(
    world: &DeliveryWorld<'_>,
    request: &Request,
    node: NodeIx,
    answer: &mut FlightRecomposition,
) {
    answer.outcome = Outcome::Hold;
    answer.warnings = vec![match end_of_zones(world, request, node) {
        Some(until) => Warning::HoldsUntil { node, until },
        None => Warning::HoldsWithoutEnd { node },
    }];
}

/// Whether a zone that is in force, or that a report brings, closes a node.
pub(super) fn is_in_zone(world: &DeliveryWorld<'_>, request: &Request, node: NodeIx) -> bool {
    zones_over(world, request, node).next().is_some()
}

/// When the last of the zones over a node ends; `None` where that is unknown.
fn end_of_zones(world: &DeliveryWorld<'_>, request: &Request, node: NodeIx) -> Option<Timestamp> {
    let airspace = world.skies.now();
    let (now, horizon) = (airspace.as_of(), airspace.horizon());
    let zones = zones_over(world, request, node);
    let ends = zones.map(|windows| counts_until(&windows, now, horizon));
    let ends: Option<Vec<Timestamp>> = ends.collect();
    ends?.into_iter().max()
}

/// The windows of each zone over a node.
fn zones_over<'a>(
    world: &DeliveryWorld<'a>,
    request: &'a Request,
    node: NodeIx,
) -> impl Iterator<Item = Vec<Window>> {
    let airspace = world.skies.now();
    let covers = move |nodes: &[NodeIx]| nodes.binary_search(&node).is_ok();
    let standing = airspace.in_force().filter(|it| it.zone().is_some());
    let standing = standing.filter(move |closure| covers(&closure.hits.nodes));
    let standing = standing.map(|closure| closure.windows.clone());
    let brought = request.zone.iter();
    let brought = brought.filter(move |brought| covers(&brought.hits.nodes));
    standing.chain(brought.map(|brought| brought.zone.windows_around(airspace.as_of())))
}

/// A plan that stays where it is.
fn staying(
    world: &DeliveryWorld<'_>,
    request: &DeliveryRequest,
    scratch: &mut DeliveryScratch,
) -> FlightComposition {
    let starts = [request.start()];
    let question = Question {
        destination: request.source,
        deadline_s: f64::INFINITY,
        ..request.question(world, &starts)
    };
    let plan = FlightPlan {
        start: starts[0],
        legs: Vec::new(),
        stops: Vec::new(),
        arrives_s: request.start_s,
        battery_at_arrival: request.battery,
        distance_m: 0.0,
        energy: 0.0,
    };
    let value = Value {
        weight: 0.0,
        arrives_s: request.start_s,
    };
    let proof = Proof {
        proved: false,
        value,
        lower_bound: value,
        reason: None,
        step: Step::Walk,
        effort: Effort::default(),
    };
    with_contingencies(world, &question, plan, proof, scratch)
}
