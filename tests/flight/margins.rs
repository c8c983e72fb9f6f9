//! How far a window reaches for a drone that is in the corridor for long: as far as for the end of its leg.

use crate::stories::along;
use crate::world::World;
use skyway::flight::{FlightRules, FlightStart, TimedClosure};
use skyway::itinerary::{FlightCause, FlightSetting, Objective};
use skyway::verify::FlightFault;
use std::sync::Arc;

/// A drone comes flying to a leg of 600 s, which a zone closes for a time.
fn long_leg(from_s: f64, until_s: f64, enters_s: f64) -> World {
    let mut world = along(&[9_600.0], &[0, 0]);
    world.rules = FlightRules {
        unknown_climb_m: 0.0,
        ..FlightRules::default()
    };
    world.starts = vec![FlightStart {
        at_s: enters_s,
        on_ground: false,
        ..world.starts[0]
    }];
    world.situation.closures.push(TimedClosure {
        from_s,
        until_s,
        segments: vec![world.topology.find_segment("0-1").expect("on the line")],
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: true,
    });
    world
}

/// Whether search, checker and the look at plans that were made before let a drone fly; they have to agree.
#[track_caller]
fn is_flown(world: &World) -> bool {
    let answer = world.answer(Objective::Time, false);
    assert!(answer.proved, "{answer:?}");
    let open = World {
        situation: skyway::flight::Situation::default(),
        starts: world.starts.clone(),
        ..long_leg(0.0, 0.0, 0.0)
    };
    let as_timed = open.answer(Objective::Time, false).plan.expect("open");
    let checked = world.check(&as_timed);
    let setting = FlightSetting::new(
        Arc::clone(&world.topology),
        world.airframe.clone(),
        world.payload_kg,
        world.wind.clone(),
        world.rules,
        &world.situation,
    );
    let met = setting.in_the_way(&as_timed, world.began_s, 0);
    match answer.plan.is_some() {
        true => {
            assert_eq!(checked, Ok(()));
            assert!(met.is_empty(), "{met:?}");
            true
        }
        false => {
            assert!(
                matches!(checked, Err(FlightFault::Closed { .. })),
                "{checked:?}"
            );
            assert_eq!(met, [FlightCause::Closure(0)]);
            false
        }
    }
}

#[test]
fn the_margin_is_that_of_the_end_of_the_leg() {
    // Entered 10 s after the beginning and left after 610 s: 60 s, and 5 % of 610 s.
    let margin_s = 60.0 + 0.05 * 610.0;
    let ends_s = 610.0;
    for (from_s, until_s, expected) in [
        (ends_s + margin_s + 0.1, f64::INFINITY, true),
        (ends_s + margin_s - 0.1, f64::INFINITY, false),
        (f64::NEG_INFINITY, 10.0 - margin_s - 0.1, true),
        (f64::NEG_INFINITY, 10.0 - margin_s + 0.1, false),
    ] {
        let world = long_leg(from_s, until_s, 10.0);
        assert_eq!(is_flown(&world), expected, "{from_s} to {until_s}");
    }
}

#[test]
fn whoever_stands_in_a_zone_waits_for_its_end_and_whoever_flies_leaves_it() {
    // The zone lies over the roof alone.
    let over = |world: &mut World, widened: bool| {
        world.situation.closures[0] = TimedClosure {
            segments: Vec::new(),
            nodes: vec![world.starts[0].node],
            widened,
            ..world.situation.closures[0].clone()
        };
    };
    let leaves_s = |stands: bool, pads: u16, widened: bool| {
        let mut world = World {
            starts: vec![FlightStart {
                on_ground: stands,
                ..long_leg(0.0, 0.0, 0.0).starts[0]
            }],
            ..along_with(pads)
        };
        over(&mut world, widened);
        let answer = world.answer(Objective::Time, false);
        let plan = answer.plan?;
        assert_eq!(world.check(&plan), Ok(()));
        Some(plan.legs[0].enters_s)
    };
    assert_eq!(leaves_s(false, 1, true), Some(0.0));
    let opens_s = leaves_s(true, 1, true).expect("it waits on its pad");
    assert!((opens_s - (1_860.0 + 0.05 * (opens_s + 600.0))).abs() < 1e-6);
    assert_eq!(leaves_s(true, 0, true), None);
    // What an operator closes lets it go.
    assert_eq!(leaves_s(true, 1, false), Some(0.0));
}

/// The leg of 600 s with pads where it starts, and a zone until half past.
fn along_with(pads: u16) -> World {
    World {
        rules: long_leg(0.0, 0.0, 0.0).rules,
        situation: long_leg(-600.0, 1_800.0, 0.0).situation,
        ..along(&[9_600.0], &[pads, 0])
    }
}
