//! The rules of where a path starts, one by one: each was an answer that was not safe to fly.
//!
//! ```text
//! C . . . D        A - B is the leg, 400 m; C - D the way around it.
//! . . . . .        A - C, B - D and C - D are open; E hangs on B, with pads.
//! A . . . B . E
//! ```

use crate::starts::{Map, on_leg};
use skyway::flight::{Aloft, Circumstances, FailureType, Location, OperationalDetail, StretchKind};
use skyway::geo::Point;
use skyway::recompose::{Flag, Outcome, Request, UnsafeCode, WhyNot};

#[test]
fn a_leg_that_the_network_does_not_have_is_never_flown_on() {
    let map = Map::new();
    for place in [Location::LegStart, on_leg(300.0), Location::Unknown] {
        let mut request = map.request(FailureType::ServiceLevel, place);
        request.report.leg = (map.node("A"), map.node("D"));
        request.report.remaining_path = None;
        if let Location::At(_) = place {
            request.report.location = Location::At(Point::new(200.0, 100.0));
        }
        let answer = map.answer(&request);
        assert!(
            map.letters(&answer).starts_with('A'),
            "{place:?}: {answer:?}"
        );
        let reentry = answer.reentry.expect("a way");
        assert_eq!(reentry.stretch.leg.expect("its leg").segment, None);
    }
}

#[test]
fn a_zone_behind_does_not_explain_a_failure_ahead() {
    let map = Map::new().with_zone(50.0, 100.0);
    // Whatever the drone reports, it did not say where.
    let answer = map.answer(&map.request(FailureType::Environmental, on_leg(200.0)));
    assert_eq!(answer.outcome, Outcome::NoRoute);
    let unsafe_way = answer.unsafe_way.expect("the least bad way");
    assert_eq!(unsafe_way.code, UnsafeCode::BetweenCauses);
    assert_eq!((unsafe_way.length_m, unsafe_way.nodes.len()), (0.0, 0));
    assert!(answer.path.nodes.is_empty() && answer.reentry.is_none());
}

#[test]
fn a_zone_behind_does_not_explain_an_operators_closure() {
    let map = Map::new()
        .with_zone(50.0, 100.0)
        .closing(&[], &[("A", "B")]);
    let answer = map.answer(&map.request(FailureType::ServiceLevel, on_leg(200.0)));
    assert_eq!(answer.outcome, Outcome::NoRoute);
}

#[test]
fn a_cause_behind_and_a_zone_behind_let_it_fly_on() {
    let map = Map::new().with_zone(50.0, 100.0);
    let mut request = map.request(FailureType::Navigational, on_leg(200.0));
    request.report.cause_location = Some(Point::new(150.0, 0.0));
    assert_eq!(map.letters(&map.answer(&request)), "BE");
    request.report.cause_location = Some(Point::new(250.0, 0.0));
    assert_eq!(map.answer(&request).outcome, Outcome::NoRoute);
}

#[test]
fn a_zone_over_the_start_is_left_ahead() {
    // It covers A, and with A all its segments.
    let map = Map::new().with_zone(-60.0, 120.0);
    for place in [Location::LegStart, on_leg(40.0), on_leg(110.0)] {
        let answer = map.answer(&map.request(FailureType::ServiceLevel, place));
        assert_eq!(map.letters(&answer), "BE", "{place:?}");
        assert_eq!(answer.flags, [Flag::LeavingZone]);
        assert_eq!(answer.outcome, Outcome::Rerouted);
    }
}

#[test]
fn a_zone_is_left_straight_only_where_the_leg_is_blocked_both_ways() {
    let map = Map::new().with_zone(-60.0, 220.0);
    for place in [Location::LegStart, on_leg(200.0)] {
        let answer = map.answer(&map.request(FailureType::Navigational, place));
        assert_eq!(answer.flags, [Flag::LeavingZone, Flag::Unverified]);
        assert_eq!(
            answer.reentry.expect("a way").stretch.kind,
            StretchKind::Straight
        );
        // Along its own leg lies what blocks it.
        assert!(!map.letters(&answer).starts_with('B'));
    }
}

#[test]
fn zones_that_overlap_are_one() {
    let map = Map::new().with_zone(150.0, 260.0);
    let map = map.with_named_zone("other", 240.0, 390.0);
    // Out of the first alone it would be shorter ahead: 60 m against 50 m; out of both it is back.
    let answer = map.answer(&map.request(FailureType::ServiceLevel, on_leg(210.0)));
    assert!(map.letters(&answer).starts_with('A'));
    assert_eq!(answer.flags, [Flag::LeavingZone]);
}

#[test]
fn a_closed_start_is_left_over_any_of_its_segments() {
    let map = Map::new().closing(&["A"], &[]);
    let mut request = map.request(FailureType::ServiceLevel, Location::LegStart);
    request.report.destination = map.node("C");
    request.report.remaining_path = None;
    let answer = map.answer(&request);
    assert_eq!(map.letters(&answer), "AC");
    assert_eq!(answer.remaining_length_m, Some(200.0));
}

#[test]
fn neither_end_may_be_entered() {
    let map = Map::new().closing(&["A", "B"], &[]);
    let answer = map.answer(&map.request(FailureType::ServiceLevel, on_leg(200.0)));
    assert_eq!(answer.outcome, Outcome::NoRoute);
    assert_eq!(
        answer.unsafe_way.expect("a way").code,
        UnsafeCode::EndsClosed
    );
    let near = answer.near.first().expect("what is near");
    assert_eq!(near.why_not, WhyNot::Closed);
}

