//! What to do on a leg that closes, and where to land, with the battery and at the time of that leg.

use super::composition::{FlightComposition, nodes_of};
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::compose::{self, Contingency};
use crate::flight::{FlightPlan, FlightStart, FlownLeg};
use crate::geo::total_m;
use crate::itinerary::{FlightOutcome, FlightRequest, Limits, find_alternate};
use crate::network::{NodeIx, SegmentIx};
use crate::recompose::Outcome;

/// Each search takes at most this many labels and checks: a plan has dozens of them, and where no detour is found a safe
/// node is told.
const MOST_LABELS: usize = 20_000;
const MOST_CHECKS: usize = 200_000;

/// What a drone does on a leg where it is told nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct LegContingency {
    /// The detour, if the leg closes while the drone is at its start.
    pub if_closed: FlownDetour,
    /// The best alternate from the leg's start; `None` where none can be reached.
    pub safe: Option<Alternate>,
}

/// A contingency with the flight that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct FlownDetour {
    /// What the drone would be told, and by which nodes.
    pub contingency: Contingency,
    /// The flight from the leg's start to the destination, or to an alternate; `None` where there is none.
    pub flight: Option<FlightPlan>,
    /// True where it draws on the reserve, to reach an alternate.
    pub reserve_used: bool,
}

/// An alternate that is reached with most battery, and the flight to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternate {
    /// The node, the way to it, and how long that is.
    pub safe: compose::Alternate,
    /// The flight.
    pub flight: FlightPlan,
    /// True where it draws on the reserve.
    pub reserve_used: bool,
}

/// The contingencies of all legs of a plan, in another state of the world than it was made in.
pub fn contingencies_of(
    world: &DeliveryWorld<'_>,
    composition: &FlightComposition,
    scratch: &mut DeliveryScratch,
) -> Vec<LegContingency> {
    let starts = [composition.plan.start];
    let question = Question {
        starts: &starts,
        destination: composition.destination,
        objective: composition.objective,
        began_s: composition.began_s,
        deadline_s: composition.deadline_s,
        reserve: composition.reserve,
        closed_segments: &composition.closed_segments,
        in_flight: true,
        explain: false,
    };
    let plan = &composition.plan;
    let legs = 0..plan.legs.len();
    legs.map(|leg| contingency(world, &question, plan, leg, scratch))
        .collect()
}

/// The contingencies of a leg of a plan that answers a question.
pub(super) fn contingency(
    world: &DeliveryWorld<'_>,
    question: &Question<'_>,
    plan: &FlightPlan,
    leg: usize,
    scratch: &mut DeliveryScratch,
) -> LegContingency {
    let flown = plan.legs[leg];
    let at_leg = [at_start_of(&flown)];
    // A detour leads to where the drone is served next: what follows is planned once it is there.
    let (destination, end) = next_landing(question.destination, plan, leg);
    let from_here = Question {
        starts: &at_leg,
        destination,
        in_flight: true,
        explain: false,
        ..*question
    };
    let mut closed = question.closed_segments.to_vec();
    closed.push(flown.segment);
    let around = Question {
        closed_segments: &closed,
        ..from_here
    };
    // All legs together take no more than a few searches, however many there are.
    let share = world.limits.share(plan.legs.len());
    let world = &DeliveryWorld {
        limits: Limits {
            labels: share.labels.min(MOST_LABELS),
            checks: share.checks.min(MOST_CHECKS),
            ..share
        },
        ..*world
    };
    LegContingency {
        if_closed: if_closed(world, &around, &plan.legs[leg..end], scratch),
        safe: alternate(world, &from_here, scratch),
    }
}

/// Where the drone of a plan on a leg is served next, and how many legs end there: at its next stop, else at its destination.
fn next_landing(destination: NodeIx, plan: &FlightPlan, leg: usize) -> (NodeIx, usize) {
    let mut stops = plan.stops.iter();
    let next = stops.find(|stop| stop.service_s.is_some() && stop.before_leg > leg);
    next.map_or((destination, plan.legs.len()), |stop| {
        (stop.node, stop.before_leg)
    })
}

