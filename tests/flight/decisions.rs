//! What a drone is told: hold, an alternate, what cuts it off; and the alternate against brute force.

use crate::stories::{along, corridor};
use crate::world::World;
use skyway::flight::{
    FirstStretch, FlightStart, Reentry, Reservation, StretchKind, StretchLeg, Tariff, TimedClosure,
    TrafficLeg, Unflyable, Wind, WindField,
};
use skyway::itinerary::{
    FlightCause, FlightDecision, FlightOrder, FlightOutcome, FlightSetting, ItineraryScratch,
    Limits, Objective, decide,
};
use skyway::network::{NodeIx, SegmentIx};
use skyway::verify::verify_flight;
use std::sync::Arc;

/// How long the pad of an alternate has to be free, in seconds.
pub(crate) const STAY_S: f64 = 600.0;

pub(crate) fn setting(world: &World) -> FlightSetting {
    FlightSetting::new(
        Arc::clone(&world.topology),
        world.airframe.clone(),
        world.payload_kg,
        world.wind.clone(),
        world.rules,
        &world.situation,
    )
}

fn decision(world: &World, objective: Objective, in_flight: bool) -> FlightDecision {
    let setting = setting(world);
    let potentials = setting.potentials(world.destination, objective);
    let order = FlightOrder {
        starts: &world.starts,
        destination: world.destination,
        objective,
        began_s: world.began_s,
        deadline_s: world.deadline_s,
        closed_segments: &world.closed_segments,
        in_flight,
        explain: true,
        refuge_stay_s: STAY_S,
        limits: Limits::THOROUGH,
    };
    let mut scratch = ItineraryScratch::new(&world.topology);
    let decision = decide(&setting, &order, &potentials, &mut scratch);
    if let Some(plan) = &decision.answer.plan {
        let mut premises = world.premises();
        if let FlightOutcome::Diverted { node, reserve_used } = decision.outcome {
            premises.destination = node;
            premises.deadline_s = f64::INFINITY;
            if reserve_used {
                premises.reserve = world.rules.floor;
            }
        }
        assert_eq!(verify_flight(plan, &premises), Ok(()), "{decision:?}");
    }
    decision
}

fn node(world: &World, id: &str) -> NodeIx {
    world.topology.node(id).expect("on the line")
}

fn segment(world: &World, id: &str) -> SegmentIx {
    world.topology.find_segment(id).expect("on the line")
}

fn closed(world: &World, id: &str, from_s: f64, until_s: f64) -> TimedClosure {
    TimedClosure {
        from_s,
        until_s,
        segments: vec![segment(world, id)],
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: false,
    }
}

/// The drone of a world comes flying with this much battery.
fn flying(world: &mut World, id: &str, battery: f64) {
    world.starts = vec![FlightStart {
        node: node(world, id),
        battery,
        on_ground: false,
        ..world.starts[0]
    }];
}

#[test]
fn a_window_is_held_for_and_after_the_deadline_told() {
    let mut world = along(&[4_000.0, 4_000.0], &[1, 0, 0]);
    world
        .situation
        .closures
        .push(closed(&world, "1-2", 0.0, 2_000.0));
    let held = decision(&world, Objective::Distance, false);
    let FlightOutcome::Hold { node, pad, until_s } = held.outcome else {
        panic!("{held:?}");
    };
    assert_eq!((node, pad), (world.starts[0].node, 0));
    assert!((until_s - 1_750.0).abs() < 1e-6, "{held:?}");
    world.deadline_s = 1_900.0;
    let late = decision(&world, Objective::Distance, false);
    assert_eq!(late.outcome, FlightOutcome::NoRoute);
    assert!(late.answer.proved, "{late:?}");
    assert_eq!(late.causes, [FlightCause::Closure(0)]);
    let opens = late.opens.expect("after the window");
    assert!((opens.arrives_s - 2_250.0).abs() < 1e-6, "{late:?}");
}

