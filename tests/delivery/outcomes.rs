//! Every outcome, and every failure type, by what the drone is told.

use crate::town::{Failure, Town};
use skyway::delivery::{FlightRecomposition, severance};
use skyway::flight::{FailureType, StopKind, Wind};
use skyway::itinerary::{FlightCause, Objective};
use skyway::recompose::{Outcome, Severance, UnsafeCode};

/// `a - b - c` along a line, 2 km each, and a way around by `d`; with pads where they are named.
fn ring(pads: &[&str]) -> Town {
    let count = |id: &str| u16::from(pads.contains(&id));
    Town::new(
        &[
            ("a", 0.0, 0.0, count("a")),
            ("b", 2_000.0, 0.0, count("b")),
            ("c", 4_000.0, 0.0, count("c")),
            ("d", 2_000.0, 3_000.0, count("d")),
        ],
        &[("a", "b"), ("b", "c"), ("a", "d"), ("d", "c")],
    )
}

/// The same without the way around.
fn line(pads: &[&str]) -> Town {
    let count = |id: &str| u16::from(pads.contains(&id));
    Town::new(
        &[
            ("a", 0.0, 0.0, count("a")),
            ("b", 2_000.0, 0.0, count("b")),
            ("c", 4_000.0, 0.0, count("c")),
        ],
        &[("a", "b"), ("b", "c")],
    )
}

fn nodes(town: &Town, answer: &FlightRecomposition) -> Vec<String> {
    let composition = answer.composition.as_ref().expect("a plan");
    let nodes = composition.nodes();
    town.ids(&nodes).into_iter().map(str::to_owned).collect()
}

fn severances(town: &Town, answer: &FlightRecomposition) -> Vec<Severance> {
    let skies = town.skies();
    let causes = answer.causes.iter();
    causes
        .filter_map(|cause| severance(&skies, cause))
        .collect()
}

#[test]
fn a_closed_leg_is_flown_around() {
    for kind in [
        FailureType::Environmental,
        FailureType::Navigational,
        FailureType::Regulatory,
    ] {
        let town = ring(&[]);
        let answer = town.answer(&Failure::of(kind));
        assert_eq!(answer.outcome, Outcome::Rerouted, "{kind:?}");
        assert_eq!(nodes(&town, &answer), ["a", "d", "c"], "{kind:?}");
        assert!(answer.proof.proved && answer.causes.is_empty());
    }
}

#[test]
fn what_lies_behind_or_ahead_decides_where_the_plan_begins() {
    let town = ring(&[]);
    let half_way = |cause: Option<f64>| Failure {
        flown: Some(0.5),
        cause,
        ..Failure::of(FailureType::Navigational)
    };
    let back = town.answer(&half_way(Some(0.9)));
    assert_eq!(nodes(&town, &back), ["a", "d", "c"]);
    assert!((back.first_stretch_m - 1_000.0).abs() < 1e-6);
    let drawn = |answer: &FlightRecomposition| {
        let plan = answer.composition.as_ref().expect("a plan");
        0.9 - plan.plan.start.battery
    };
    // Half of 2 km at 3.95 Wh/km of 68.1 Wh.
    assert!((drawn(&back) - 0.058).abs() < 1e-3, "{}", drawn(&back));
    let on = town.answer(&half_way(Some(0.1)));
    assert_eq!(nodes(&town, &on), ["b", "c"]);
    assert_eq!(on.outcome, Outcome::Unaffected);
    // Its place is unknown: the whole leg back.
    let unknown = town.answer(&Failure {
        flown: None,
        ..Failure::of(FailureType::Navigational)
    });
    assert!((unknown.first_stretch_m - 2_000.0).abs() < 1e-6);
}

