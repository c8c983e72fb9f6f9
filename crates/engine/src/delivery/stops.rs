//! Deliveries that stop on their way: for a pickup, a drop or a visit, and to come home.
//!
//! They are composed part by part, each the best plan from where and when the one before it has been served. What is told of the
//! whole is argued in `docs/flight-search.md`.

use super::brought::OwnWorld;
use super::composition::{
    DeliveryRequest, FlightComposition, NoDelivery, Proof, compose, with_contingencies,
};
use super::contingency::contingencies_of;
use super::flight_failure::FlightRecomposition;
use super::standing::Stand;
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::flight::{FlightPlan, FlightStart, ServiceStop, Stop, StopKind};
use crate::itinerary::{
    FlightCause, FlightRequest, NoAlternate, Objective, Unproved, Value, find_alternate,
};
use crate::network::NodeIx;
use crate::recompose::{Outcome, Request, Warning};

/// Where a delivery with stops ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lands {
    /// At the destination of its request.
    AtDestination,
    /// On the pad nearest to its last stop, by energy, that is free for as long as one at an alternate has to be. That may be the
    /// pad of the last stop itself.
    OnNearestPad,
}

/// Composes a delivery that stops on its way.
///
/// # Errors
/// [`NoDelivery`] where one of its parts has no plan, with what cuts the drone off there.
pub fn compose_with_stops(
    world: &DeliveryWorld<'_>,
    request: &DeliveryRequest,
    (stops, lands): (&[ServiceStop], Lands),
    scratch: &mut DeliveryScratch,
) -> Result<FlightComposition, NoDelivery> {
    let parts = &DeliveryWorld {
        with_contingencies: false,
        ..*world
    };
    let first = DeliveryRequest {
        destination: stops.first().map_or(request.destination, |stop| stop.node),
        ..*request
    };
    let head = compose(parts, &first, scratch)?;
    let mut composition = match visit(parts, head, stops, scratch) {
        (composition, None) => composition,
        (_, Some(none)) => return Err(none),
    };
    let last = stops.last().copied();
    let last = last.unwrap_or(ServiceStop {
        node: request.source,
        service_s: 0.0,
    });
    let destination = match lands {
        Lands::AtDestination => request.destination,
        Lands::OnNearestPad => nearest_pad(parts, &composition, last, scratch)
            .map_err(|_| no_pad(&composition, last.node))?,
    };
    // Where nothing follows the last stop it is the end.
    if !stops.is_empty() && destination != last.node {
        composition = with_part(parts, &composition, (last, destination), scratch)?;
    }
    if world.with_contingencies {
        composition.contingencies = contingencies_of(world, &composition, scratch);
    }
    Ok(composition)
}

/// A composition to the first of some stops with the parts to the others, up to the first that has no plan.
fn visit(
    world: &DeliveryWorld<'_>,
    head: FlightComposition,
    stops: &[ServiceStop],
    scratch: &mut DeliveryScratch,
) -> (FlightComposition, Option<NoDelivery>) {
    let mut composition = head;
    for pair in stops.windows(2) {
        let next = (pair[0], pair[1].node);
        match with_part(world, &composition, next, scratch) {
            Ok(longer) => composition = longer,
            Err(none) => return (composition, Some(none)),
        }
    }
    (composition, None)
}

/// The answer to a drone whose delivery goes on beyond the answer's end: with the parts that follow, as far as there are plans.
pub(super) fn go_on(
    world: &DeliveryWorld<'_>,
    request: &Request,
    onward: &[ServiceStop],
    mut answer: FlightRecomposition,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let leads_there = matches!(
        answer.outcome,
        Outcome::Rerouted | Outcome::Unaffected | Outcome::Hold
    );
    let next = onward.first().map(|stop| stop.node);
    let ends_there = |composition: &FlightComposition| next == Some(composition.destination);
    let goes_on = onward.len() > 1 && leads_there;
    let Some(head) = answer.composition.take_if(|it| goes_on && ends_there(it)) else {
        return answer;
    };
    let own = OwnWorld::of(world, request, true);
    let parts = DeliveryWorld {
        with_contingencies: false,
        ..own.world(world)
    };
    let (mut composition, none) = visit(&parts, head, onward, scratch);
    if none.is_some() {
        let node = composition.destination;
        answer.warnings.push(Warning::EndsAtStop { node });
    }
    if world.with_contingencies {
        composition.contingencies = contingencies_of(&own.world(world), &composition, scratch);
    }
    answer.proof = composition.proof;
    answer.composition = Some(composition);
    answer
}

