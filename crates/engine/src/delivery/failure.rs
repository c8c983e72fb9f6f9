//! The answer to a failure in flight, with time, battery and pads.

use super::brought::{OwnWorld, causes_of_leg, with_airframe};
use super::composition::{FlightComposition, Proof, with_contingencies};
use super::grounded::hold_on_the_ground;
use super::in_flight::{Beginnings, battery_now};
use super::landing::{Landing, land};
use super::local::{Local, answer_locally};
use super::nearby::tell_what_is_near;
use super::skies::FlightEnvironment;
use super::unaffected::prefer_old_plan;
use super::world::{DEFAULT_DEADLINE_S, DeliveryScratch, DeliveryWorld, Question};
use crate::flight::{Aloft, FlightPlan, FlightRules, StretchKind};
use crate::itinerary::{
    FlightCause, FlightDecision, FlightOpening, FlightOutcome, FlightRequest, FlightSetting,
    Objective,
};
use crate::network::{NodeIx, SegmentIx};
use crate::recompose::{
    Fallback, Flag, Near, Outcome, ReentryPoints, Request, Severance, Stage, Strategy, UnsafeWay,
    Warning, World, reentry_points,
};

/// What is known of the battery of a drone in flight, as fractions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BatteryNow {
    /// It says so.
    Given(f64),
    /// Nothing says so: a drone that has to land is taken to have this much.
    Assumed(f64),
    /// By its plan: at the start and at the end of the leg.
    ByPlan {
        /// At the start.
        before: f64,
        /// At the end.
        after: f64,
    },
}

/// A failure report with what it takes to answer it by a flight.
#[derive(Clone, Copy, Debug)]
pub struct FlightFailure<'a> {
    /// The report, what it brings, and the strategy to answer it with.
    pub request: &'a Request,
    /// When it is, in seconds.
    pub at_s: f64,
    /// The battery.
    pub battery: BatteryNow,
    /// What is made least.
    pub objective: Objective,
    /// The latest landing, in seconds; [`DEFAULT_DEADLINE_S`] from now where there is none.
    pub deadline_s: Option<f64>,
    /// Where the old plan was going to stop, if anybody knows; else where it would have.
    pub planned_stops: Option<&'a [NodeIx]>,
    /// Where the drone has to land, of which nothing that it reports shows that it can fly on.
    pub landing: Option<Landing>,
}

impl FlightFailure<'_> {
    /// Whether the battery of an answer is known: what a plan has is what a drone that has to land does not have.
    pub(super) fn is_energy_known(&self) -> bool {
        self.landing.is_none() || matches!(self.battery, BatteryNow::Given(_))
    }

    /// The least battery to land with: the floor, but for who has to come down, or of whom nobody knows what is left.
    pub(super) fn least_at_landing(&self, rules: &FlightRules) -> f64 {
        match (self.landing, self.is_energy_known()) {
            (Some(Landing::FreePad), true) => rules.floor,
            _ => FlightRequest::NO_RESERVE,
        }
    }
}

/// A wait on a pad, where the way is not open yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Where.
    pub node: NodeIx,
    /// On which pad, counted from 0.
    pub pad: u16,
    /// Until when, in seconds.
    pub until_s: f64,
}

/// What a drone in flight is told, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightRecomposition {
    /// What it is to do.
    pub outcome: Outcome,
    /// The plan, to the destination or to an alternate; `None` for [`Outcome::NoRoute`].
    pub composition: Option<FlightComposition>,
    /// For [`Outcome::Hold`], where it waits.
    pub hold: Option<Hold>,
    /// True where the plan draws on the reserve, to reach an alternate.
    pub reserve_used: bool,
    /// Where the destination cannot be reached, what cuts the drone off; [`severance`] names closures.
    pub causes: Vec<FlightCause>,
    /// The plan that there would be but for the deadline.
    pub opens: Option<FlightOpening>,
    /// The deadline that was kept, in seconds.
    pub deadline_s: f64,
    /// The battery when it reported, as a fraction.
    pub battery: f64,
    /// From where the drone is to the first node of the plan, in metres.
    pub first_stretch_m: f64,
    /// What holds of the way told; rising.
    pub flags: Vec<Flag>,
    /// False where nobody knows whether the battery suffices.
    pub is_energy_checked: bool,
    /// Without a plan: the least bad way.
    pub unsafe_way: Option<UnsafeWay>,
    /// Without a plan: what is near, the nearest first.
    pub near: Vec<Near>,
    /// Where nobody knows whether the drone is in the air: what one is told that is.
    pub if_airborne: Option<Box<FlightRecomposition>>,
    /// How certain it is that no plan is better, or that there is none.
    pub proof: Proof,
    /// The strategy asked for.
    pub strategy: Strategy,
    /// The strategy that answered.
    pub strategy_used: Strategy,
    /// Why they differ.
    pub fallback: Option<Fallback>,
    /// Where the search that answered looked.
    pub stage: Stage,
    /// The stages of a local strategy whose answers this drone cannot fly.
    pub unflyable_stages: Vec<Stage>,
    /// What the receiver should know.
    pub warnings: Vec<Warning>,
}

/// What a cause is called: a closure by its id, the report, or the network; `None` for wind, battery, pads and time.
///
/// The skies are those that the answer was computed in.
pub fn severance(skies: &FlightEnvironment, cause: &FlightCause) -> Option<Severance> {
    match cause {
        // What a report brings follows what stands.
        FlightCause::Closure(number) => {
            let standing = skies.causes().get(*number).cloned();
            Some(standing.unwrap_or(Severance::Report))
        }
        FlightCause::Request(_) => Some(Severance::Report),
        FlightCause::Network => Some(Severance::Network),
        _ => None,
    }
}

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
    let Some(node) = held else {
        return answer_by(world, failure, &ways, scratch);
    };
    let mut answer = hold_on_the_ground(world, failure, node, scratch);
    if aloft == Aloft::Unknown {
        let airborne = answer_by(world, failure, &ways, scratch);
        answer.if_airborne = Some(Box::new(airborne));
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
    if found.outcome == Outcome::Rerouted && (!closes_leg || case.ways.only_ahead) {
        prefer_old_plan(case, &mut found, scratch);
    }
    conclude(case, &case.question, found, scratch)
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
            // What is best on this way need not be best of all.
            found.proof.proved = false;
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
        destination: diverted_to.unwrap_or(asked.destination),
        deadline_s: match diverted_to {
            Some(_) => f64::INFINITY,
            None => asked.deadline_s,
        },
        reserve: found.reserve,
        ..*asked
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
        warnings.push(Warning::NoSafeNode);
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
