//! Local strategies held against the battery: what this drone cannot fly goes on to the next stage.

use super::case::{Case, outcome_of};
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::itinerary::FlightDecision;
use crate::network::{NodeIx, SegmentIx};
use crate::recompose::{
    Fallback, Outcome, Recomposition, Request, Stage, Strategy, Warning, World, recompose,
};

/// The answer of a strategy that this drone can fly.
pub(super) struct Local {
    pub(super) outcome: Outcome,
    pub(super) decision: FlightDecision,
    pub(super) stage: Stage,
    pub(super) warnings: Vec<Warning>,
}

/// The first answer of a strategy, stage by stage, that this drone can fly with stops on its way.
///
/// Strategies know no times: for them a closure counts that meets the airspace's look ahead.
///
/// # Errors
/// Why `exact` has to answer.
pub(super) fn answer_locally(
    case: &Case<'_>,
    unflyable: &mut Vec<Stage>,
    scratch: &mut DeliveryScratch,
) -> Result<Local, Fallback> {
    let mut request = Request {
        optimum: false,
        explain: false,
        ..case.failure.request.clone()
    };
    loop {
        let world = World {
            airspace: case.world.skies.airspace(),
            trees: None,
        };
        let local = recompose(&world, &request, &mut scratch.recompose);
        if local.strategy_used == Strategy::Exact {
            return Err(local.fallback.unwrap_or(Fallback::NothingClosed));
        }
        if !matches!(local.outcome, Outcome::Rerouted | Outcome::Unaffected) {
            return Err(Fallback::RepairFailed);
        }
        if let Some(flown) = flown(case, &local, scratch) {
            return Ok(flown);
        }
        unflyable.push(local.stage);
        if matches!(local.stage, Stage::Global | Stage::Local) {
            return Err(Fallback::NotFlyable);
        }
        request.parameters.after = Some(local.stage);
    }
}

/// The flight along a path; `None` where this drone cannot fly it.
fn flown(case: &Case<'_>, local: &Recomposition, scratch: &mut DeliveryScratch) -> Option<Local> {
    let first = *local.path.nodes.first()?;
    let starts = case.question.starts.iter();
    let start = *starts.clone().find(|start| start.node == first)?;
    let question = Question {
        starts: &[start],
        ..case.question
    };
    let decision = on_way_alone(&case.world, &question, &local.path.nodes, scratch)?;
    let outcome = match (outcome_of(&decision.outcome), local.outcome) {
        (Outcome::Rerouted, Outcome::Unaffected) => Outcome::Unaffected,
        (outcome, _) => outcome,
    };
    Some(Local {
        outcome,
        decision,
        stage: local.stage,
        warnings: local.warnings.clone(),
    })
}

/// The best plan that flies no segment but those of a way; `None` where there is none.
pub(super) fn on_way_alone(
    world: &DeliveryWorld<'_>,
    question: &Question<'_>,
    nodes: &[NodeIx],
    scratch: &mut DeliveryScratch,
) -> Option<FlightDecision> {
    let topology = world.setting.topology();
    let steps = nodes.windows(2);
    let way: Option<Vec<SegmentIx>> = steps
        .map(|step| topology.segment_between(step[0], step[1]))
        .collect();
    let mut open = vec![false; topology.segment_count()];
    for segment in way? {
        open[segment.at()] = true;
    }
    for segment in question.closed_segments {
        open[segment.at()] = false;
    }
    let closed = topology.segments().filter(|segment| !open[segment.at()]);
    let closed: Vec<SegmentIx> = closed.collect();
    let alone = Question {
        closed_segments: &closed,
        in_flight: false,
        explain: false,
        ..*question
    };
    let decision = world.decide(&alone, scratch);
    decision.answer.plan.is_some().then_some(decision)
}
