//! Where a path begins, and what its first stretch meets.

use super::*;

#[test]
fn a_path_begins_where_the_drone_is() {
    let mut swapped = Story::around();
    swapped.stretch.length_m = 300.0;
    swapped.length_m = 1_500.0;
    assert_eq!(swapped.rule(), Rule::Length);
    let mut forgotten = Story::around();
    forgotten.stretch.length_m = 0.0;
    forgotten.stretch.kind = StretchKind::None;
    forgotten.length_m = 1_200.0;
    assert_eq!(forgotten.rule(), Rule::BeginsAtDrone);
    let mut other = Story::around();
    other.stretch.enters = node(&other.topology, "D");
    assert_eq!(other.rule(), Rule::BeginsAtDrone);
}

#[test]
fn past_the_end_of_its_leg_a_drone_is_not_at_the_node() {
    let mut past = Story {
        at: Whereabouts::At(Point::new(530.0, 0.0)),
        length_m: 530.0,
        ..Story::on()
    };
    past.stretch.length_m = 30.0;
    assert_eq!(past.checked(), Ok(()));
    past.stretch.length_m = 0.0;
    past.length_m = 500.0;
    assert_eq!(past.rule(), Rule::Length);
    past.stretch.kind = StretchKind::None;
    assert_eq!(past.rule(), Rule::BeginsAtDrone);
}

#[test]
fn the_first_stretch_passes_no_cause() {
    // Its own failure lies ahead, or at an unknown place.
    let failed = Story {
        told: Told::Rerouted,
        closes_leg: true,
        ..Story::on()
    };
    assert_eq!(failed.rule(), Rule::PassesCause);
    let ahead = Story {
        cause: Some(Point::new(400.0, 0.0)),
        ..failed
    };
    assert_eq!(ahead.rule(), Rule::PassesCause);
    let behind = Story {
        cause: Some(Point::new(100.0, 0.0)),
        ..ahead
    };
    assert_eq!(behind.checked(), Ok(()));
    let back = Story {
        cause: Some(Point::new(100.0, 0.0)),
        ..Story::around()
    };
    assert_eq!(back.rule(), Rule::PassesCause);
}

#[test]
fn closures_of_operators_and_reports_lie_ahead() {
    let story = Story::on();
    let segment = story.topology.segment_between(story.leg.0, story.leg.1);
    let closure = Closure {
        cause: Cause::Report {
            report: "r".to_owned(),
        },
        id: "r".to_owned(),
        windows: Vec::new(),
        hits: Hits::new(segment.into_iter().collect(), Vec::new()),
        pads: Vec::new(),
    };
    let closed = story.closing(&[Change::Put(Arc::new(closure))]);
    assert_eq!(closed.rule(), Rule::PassesCause);
}

#[test]
fn a_removed_leg_is_no_way_on() {
    // A - C has no segment.
    let story = Story::on();
    let leg = (node(&story.topology, "A"), node(&story.topology, "C"));
    let removed = Story {
        leg,
        ids: "C",
        told: Told::Rerouted,
        stretch: Stretch {
            leg: Some(leg),
            enters: leg.1,
            length_m: 800.0,
            ..story.stretch
        },
        ..story
    };
    assert_eq!(removed.rule(), Rule::PassesCause);
}

#[test]
fn the_first_stretch_enters_no_zone_and_leaves_the_one_around_it() {
    let story = Story::on();
    let zone = circle(&story.topology, 400.0, 0.0, 20.0);
    assert_eq!(story.closing(&[zone]).rule(), Rule::EntersZone);
    let story = Story::around();
    let zone = circle(&story.topology, 100.0, 0.0, 20.0);
    assert_eq!(story.closing(&[zone]).rule(), Rule::EntersZone);
    let story = Story::around();
    let zone = circle(&story.topology, 200.0, 0.0, 30.0);
    let inside = story.closing(&[zone]);
    assert_eq!(inside.rule(), Rule::FlagMissing(Flag::LeavingZone));
    let flagged = Story {
        flags: Flags::default().with(Flag::LeavingZone),
        ..inside
    };
    assert_eq!(flagged.checked(), Ok(()));
}

