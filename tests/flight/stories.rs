//! The search on the bundled corridor, which no charge lasts for, and on drawn networks: wind, windows, pads, limits.

use crate::world::World;
use skyway::flight::{
    Airframe, FlightPlan, FlightRules, FlightStart, Reservation, Situation, StopKind, TimedClosure,
    TrafficLeg, Wind, WindField,
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
fn begin(source: NodeIx, payload_kg: f64) -> World {
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
            flown_m: 0.0,
            drawn: 0.0,
        }],
        destination: source,
        began_s: 0.0,
        deadline_s: 86_400.0,
        reserve: 0.2,
        closed_segments: Vec::new(),
    }
}

/// Nodes `0`, `1`, ... on a line towards the east, so far apart and with so many pads.
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
fn plan(world: &World, objective: Objective) -> FlightPlan {
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
    // 60 s of margin, and 5 % of the time since the plan began.
    let opens_s = after.legs[0].enters_s;
    assert!((opens_s - (3_660.0 + 0.05 * (opens_s - 2_400.0))).abs() < 1e-6);
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
    assert!(
        plan.stops
            .iter()
            .skip(1)
            .all(|stop| stop.lands_s >= 2_000.0 - 1e-6),
        "{plan:?}"
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
                ..Limits::default()
            },
            Unproved::Labels,
        ),
        (
            Limits {
                checks: 10,
                ..Limits::default()
            },
            Unproved::Checks,
        ),
        (
            Limits {
                is_over: Some(&|| true),
                ..Limits::default()
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
