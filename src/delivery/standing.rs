//! The answer to a drone that stands on a pad, or has not left yet, when the world changes.

use super::composition::{DeliveryRequest, Proof};
use super::failure::{FlightRecomposition, Found, outcome_of, put_into_words};
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::recompose::Strategy;

/// Answers a drone on the ground: it goes on from where it stands, charging and waiting there as long as its pad is free.
///
/// Never fails. Without a plan to the destination it stays where it is, if its pad stays free for the stay at a safe node, or
/// goes to a safe node.
pub fn answer_standing(
    world: &DeliveryWorld<'_>,
    request: &DeliveryRequest,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let starts = [request.start()];
    let question = Question {
        in_flight: true,
        ..request.question(world, &starts)
    };
    let decision = world.decide(&question, scratch);
    let found = Found {
        outcome: outcome_of(&decision.outcome),
        plan: decision.answer.plan.clone(),
        starts: starts.to_vec(),
        proof: Proof::of(&decision.answer),
        decision,
    };
    let answer = put_into_words(world, &question, found, Strategy::Exact, scratch);
    FlightRecomposition {
        battery: request.battery,
        ..answer
    }
}