#[test]
fn straight_lines_are_for_those_off_their_leg_and_flagged() {
    let story = Story::around();
    let enters = node(&story.topology, "D");
    let mut straight = Story {
        ids: "DEBC",
        at: Whereabouts::At(Point::new(200.0, -100.0)),
        flags: Flags::default().with(Flag::Unverified),
        stretch: Stretch {
            kind: StretchKind::Straight,
            leg: None,
            enters,
            length_m: 200.0_f64.hypot(200.0),
            overrun_m: 0.0,
        },
        ..story
    };
    straight.length_m = straight.stretch.length_m + 1_100.0;
    assert_eq!(straight.checked(), Ok(()));
    straight.flags = Flags::default();
    assert_eq!(straight.rule(), Rule::FlagMissing(Flag::Unverified));
    straight.flags = Flags::default().with(Flag::Unverified);
    let zone = circle(&straight.topology, 100.0, 0.0, 20.0);
    assert_eq!(straight.closing(&[zone]).rule(), Rule::EntersZone);
    // On its leg no drone flies straight over roofs.
    let mut on_leg = Story::around();
    on_leg.stretch.kind = StretchKind::Straight;
    on_leg.stretch.leg = None;
    on_leg.flags = Flags::default().with(Flag::Unverified);
    assert_eq!(on_leg.rule(), Rule::FlagWithoutGround(Flag::Unverified));
}

#[test]
fn who_cannot_turn_before_a_zone_says_so() {
    let mut story = Story::around();
    story.stretch.overrun_m = 69.0;
    story.stretch.length_m = 200.0 + 2.0 * 69.0;
    story.length_m += 2.0 * 69.0;
    assert_eq!(story.checked(), Ok(()));
    let zone = circle(&story.topology, 300.0, 0.0, 50.0);
    let mut entering = story.closing(&[zone]);
    assert_eq!(entering.rule(), Rule::FlagMissing(Flag::CannotStop));
    entering.flags = Flags::default().with(Flag::CannotStop);
    assert_eq!(entering.checked(), Ok(()));
    // Farther than it needs.
    entering.stretch.overrun_m = 90.0;
    assert_eq!(entering.rule(), Rule::BeginsAtDrone);
}

#[test]
fn who_flies_into_a_zone_that_is_too_near_may_leave_it_on_the_other_side() {
    // 60 m ahead: nearer than the 69 m that it needs to turn.
    let story = Story::on();
    let zone = circle(&story.topology, 280.0, 0.0, 20.0);
    let mut through = story.closing(&[zone]);
    assert_eq!(through.rule(), Rule::FlagMissing(Flag::CannotStop));
    through.flags = Flags::default().with(Flag::CannotStop);
    through.told = Told::Rerouted;
    assert_eq!(through.checked(), Ok(()));
    let far = Story::on();
    let zone = circle(&far.topology, 380.0, 0.0, 20.0);
    let mut flagged = far.closing(&[zone]);
    flagged.flags = Flags::default().with(Flag::CannotStop);
    assert_eq!(flagged.rule(), Rule::EntersZone);
}

#[test]
fn a_drone_at_a_node_in_a_zone_leaves_over_any_segment() {
    let story = Story::around();
    let (a, d) = (node(&story.topology, "A"), node(&story.topology, "D"));
    let zone = circle(&story.topology, 0.0, 0.0, 40.0);
    let mut out = Story {
        at: Whereabouts::LegStart,
        ids: "DEBC",
        flags: Flags::default().with(Flag::LeavingZone),
        stretch: Stretch {
            kind: StretchKind::Leg,
            leg: Some((a, d)),
            enters: d,
            length_m: 100.0,
            overrun_m: 0.0,
        },
        length_m: 1_200.0,
        ..story
    }
    .closing(&[zone]);
    assert_eq!(out.checked(), Ok(()));
    // Only from where it is.
    out.at = Whereabouts::At(Point::new(200.0, 0.0));
    assert_eq!(out.rule(), Rule::BeginsAtDrone);
}
