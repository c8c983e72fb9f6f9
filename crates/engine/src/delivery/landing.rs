//! Drones that have to land: of which no reported figure shows that they can fly on, or which cannot wait for one.

use super::case::{Case, Found, conclude};
use super::composition::Proof;
use super::flight_failure::FlightRecomposition;
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::flight::{FailureType, FlightPlan, FlightStart, OperationalDetail};
use crate::itinerary::{
    Alternate, FlightAnswer, FlightDecision, FlightOutcome, FlightRequest, NoAlternate, Objective,
    Step, Value, find_alternate, find_nearest,
};
use crate::network::NodeIx;
use crate::recompose::{Flag, Outcome};

/// A node with a free pad is taken instead of the nearest one where it costs at most this many times as much.
const WORTH_A_PAD: f64 = 1.2;

/// Where a drone has to land.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Landing {
    /// At the node with a free pad that takes least energy: what is left is unknown.
    FreePad,
    /// At the node that takes least energy and is not closed, with or without pads: it cannot fly far. One with a free pad where that
    /// costs at most a fifth more.
    AnyNode,
}

/// What fails of a drone that reports `operational`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// It does not say.
    Unknown,
    /// The battery.
    Battery,
    /// The payload.
    Payload,
    /// It cannot be kept in the air for long, or has to come down at once.
    Urgent,
}

impl Trouble {
    /// By what a report says of its failure.
    pub fn of(detail: Option<OperationalDetail>) -> Self {
        match detail {
            None => Self::Unknown,
            Some(OperationalDetail::Battery) => Self::Battery,
            Some(OperationalDetail::Payload) => Self::Payload,
            Some(OperationalDetail::Propulsion | OperationalDetail::LandNow) => Self::Urgent,
        }
    }
}

/// Which figures a report itself states, of those that show whether its drone can fly on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReportedFigures {
    /// The battery.
    pub battery: bool,
    /// The payload, with a battery that the drone has told of lately.
    pub payload: bool,
}

impl Landing {
    /// Where a drone has to land; `None` where its failure, or a figure in its report, leaves that to the search.
    ///
    /// What failed is what the plan believed, so that only what the report states counts.
    pub fn of(failure: FailureType, trouble: Trouble, figures: ReportedFigures) -> Option<Self> {
        if failure != FailureType::Operational {
            return None;
        }
        let shows_it = match trouble {
            Trouble::Unknown => figures.battery || figures.payload,
            Trouble::Battery => figures.battery,
            Trouble::Payload => figures.payload,
            Trouble::Urgent => return Some(Self::AnyNode),
        };
        (!shows_it).then_some(Self::FreePad)
    }

    /// The name in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::FreePad => "free_pad",
            Self::AnyNode => "any_node",
        }
    }
}

/// Leads a drone to where it has to land, with no less in its battery than so much.
pub(super) fn land(
    case: &Case<'_>,
    landing: Landing,
    (starts, least): (&[FlightStart], f64),
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let question = Question {
        starts,
        reserve: least,
        ..case.question
    };
    let found = landed(&case.world, &question, landing, scratch);
    conclude(case, &question, found, scratch)
}

/// The flight to where a drone has to land, with the reserve of the question.
pub(super) fn landed(
    world: &DeliveryWorld<'_>,
    question: &Question<'_>,
    landing: Landing,
    scratch: &mut DeliveryScratch,
) -> Found {
    let request = FlightRequest {
        starts: question.starts,
        destination: question.destination,
        objective: Objective::Energy,
        began_s: question.began_s,
        deadline_s: f64::INFINITY,
        reserve: question.reserve,
        closed_segments: question.closed_segments,
        limits: world.limits,
    };
    let stay_s = world.refuge_stay_s;
    let itinerary = &mut scratch.itinerary;
    let with_pad = find_alternate(world.setting, &request, stay_s, itinerary);
    let alternate = match landing {
        Landing::FreePad => with_pad,
        Landing::AnyNode => {
            let nearest = find_nearest(world.setting, &request, itinerary);
            let is_near = |padded: &Alternate| {
                let least = nearest
                    .as_ref()
                    .ok()
                    .map(|nearest| nearest.answer.value.weight);
                least.is_none_or(|least| padded.answer.value.weight <= WORTH_A_PAD * least)
            };
            match with_pad {
                Ok(padded) if is_near(&padded) => Ok(padded),
                _ => nearest,
            }
        }
    };
    found(world, alternate, question.reserve.max(0.0))
}

/// A landing as an outcome; nothing to reach is one, too.
fn found(
    world: &DeliveryWorld<'_>,
    alternate: Result<Alternate, NoAlternate>,
    least: f64,
) -> Found {
    let (node, answer) = match alternate {
        Ok(Alternate { node, answer }) => (node, answer),
        Err(none) => return without(none, least),
    };
    let plan = answer.plan.clone();
    let reserve = world.setting.rules().reserve;
    let reserve_used = plan
        .as_ref()
        .is_some_and(|plan| plan.battery_at_arrival < reserve);
    let is_taken = plan
        .as_ref()
        .is_some_and(|plan| is_pad_taken(world, node, plan));
    Found {
        outcome: Outcome::Diverted,
        plan,
        proof: Proof::of(&answer),
        reserve: least,
        flags: is_taken.then_some(Flag::PadOccupied).into_iter().collect(),
        decision: FlightDecision {
            outcome: FlightOutcome::Diverted { node, reserve_used },
            answer,
            causes: Vec::new(),
            opens: None,
        },
    }
}

/// No landing as an outcome.
fn without(none: NoAlternate, least: f64) -> Found {
    let answer = FlightAnswer {
        plan: None,
        value: Value::NONE,
        proved: none.reason.is_none(),
        lower_bound: Value::NONE,
        reason: none.reason,
        step: Step::Exact,
        effort: crate::itinerary::Effort::default(),
    };
    Found {
        outcome: Outcome::NoRoute,
        plan: None,
        proof: Proof::of(&answer),
        reserve: least,
        flags: Vec::new(),
        decision: FlightDecision {
            outcome: FlightOutcome::NoRoute,
            answer,
            causes: Vec::new(),
            opens: None,
        },
    }
}

/// Whether a node has pads, and none of them is free for the stay of an alternate.
fn is_pad_taken(world: &DeliveryWorld<'_>, node: NodeIx, plan: &FlightPlan) -> bool {
    let lands_s = plan.arrives_s;
    let stays_until_s = world.setting.pads().stay_until_s(node, lands_s);
    world.setting.topology().pads(node) > 0 && stays_until_s < lands_s + world.refuge_stay_s
}
