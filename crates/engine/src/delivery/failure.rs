//! The answer to a failure in flight, with time, battery and pads.

use super::brought::{OwnWorld, causes_of_leg, with_airframe};
use super::case::{Case, Found, conclude};
use super::flight_failure::{FlightFailure, FlightRecomposition};
use super::grounded::{hold_instead, hold_on_the_ground};
use super::in_flight::{Beginnings, battery_now};
use super::landing::land;
use super::local::{Local, answer_locally};
use super::nearby::tell_what_is_near;
use super::skies::FlightEnvironment;
use super::stops::go_on;
use super::unaffected::prefer_old_plan;
use super::world::{DEFAULT_DEADLINE_S, DeliveryScratch, DeliveryWorld, Question};
use crate::flight::Aloft;
use crate::itinerary::FlightCause;
use crate::network::SegmentIx;
use crate::recompose::{
    Flag, Outcome, ReentryPoints, Severance, Strategy, UnsafeWay, World, reentry_points,
};

/// What a cause is called: a closure by its id, the report, or the network; `None` for wind, battery, pads and time.
///
/// The skies are those that the answer was computed in.
pub fn severance(skies: &FlightEnvironment, cause: &FlightCause) -> Option<Severance> {
    match cause {
        FlightCause::Closure(number) => Some(skies.cause_of(*number).unwrap_or(Severance::Report)),
        FlightCause::Request(_) => Some(Severance::Report),
        FlightCause::Network => Some(Severance::Network),
        _ => None,
    }
}

/// Answers a drone in flight.
///
/// Never fails: without a plan to the destination it names an alternate, and without one everything that cuts the drone off. A
/// local strategy whose answer this drone cannot fly goes on to its next stage, and finally to `exact`.
pub fn answer_failure(
    world: &DeliveryWorld<'_>,
    failure: &FlightFailure<'_>,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let of_airframe = with_airframe(world.setting, failure.request);
    let failure = &FlightFailure {
        request: of_airframe.as_ref().unwrap_or(failure.request),
        ..*failure
    };
    let now = World {
        airspace: world.skies.now(),
        trees: None,
    };
    let ways = reentry_points(&now, failure.request, &mut scratch.recompose);
    let aloft = failure.request.circumstances.aloft;
    let held = ways.held_at.filter(|_| aloft != Aloft::Airborne);
    let onward = &failure.request.onward;
    let airborne = |scratch: &mut DeliveryScratch| {
        let answer = answer_in_the_air(world, failure, &ways, scratch);
        go_on(world, failure.request, onward, answer, scratch)
    };
    let Some(node) = held else {
        let mut answer = airborne(scratch);
        if aloft == Aloft::Grounded {
            hold_instead(failure, &mut answer);
        }
        return answer;
    };
    let answer = hold_on_the_ground(world, failure, node, scratch);
    let mut answer = go_on(world, failure.request, onward, answer, scratch);
    if aloft == Aloft::Unknown {
        answer.if_airborne = Some(Box::new(airborne(scratch)));
    }
    answer
}

/// Answers a drone in flight. Where other plans are too near to every way, it is told one that does not keep apart from
/// them: in the air, waiting for them to pass is none.
fn answer_in_the_air(
    world: &DeliveryWorld<'_>,
    failure: &FlightFailure<'_>,
    ways: &ReentryPoints,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let met_before = scratch.itinerary.met_others();
    let answer = answer_by(world, failure, ways, scratch);
    let has_met_others = scratch.itinerary.met_others() > met_before;
    if answer.outcome != Outcome::NoRoute || !has_met_others {
        return flagged(world, failure.at_s, answer);
    }
    let setting = world.setting.unseparated();
    let among_all = DeliveryWorld {
        setting: &setting,
        ..*world
    };
    let unseparated = answer_by(&among_all, failure, ways, scratch);
    match unseparated.outcome {
        Outcome::NoRoute => answer,
        _ => flagged(world, failure.at_s, unseparated),
    }
}

/// An answer that says where its drone comes too near to others: on the way back to its first node there is no choice, and
/// elsewhere there may be none.
fn flagged(
    world: &DeliveryWorld<'_>,
    at_s: f64,
    mut answer: FlightRecomposition,
) -> FlightRecomposition {
    let Some(composition) = &answer.composition else {
        return answer;
    };
    let met = world.setting.world().met_by(&composition.plan, at_s);
    if !met.is_empty() {
        answer
            .causes
            .extend(met.into_iter().map(FlightCause::Traffic));
        answer.flags.push(Flag::Unseparated);
        answer.flags.sort_unstable();
    }
    answer
}

/// Answers a drone in flight by its ways back; where the shorter way out of a zone leads nowhere, by the longer one.
fn answer_by(
    world: &DeliveryWorld<'_>,
    failure: &FlightFailure<'_>,
    ways: &ReentryPoints,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let answer = answer_by_these(world, failure, ways, scratch);
    let spare = ways.spare.filter(|_| answer.outcome == Outcome::NoRoute);
    let Some(spare) = spare else {
        return answer;
    };
    let longer = ReentryPoints {
        ways: vec![spare],
        spare: None,
        ..ways.clone()
    };
    let other = answer_by_these(world, failure, &longer, scratch);
    match other.outcome {
        Outcome::NoRoute => answer,
        _ => other,
    }
}