/// A plan of a drone that has to stay where it stands until it has been served.
pub(super) fn served_first(
    world: &DeliveryWorld<'_>,
    composition: &mut FlightComposition,
    stand: &Stand,
    service_s: f64,
) {
    let plan = &mut composition.plan;
    let Some(first) = plan.legs.first() else {
        return;
    };
    let node = plan.start.node;
    let vertical_s = world.setting.legs().vertical_s(node);
    let ready = (plan.start.at_s, plan.start.battery);
    let waits = plan.stops.first().filter(|stop| stop.before_leg == 0);
    let waits = waits.copied();
    let takes_off_s = waits.map_or(first.enters_s - vertical_s, |stop| stop.takes_off_s);
    let (at_s, battery) = (stand.at_s, stand.battery);
    let pads = world.setting.pads();
    let pad = stand.pad.or(pads.free_pad(node, at_s, takes_off_s));
    let stay = Stop {
        kind: waits.map_or(StopKind::Start, |stop| stop.kind),
        before_leg: 0,
        node,
        pad: pad.unwrap_or_default(),
        lands_s: at_s,
        takes_off_s,
        battery_before: battery,
        battery_after: waits.map_or(ready.1, |stop| stop.battery_after),
        service_s: Some(service_s),
    };
    match plan.stops.first_mut().filter(|stop| stop.before_leg == 0) {
        Some(stop) => *stop = stay,
        None => plan.stops.insert(0, stay),
    }
    plan.start.at_s = at_s;
    plan.start.battery = battery;
    let (began_s, reserve) = (composition.began_s, composition.reserve);
    composition.figures = world
        .setting
        .figures(&composition.plan, began_s, reserve, world.tariff);
}

/// A drone that has landed to be served: when it may take off, and with how much battery.
struct Served {
    kind: StopKind,
    ready_s: f64,
    battery: f64,
}

impl Served {
    /// At the end of a composition.
    fn after(
        world: &DeliveryWorld<'_>,
        composition: &FlightComposition,
        stop: ServiceStop,
    ) -> Self {
        let (setting, plan) = (world.setting, &composition.plan);
        let (rules, charging) = (setting.rules(), setting.airframe().charging());
        let (kind, handling_s) = match setting.pads().swaps(stop.node) {
            true => (StopKind::Swap, rules.swap_s),
            false => (StopKind::Charge, rules.stop_s),
        };
        let stay_s = stop.service_s.max(handling_s);
        let battery = match kind {
            StopKind::Swap => charging.full,
            _ => charging.level_after(plan.battery_at_arrival, stay_s - handling_s),
        };
        Self {
            kind,
            ready_s: plan.arrives_s + stay_s,
            battery,
        }
    }

    fn start(&self, node: NodeIx) -> FlightStart {
        FlightStart {
            node,
            at_s: self.ready_s,
            battery: self.battery,
            on_ground: true,
            pad: None,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        }
    }
}

/// A composition with the part that follows it: served where it ends, and on to the next node.
fn with_part(
    world: &DeliveryWorld<'_>,
    head: &FlightComposition,
    (here, next): (ServiceStop, NodeIx),
    scratch: &mut DeliveryScratch,
) -> Result<FlightComposition, NoDelivery> {
    let served = Served::after(world, head, here);
    let starts = [served.start(here.node)];
    let question = Question {
        starts: &starts,
        destination: next,
        objective: head.objective,
        began_s: head.began_s,
        deadline_s: head.deadline_s,
        reserve: world.setting.rules().reserve,
        closed_segments: &head.closed_segments,
        in_flight: false,
        explain: true,
    };
    let decision = world.decide(&question, scratch);
    let proof = Proof::of(&decision.answer);
    let Some(part) = decision.answer.plan else {
        return Err(NoDelivery {
            causes: decision.causes,
            opens: decision.opens,
            deadline_s: question.deadline_s,
            // After another head there may be one.
            proved: false,
        });
    };
    let joined = joined(world, &head.plan, &part, (here, &served));
    let plan = joined.ok_or_else(|| no_pad(head, here.node))?;
    let proof = joint_proof(world, head, (here.node, next), proof);
    Ok(with_contingencies(world, &question, plan, proof, scratch))
}