#[test]
fn a_drone_waits_where_the_way_opens_at_a_known_time() {
    let half_way = Failure {
        flown: Some(0.5),
        ..Failure::of(FailureType::ServiceLevel)
    };
    let town = line(&["b"]).zone("parade", &[("b", "c")], (0, 20));
    let answer = town.answer(&half_way);
    assert_eq!(answer.outcome, Outcome::Hold, "{answer:#?}");
    let hold = answer.hold.expect("where it waits");
    assert_eq!(hold.node, town.node("b"));
    // 20 minutes, a minute of margin, and 5 % of the time until the leg has been flown in 125 s.
    let opens_s = (1_260.0 + 0.05 * 125.0) / 0.95;
    assert!((hold.until_s - opens_s).abs() < 1.0, "{hold:?}");
    // Waiting competes with a detour: by distance it wins, where the detour is longer.
    let around = ring(&["b"]).zone("parade", &[("b", "c")], (0, 20));
    assert_eq!(around.answer(&half_way).outcome, Outcome::Hold);
    // Not on a pad that is another's: the one at `b` is free again after the way has opened.
    let zone = [("b", "c")];
    let no_pad = line(&["b"]).zone("parade", &zone, (0, 20)).taken("b");
    let answer = no_pad.answer(&half_way);
    assert_eq!(answer.outcome, Outcome::NoRoute, "{answer:#?}");
    assert!(answer.hold.is_none());
    // What it lacks is the pad, not the battery.
    let least_bad = answer.unsafe_way.expect("the least bad way");
    assert_eq!(least_bad.code, UnsafeCode::NoAlternate);
    // Not beyond the deadline.
    let mut hurried = line(&["b"]).zone("parade", &[("b", "c")], (0, 20));
    hurried.deadline_s = Some(900.0);
    let answer = hurried.answer(&half_way);
    assert_eq!(answer.outcome, Outcome::Diverted, "{answer:#?}");
    let parade = Severance::Closure("parade".to_owned());
    assert_eq!(severances(&hurried, &answer), [parade]);
    let opens = answer.opens.expect("when it would be open");
    assert!(opens.arrives_s > 900.0);
}

#[test]
fn a_drone_is_diverted_to_the_pad_that_it_reaches_with_most_battery() {
    let closed = |pads: &[&str]| line(pads).zone("fire", &[("b", "c")], (-10, 600));
    let flown = |flown: f64, battery: f64| Failure {
        flown: Some(flown),
        battery,
        ..Failure::of(FailureType::ServiceLevel)
    };
    let town = closed(&["a", "b"]);
    for (share, end) in [(0.2, "a"), (0.8, "b")] {
        let answer = town.answer(&flown(share, 0.9));
        assert_eq!(answer.outcome, Outcome::Diverted);
        assert_eq!(nodes(&town, &answer).last().expect("an end"), end);
        assert!(!answer.reserve_used);
        // The value is what it draws, which is no distance.
        let composition = answer.composition.as_ref().expect("a plan");
        assert_eq!(composition.objective, Objective::Energy);
        let fire = Severance::Closure("fire".to_owned());
        assert_eq!(severances(&town, &answer), [fire]);
    }
    // A pad that is another's is no alternate.
    let town = closed(&["a", "b"]).taken("b");
    let answer = town.answer(&flown(0.8, 0.9));
    assert_eq!(nodes(&town, &answer), ["a"]);
    // The reserve is there for this, and for nothing else.
    let town = closed(&["b"]);
    let answer = town.answer(&flown(0.5, 0.21));
    assert_eq!(answer.outcome, Outcome::Diverted);
    assert!(answer.reserve_used);
    let composition = answer.composition.as_ref().expect("a plan");
    assert!(composition.plan.battery_at_arrival < 0.2);
    assert_eq!(composition.reserve, town.rules.floor);
    let below_the_floor = town.answer(&flown(0.5, 0.1));
    assert_eq!(below_the_floor.outcome, Outcome::NoRoute);
    assert!(below_the_floor.causes.contains(&FlightCause::BelowReserve));
    let least_bad = below_the_floor.unsafe_way.expect("the least bad way");
    assert_eq!(least_bad.code, UnsafeCode::BelowReserve);
}

