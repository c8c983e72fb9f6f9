//! Drones that have to land, drones whose place is unknown, and what those are told that have nothing safe left.

use crate::town::{Failure, Town};
use skyway::delivery::{BatteryNow, FlightRecomposition, Landing, ReportedFigures, Trouble};
use skyway::flight::{Aloft, FailureType, StretchKind};
use skyway::recompose::{Flag, Outcome, Warning, WhyNot};

/// `p - a - b - c - q` along a line, pads where they are named.
fn line(pads: &[&str]) -> Town {
    let count = |id: &str| u16::from(pads.contains(&id));
    let nodes = ["p", "a", "b", "c", "q"];
    let places = [-1_150.0, 0.0, 2_000.0, 4_000.0, 12_000.0];
    let nodes: Vec<_> = nodes
        .into_iter()
        .zip(places)
        .map(|(id, x)| (id, x, 0.0, count(id)))
        .collect();
    Town::new(&nodes, &[("p", "a"), ("a", "b"), ("b", "c"), ("c", "q")])
}

fn lands(town: &Town, failure: &Failure<'_>) -> (FlightRecomposition, String) {
    let answer = town.answer(failure);
    assert_eq!(answer.outcome, Outcome::Diverted, "{answer:#?}");
    let nodes = answer.composition.as_ref().expect("a plan").nodes();
    let end = *nodes.last().expect("an end");
    let end = town.ids(&[end])[0].to_owned();
    (answer, end)
}

fn operational(flown: f64, battery: f64, landing: Option<Landing>) -> Failure<'static> {
    Failure {
        flown: Some(flown),
        battery,
        landing,
        ..Failure::of(FailureType::Operational)
    }
}

#[test]
fn without_a_figure_that_shows_it_nobody_flies_on() {
    let figures = |battery: bool, payload: bool| ReportedFigures { battery, payload };
    let landing = |trouble: Trouble, figures: ReportedFigures| {
        Landing::of(FailureType::Operational, trouble, figures)
    };
    let (none, battery, payload) = (
        figures(false, false),
        figures(true, false),
        figures(false, true),
    );
    for (trouble, reported, expected) in [
        (Trouble::Unknown, none, Some(Landing::FreePad)),
        (Trouble::Unknown, battery, None),
        (Trouble::Unknown, payload, None),
        (Trouble::Battery, payload, Some(Landing::FreePad)),
        (Trouble::Battery, battery, None),
        (Trouble::Payload, battery, Some(Landing::FreePad)),
        (Trouble::Payload, payload, None),
        (Trouble::Urgent, figures(true, true), Some(Landing::AnyNode)),
    ] {
        assert_eq!(landing(trouble, reported), expected, "{trouble:?}");
    }
    let late = Landing::of(FailureType::ServiceLevel, Trouble::Urgent, none);
    assert_eq!(late, None);
    // Its plan would have let it fly to `c` with nine tenths.
    let town = line(&["p", "c"]);
    let (answer, end) = lands(&town, &operational(0.2, 0.9, Some(Landing::FreePad)));
    assert_eq!(end, "p");
    assert!(!answer.is_energy_checked);
    assert!(answer.flags.is_empty(), "{:?}", answer.flags);
    // What is left does not count: it is unknown.
    let (_, end) = lands(&town, &operational(0.2, 0.1, Some(Landing::FreePad)));
    assert_eq!(end, "p");
    // A free pad it has to be.
    let taken = line(&["p", "c"]).taken("p");
    let (_, end) = lands(&taken, &operational(0.2, 0.9, Some(Landing::FreePad)));
    assert_eq!(end, "c");
}

#[test]
fn whoever_cannot_wait_for_a_pad_lands_at_the_nearest_node() {
    let landing = Some(Landing::AnyNode);
    let town = line(&["c"]);
    let (answer, end) = lands(&town, &operational(0.4, 0.9, landing));
    assert_eq!(end, "a");
    assert!(answer.flags.is_empty(), "{:?}", answer.flags);
    // A pad that costs a fifth more is worth it, one that costs more is not; one that is taken is flagged.
    let with_pad = line(&["b"]);
    let (_, end) = lands(&with_pad, &operational(0.46, 0.9, landing));
    assert_eq!(end, "b");
    let (_, end) = lands(&with_pad, &operational(0.45, 0.9, landing));
    assert_eq!(end, "a");
    let taken = line(&["a"]).taken("a");
    let (answer, end) = lands(&taken, &operational(0.4, 0.9, landing));
    assert_eq!((end.as_str(), answer.flags), ("a", vec![Flag::PadOccupied]));
    // Below the floor, too.
    let (answer, end) = lands(&town, &operational(0.4, 0.07, landing));
    assert_eq!(end, "a");
    assert_eq!(answer.flags, [Flag::ReserveUsed]);
    // What is closed is not landed in.
    let closed = line(&["c"]).closed_node("a");
    let (_, end) = lands(&closed, &operational(0.4, 0.9, landing));
    assert_eq!(end, "b");
}

