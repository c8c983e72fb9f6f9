//! Deliveries that stop on their way: for pickups, drops and visits, and to come home.

use crate::town::{Failure, Town};
use skyway::delivery::{FlightComposition, Lands, NoDelivery};
use skyway::flight::{FailureType, ServiceStop, Stop};
use skyway::itinerary::{FlightCause, Objective, Unproved};
use skyway::recompose::{Outcome, Warning};

/// `a - b - c - d` along a line, 2 km each, with so many pads at each, and a way around `b - c` by `e`.
fn street(pads: [u16; 4]) -> Town {
    let [a, b, c, d] = pads;
    Town::new(
        &[
            ("a", 0.0, 0.0, a),
            ("b", 2_000.0, 0.0, b),
            ("c", 4_000.0, 0.0, c),
            ("d", 6_000.0, 0.0, d),
            ("e", 3_000.0, 2_000.0, 0),
        ],
        &[("a", "b"), ("b", "c"), ("c", "d"), ("b", "e"), ("e", "c")],
    )
}

fn served(town: &Town, stops: &[(&str, f64)]) -> Vec<ServiceStop> {
    let stops = stops.iter();
    stops
        .map(|&(node, service_s)| ServiceStop {
            node: town.node(node),
            service_s,
        })
        .collect()
}

/// The stays at which a delivery is served: where, for how long, and after how many legs.
fn stays(town: &Town, composition: &FlightComposition) -> Vec<(String, f64, usize)> {
    let stops = composition.plan.stops.iter();
    let served = stops.filter(|stop| stop.service_s.is_some());
    let told = |stop: &Stop| {
        let node = town.topology.node_id(stop.node).to_owned();
        let stay_s = (stop.takes_off_s - stop.lands_s).round();
        (node, stay_s, stop.before_leg)
    };
    served.map(told).collect()
}

fn ids(town: &Town, composition: &FlightComposition) -> Vec<String> {
    let nodes = composition.nodes();
    town.ids(&nodes).into_iter().map(str::to_owned).collect()
}

fn compose(
    town: &Town,
    (source, stops, destination): (&str, &[(&str, f64)], Option<&str>),
) -> Result<FlightComposition, NoDelivery> {
    let stops = served(town, stops);
    let lands = match destination {
        Some(_) => Lands::AtDestination,
        None => Lands::OnNearestPad,
    };
    let ends = (source, destination.unwrap_or(source));
    town.compose_with_stops(ends, (&stops, lands), Objective::Distance)
}

#[test]
fn it_is_served_in_order_and_comes_home() {
    let town = street([1, 1, 1, 1]);
    let stops = [("b", 90.0), ("c", 300.0)];
    let plan = compose(&town, ("a", &stops, Some("a"))).expect("a plan");
    assert_eq!(ids(&town, &plan), ["a", "b", "c", "b", "a"]);
    // Nobody stops for less than every stop takes.
    let served = [("b".to_owned(), 90.0, 1), ("c".to_owned(), 300.0, 2)];
    assert_eq!(stays(&town, &plan), served);
    assert!((plan.plan.distance_m - 8_000.0).abs() < 1e-6);
    assert!(plan.proof.proved, "{:?}", plan.proof);
    assert_eq!(plan.figures.legs.len(), plan.leg_costs_usd.len());
    let short = compose(&town, ("a", &[("b", 5.0)], Some("a"))).expect("a plan");
    assert_eq!(stays(&town, &short), [("b".to_owned(), 60.0, 1)]);
}

#[test]
fn the_battery_lasts_for_the_whole_or_is_charged_where_it_is_served() {
    let mut town = street([1, 1, 1, 1]);
    // 12 km take 0.70 of the battery, and there are 0.78 above the reserve.
    let there_and_back = compose(&town, ("a", &[("d", 0.0)], Some("a"))).expect("a plan");
    let arrival = there_and_back.plan.battery_at_arrival;
    assert!((0.2..0.3).contains(&arrival), "{arrival}");
    // With a payload they take more than that: it charges at a stop that it makes anyway, or at one more.
    town.payload_kg = 0.8;
    let loaded = compose(&town, ("a", &[("d", 0.0)], Some("a"))).expect("a plan");
    let lowest = loaded.plan.legs.iter().map(|leg| leg.battery_after);
    let lowest = lowest.fold(1.0, f64::min);
    assert!(lowest >= 0.2 - 1e-9, "{lowest}");
    let stops = &loaded.plan.stops;
    assert!(
        stops
            .iter()
            .any(|stop| stop.battery_after > stop.battery_before)
    );
}

