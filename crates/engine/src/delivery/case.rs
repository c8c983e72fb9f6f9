//! A failure with all that is worked out of it, and how what a search finds becomes its answer.

use super::composition::{Proof, with_contingencies};
use super::flight_failure::{FlightFailure, FlightRecomposition, Hold};
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::flight::{FlightPlan, StretchKind};
use crate::itinerary::{FlightDecision, FlightOutcome, FlightSetting, Objective};
use crate::network::NodeIx;
use crate::recompose::{Flag, Outcome, ReentryPoints, Stage, Strategy, Warning};

/// A failure with all that is worked out of it before anything is searched.
pub(super) struct Case<'a> {
    pub(super) world: DeliveryWorld<'a>,
    pub(super) failure: &'a FlightFailure<'a>,
    pub(super) question: Question<'a>,
    pub(super) ways: &'a ReentryPoints,
    /// The world before the report.
    pub(super) before: DeliveryWorld<'a>,
}

/// An outcome with its plan, before it is put into words.
pub(super) struct Found {
    pub(super) outcome: Outcome,
    pub(super) plan: Option<FlightPlan>,
    pub(super) decision: FlightDecision,
    pub(super) proof: Proof,
    /// The least battery at a node of the plan.
    pub(super) reserve: f64,
    /// What holds of the plan beside what the way back and the reserve say.
    pub(super) flags: Vec<Flag>,
}

impl Found {
    /// What a search for a plan to the destination has found.
    pub(super) fn of(setting: &FlightSetting, decision: FlightDecision) -> Self {
        let rules = setting.rules();
        Self {
            outcome: outcome_of(&decision.outcome),
            plan: decision.answer.plan.clone(),
            proof: Proof::of(&decision.answer),
            reserve: match decision.outcome {
                FlightOutcome::Diverted {
                    reserve_used: true, ..
                } => rules.floor,
                _ => rules.reserve,
            },
            flags: Vec::new(),
            decision,
        }
    }
}

/// What the search says in the words of an answer.
pub(super) fn outcome_of(outcome: &FlightOutcome) -> Outcome {
    match outcome {
        FlightOutcome::Planned => Outcome::Rerouted,
        FlightOutcome::Hold { .. } => Outcome::Hold,
        FlightOutcome::Diverted { .. } => Outcome::Diverted,
        FlightOutcome::NoRoute => Outcome::NoRoute,
    }
}

/// Puts an outcome into the answer to a failure.
pub(super) fn conclude(
    case: &Case<'_>,
    asked: &Question<'_>,
    found: Found,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let strategy = case.failure.request.strategy;
    let mut answer = put_into_words(&case.world, asked, found, strategy, scratch);
    answer
        .warnings
        .splice(0..0, case.ways.warnings.iter().cloned());
    let is_told = answer.composition.is_some();
    let of_ways = [
        (case.ways.leaves_zone, Flag::LeavingZone),
        (case.ways.cannot_stop, Flag::CannotStop),
    ];
    let held = of_ways.into_iter().filter(|(holds, _)| is_told && *holds);
    answer.flags.extend(held.map(|(_, flag)| flag));
    answer.flags.sort_unstable();
    answer
}

/// What the plan of a diversion answers: an alternate is the one that takes least of the battery, whatever was asked.
fn diverted<'a>(asked: &Question<'a>, node: NodeIx) -> Question<'a> {
    Question {
        destination: node,
        objective: Objective::Energy,
        deadline_s: f64::INFINITY,
        ..*asked
    }
}

/// Puts an outcome into an answer, its plan with all that follows from it.
pub(super) fn put_into_words(
    world: &DeliveryWorld<'_>,
    asked: &Question<'_>,
    found: Found,
    strategy: Strategy,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let (diverted_to, reserve_used) = match found.decision.outcome {
        FlightOutcome::Diverted { node, reserve_used } => (Some(node), reserve_used),
        _ => (None, false),
    };
    let question = Question {
        reserve: found.reserve,
        ..diverted_to.map_or(*asked, |node| diverted(asked, node))
    };
    let proof = found.proof;
    let composition = found
        .plan
        .map(|plan| with_contingencies(world, &question, plan, proof, scratch));
    let hold = match found.decision.outcome {
        FlightOutcome::Hold { node, pad, until_s } if found.outcome == Outcome::Hold => {
            Some(Hold { node, pad, until_s })
        }
        _ => None,
    };
    let mut warnings = Vec::new();
    if found.outcome == Outcome::NoRoute {
        warnings.push(Warning::NoAlternate);
    }
    let start = composition
        .as_ref()
        .map(|composition| composition.plan.start);
    let stretch = start.and_then(|start| start.stretch);
    let mut flags = found.flags;
    if stretch.is_some_and(|stretch| stretch.kind == StretchKind::Straight) {
        flags.push(Flag::Unverified);
    }
    if reserve_used {
        flags.push(Flag::ReserveUsed);
    }
    flags.sort_unstable();
    FlightRecomposition {
        outcome: found.outcome,
        first_stretch_m: start.map_or(0.0, |start| start.flown_m),
        flags,
        is_energy_checked: true,
        unsafe_way: None,
        near: Vec::new(),
        if_airborne: None,
        composition,
        hold,
        reserve_used,
        causes: found.decision.causes,
        opens: found.decision.opens,
        deadline_s: asked.deadline_s,
        battery: 0.0,
        proof,
        strategy,
        strategy_used: strategy,
        fallback: None,
        stage: Stage::Global,
        unflyable_stages: Vec::new(),
        warnings,
    }
}