#[test]
fn whoever_cannot_go_on_is_sent_to_the_pad_with_most_battery_left() {
    // 2 - 1 - 0 behind, 3 ahead; pads at 0 and at the nearer 1.
    let mut world = along(&[2_000.0, 2_000.0, 4_000.0], &[1, 1, 0, 0]);
    world
        .situation
        .closures
        .push(closed(&world, "2-3", 0.0, f64::INFINITY));
    flying(&mut world, "2", 0.5);
    let diverted = decision(&world, Objective::Distance, true);
    let alternate = FlightOutcome::Diverted {
        node: node(&world, "1"),
        reserve_used: false,
    };
    assert_eq!(diverted.outcome, alternate, "{diverted:?}");
    assert_eq!(diverted.causes, [FlightCause::Closure(0)]);
    assert_eq!(diverted.opens, None);
    // Its pad is another's: on to the next one.
    let reservation = Reservation {
        node: node(&world, "1"),
        pad: 0,
        from_s: 300.0,
        until_s: 5_000.0,
    };
    world.situation.reservations.push(reservation);
    let farther = decision(&world, Objective::Distance, true);
    let FlightOutcome::Diverted {
        node: alternate, ..
    } = farther.outcome
    else {
        panic!("{farther:?}");
    };
    assert_eq!(alternate, node(&world, "0"));
}

#[test]
fn the_floor_is_for_the_way_to_an_alternate() {
    let mut world = along(&[2_000.0, 14_000.0], &[1, 0, 0]);
    let taken = 2.0 * 3.95 / 68.1;
    for (battery, expected) in [
        (0.22 + taken, Some(false)),
        (0.19 + taken, Some(true)),
        (0.07 + taken, None),
    ] {
        flying(&mut world, "1", battery);
        let decision = decision(&world, Objective::Time, true);
        let told = match decision.outcome {
            FlightOutcome::Diverted { reserve_used, .. } => Some(reserve_used),
            FlightOutcome::NoRoute => None,
            FlightOutcome::Planned | FlightOutcome::Hold { .. } => panic!("{decision:?}"),
        };
        assert_eq!(told, expected, "{battery}: {decision:?}");
        let by_battery = |cause: &FlightCause| {
            matches!(
                cause,
                FlightCause::Energy { .. } | FlightCause::BelowReserve
            )
        };
        assert!(decision.causes.iter().any(by_battery), "{decision:?}");
    }
}

#[test]
fn below_the_reserve_nobody_goes_on_to_the_destination() {
    let mut world = along(&[500.0, 500.0], &[0, 1, 0]);
    flying(&mut world, "1", 0.19);
    let decision = decision(&world, Objective::Time, true);
    let alternate = FlightOutcome::Diverted {
        node: node(&world, "1"),
        reserve_used: true,
    };
    assert_eq!(decision.outcome, alternate);
    assert_eq!(decision.causes, [FlightCause::BelowReserve]);
}

