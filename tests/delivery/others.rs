//! Plans beside each other: what one takes the next one keeps off.

use crate::town::{Failure, Town};
use skyway::delivery::{FlightComposition, OtherPlans};
use skyway::flight::{FailureType, Reservation, TrafficLeg};
use skyway::formats::load_network;
use skyway::itinerary::{FlightCause, Objective};
use skyway::network::bundled;
use skyway::recompose::{Flag, Outcome};

/// What some plans take, for the next one.
fn taken_by(plans: &[FlightComposition]) -> OtherPlans {
    let reservations = plans.iter().flat_map(FlightComposition::reservations);
    let traffic = plans.iter().flat_map(FlightComposition::occupations);
    OtherPlans {
        reservations: reservations.collect(),
        traffic: traffic
            .map(|leg| TrafficLeg {
                segment: leg.segment,
                from: leg.from,
                enters_s: leg.enters_s,
                leaves_s: leg.leaves_s,
            })
            .collect(),
        ..OtherPlans::default()
    }
}

fn meet(one: &Reservation, other: &Reservation) -> bool {
    (one.node, one.pad) == (other.node, other.pad)
        && one.from_s < other.until_s - 1e-6
        && other.from_s < one.until_s - 1e-6
}

/// The corridor as far as Gruene, with as many deliveries at the same time, one after the other composed.
fn deliveries(count: usize) -> Vec<FlightComposition> {
    let loaded = load_network(bundled::CORRIDOR).expect("the bundled corridor");
    let mut town = Town::of(loaded.topology, 30.0);
    town.payload_kg = 0.25;
    let mut plans: Vec<FlightComposition> = Vec::new();
    for _ in 0..count {
        town.others = taken_by(&plans);
        let plan = town.compose("1", "52", Objective::Distance);
        plans.push(plan.expect("room for one more"));
    }
    plans
}

#[test]
fn no_two_plans_have_a_pad_at_the_same_time() {
    let plans = deliveries(4);
    let mut stays = 0;
    for (number, plan) in plans.iter().enumerate() {
        let others = &plans[..number];
        for stay in plan.reservations() {
            stays += 1;
            for other in others.iter().flat_map(FlightComposition::reservations) {
                assert!(!meet(&stay, &other), "plan {number}: {stay:?} {other:?}");
            }
        }
    }
    assert!(stays >= 8, "{stays}");
}

#[test]
fn plans_on_the_same_way_keep_the_headway() {
    let plans = deliveries(3);
    let mut shared = 0;
    for pair in plans.windows(2) {
        for leg in &pair[1].plan.legs {
            let same = |other: &&skyway::flight::FlownLeg| {
                (other.segment, other.from) == (leg.segment, leg.from)
            };
            for other in pair[0].plan.legs.iter().filter(same) {
                shared += 1;
                assert!((other.enters_s - leg.enters_s).abs() > 30.0, "{leg:?}");
            }
        }
    }
    assert!(shared > 0);
}

/// Of four rooftops around a square of 1 km the one at c has a pad; a drone flies from a to b, and something is ahead.
fn square() -> (Town, Failure<'static>) {
    let nodes = [
        ("a", 0.0, 0.0, 0),
        ("b", 1_000.0, 0.0, 0),
        ("c", 1_000.0, 1_000.0, 1),
        ("d", 0.0, 1_000.0, 0),
    ];
    let town = Town::new(&nodes, &[("a", "b"), ("b", "c"), ("a", "d"), ("d", "c")]);
    let failure = Failure {
        leg: ("a", "b"),
        flown: Some(0.5),
        cause: Some(0.8),
        destination: "c",
        battery: 0.9,
        ..Failure::of(FailureType::Environmental)
    };
    (town, failure)
}

#[test]
fn a_drone_in_the_air_whose_every_way_others_fly_is_told_one_that_says_so() {
    let (mut town, failure) = square();
    let alone = town.answer(&failure);
    assert_eq!(alone.outcome, Outcome::Rerouted);
    assert!(alone.flags.is_empty(), "{alone:#?}");
    // One flies towards it for hours.
    town.others.traffic.push(TrafficLeg {
        segment: town.segment("a", "d"),
        from: town.node("d"),
        enters_s: 0.0,
        leaves_s: 10_000.0,
    });
    let among_others = town.answer(&failure);
    assert_eq!(among_others.outcome, Outcome::Rerouted);
    assert_eq!(among_others.flags, [Flag::Unseparated]);
    let is_named = |cause: &FlightCause| matches!(cause, FlightCause::Traffic(_));
    assert!(
        among_others.causes.iter().any(is_named),
        "{among_others:#?}"
    );
    let way = |answer: &skyway::delivery::FlightRecomposition| {
        answer.composition.as_ref().map(FlightComposition::nodes)
    };
    assert_eq!(way(&alone), way(&among_others));
}

#[test]
fn a_drone_below_its_reserve_is_told_a_way_among_others_too() {
    let (mut town, failure) = square();
    let failure = Failure {
        battery: 0.199,
        flown: Some(0.03),
        ..failure
    };
    let alone = town.answer(&failure);
    assert_eq!(
        alone.outcome,
        Outcome::Diverted,
        "{:#?} {:#?} {:?}",
        alone.causes,
        alone.near,
        alone.battery
    );
    town.others.traffic.push(TrafficLeg {
        segment: town.segment("a", "d"),
        from: town.node("d"),
        enters_s: 0.0,
        leaves_s: 10_000.0,
    });
    let among_others = town.answer(&failure);
    assert_eq!(among_others.outcome, Outcome::Diverted, "{among_others:#?}");
    assert!(among_others.flags.contains(&Flag::Unseparated));
}

#[test]
fn a_way_back_on_which_another_drone_comes_says_so() {
    let (mut town, failure) = square();
    let alone = town.answer(&failure);
    // It follows on the leg that the drone turns back on.
    let follower = TrafficLeg {
        segment: town.segment("a", "b"),
        from: town.node("a"),
        enters_s: 0.0,
        leaves_s: 62.5,
    };
    town.others.traffic.push(follower);
    let among_others = town.answer(&failure);
    assert_eq!(among_others.flags, [Flag::Unseparated], "{among_others:#?}");
    assert_eq!(among_others.causes, [FlightCause::Traffic(follower)]);
    let way = |answer: &skyway::delivery::FlightRecomposition| {
        answer.composition.as_ref().map(FlightComposition::nodes)
    };
    assert_eq!(way(&alone), way(&among_others));
}
