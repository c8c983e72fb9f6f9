//! The best alternate for a drone that cannot reach its destination: most battery on arrival, and a pad that is free.

use super::expander::Expander;
use super::label::How;
use super::memory::ItineraryScratch;
use super::potentials::Potentials;
use super::request::{
    Effort, FlightAnswer, FlightRequest, FlightWorld, Objective, Step, Unproved, Value, close,
    reopen,
};
use super::rounds::{Most, has_spent, is_last_of_few};
use super::run::{Goal, Mode, Run, RunEnd};
use super::setting::FlightSetting;
use super::trace::plan;
use crate::network::NodeIx;

/// There is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoAlternate {
    /// The limit that was reached, where the search was cut short.
    pub reason: Option<Unproved>,
}

impl NoAlternate {
    const CERTAIN: Self = Self { reason: None };
}

/// A plan to an alternate.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternate {
    /// The node.
    pub node: NodeIx,
    /// The plan that leads there, by least energy; its value's weight is the energy drawn.
    pub answer: FlightAnswer,
}

/// Finds the alternate that is reached with most battery: one with a pad that is free for `stay_s` from the landing on.
///
/// The request's destination and objective do not matter, its deadline does not bind: a drone lands where it can. The energy that
/// the starts have drawn already has to be counted from one place for all of them.
///
/// # Errors
/// No alternate can be reached with the request's reserve, or none was found within its limits: of a drone that
/// stands also where others fly on all of the ways looked at.
pub fn find_alternate(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    stay_s: f64,
    scratch: &mut ItineraryScratch,
) -> Result<Alternate, NoAlternate> {
    find_landing(setting, request, Goal::Alternate { stay_s }, scratch)
}

/// Finds the node that is not closed and is reached with most battery, with or without pads.
///
/// The same holds of the request as for [`find_alternate`].
///
/// # Errors
/// No node can be reached with the request's reserve, or none was found within its limits.
pub fn find_nearest(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    scratch: &mut ItineraryScratch,
) -> Result<Alternate, NoAlternate> {
    find_landing(setting, request, Goal::AnyNode, scratch)
}

fn find_landing(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    goal: Goal,
    scratch: &mut ItineraryScratch,
) -> Result<Alternate, NoAlternate> {
    let world = setting.world();
    let nodes = world.topology.node_count();
    let first = request.starts.first().ok_or(NoAlternate::CERTAIN)?;
    let request = FlightRequest {
        objective: Objective::Energy,
        deadline_s: f64::INFINITY,
        destination: first.node,
        ..request.clone()
    };
    scratch.begin(world.topology);
    let potentials = Potentials::nowhere(nodes, Objective::Energy);
    let terms = Expander::new(&world, &request, &potentials);
    let mut effort = Effort::default();
    let stands = request.starts.iter().all(|start| start.on_ground);
    let standing = standing_safely(&terms, goal);
    scratch.best.clear();
    if let Some((number, value)) = standing {
        scratch.best.push(How::Start(number));
        return Ok(alternate(&terms, scratch, (value, value, None), effort));
    }
    let mut round = 1;
    let found = loop {
        let is_last = scratch.active.is_everywhere() || !world.keeps_apart();
        let most = Most::in_round(request.limits, is_last, effort);
        let found = fly_on(&terms, goal, scratch, (&mut effort, most));
        if found.0 == Value::NONE {
            break Err(NoAlternate { reason: found.2 });
        }
        let found = alternate(&terms, scratch, found, effort);
        let active = &mut scratch.active;
        let meets = |plan| world.activate_met(active, plan);
        if !found.answer.plan.as_ref().is_some_and(meets) {
            break Ok(found);
        }
        if stands && has_spent(round, effort, request.limits) {
            // It is safe without.
            break Err(NoAlternate {
                reason: Some(Unproved::Checks),
            });
        }
        if !stands && is_last_of_few(round, effort, request.limits) {
            active.widen();
        }
        round += 1;
    };
    scratch.active.clear();
    found
}

/// What a search has found, with its steps in the scratch: the value, its lower bound, and the limit that was
/// reached.
fn alternate(
    terms: &Expander<'_>,
    scratch: &ItineraryScratch,
    (value, lower_bound, reason): (Value, Value, Option<Unproved>),
    effort: Effort,
) -> Alternate {
    let node = last_node(terms, &scratch.best);
    let there = FlightRequest {
        destination: node,
        ..terms.request.clone()
    };
    let terms = Expander::new(terms.world, &there, terms.potentials);
    Alternate {
        node,
        answer: FlightAnswer {
            plan: Some(plan(&terms, &scratch.best, value)),
            value,
            proved: reason.is_none(),
            lower_bound,
            reason,
            step: Step::Exact,
            effort,
        },
    }
}

