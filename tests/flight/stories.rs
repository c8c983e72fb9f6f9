//! The search on the bundled corridor, which no charge lasts for, and on drawn networks: wind, windows, pads, limits.

use crate::world::World;
use skyway::flight::{
    Airframe, FlightPlan, FlightRules, FlightStart, Reservation, Situation, StopKind, TimedClosure,
    TrafficLeg, Wind, WindField, WindPatch,
};
use skyway::itinerary::{Limits, Objective, Unproved, Value};
use skyway::network::{
    CORRIDOR_SEED, NetworkDraft, NodeDraft, NodeIx, SegmentDraft, Topology, san_marcos_san_antonio,
};
use std::sync::Arc;

/// From depot to depot with a full battery.
pub(crate) fn corridor(wind: Wind, payload_kg: f64) -> World {
    let draft = san_marcos_san_antonio(CORRIDOR_SEED);
    let depot = |town: &str| {
        let name = format!("{town} depot");
        let node = draft
            .nodes
            .iter()
            .find(|node| node.name.as_ref() == Some(&name));
        node.expect("the corridor has it").id.clone()
    };
    let (source, destination) = (depot("San Marcos"), depot("San Antonio"));
    let topology = Topology::build(draft, [0; 32]).expect("the bundled corridor");
    let [source, destination] =
        [source, destination].map(|id| topology.node(&id).expect("it is there"));
    World {
        topology: Arc::new(topology),
        wind: WindField::uniform(wind),
        rules: FlightRules::default(),
        destination,
        ..begin(source, payload_kg)
    }
}

/// A drone on the ground at a node at second 0, with a day to arrive.
pub(crate) fn begin(source: NodeIx, payload_kg: f64) -> World {
    World {
        topology: Arc::new(line(&[500.0], &[0, 0])),
        airframe: Airframe::phantom3(),
        payload_kg,
        wind: WindField::default(),
        rules: FlightRules {
            unknown_climb_m: 0.0,
            ..FlightRules::default()
        },
        situation: Situation::default(),
        starts: vec![FlightStart {
            node: source,
            at_s: 0.0,
            battery: 0.98,
            on_ground: true,
            pad: None,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        }],
        destination: source,
        began_s: 0.0,
        deadline_s: 86_400.0,
        reserve: 0.2,
        closed_segments: Vec::new(),
    }
}

/// Nodes `0`, `1`, ... on a line towards the east, with their distance and pads.
fn line(lengths_m: &[f64], pads: &[u16]) -> Topology {
    let mut draft = NetworkDraft {
        name: "line".to_owned(),
        ..NetworkDraft::default()
    };
    let mut x = 0.0;
    for (number, &pads) in pads.iter().enumerate() {
        draft.nodes.push(NodeDraft {
            id: number.to_string(),
            position: [x, 0.0],
            pads,
            ..NodeDraft::default()
        });
        if let Some(length_m) = lengths_m.get(number) {
            x += length_m;
            draft.segments.push(SegmentDraft {
                from: number.to_string(),
                to: (number + 1).to_string(),
                ..SegmentDraft::default()
            });
        }
    }
    Topology::build(draft, [0; 32]).expect("a line")
}

/// From the first node of a line to the last, without payload.
pub(crate) fn along(lengths_m: &[f64], pads: &[u16]) -> World {
    let topology = line(lengths_m, pads);
    let node = |number: usize| topology.node(&number.to_string()).expect("on the line");
    let (source, destination) = (node(0), node(lengths_m.len()));
    World {
        topology: Arc::new(topology),
        destination,
        ..begin(source, 0.0)
    }
}

#[track_caller]
pub(crate) fn plan(world: &World, objective: Objective) -> FlightPlan {
    let answer = world.answer(objective, false);
    assert!(answer.proved, "{answer:?}");
    let plan = answer.plan.expect("there is a plan");
    assert_eq!(world.check(&plan), Ok(()));
    plan
}

fn charged(plan: &FlightPlan) -> f64 {
    let stops = plan.stops.iter();
    stops
        .map(|stop| stop.battery_after - stop.battery_before)
        .sum()
}

