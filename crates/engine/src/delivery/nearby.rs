//! What a drone is told that has nothing safe left: what is near, with the battery that it would be reached with, and the least bad way.

use super::case::Case;
use super::composition::nodes_of;
use super::flight_failure::FlightRecomposition;
use super::world::DeliveryScratch;
use crate::flight::{FlightRules, FlightStart};
use crate::itinerary::{FlightRequest, Nearby, Objective, find_near};
use crate::network::Topology;
use crate::recompose::{Near, UnsafeCode, UnsafeWay, WhyNot};

/// The most nodes told.
const NEAR_MAX: usize = 5;

/// Tells what is near a drone that has no way, by the starts that it has whatever its battery and whatever others fly.
pub(super) fn tell_what_is_near(
    case: &Case<'_>,
    starts: &[FlightStart],
    answer: &mut FlightRecomposition,
    scratch: &mut DeliveryScratch,
) {
    let (world, question) = (&case.world, &case.question);
    let request = FlightRequest {
        starts,
        destination: question.destination,
        objective: Objective::Energy,
        began_s: question.began_s,
        deadline_s: f64::INFINITY,
        reserve: FlightRequest::NO_RESERVE,
        closed_segments: question.closed_segments,
        limits: world.limits,
    };
    let stay_s = world.refuge_stay_s;
    let itinerary = &mut scratch.itinerary;
    let near = find_near(
        world.setting,
        &request,
        stay_s,
        (NEAR_MAX, false),
        itinerary,
    );
    let topology = world.setting.topology();
    let rules = world.setting.rules();
    answer.near = near.iter().map(|one| told(topology, rules, one)).collect();
    // A free pad with most battery left, else whatever takes least.
    let least_bad = near.iter().find(|one| one.has_free_pad).or(near.first());
    answer.unsafe_way = least_bad.map(|one| {
        let why_not = told(topology, rules, one).why_not;
        unsafe_way(topology, one, why_not)
    });
}

fn told(topology: &Topology, rules: &FlightRules, nearby: &Nearby) -> Near {
    let pads = topology.pads(nearby.node);
    let battery = nearby.flight.battery_at_arrival;
    let why_not = if battery < rules.floor {
        WhyNot::BelowFloor
    } else if pads == 0 {
        WhyNot::NoPads
    } else if nearby.has_free_pad {
        WhyNot::BelowReserve
    } else {
        WhyNot::PadsTaken
    };
    Near {
        node: nearby.node,
        length_m: nearby.flight.distance_m,
        pads,
        battery: Some(battery),
        why_not,
    }
}

fn unsafe_way(topology: &Topology, nearby: &Nearby, why_not: WhyNot) -> UnsafeWay {
    let flight = &nearby.flight;
    let nodes = nodes_of(flight);
    let begin = flight.start.stretch.map(|stretch| stretch.begin);
    let places = nodes.iter().map(|&node| topology.position(node));
    let mut line: Vec<_> = begin.into_iter().chain(places).collect();
    line.dedup();
    UnsafeWay {
        code: match why_not {
            WhyNot::BelowFloor | WhyNot::BelowReserve => UnsafeCode::BelowReserve,
            // The battery would do.
            WhyNot::NoPads
            | WhyNot::PadsTaken
            | WhyNot::Closed
            | WhyNot::CutOff
            | WhyNot::Unflyable => UnsafeCode::NoAlternate,
        },
        line,
        nodes,
        length_m: flight.distance_m,
        battery: Some(flight.battery_at_arrival),
    }
}