/// Two plans as one, with the stay between them; `None` where no pad is free for as long.
fn joined(
    world: &DeliveryWorld<'_>,
    head: &FlightPlan,
    part: &FlightPlan,
    (here, served): (ServiceStop, &Served),
) -> Option<FlightPlan> {
    let waits = part.stops.first().filter(|stop| stop.before_leg == 0);
    let (takes_off_s, battery_after) = match waits {
        Some(stop) => (stop.takes_off_s, stop.battery_after),
        None => (served.ready_s, served.battery),
    };
    let pads = world.setting.pads();
    let stay = Stop {
        kind: served.kind,
        before_leg: head.legs.len(),
        node: here.node,
        pad: pads.free_pad(here.node, head.arrives_s, takes_off_s)?,
        lands_s: head.arrives_s,
        takes_off_s,
        battery_before: head.battery_at_arrival,
        battery_after,
        service_s: Some(here.service_s),
    };
    let later = part.stops.iter().skip(usize::from(waits.is_some()));
    let later = later.map(|stop| Stop {
        before_leg: stop.before_leg + head.legs.len(),
        ..*stop
    });
    let mut plan = FlightPlan {
        arrives_s: part.arrives_s,
        battery_at_arrival: part.battery_at_arrival,
        distance_m: head.distance_m + part.distance_m,
        energy: head.energy + part.energy,
        ..head.clone()
    };
    plan.legs.extend_from_slice(&part.legs);
    plan.stops.push(stay);
    plan.stops.extend(later);
    Some(plan)
}

/// What is certain of a plan with one more part.
fn joint_proof(
    world: &DeliveryWorld<'_>,
    head: &FlightComposition,
    (here, next): (NodeIx, NodeIx),
    part: Proof,
) -> Proof {
    let table = world.tables.get(world.setting, next, head.objective);
    let landed_s = head.plan.arrives_s;
    let is_free = world.setting.pads().stay_until_s(here, landed_s) == f64::INFINITY;
    let is_lightest =
        head.objective == Objective::Time || part.value.weight <= table.least_weight(here);
    let proved = head.proof.proved && part.proved && is_free && is_lightest;
    let value = Value {
        weight: head.proof.value.weight + part.value.weight,
        arrives_s: part.value.arrives_s,
    };
    let bound = Value {
        weight: head.proof.lower_bound.weight + table.least_weight(here),
        arrives_s: head.proof.lower_bound.arrives_s + table.least_time_s(here),
    };
    let effort = head.proof.effort;
    Proof {
        proved,
        value,
        lower_bound: if proved { value } else { bound },
        reason: match proved {
            true => None,
            false => head.proof.reason.or(part.reason).or(Some(Unproved::Parts)),
        },
        step: part.step,
        effort: effort.and(part.effort),
    }
}

/// The node with a free pad that a drone reaches with most battery once it has been served at the end of a composition.
fn nearest_pad(
    world: &DeliveryWorld<'_>,
    composition: &FlightComposition,
    last: ServiceStop,
    scratch: &mut DeliveryScratch,
) -> Result<NodeIx, NoAlternate> {
    let starts = [Served::after(world, composition, last).start(last.node)];
    let request = FlightRequest {
        starts: &starts,
        destination: last.node,
        objective: Objective::Energy,
        began_s: composition.began_s,
        deadline_s: composition.deadline_s,
        reserve: world.setting.rules().reserve,
        closed_segments: &composition.closed_segments,
        limits: world.limits,
    };
    let stay_s = world.refuge_stay_s;
    let found = find_alternate(world.setting, &request, stay_s, &mut scratch.itinerary);
    found.map(|alternate| alternate.node)
}

/// No pad for a stop of this composition; a later one may find it free.
fn no_pad(composition: &FlightComposition, node: NodeIx) -> NoDelivery {
    NoDelivery {
        causes: vec![FlightCause::Pads(node)],
        opens: None,
        deadline_s: composition.deadline_s,
        proved: false,
    }
}