/// The search for an alternate: first with earlier as better, so that there is one where the other search reaches a bound. The value,
/// its lower bound, and the limit that was reached; the best steps are in the scratch.
fn fly_on(
    terms: &Expander<'_>,
    goal: Goal,
    scratch: &mut ItineraryScratch,
    (effort, most): (&mut Effort, Most),
) -> (Value, Value, Option<Unproved>) {
    let request = terms.request;
    close(&mut scratch.closed, request.closed_segments);
    let checks_before = effort.checks;
    let mut best = Value::NONE;
    let mut end = RunEnd {
        bound: best,
        stopped_by: None,
    };
    for (mode, share) in [(Mode::Earlier, 2), (Mode::Exact, 1)] {
        let request = FlightRequest {
            deadline_s: ends_by_s(terms, best),
            ..request.clone()
        };
        let mut run = Run {
            terms: Expander::new(terms.world, &request, terms.potentials),
            mode,
            goal,
            scratch: &mut *scratch,
            effort: &mut *effort,
            best,
            improved: false,
            doubt: Value::NONE,
            may_tie: false,
            target: Value::LEAST,
            most_labels: effort_of(most.labels_before, most.labels, share),
            most_checks: effort_of(checks_before, most.checks, share),
            walks: false,
        };
        end = run.search();
        best = run.best;
        let is_certain = end.stopped_by.is_none() && !run.doubt.beats(best);
        if is_certain {
            break;
        }
    }
    reopen(&mut scratch.closed, request.closed_segments);
    (best, end.bound, end.stopped_by)
}

/// No flight that is better ends later, nor would a stop where it lands: there is none on the way, so that each second draws on
/// the battery. Who stands may wait before.
fn ends_by_s(terms: &Expander<'_>, best: Value) -> f64 {
    let starts = terms.request.starts;
    let (mut last_s, mut most) = (f64::NEG_INFINITY, 0.0_f64);
    for start in starts {
        if start.on_ground {
            return f64::INFINITY;
        }
        let above_reserve = start.battery - terms.request.reserve;
        last_s = last_s.max(start.at_s);
        most = most.max(above_reserve.min(best.weight - terms.start_weight(start)));
    }
    let FlightWorld {
        legs,
        rules,
        topology,
        ..
    } = *terms.world;
    let verticals_s = topology.nodes().map(|node| legs.vertical_s(node));
    // Sums of times in another order differ by less than the second beside them.
    let stop_s = rules.stop_s.max(rules.swap_s) + 2.0 * verticals_s.fold(0.0, f64::max) + 1.0;
    last_s + most / legs.least_draw_per_s() + stop_s
}

/// What there may be at the end of a run that takes one part in so many of what is left.
fn effort_of(before: usize, most: usize, share: usize) -> usize {
    before + most.saturating_sub(before) / share
}

/// A drone that stands on a pad that stays free is safe where it is; where pads do not matter, one that stands.
fn standing_safely(terms: &Expander<'_>, goal: Goal) -> Option<(u8, Value)> {
    let starts = terms.request.starts.iter().take(super::MAX_STARTS);
    let mut safe = starts.enumerate().filter(|(_, start)| {
        let stays_until_s = terms.world.pads.stay_until_s(start.node, start.at_s);
        let may_stay = match goal {
            Goal::Alternate { stay_s } => stays_until_s >= start.at_s + stay_s,
            Goal::AnyNode | Goal::Destination | Goal::Nowhere | Goal::Near => true,
        };
        start.on_ground && may_stay
    });
    let (number, start) = safe.next()?;
    let value = Value {
        weight: terms.start_weight(start),
        arrives_s: start.at_s,
    };
    Some((number as u8, value))
}

/// Where some steps end.
fn last_node(terms: &Expander<'_>, steps: &[How]) -> NodeIx {
    let ends = steps.iter().rev().find_map(|how| match how {
        How::Leg { leg, .. } => Some(terms.world.legs.leg(*leg).to),
        How::Start(number) => Some(terms.request.starts[usize::from(*number)].node),
        How::Stop { .. } => None,
    });
    ends.unwrap_or(terms.request.destination)
}