#[test]
fn the_corridor_takes_recharging_and_more_of_it_into_the_wind() {
    // The corridor leads to the south-west.
    let calm = plan(&corridor(Wind::CALM, 0.25), Objective::Distance);
    let headwind = plan(
        &corridor(Wind::coming_from(225.0, 7.0), 0.25),
        Objective::Distance,
    );
    let landings = |plan: &FlightPlan| {
        let stops = plan.stops.iter();
        stops.filter(|stop| stop.kind == StopKind::Charge).count()
    };
    assert!(landings(&calm) >= 8, "{calm:?}");
    assert!((85_000.0..110_000.0).contains(&calm.distance_m), "{calm:?}");
    assert!(charged(&headwind) > charged(&calm) + 1.0);
    assert!(headwind.arrives_s > calm.arrives_s);
}

#[test]
fn a_zone_is_flown_through_before_it_waited_out_or_flown_around() {
    // Half past eleven is second 0; the zone stands from 12:00 to 12:30.
    let zone = |world: &World| TimedClosure {
        from_s: 1_800.0,
        until_s: 3_600.0,
        segments: vec![world.topology.find_segment("0-1").expect("on the line")],
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: true,
    };
    let at = |at_s: f64, pads: u16| {
        let mut world = along(&[4_000.0], &[pads, 0]);
        world.situation.closures.push(zone(&world));
        world.starts[0].at_s = at_s;
        world.began_s = at_s;
        world
    };
    let before = plan(&at(1_200.0, 1), Objective::Time);
    assert_eq!(before.arrives_s, 1_450.0);
    assert!(before.stops.is_empty());
    let after = plan(&at(2_400.0, 1), Objective::Time);
    // 60 s of margin, and 5 % of the time from the plan's beginning to the end of the leg.
    let leg = &after.legs[0];
    assert!((leg.enters_s - (3_660.0 + 0.05 * (leg.leaves_s - 2_400.0))).abs() < 1e-6);
    assert_eq!(after.stops[0].kind, StopKind::Start);
    // No pad to wait on, and no other way.
    let nowhere = at(2_400.0, 0).answer(Objective::Time, false);
    assert!(nowhere.proved && nowhere.plan.is_none());
}

#[test]
fn a_plan_charges_no_more_than_it_needs() {
    let world = along(&[9_000.0, 6_000.0], &[0, 1, 0]);
    let plan = plan(&world, Objective::Time);
    let [stop] = plan.stops.as_slice() else {
        panic!("one stop: {plan:?}");
    };
    assert_eq!(stop.kind, StopKind::Charge);
    assert!((plan.battery_at_arrival - 0.2).abs() < 1e-9, "{plan:?}");
}

#[test]
fn a_pad_that_is_taken_is_waited_for_elsewhere() {
    let mut world = along(&[6_000.0, 6_000.0, 6_000.0], &[1, 1, 1, 0]);
    let node = |id: &str| world.topology.node(id).expect("on the line");
    for id in ["1", "2"] {
        let reservation = Reservation {
            node: node(id),
            pad: 0,
            from_s: 0.0,
            until_s: 2_000.0,
        };
        world.situation.reservations.push(reservation);
    }
    let plan = plan(&world, Objective::Time);
    // It lands as soon as the farther pad is free, handles, and charges for the rest.
    let stop = plan.stops.last().expect("it cannot do without");
    assert_eq!(stop.node, node("2"), "{plan:?}");
    let drawn = plan.legs[0].battery_before - plan.legs[0].battery_after;
    let (before, after) = (0.98 - 2.0 * drawn, 0.2 + drawn);
    let charging_s = 960.0 * ((1.0 - before) / (1.0 - after)).ln();
    let expected_s = 2_000.0 + 60.0 + charging_s + 375.0;
    assert!(
        (plan.arrives_s - expected_s).abs() < 1e-6,
        "{expected_s}, not {plan:?}"
    );
}

#[test]
fn a_swap_station_takes_its_time_and_gives_a_full_battery() {
    let mut world = along(&[10_000.0, 10_000.0], &[0, 1, 0]);
    let station = world.topology.node("1").expect("on the line");
    world.situation.swap_stations.push(station);
    let plan = plan(&world, Objective::Time);
    let stop = plan.stops[0];
    assert_eq!(stop.kind, StopKind::Swap);
    assert_eq!(stop.battery_after, 0.98);
    assert!((stop.takes_off_s - stop.lands_s - 180.0).abs() < 1e-9);
}