#[test]
fn without_a_destination_it_ends_on_the_nearest_free_pad() {
    let town = street([1, 1, 0, 1]);
    let plan = compose(&town, ("a", &[("b", 60.0), ("d", 60.0)], None)).expect("a plan");
    // The pad of the last stop itself is free.
    assert_eq!(ids(&town, &plan), ["a", "b", "c", "d"]);
    assert_eq!(stays(&town, &plan), [("b".to_owned(), 60.0, 1)]);
    let town = street([1, 2, 1, 1])
        .reserved("b", 0, 900.0)
        .reserved("b", 1, 900.0);
    let plan = compose(&town, ("c", &[("b", 60.0)], None)).expect("a plan");
    assert_eq!(ids(&town, &plan).last().map(String::as_str), Some("a"));
}

#[test]
fn a_stop_without_a_free_pad_is_named() {
    let town = street([1, 1, 1, 1]).taken("b");
    let refused = compose(&town, ("a", &[("b", 60.0)], Some("c"))).expect_err("no pad");
    assert_eq!(refused.causes, [FlightCause::Pads(town.node("b"))]);
}

#[test]
fn that_no_pad_is_free_at_the_end_is_never_certain() {
    let town = street([1, 1, 0, 0])
        .reserved("a", 0, 99_999.0)
        .reserved("b", 0, 99_999.0);
    let refused = compose(&town, ("a", &[("b", 60.0)], None)).expect_err("no pad");
    assert_eq!(refused.causes, [FlightCause::Pads(town.node("b"))]);
    // A later one may find one.
    assert!(!refused.proved);
}

#[test]
fn what_closes_after_a_stop_is_flown_around_and_not_proved_jointly() {
    let town = street([1, 1, 1, 1]).zone("match", &[("b", "c")], (0, 600));
    let plan = compose(&town, ("a", &[("b", 60.0)], Some("c"))).expect("a plan");
    assert_eq!(ids(&town, &plan), ["a", "b", "e", "c"]);
    assert!(!plan.proof.proved);
    assert_eq!(plan.proof.reason, Some(Unproved::Parts));
    assert!(plan.proof.lower_bound.weight < plan.proof.value.weight);
}

#[test]
fn a_detour_leads_to_where_it_is_served_next() {
    let town = street([1, 1, 1, 1]);
    let stops = [("b", 60.0), ("c", 60.0)];
    let plan = compose(&town, ("a", &stops, Some("a"))).expect("a plan");
    let ends: Vec<Option<&str>> = plan
        .contingencies
        .iter()
        .map(|leg| leg.if_closed.contingency.nodes.last())
        .map(|node| node.map(|&node| town.topology.node_id(node)))
        .collect();
    // There is a way around b - c alone, in both directions; the others divert or lead nowhere.
    assert_eq!(ends[1], Some("c"));
    assert_eq!(ends[2], Some("b"), "the way home joins its plan again");
}

#[test]
fn a_failure_on_the_way_keeps_the_stops_that_are_ahead() {
    let town = street([1, 1, 1, 1]);
    let onward = served(&town, &[("c", 120.0), ("d", 0.0)]);
    let failure = Failure {
        leg: ("b", "c"),
        destination: "c",
        onward,
        ..Failure::of(FailureType::Navigational)
    };
    let answer = town.answer(&failure);
    assert_eq!(answer.outcome, Outcome::Rerouted);
    let plan = answer.composition.as_ref().expect("a plan");
    assert_eq!(ids(&town, plan), ["b", "e", "c", "d"]);
    assert_eq!(stays(&town, plan), [("c".to_owned(), 120.0, 2)]);
    assert_eq!(answer.proof, plan.proof);
}

#[test]
fn where_no_plan_leads_on_it_ends_at_the_stop_and_says_so() {
    let town = street([1, 1, 1, 1]).zone("for good", &[("c", "d")], (0, 100_000));
    let onward = served(&town, &[("c", 120.0), ("d", 0.0)]);
    let failure = Failure {
        leg: ("a", "b"),
        destination: "c",
        onward,
        ..Failure::of(FailureType::ServiceLevel)
    };
    let answer = town.answer(&failure);
    let plan = answer.composition.as_ref().expect("a plan");
    assert_eq!(ids(&town, plan), ["a", "b", "c"]);
    let node = town.node("c");
    assert_eq!(answer.warnings, [Warning::EndsAtStop { node }]);
}
