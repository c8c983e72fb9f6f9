//! Whether a drone in flight goes on as it was going to.

use super::case::{Case, Found};
use super::composition::{Proof, nodes_of};
use super::local::on_way_alone;
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::compose::planned_nodes;
use crate::flight::FlightStart;
use crate::network::NodeIx;
use crate::recompose::{Outcome, World};

/// Says `unaffected` where the old way can be flown with the stops that it had, and nothing found is better.
pub(super) fn prefer_old_plan(case: &Case<'_>, found: &mut Found, scratch: &mut DeliveryScratch) {
    let report = &case.failure.request.report;
    let old_world = World {
        airspace: case.before.skies.airspace(),
        trees: None,
    };
    let nodes = planned_nodes(&old_world, report, scratch.recompose.searcher());
    let starts = case.question.starts;
    let at_leg_start = |start: &&FlightStart| start.node == report.leg.0 && start.flown_m == 0.0;
    let (first, start) = match starts.iter().find(at_leg_start) {
        Some(start) => (0, *start),
        None => match starts.iter().find(|start| start.node == report.leg.1) {
            Some(start) => (1, *start),
            None => return,
        },
    };
    let Some(rest) = nodes.get(first..) else {
        return;
    };
    let leads_there = rest.last() == Some(&report.destination);
    let start = [start];
    let along = |world: &DeliveryWorld<'_>, scratch: &mut DeliveryScratch| {
        let question = Question {
            starts: &start,
            ..case.question
        };
        on_way_alone(world, &question, rest, scratch)
    };
    let Some(old) = along(&case.world, scratch).filter(|_| leads_there) else {
        return;
    };
    let Some(plan) = &old.answer.plan else {
        return;
    };
    // A plan that passes a node twice may be flown another way round.
    if nodes_of(plan) != *rest {
        return;
    }
    let is_same = found
        .plan
        .as_ref()
        .is_some_and(|best| best.legs == plan.legs);
    let is_better = found.decision.answer.value.beats(old.answer.value);
    if is_better && !is_same {
        return;
    }
    let stops: Vec<NodeIx> = plan.stops.iter().map(|stop| stop.node).collect();
    let stops_stand = match case.failure.planned_stops {
        Some(planned) => planned == stops,
        None => {
            let before = along(&case.before, scratch).and_then(|before| before.answer.plan);
            before.is_none_or(|before| before.stops.iter().map(|stop| stop.node).eq(stops))
        }
    };
    if !stops_stand {
        return;
    }
    found.outcome = Outcome::Unaffected;
    found.proof = among_all(found.proof, Proof::of(&old.answer));
    found.plan = old.answer.plan;
}

/// How certain it is that the best plan of one way is the best of all, by a search for those that found no better one.
fn among_all(all: Proof, alone: Proof) -> Proof {
    Proof {
        // That nothing on this way is better says nothing of the others, where the search for them reached a bound.
        proved: all.proved && alone.proved,
        reason: all.reason.or(alone.reason),
        lower_bound: all.lower_bound,
        ..alone
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::itinerary::{Effort, Step, Unproved, Value};

    #[test]
    fn what_is_proved_of_one_way_is_not_proved_of_all() {
        let value = |weight: f64| Value {
            weight,
            arrives_s: weight,
        };
        let alone = Proof {
            proved: true,
            value: value(2.0),
            lower_bound: value(2.0),
            reason: None,
            step: Step::Exact,
            effort: Effort::default(),
        };
        let cut_short = Proof {
            proved: false,
            lower_bound: value(1.0),
            reason: Some(Unproved::Labels),
            ..alone
        };
        assert_eq!(among_all(cut_short, alone), cut_short);
        assert_eq!(among_all(alone, cut_short).reason, Some(Unproved::Labels));
        assert_eq!(among_all(alone, alone), alone);
    }
}