#[test]
fn another_plan_ahead_is_waited_for_on_the_ground() {
    let mut world = along(&[4_000.0], &[1, 0]);
    let oncoming = TrafficLeg {
        segment: world.topology.find_segment("0-1").expect("on the line"),
        from: world.destination,
        enters_s: 100.0,
        leaves_s: 350.0,
    };
    world.situation.traffic.push(oncoming);
    // The other one passes the node when it leaves the segment.
    assert_eq!(plan(&world, Objective::Time).legs[0].enters_s, 355.0);
    world.rules.node_headway_s = 0.0;
    assert_eq!(plan(&world, Objective::Time).legs[0].enters_s, 350.0);
    world.situation.traffic[0].from = world.starts[0].node;
    world.situation.traffic[0].enters_s = 10.0;
    let follows = plan(&world, Objective::Time);
    assert!(
        (follows.legs[0].enters_s - 40.001).abs() < 1e-6,
        "{follows:?}"
    );
    world.rules.headway_s = 0.0;
    assert_eq!(plan(&world, Objective::Time).legs[0].enters_s, 0.0);
}

#[test]
fn past_a_bound_the_answer_says_that_it_is_not_proved() {
    let world = corridor(Wind::coming_from(225.0, 5.0), 0.5);
    let limits = [
        (
            Limits {
                labels: 40,
                ..Limits::THOROUGH
            },
            Unproved::Labels,
        ),
        (
            Limits {
                checks: 10,
                ..Limits::THOROUGH
            },
            Unproved::Checks,
        ),
        (
            Limits {
                is_over: Some(&|| true),
                ..Limits::THOROUGH
            },
            Unproved::Time,
        ),
    ];
    let best = world.answer(Objective::Time, false);
    for (limits, reason) in limits {
        let answer = world.answer_within(Objective::Time, false, limits);
        assert_eq!(
            (answer.proved, answer.reason),
            (false, Some(reason)),
            "{answer:?}"
        );
        assert!(!best.value.beats(answer.lower_bound) || best.value == answer.lower_bound);
        assert!(answer.lower_bound.arrives_s.is_finite());
        if let Some(plan) = &answer.plan {
            assert_eq!(world.check(plan), Ok(()));
        }
        assert!(!answer.value.beats(best.value) || !best.proved);
    }
    assert_ne!(best.value, Value::NONE);
}

/// The drone of a world comes flying to where it stood.
fn comes_flying(world: &mut World) {
    world.starts[0].on_ground = false;
}

#[test]
fn whoever_waits_for_another_wind_may_be_faster() {
    // Into 7 m/s until second 300, calm then; the only way has a pad between its legs.
    let mut world = along(&[2_000.0, 4_000.0], &[0, 1, 0]);
    comes_flying(&mut world);
    world.wind = WindField {
        base: Wind::CALM,
        patches: vec![WindPatch {
            area: None,
            from_s: 0.0,
            until_s: 300.0,
            wind: Wind::coming_from(90.0, 7.0),
        }],
    };
    let plan = plan(&world, Objective::Distance);
    assert!((plan.arrives_s - 550.0).abs() < 1e-6, "{plan:?}");
    assert_eq!(plan.stops.len(), 1);
}

/// Nodes `0`, `1`, ... with their pads, and segments between them; from node 0 to another one, without payload.
fn drawn(places: &[([f64; 2], u16)], segments: &[(&str, f64)], destination: &str) -> World {
    let mut draft = NetworkDraft {
        name: "drawn".to_owned(),
        ..NetworkDraft::default()
    };
    for (number, &(position, pads)) in places.iter().enumerate() {
        draft.nodes.push(NodeDraft {
            id: number.to_string(),
            position,
            pads,
            ..NodeDraft::default()
        });
    }
    for &(id, length_m) in segments {
        let (from, to) = id.split_once('-').expect("two nodes");
        draft.segments.push(SegmentDraft {
            from: from.to_owned(),
            to: to.to_owned(),
            length_m: Some(length_m),
            ..SegmentDraft::default()
        });
    }
    let topology = Topology::build(draft, [0; 32]).expect("it is valid");
    let node = |id: &str| topology.node(id).expect("it is there");
    let (source, destination) = (node("0"), node(destination));
    World {
        topology: Arc::new(topology),
        destination,
        ..begin(source, 0.0)
    }
}

fn close(world: &mut World, id: &str, from_s: f64, until_s: f64) {
    world.situation.closures.push(TimedClosure {
        from_s,
        until_s,
        segments: vec![world.topology.find_segment(id).expect("it is there")],
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: false,
    });
}