#[test]
fn off_the_leg_with_zones_all_around_there_is_no_path() {
    let map = Map::new().with_zone(-1_000.0, 1_000.0);
    let below = Location::At(Point::new(200.0, -150.0));
    let answer = map.answer(&map.request(FailureType::ServiceLevel, below));
    assert_eq!(answer.outcome, Outcome::NoRoute);
    assert!(answer.path.nodes.is_empty());
    assert_eq!(
        answer.unsafe_way.expect("a way").code,
        UnsafeCode::Unverified
    );
}

fn moving(map: &Map, failure: FailureType, x: f64, speed_mps: f64, age_s: f64) -> Request {
    let circumstances = Circumstances {
        speed_mps,
        place_age_s: age_s,
        ..Circumstances::default()
    };
    Request {
        circumstances,
        ..map.request(failure, on_leg(x))
    }
}

#[test]
fn a_zone_nearer_than_the_drone_can_stop_is_entered_and_left() {
    // At 16 m/s it needs 68.57 m; the zone begins 10 m ahead.
    let map = Map::new().with_zone(160.0, 360.0);
    let answer = map.answer(&moving(&map, FailureType::ServiceLevel, 150.0, 16.0, 0.0));
    let stretch = answer.reentry.expect("a way").stretch;
    let stopping_m = 32.0 + 256.0 / 7.0;
    assert_eq!(answer.flags, [Flag::CannotStop]);
    assert!((stretch.overrun_m - stopping_m).abs() < 1e-9);
    assert!((stretch.length_m - 150.0 - 2.0 * stopping_m).abs() < 1e-9);
    // A slower one turns before it.
    let slow = map.answer(&moving(&map, FailureType::ServiceLevel, 150.0, 2.0, 0.0));
    assert!(slow.flags.is_empty());
    assert_eq!(slow.first_stretch_m, 150.0);
    // It is through a narrow one before it can turn, and back would enter that again.
    let narrow = Map::new().with_zone(160.0, 190.0);
    let on = narrow.answer(&moving(
        &narrow,
        FailureType::ServiceLevel,
        150.0,
        16.0,
        0.0,
    ));
    assert_eq!(
        (narrow.letters(&on).as_str(), on.flags.as_slice()),
        ("BE", [Flag::CannotStop].as_slice())
    );
}

#[test]
fn an_old_place_counts_as_further_on_for_the_way_back_alone() {
    let map = Map::new();
    let back = map.answer(&moving(&map, FailureType::Navigational, 150.0, 10.0, 5.0));
    assert_eq!(back.first_stretch_m, 200.0);
    let very_old = map.answer(&moving(&map, FailureType::Navigational, 150.0, 10.0, 500.0));
    assert_eq!(very_old.first_stretch_m, 400.0);
    let on = map.answer(&moving(&map, FailureType::ServiceLevel, 150.0, 10.0, 5.0));
    assert_eq!(
        (on.outcome, on.first_stretch_m),
        (Outcome::Unaffected, 250.0)
    );
}

#[test]
fn an_unknown_place_is_the_worst_for_each_way() {
    let map = Map::new();
    let free = map.answer(&map.request(FailureType::ServiceLevel, Location::Unknown));
    assert_eq!(
        (map.letters(&free).as_str(), free.first_stretch_m),
        ("BE", 400.0)
    );
    let zone = Map::new().with_zone(150.0, 250.0);
    let between = zone.answer(&zone.request(FailureType::ServiceLevel, Location::Unknown));
    assert_eq!(between.outcome, Outcome::NoRoute);
    assert_eq!(
        between.unsafe_way.expect("a way").code,
        UnsafeCode::PlaceUnknown
    );
}

#[test]
fn on_the_ground_in_a_zone_it_holds() {
    let map = Map::new().with_zone(-60.0, 120.0);
    let mut request = map.request(FailureType::ServiceLevel, Location::LegStart);
    request.circumstances.aloft = Aloft::Grounded;
    let answer = map.answer(&request);
    assert_eq!(
        (answer.outcome, map.letters(&answer).as_str()),
        (Outcome::Hold, "A")
    );
    assert!(answer.if_airborne.is_none() && answer.flags.is_empty());
    request.circumstances.aloft = Aloft::Unknown;
    let either = map.answer(&request);
    let airborne = either.if_airborne.as_deref().expect("the other answer");
    assert_eq!(
        (either.outcome, airborne.outcome),
        (Outcome::Hold, Outcome::Rerouted)
    );
    assert_eq!(airborne.flags, [Flag::LeavingZone]);
}

#[test]
fn a_drone_that_has_to_land_takes_the_nearest_node() {
    let map = Map::new();
    let mut request = map.request(FailureType::Operational, on_leg(300.0));
    assert_eq!(
        map.answer(&request).outcome,
        Outcome::NoRoute,
        "no node has pads"
    );
    for detail in [OperationalDetail::Propulsion, OperationalDetail::LandNow] {
        request.circumstances.detail = Some(detail);
        let answer = map.answer(&request);
        assert_eq!(
            (answer.outcome, map.letters(&answer).as_str()),
            (Outcome::Diverted, "B")
        );
    }
}
