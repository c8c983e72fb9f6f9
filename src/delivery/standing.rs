//! The answer to a drone that stands on a pad, or has not left yet, when the world changes.

use super::composition::DeliveryRequest;
use super::failure::{FlightRecomposition, Found, put_into_words};
use super::landing::{Landing, landed};
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::recompose::Strategy;

/// Answers a drone on the ground: it goes on from where it stands, charging and waiting there as long as its pad is free.
///
/// Never fails. Without a plan to the destination it stays where it is, if its pad stays free for the stay at a safe node, or
/// goes to a safe node. One that has to land stays where its pad is free.
pub fn answer_standing(
    world: &DeliveryWorld<'_>,
    request: &DeliveryRequest,
    landing: Option<Landing>,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let starts = [request.start()];
    let question = Question {
        in_flight: true,
        ..request.question(world, &starts)
    };
    let found = match landing {
        Some(landing) => landed(world, &question, landing, scratch),
        None => Found::of(world.setting, world.decide(&question, scratch)),
    };
    let answer = put_into_words(world, &question, found, Strategy::Exact, scratch);
    FlightRecomposition {
        battery: request.battery,
        is_energy_checked: landing.is_none(),
        ..answer
    }
}