#[test]
fn nobody_counts_a_leg_twice_where_the_place_is_unknown() {
    let town = line(&["a", "c"]);
    let whole_leg = 2.0 * 3.95 / 68.1;
    let unknown = |destination: &'static str| Failure {
        flown: None,
        destination,
        by_plan: Some(BatteryNow::ByPlan {
            before: 0.9,
            after: 0.9 - whole_leg,
        }),
        ..Failure::of(FailureType::ServiceLevel)
    };
    let start = |failure: &Failure<'_>| {
        let answer = town.answer(failure);
        let plan = answer.composition.expect("a plan").plan;
        let stretch = plan.start.stretch.expect("it is under way");
        assert_eq!(stretch.kind, StretchKind::Leg);
        assert!((plan.start.flown_m - 2_000.0).abs() < 1e-6);
        plan.start
    };
    // On to the end from the start of the leg, with the battery of the start.
    let on = start(&unknown("c"));
    assert_eq!(on.node, town.node("b"));
    assert!((on.battery - (0.9 - whole_leg)).abs() < 1e-3, "{on:?}");
    // Back to the start from the end of the leg, with the battery of the end.
    let back = start(&unknown("p"));
    assert_eq!(back.node, town.node("a"));
    assert!(
        (back.battery - (0.9 - 2.0 * whole_leg)).abs() < 1e-3,
        "{back:?}"
    );
}

#[test]
fn whoever_has_nothing_left_is_told_what_is_near() {
    // 1 km back to `a`, and 1,150 m more to the pad at `p`.
    let town = line(&["p"]);
    let leg = 3.95 / 68.1;
    let answer = town.answer(&Failure {
        flown: Some(0.5),
        battery: 0.046 + 2.15 * leg,
        ..Failure::of(FailureType::Navigational)
    });
    assert_eq!(answer.outcome, Outcome::NoRoute);
    let near: Vec<_> = answer
        .near
        .iter()
        .map(|near| (town.ids(&[near.node])[0], near.pads, near.why_not))
        .collect();
    assert_eq!(
        near,
        [("a", 0, WhyNot::NoPads), ("p", 1, WhyNot::BelowFloor)]
    );
    let pad = &answer.near[1];
    assert!((pad.length_m - 2_150.0).abs() < 1e-6, "{pad:?}");
    let battery = pad.battery.expect("it is reckoned");
    assert!((battery - 0.046).abs() < 1e-3, "{pad:?}");
    let way = answer.unsafe_way.expect("the least bad");
    assert_eq!(town.ids(&way.nodes), ["a", "p"]);
    assert_eq!((way.line.len(), way.length_m), (3, pad.length_m));
    assert_eq!(way.battery, pad.battery);
    assert!(answer.composition.is_none());
    // So is one that does not even come to an end of its leg.
    let empty = town.answer(&Failure {
        flown: Some(0.5),
        battery: 0.05,
        ..Failure::of(FailureType::Navigational)
    });
    let near = empty.near.first().expect("the start of its leg");
    assert_eq!(town.ids(&[near.node]), ["a"]);
    assert!(near.battery.expect("it is reckoned") < 0.0);
}

#[test]
fn whoever_stands_in_a_zone_is_not_sent_up_through_it() {
    let town = line(&["a", "c"]).closed_node("a");
    let at_a = |aloft: Aloft| Failure {
        aloft,
        ..Failure::of(FailureType::ServiceLevel)
    };
    let node = town.node("a");
    let holds = town.answer(&at_a(Aloft::Grounded));
    assert_eq!(holds.outcome, Outcome::Hold, "{holds:#?}");
    assert_eq!(holds.warnings, [Warning::HoldsWithoutEnd { node }]);
    let plan = holds.composition.expect("it stays").plan;
    assert_eq!((plan.start.node, plan.legs.len()), (node, 0));
    assert!(holds.if_airborne.is_none());
    // It is unknown whether it is in the air: it is told both.
    let both = town.answer(&at_a(Aloft::Unknown));
    assert_eq!(both.outcome, Outcome::Hold);
    let airborne = both.if_airborne.expect("the answer to one that is");
    assert_ne!(airborne.outcome, Outcome::Hold, "{airborne:#?}");
    let in_the_air = town.answer(&at_a(Aloft::Airborne));
    assert_eq!(in_the_air.outcome, airborne.outcome);
    assert_eq!(in_the_air.composition, airborne.composition);
}