#[test]
fn every_kind_of_cause_is_named() {
    let mut heavy = along(&[500.0], &[1, 0]);
    heavy.payload_kg = 1.2;
    let mut windy = along(&[500.0], &[1, 0]);
    windy.wind = WindField::uniform(Wind::coming_from(90.0, 8.0));
    let far = along(&[15_000.0], &[1, 0]);
    let mut closed_here = along(&[500.0], &[1, 0]);
    closed_here.closed_segments = vec![segment(&closed_here, "0-1")];
    let mut taken = along(&[10_000.0, 10_000.0], &[1, 1, 0]);
    taken.deadline_s = 4_000.0;
    let reservation = Reservation {
        node: node(&taken, "1"),
        pad: 0,
        from_s: 0.0,
        until_s: 3_950.0,
    };
    taken.situation.reservations.push(reservation);
    let mut late = along(&[500.0, 500.0], &[1, 0, 0]);
    late.deadline_s = 40.0;
    let mut met = along(&[500.0], &[0, 0]);
    met.situation.traffic.push(TrafficLeg {
        segment: segment(&met, "0-1"),
        from: node(&met, "1"),
        enters_s: 10.0,
        leaves_s: 40.0,
    });
    let mut apart = along(&[500.0], &[1, 0]);
    apart.destination = apart.starts[0].node;
    let causes = |world: &World| {
        let decision = decision(world, Objective::Distance, false);
        assert_eq!(decision.outcome, FlightOutcome::NoRoute, "{decision:?}");
        assert!(decision.answer.proved, "{decision:?}");
        decision.causes
    };
    let why = |world: &World| match causes(world).as_slice() {
        [FlightCause::Unflyable { why, legs: 1, .. }] => *why,
        other => panic!("{other:?}"),
    };
    assert!(matches!(why(&heavy), Unflyable::Payload { .. }));
    assert!(matches!(why(&windy), Unflyable::Gusts { .. }));
    match causes(&far).as_slice() {
        [
            FlightCause::Energy {
                missing, legs: 1, ..
            },
        ] => {
            let lacks = 15.0 * 3.95 / 68.1 + 0.2 - 0.98;
            assert!((missing - lacks).abs() < 0.01, "{missing}, not {lacks}");
        }
        other => panic!("{other:?}"),
    }
    let here = closed_here.closed_segments[0];
    assert_eq!(causes(&closed_here), [FlightCause::Request(here)]);
    let of_taken = causes(&taken);
    assert!(
        of_taken.contains(&FlightCause::Pads(node(&taken, "1"))),
        "{of_taken:?}"
    );
    assert_eq!(causes(&late), [FlightCause::Deadline]);
    let other = met.situation.traffic[0];
    assert_eq!(causes(&met), [FlightCause::Traffic(other)]);
    let there = decision(&apart, Objective::Distance, false);
    assert_eq!(there.outcome, FlightOutcome::Planned);
}

#[test]
fn where_closures_part_a_drone_from_its_destination_for_good_no_search_has_to_find_out() {
    let lengths_m = [500.0; 12];
    let pads = [1; 13];
    // Next to the destination, next to the drone, and far from both.
    for segment in ["11-12", "0-1", "6-7"] {
        let mut world = along(&lengths_m, &pads);
        let shut = closed(&world, segment, 0.0, f64::INFINITY);
        world.situation.closures.push(shut);
        let cut = decision(&world, Objective::Time, false);
        assert!(cut.answer.proved && cut.answer.plan.is_none(), "{cut:?}");
        assert_eq!(cut.causes, [FlightCause::Closure(0)], "{segment}");
        assert_eq!(cut.opens, None, "{segment}");
        let most = if segment == "6-7" { 64 } else { 0 };
        assert!(cut.answer.effort.labels <= most, "{segment}: {cut:?}");
        // It is another matter where that opens in time.
        world.situation.closures[0].until_s = 2_000.0;
        let held = decision(&world, Objective::Time, false);
        assert!(held.answer.plan.is_some(), "{segment}: {held:?}");
    }
}

#[test]
fn of_others_those_that_were_met_are_causes_and_not_those_that_come_later() {
    let mut world = along(&[500.0], &[0, 0]);
    let other = TrafficLeg {
        segment: segment(&world, "0-1"),
        from: node(&world, "1"),
        enters_s: 10.0,
        leaves_s: 40.0,
    };
    let later = TrafficLeg {
        enters_s: 5_000.0,
        leaves_s: 5_030.0,
        ..other
    };
    world.situation.traffic.extend([other, later]);
    let met = decision(&world, Objective::Distance, false);
    assert_eq!(met.outcome, FlightOutcome::NoRoute, "{met:?}");
    // Who comes later is not why.
    assert_eq!(met.causes, [FlightCause::Traffic(other)]);
}