/// The drone at the start of a leg, in the air.
fn at_start_of(leg: &FlownLeg) -> FlightStart {
    FlightStart {
        node: leg.from,
        at_s: leg.enters_s,
        battery: leg.battery_before,
        on_ground: false,
        pad: None,
        flown_m: 0.0,
        drawn: 0.0,
        stretch: None,
    }
}

fn if_closed(
    world: &DeliveryWorld<'_>,
    around: &Question<'_>,
    planned: &[FlownLeg],
    scratch: &mut DeliveryScratch,
) -> FlownDetour {
    let decision = world.decide(around, scratch);
    let (outcome, reserve_used) = match decision.outcome {
        FlightOutcome::Planned => (Outcome::Rerouted, false),
        FlightOutcome::Hold { .. } => (Outcome::Hold, false),
        FlightOutcome::Diverted { reserve_used, .. } => (Outcome::Diverted, reserve_used),
        FlightOutcome::NoRoute => (Outcome::NoRoute, false),
    };
    let flight = decision.answer.plan;
    let mut nodes = flight.as_ref().map_or_else(Vec::new, nodes_of);
    let remaining_length_m = flight.as_ref().map(|flight| flight.distance_m);
    let leads_there = matches!(outcome, Outcome::Rerouted | Outcome::Hold);
    let (mut rejoins, mut extra_m) = (None, None);
    if let Some(detour) = flight.as_ref().filter(|_| leads_there) {
        nodes.truncate(nodes.len() - flown_as_planned(planned, &detour.legs));
        rejoins = nodes.last().copied();
        extra_m = Some(detour.distance_m - length_m(world, planned));
    }
    FlownDetour {
        contingency: Contingency {
            outcome,
            nodes,
            rejoins,
            remaining_length_m,
            extra_m,
        },
        flight,
        reserve_used,
    }
}

/// Ways that end at the same node and share their last segments share the nodes between them.
fn flown_as_planned(planned: &[FlownLeg], detour: &[FlownLeg]) -> usize {
    let segment = |leg: &FlownLeg| -> SegmentIx { leg.segment };
    let backwards = planned.iter().rev().map(segment);
    let backwards = backwards.zip(detour.iter().rev().map(segment));
    backwards.take_while(|(one, other)| one == other).count()
}

fn length_m(world: &DeliveryWorld<'_>, legs: &[FlownLeg]) -> f64 {
    let topology = world.setting.topology();
    let lengths = legs
        .iter()
        .map(|leg| topology.segment(leg.segment).length_m);
    total_m(lengths)
}

/// The best alternate of a drone in flight, with the reserve, else with the floor.
fn alternate(
    world: &DeliveryWorld<'_>,
    question: &Question<'_>,
    scratch: &mut DeliveryScratch,
) -> Option<Alternate> {
    let rules = world.setting.rules();
    let mut alternate = |reserve: f64| {
        let request = FlightRequest {
            starts: question.starts,
            destination: question.destination,
            objective: question.objective,
            began_s: question.began_s,
            deadline_s: question.deadline_s,
            reserve,
            closed_segments: question.closed_segments,
            limits: world.limits,
        };
        let found = find_alternate(
            world.setting,
            &request,
            world.refuge_stay_s,
            &mut scratch.itinerary,
        );
        let found = found.ok()?;
        Some((found.node, found.answer.plan?, reserve < rules.reserve))
    };
    let (node, flight, reserve_used): (NodeIx, FlightPlan, bool) =
        alternate(rules.reserve).or_else(|| alternate(rules.floor))?;
    Some(Alternate {
        safe: compose::Alternate {
            node,
            nodes: nodes_of(&flight),
            length_m: flight.distance_m,
        },
        flight,
        reserve_used,
    })
}