fn answer_by_these(
    world: &DeliveryWorld<'_>,
    failure: &FlightFailure<'_>,
    ways: &ReentryPoints,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let request = failure.request;
    let battery = battery_now(world.setting.topology(), failure);
    let own = OwnWorld::of(world, request, false);
    let own_world = own.world(world);
    let beginnings = Beginnings::of(own_world.setting, failure, ways);
    let closes_leg = request.report.failure.closes_leg();
    let closed: Vec<SegmentIx> = ways.segment.filter(|_| closes_leg).into_iter().collect();
    let latest_s = failure.at_s + DEFAULT_DEADLINE_S;
    let case = Case {
        world: own_world,
        failure,
        question: Question {
            starts: &beginnings.starts,
            destination: request.report.destination,
            objective: failure.objective,
            began_s: failure.at_s,
            deadline_s: failure.deadline_s.unwrap_or(latest_s),
            reserve: world.setting.rules().reserve,
            closed_segments: &closed,
            in_flight: true,
            explain: true,
        },
        ways,
        before: *world,
    };
    let all = beginnings.all();
    let mut answer = match (failure.landing, request.strategy) {
        (Some(landing), _) => {
            let least = failure.least_at_landing(world.setting.rules());
            let starts = if least > 0.0 {
                &beginnings.starts
            } else {
                &all
            };
            land(&case, landing, (starts, least), scratch)
        }
        (None, Strategy::Exact) => exactly(&case, scratch),
        (None, _) => by_strategy(&case, scratch),
    };
    answer.battery = battery;
    answer.is_energy_checked = failure.is_energy_known();
    if answer.outcome == Outcome::NoRoute {
        tell_what_is_near(&case, &all, &mut answer, scratch);
        answer.unsafe_way = answer.unsafe_way.or_else(|| least_bad(&case));
        let landing = failure.landing.is_some();
        answer.causes = match &beginnings {
            _ if ways.ways.is_empty() => causes_of_leg(case.world.skies, failure),
            Beginnings { starts, causes, .. } if starts.is_empty() => causes.clone(),
            _ if landing => why_no_landing(&case, scratch),
            _ => answer.causes,
        };
    }
    answer
}

/// Where nothing can be flown: what the ways back say, else the first of them.
fn least_bad(case: &Case<'_>) -> Option<UnsafeWay> {
    let ways = case.ways;
    ways.least_bad.clone().or_else(|| {
        let topology = case.world.setting.topology();
        ways.ways.first().map(|way| UnsafeWay::along(topology, way))
    })
}

/// Why a drone can land nowhere: what keeps it from its destination, or that no pad is free there.
fn why_no_landing(case: &Case<'_>, scratch: &mut DeliveryScratch) -> Vec<FlightCause> {
    let causes = case.world.decide(&case.question, scratch).causes;
    match causes.is_empty() {
        true => vec![FlightCause::Pads(case.question.destination)],
        false => causes,
    }
}

/// The answer of `exact`.
fn exactly(case: &Case<'_>, scratch: &mut DeliveryScratch) -> FlightRecomposition {
    let decision = case.world.decide(&case.question, scratch);
    let mut found = Found::of(case.world.setting, decision);
    let closes_leg = case.failure.request.report.failure.closes_leg();
    // A drone that has to leave a zone, or comes into one as it turns, does not simply fly on.
    let flies_on = !case.ways.leaves_zone && !case.ways.cannot_stop;
    if found.outcome == Outcome::Rerouted && flies_on && (!closes_leg || case.ways.only_ahead) {
        prefer_old_plan(case, &mut found, scratch);
    }
    conclude(case, &case.question, found, scratch)
}

/// A local strategy or a baseline, as far as this drone can fly what it says.
fn by_strategy(case: &Case<'_>, scratch: &mut DeliveryScratch) -> FlightRecomposition {
    let mut unflyable_stages = Vec::new();
    match answer_locally(case, &mut unflyable_stages, scratch) {
        Ok(local) => {
            let Local {
                outcome,
                decision,
                stage,
                warnings,
            } = local;
            let mut found = Found {
                outcome,
                ..Found::of(case.world.setting, decision)
            };
            // What is best on this way need not be best of all: the bound is that of every way.
            let table = case.world.table(&case.question);
            found.proof.proved = false;
            found.proof.lower_bound = table.least_from(case.question.starts);
            let mut answer = conclude(case, &case.question, found, scratch);
            answer.stage = stage;
            answer.unflyable_stages = unflyable_stages;
            answer.warnings = warnings;
            answer
        }
        Err(fallback) => FlightRecomposition {
            strategy_used: Strategy::Exact,
            fallback: Some(fallback),
            unflyable_stages,
            ..exactly(case, scratch)
        },
    }
}