#[test]
fn whoever_has_landed_does_not_stand_for_who_lands_later_on_a_better_pad() {
    // On from node 1 the short way is closed, the other one until 1000. Pad 0 has to be left at 500, pad 1 is free from 450
    // on: who comes straight lands at 375 and may not stay, who comes by node 3 lands at 470 and may.
    let places = [
        ([0.0, 0.0], 0),
        ([6_000.0, 0.0], 2),
        ([10_000.0, 0.0], 0),
        ([3_000.0, 2_000.0], 0),
        ([8_000.0, 1_000.0], 0),
    ];
    let segments = [
        ("0-1", 6_000.0),
        ("1-2", 4_000.0),
        ("0-3", 3_760.0),
        ("3-1", 3_760.0),
        ("1-4", 2_500.0),
        ("4-2", 2_500.0),
    ];
    let mut world = drawn(&places, &segments, "2");
    comes_flying(&mut world);
    let node = world.topology.node("1").expect("it is there");
    let on = |pad: u16, from_s: f64, until_s: f64| Reservation {
        node,
        pad,
        from_s,
        until_s,
    };
    world.situation.reservations = vec![on(0, 500.0, 9_000.0), on(1, 0.0, 450.0)];
    close(&mut world, "1-2", 0.0, f64::INFINITY);
    close(&mut world, "1-4", 0.0, 1_000.0);
    let plan = plan(&world, Objective::Distance);
    assert!((plan.distance_m - 12_520.0).abs() < 1e-3, "{plan:?}");
    assert!((plan.stops[0].lands_s - 470.0).abs() < 1e-6, "{plan:?}");
    assert!((plan.arrives_s - 1_312.5).abs() < 1e-6, "{plan:?}");
}

#[test]
fn whoever_begins_at_a_closed_node_may_leave_it_and_nobody_else() {
    // From 35 s on node 1 is closed. Who begins at 0 gets there at 31 s and cannot go on; who begins there at 40 s with
    // less battery is let out. The short way on is closed.
    let places = [
        ([0.0, 0.0], 0),
        ([500.0, 0.0], 0),
        ([1_000.0, 0.0], 0),
        ([750.0, 300.0], 0),
    ];
    let segments = [
        ("0-1", 500.0),
        ("1-2", 500.0),
        ("1-3", 400.0),
        ("3-2", 400.0),
    ];
    let mut world = drawn(&places, &segments, "2");
    let node = |id: &str| world.topology.node(id).expect("it is there");
    let (first, second) = (node("0"), node("1"));
    let flying = |node: NodeIx, at_s: f64, battery: f64| FlightStart {
        node,
        at_s,
        battery,
        on_ground: false,
        ..world.starts[0]
    };
    world.starts = vec![flying(first, 0.0, 0.98), flying(second, 40.0, 0.5)];
    close(&mut world, "1-2", 0.0, f64::INFINITY);
    world.situation.closures.push(TimedClosure {
        from_s: 35.0,
        until_s: f64::INFINITY,
        segments: Vec::new(),
        nodes: vec![second],
        pads: Vec::new(),
        widened: false,
    });
    let plan = plan(&world, Objective::Time);
    assert_eq!(
        (plan.start, plan.legs.len()),
        (world.starts[1], 2),
        "{plan:?}"
    );
}

#[test]
fn of_two_equally_long_ways_the_earlier_one_is_taken() {
    // One has to be begun at once, and its second leg opens at 300: with a stop of 60 s on the way it is
    // entered at 310. The other can be begun later, and its second leg is entered when it opens, at 305.
    let places = [
        ([0.0, 0.0], 1),
        ([3_000.0, 2_000.0], 1),
        ([3_000.0, -2_000.0], 1),
        ([6_000.0, 0.0], 1),
    ];
    let segments = ["0-1", "0-2", "1-3", "2-3"].map(|id| (id, 4_000.0));
    for (hasty, other) in [("1", "2"), ("2", "1")] {
        let mut world = drawn(&places, &segments, "3");
        close(&mut world, &format!("0-{hasty}"), 250.0, 9_000.0);
        close(&mut world, &format!("{hasty}-3"), 0.0, 300.0);
        close(&mut world, &format!("{other}-3"), 0.0, 305.0);
        let plan = plan(&world, Objective::Distance);
        assert!((plan.arrives_s - 555.0).abs() < 1e-6, "{hasty}: {plan:?}");
    }
}
