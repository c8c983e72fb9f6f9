//! Compositions over the bundled corridor: every contingency of every leg is one that can be flown.

use crate::town::{Held, Town};
use skyway::delivery::FlightComposition;
use skyway::flight::{FlightStart, StopKind, Wind};
use skyway::formats::load_network;
use skyway::itinerary::{FlightCause, Objective};
use skyway::network::bundled;
use skyway::recompose::Outcome;

fn corridor(wind: Wind) -> Town {
    let loaded = load_network(bundled::CORRIDOR).expect("the bundled corridor");
    let mut town = Town::of(loaded.topology, 30.0);
    town.payload_kg = 0.25;
    town.wind = wind;
    town.deadline_s = Some(43_200.0);
    town
}

fn composed(town: &Town) -> FlightComposition {
    let composition = town.compose("1", "280", Objective::Distance);
    composition.expect("the corridor can be flown")
}

#[test]
fn the_corridor_is_flown_from_pad_to_pad_with_contingencies_that_can_be_flown() {
    for wind in [Wind::CALM, Wind::coming_from(225.0, 7.0)] {
        let town = corridor(wind);
        let composition = composed(&town);
        assert!(composition.proof.proved);
        let charges = composition.plan.stops.iter();
        let charges = charges.filter(|stop| stop.kind == StopKind::Charge);
        assert!(charges.count() >= 8);
        check_contingencies(&town, &composition);
    }
}

/// Flies every detour and every way to an alternate again.
#[track_caller]
fn check_contingencies(town: &Town, composition: &FlightComposition) {
    let skies = town.skies();
    let mut rerouted = 0;
    for (leg, contingency) in composition.plan.legs.iter().zip(&composition.contingencies) {
        let start = FlightStart {
            node: leg.from,
            at_s: leg.enters_s,
            battery: leg.battery_before,
            on_ground: false,
            pad: None,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        };
        let detour = &contingency.if_closed;
        let flight = detour.flight.as_ref().expect("a way out of every leg");
        let leads_there = detour.contingency.outcome != Outcome::Diverted;
        let last = flight.legs.last().map_or(leg.from, |last| last.to);
        let least = |reserve_used: bool| match reserve_used {
            true => town.rules.floor,
            false => town.rules.reserve,
        };
        let around = Held {
            start,
            destination: if leads_there {
                composition.destination
            } else {
                last
            },
            began_s: composition.began_s,
            deadline_s: f64::INFINITY,
            reserve: least(detour.reserve_used),
            closed_segments: &[leg.segment],
        };
        assert_eq!(town.fly(&skies, flight, &around), Ok(()), "{leg:?}");
        rerouted += usize::from(leads_there);
        let safe = contingency.safe.as_ref().expect("a pad within reach");
        let landing = Held {
            destination: safe.safe.node,
            reserve: least(safe.reserve_used),
            closed_segments: &[],
            ..around
        };
        assert_eq!(town.fly(&skies, &safe.flight, &landing), Ok(()), "{leg:?}");
        assert!(town.topology.pads(safe.safe.node) > 0);
    }
    assert!(rerouted > 0, "no leg has a detour");
}

#[test]
fn a_headwind_takes_more_recharging() {
    let calm = composed(&corridor(Wind::CALM));
    let headwind = composed(&corridor(Wind::coming_from(225.0, 7.0)));
    let charged = |composition: &FlightComposition| -> f64 {
        let stops = composition.figures.stops.iter();
        stops.map(|stop| stop.charged).sum()
    };
    assert!(charged(&headwind) > charged(&calm) + 1.0);
    let places = |composition: &FlightComposition| {
        let stops = composition.plan.stops.iter();
        stops.map(|stop| stop.node).collect::<Vec<_>>()
    };
    assert_ne!(places(&headwind), places(&calm));
}

#[test]
fn the_tuples_of_the_paper_follow_each_other_and_carry_the_cost() {
    let town = corridor(Wind::CALM);
    let composition = composed(&town);
    let services = composition.services(&town.topology, town.payload_kg);
    assert_eq!(services.len(), composition.plan.legs.len());
    for pair in services.windows(2) {
        assert_eq!(pair[0].to, pair[1].from);
        assert!(pair[0].ends_s <= pair[1].starts_s + 1e-6);
    }
    let cost_usd: f64 = services.iter().map(|one| one.quality.cost_usd).sum();
    assert!((cost_usd - composition.figures.cost_usd).abs() < 1e-6);
    // 0.1 USD for 2 kg over 10 km: an eighth of it for 0.25 kg.
    let by_hand_usd = 0.1 * 0.125 * composition.figures.distance_m / 10_000.0;
    assert!((cost_usd - by_hand_usd).abs() < 1e-6);
}

#[test]
fn without_time_for_it_the_deadline_is_named_with_when_it_could_be() {
    let mut town = corridor(Wind::CALM);
    town.deadline_s = None;
    let refused = town.compose("1", "280", Objective::Distance);
    let refused = refused.expect_err("it takes longer than two hours and a half");
    assert!(refused.proved);
    let opens = refused.opens.expect("a later landing");
    assert!(opens.arrives_s > 9_000.0);
    assert!(refused.causes.contains(&FlightCause::Deadline));
    // Every pad is free.
    let is_pads = |cause: &FlightCause| matches!(cause, FlightCause::Pads(_));
    assert!(!refused.causes.iter().any(is_pads), "{refused:?}");
}
