//! The answer to a drone that stands on a pad, or has not left yet, when the world changes.

use super::brought::OwnWorld;
use super::case::{Found, put_into_words};
use super::composition::DeliveryRequest;
use super::flight_failure::{FlightFailure, FlightRecomposition};
use super::grounded::{hold_instead, is_in_zone, stay};
use super::landing::landed;
use super::stops::{go_on, served_first};
use super::world::{DeliveryScratch, DeliveryWorld, Question};
use crate::flight::Reentry;
use crate::network::NodeIx;
use crate::recompose::{Outcome, Strategy, UnsafeCode, UnsafeWay};

/// A drone that stands on a pad, or has not left yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Where.
    pub node: NodeIx,
    /// On which pad, counted from 0, where that is known.
    pub pad: Option<u16>,
    /// From when on it can do anything, in seconds.
    pub at_s: f64,
    /// Its battery then, as a fraction.
    pub battery: f64,
}

impl Stand {
    /// Answers the failure of a drone that stands here.
    pub fn answer(
        &self,
        world: &DeliveryWorld<'_>,
        failure: &FlightFailure<'_>,
        scratch: &mut DeliveryScratch,
    ) -> FlightRecomposition {
        let own = OwnWorld::of(world, failure.request, true);
        let own_world = &own.world(world);
        let onward = &*failure.request.onward;
        // What it is served where it stands comes before it departs.
        let (served, onward) = match onward {
            [here, rest @ ..] if here.node == self.node && !rest.is_empty() => (Some(here), rest),
            _ => (None, onward),
        };
        let service_s = served.map_or(0.0, |stop| stop.service_s);
        let next = onward.first().map(|stop| stop.node);
        let request = DeliveryRequest {
            source: self.node,
            pad: self.pad,
            destination: next.unwrap_or(failure.request.report.destination),
            start_s: self.at_s + service_s,
            began_s: self.at_s,
            battery: self.battery_after(world, service_s),
            objective: failure.objective,
            deadline_s: failure.deadline_s,
        };
        let answer = answer_standing(own_world, &request, Some(failure), scratch);
        let mut answer = go_on(world, failure.request, onward, answer, scratch);
        if let Some(composition) = answer.composition.as_mut().filter(|_| served.is_some()) {
            served_first(world, composition, self, service_s);
        }
        hold_instead(failure, &mut answer);
        // In a zone it is told to hold, as one that reports there: no operator has to find it a way.
        let has_nowhere_to_go = answer.outcome == Outcome::NoRoute;
        if has_nowhere_to_go && is_in_zone(world, failure.request, self.node) {
            stay(own_world, failure.request, &request, &mut answer, scratch);
        }
        if let Some(composition) = &mut answer.composition {
            let place = world.setting.topology().position(self.node);
            let stands = Reentry::at_node(self.node, place, None);
            composition.plan.start.stretch = Some(stands.stretch);
        }
        answer
    }

    /// The battery once it has stood so many seconds more.
    fn battery_after(&self, world: &DeliveryWorld<'_>, stay_s: f64) -> f64 {
        match world.setting.pads().swaps(self.node) {
            true => self.battery,
            false => {
                let charging = world.setting.airframe().charging();
                charging.level_after(self.battery, stay_s)
            }
        }
    }
}

/// Answers a drone on the ground: it goes on from where it stands, charging and waiting there as long as its pad is free.
///
/// Never fails. Without a plan to the destination it stays where it is, if its pad stays free for the stay at an alternate, or
/// goes to an alternate; both are told as diverted. One that has to land stays where its pad is free.
pub fn answer_standing(
    world: &DeliveryWorld<'_>,
    request: &DeliveryRequest,
    failure: Option<&FlightFailure<'_>>,
    scratch: &mut DeliveryScratch,
) -> FlightRecomposition {
    let starts = [request.start()];
    let question = Question {
        in_flight: true,
        ..request.question(world, &starts)
    };
    let landing = failure.and_then(|failure| Some((failure.landing?, failure)));
    let found = match landing {
        Some((landing, failure)) => {
            let reserve = failure.least_at_landing(world.setting.rules());
            let question = Question {
                reserve,
                ..question
            };
            landed(world, &question, landing, scratch)
        }
        None => Found::of(world.setting, world.decide(&question, scratch)),
    };
    let mut answer = put_into_words(world, &question, found, Strategy::Exact, scratch);
    if answer.outcome == Outcome::NoRoute {
        // It stays, though its pad is not its own for as long as a drone in need may stay.
        answer.unsafe_way = Some(UnsafeWay {
            code: UnsafeCode::NoAlternate,
            nodes: vec![request.source],
            line: vec![world.setting.topology().position(request.source)],
            length_m: 0.0,
            battery: Some(request.battery),
        });
    }
    FlightRecomposition {
        battery: request.battery,
        is_energy_checked: failure.is_none_or(FlightFailure::is_energy_known),
        ..answer
    }
}