#[test]
fn where_nothing_can_be_reached_every_cause_is_named() {
    let town = line(&[]).zone("fire", &[("b", "c")], (-10, 600));
    let half_way = |battery: f64| Failure {
        flown: Some(0.5),
        battery,
        ..Failure::of(FailureType::ServiceLevel)
    };
    let answer = town.answer(&half_way(0.9));
    assert_eq!(answer.outcome, Outcome::NoRoute);
    assert!(answer.composition.is_none());
    let fire = Severance::Closure("fire".to_owned());
    assert_eq!(severances(&town, &answer), [fire]);

    let closed_by_report = line(&[]).answer(&Failure::of(FailureType::Navigational));
    assert_eq!(
        severances(&line(&[]), &closed_by_report),
        [Severance::Report]
    );

    let empty = line(&[]).answer(&half_way(0.3));
    let lacks_energy = |cause: &FlightCause| matches!(cause, FlightCause::Energy { .. });
    assert!(empty.causes.iter().any(lacks_energy), "{empty:#?}");

    let mut windy = line(&["b"]);
    windy.wind = Wind::coming_from(0.0, 9.0);
    let blown = windy.answer(&half_way(0.9));
    assert_eq!(blown.outcome, Outcome::NoRoute);
    let is_wind = |cause: &FlightCause| matches!(cause, FlightCause::Unflyable { .. });
    assert!(blown.causes.iter().any(is_wind), "{blown:#?}");

    let town = long_line().taken("b");
    let waits_for_a_pad = town.answer(&half_way(0.6));
    let wants_pads = |cause: &FlightCause| *cause == FlightCause::Pads(town.node("b"));
    assert!(
        waits_for_a_pad.causes.iter().any(wants_pads),
        "{waits_for_a_pad:#?}"
    );
}

/// `a - b - c`, 6 km each: two legs take 0.7 of a battery. A pad at `b` and one off the way at `d`.
fn long_line() -> Town {
    Town::new(
        &[
            ("a", 0.0, 0.0, 0),
            ("b", 6_000.0, 0.0, 1),
            ("c", 12_000.0, 0.0, 0),
        ],
        &[("a", "b"), ("b", "c")],
    )
}

#[test]
fn a_drone_that_is_late_or_low_flies_on_as_far_as_it_can() {
    let town = long_line();
    let kinds = [FailureType::ServiceLevel, FailureType::Operational];
    for kind in kinds {
        let on_plan = town.answer(&Failure {
            battery: 0.95,
            ..Failure::of(kind)
        });
        assert_eq!(on_plan.outcome, Outcome::Unaffected, "{kind:?}");
        let low = town.answer(&Failure {
            flown: Some(0.5),
            battery: 0.5,
            ..Failure::of(kind)
        });
        let composition = low.composition.as_ref().expect("a plan");
        let stops = &composition.plan.stops;
        assert_eq!(stops.len(), 1, "{kind:?}: {low:#?}");
        assert_eq!(stops[0].kind, StopKind::Charge);
        assert_eq!(stops[0].node, town.node("b"));
    }
}

#[test]
fn pads_that_fail_are_overflown_and_not_used() {
    let around = Town::new(
        &[
            ("a", 0.0, 0.0, 0),
            ("b", 6_000.0, 0.0, 1),
            ("c", 12_000.0, 0.0, 0),
            ("d", 6_000.0, 3_000.0, 1),
        ],
        &[("a", "b"), ("b", "c"), ("a", "d"), ("d", "c")],
    );
    let failure = Failure {
        battery: 0.8,
        ..Failure::of(FailureType::Infrastructure)
    };
    let answer = around.answer(&failure);
    assert_eq!(answer.outcome, Outcome::Rerouted, "{answer:#?}");
    let composition = answer.composition.as_ref().expect("a plan");
    let stops = composition.plan.stops.iter();
    let stops: Vec<_> = stops.map(|stop| stop.node).collect();
    assert_eq!(stops, [around.node("d")]);
    // With battery for all of it the pads ahead do not matter.
    let enough = around.answer(&Failure {
        battery: 0.98,
        ..Failure::of(FailureType::Infrastructure)
    });
    assert_eq!(enough.outcome, Outcome::Unaffected);
}