#[test]
fn a_drone_in_the_middle_of_a_leg_begins_at_either_end() {
    let mut world = along(&[1_000.0], &[1, 0]);
    world.wind = WindField::uniform(Wind::coming_from(270.0, 5.0));
    let setting = setting(&world);
    let node = |id: &str| node(&world, id);
    let place = setting
        .topology()
        .position(node("0"))
        .towards(setting.topology().position(node("1")), 0.25);
    let by = |to: &str, length_m: f64, overrun_m: f64| {
        let leg = StretchLeg {
            from: node("0"),
            to: node("1"),
            segment: Some(segment(&world, "0-1")),
            fraction: 0.25,
        };
        let reentry = Reentry {
            node: node(to),
            stretch: FirstStretch {
                kind: StretchKind::Leg,
                leg: Some(leg),
                length_m,
                overrun_m,
                begin: place,
            },
        };
        let start = setting.start_by(&reentry, 0.6, 100.0).expect("flyable");
        assert_eq!(start.reentry(), Some(reentry));
        assert!((start.battery + start.drawn - 0.6).abs() < 1e-12);
        start
    };
    let ahead = by("1", 750.0, 0.0);
    assert!((ahead.at_s - (100.0 + 750.0 / 21.0)).abs() < 1e-9);
    assert_eq!((ahead.node, ahead.flown_m), (node("1"), 750.0));
    let behind = by("0", 250.0, 0.0);
    assert!((behind.at_s - (100.0 + 250.0 / 11.0)).abs() < 1e-9);
    // What it needs to turn is flown with the wind, and then back against it.
    let turned = by("0", 350.0, 50.0);
    assert!((turned.at_s - (100.0 + 50.0 / 21.0 + 300.0 / 11.0)).abs() < 1e-9);
    let straight = Reentry {
        node: node("0"),
        stretch: FirstStretch {
            kind: StretchKind::Straight,
            leg: None,
            length_m: 250.0,
            overrun_m: 0.0,
            begin: place,
        },
    };
    let straight = setting.start_by(&straight, 0.6, 100.0);
    let straight = straight.expect("the same way");
    assert!((straight.at_s - behind.at_s).abs() < 1e-9);
    assert!((straight.drawn - behind.drawn).abs() < 1e-12);
    let there = Reentry::at_node(node("0"), place, None);
    let there = setting.start_by(&there, 0.6, 100.0).expect("it is there");
    assert_eq!(
        (there.at_s, there.battery, there.flown_m),
        (100.0, 0.6, 0.0)
    );
}

#[test]
fn figures_tell_charging_from_waiting() {
    let mut world = along(&[9_000.0, 6_000.0], &[0, 1, 0]);
    let charging = decision(&world, Objective::Time, false);
    let figures = |world: &World, decision: &FlightDecision| {
        let plan = decision.answer.plan.clone().expect("there is a plan");
        setting(world).figures(&plan, world.began_s, world.reserve, Tariff::default())
    };
    let told = figures(&world, &charging);
    assert!(told.stops[0].waits_s < 1e-6, "{told:?}");
    assert!((told.legs[0].ground_speed_mps - 16.0).abs() < 1e-9);
    assert!((told.energy_wh - 15.0 * 3.95).abs() < 0.2, "{told:?}");
    let opens_s = 3_000.0;
    world
        .situation
        .closures
        .push(closed(&world, "1-2", 0.0, opens_s));
    let waiting = decision(&world, Objective::Time, false);
    let told = figures(&world, &waiting);
    let expected_s = opens_s - charging.answer.plan.expect("there is one").legs[1].enters_s;
    assert!(
        (told.stops[0].waits_s - expected_s).abs() < 1e-6,
        "{told:?}"
    );
}

#[test]
fn the_corridor_says_why_it_cannot_be_flown() {
    // Half a kilogram into 7 m/s: some stations are too far apart.
    let told = decision(
        &corridor(Wind::coming_from(225.0, 7.0), 0.5),
        Objective::Distance,
        false,
    );
    assert_eq!(told.outcome, FlightOutcome::NoRoute);
    let by_energy = |cause: &FlightCause| matches!(cause, FlightCause::Energy { .. });
    assert!(told.causes.iter().any(by_energy), "{told:?}");
}
