//! Drones keep apart where segments cross and at nodes that they share.

use crate::stories::{begin, plan};
use crate::world::{Kind, World, crowded, world};
use skyway::flight::{Corner, Crossings, LegCourse, TrafficLeg, Vertical};
use skyway::geo::Point;
use skyway::itinerary::{Objective, Occupancy, OccupiedLeg, OthersOccupancy, Owner, Separation};
use skyway::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology};
use std::sync::Arc;

fn node_at(id: &str, x: f64, y: f64) -> NodeDraft {
    NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads: 1,
        ..NodeDraft::default()
    }
}

fn street(from: &str, to: &str) -> SegmentDraft {
    SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        ..SegmentDraft::default()
    }
}

/// West to east over 1,000 m, and south to north across its middle.
fn cross() -> Topology {
    let nodes = vec![
        node_at("w", 0.0, 0.0),
        node_at("e", 1_000.0, 0.0),
        node_at("s", 500.0, -500.0),
        node_at("n", 500.0, 500.0),
    ];
    let draft = NetworkDraft {
        name: "cross".to_owned(),
        nodes,
        segments: vec![street("w", "e"), street("s", "n")],
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("a valid network")
}

#[test]
fn a_drone_is_not_at_a_crossing_while_another_one_is() {
    let topology = Arc::new(cross());
    let node = |id: &str| topology.node(id).expect("a node");
    let mut world = begin(node("w"), 0.0);
    world.destination = node("e");
    world.topology = topology.clone();
    let alone = plan(&world, Objective::Time).legs[0];
    let flight_s = alone.leaves_s - alone.enters_s;
    let crossing = TrafficLeg {
        segment: topology
            .segment_between(node("s"), node("n"))
            .expect("a segment"),
        from: node("s"),
        enters_s: 0.0,
        leaves_s: flight_s,
    };
    world.situation.traffic.push(crossing);
    let after = plan(&world, Objective::Time).legs[0];
    // Both are 20 m before the crossing to 20 m behind it.
    let there_s = flight_s * 40.0 / 1_000.0;
    assert!(
        (after.enters_s - there_s).abs() < 1e-6,
        "{after:?}, not {there_s}"
    );
    world.rules.crossing_m = 0.0;
    assert_eq!(plan(&world, Objective::Time).legs[0].enters_s, 0.0);
}

/// Two streets end 8 m from each other: who comes to the end of one waits until who leaves the other is gone.
#[test]
fn at_two_nodes_near_each_other_drones_keep_apart_as_at_one() {
    let places = [("w", 0.0), ("a", 1_000.0), ("b", 1_008.0), ("e", 2_008.0)];
    let draft = NetworkDraft {
        name: "ends".to_owned(),
        nodes: places.map(|(id, x)| node_at(id, x, 0.0)).to_vec(),
        segments: vec![street("w", "a"), street("b", "e")],
        ..NetworkDraft::default()
    };
    let topology = Arc::new(Topology::build(draft, [0; 32]).expect("a valid network"));
    let node = |id: &str| topology.node(id).expect("a node");
    let mut world = begin(node("w"), 0.0);
    world.destination = node("a");
    world.topology = topology.clone();
    let alone = plan(&world, Objective::Time).legs[0];
    world.situation.traffic.push(TrafficLeg {
        segment: topology
            .segment_between(node("b"), node("e"))
            .expect("a segment"),
        from: node("b"),
        enters_s: alone.leaves_s,
        leaves_s: 2.0 * alone.leaves_s,
    });
    let among_others = plan(&world, Objective::Time).legs[0];
    let later_s = among_others.leaves_s - alone.leaves_s;
    assert!(later_s >= world.rules.node_headway_s, "{later_s}");
    world.rules.crossing_m = 0.0;
    assert_eq!(plan(&world, Objective::Time).legs[0], alone);
}

#[test]
fn where_it_is_unknown_when_a_drone_is_at_a_crossing_it_may_be_there_all_the_time() {
    let topology = Arc::new(cross());
    let node = |id: &str| topology.node(id).expect("a node");
    let mut world = begin(node("w"), 0.0);
    world.destination = node("e");
    world.topology = topology.clone();
    let plan = plan(&world, Objective::Time);
    let crossed = topology.segment_between(node("s"), node("n"));
    let vertical = Vertical::of(&topology, world.rules.unknown_climb_m);
    let separation = Separation {
        topology: &topology,
        crossings: &Crossings::of(&topology, &vertical, 20.0),
        rules: &world.rules,
    };
    for (is_uncertain, met) in [(false, 0), (true, 1)] {
        let mut occupancy = Occupancy::default();
        let slow = OccupiedLeg {
            plan: Owner::from(Arc::from("slow")),
            version: 1,
            leg: 0,
            from: node("s"),
            enters_s: 0.0,
            leaves_s: 10.0 * plan.arrives_s,
            is_uncertain,
        };
        occupancy.put_leg(crossed.expect("a segment"), slow);
        let others = OthersOccupancy::of(occupancy, [None, None], 0.0);
        let found = separation.met_by(&plan, 0.0, &others, &|_| true);
        assert_eq!(found.len(), met, "{is_uncertain}");
    }
}

/// Where a drone is on a segment after a share of its time, and how high, by the corners of its course.
fn place(course: &LegCourse, share: f64) -> (Point, Option<f64>) {
    let up_m = |pair: &[Corner]| {
        let heights = pair[0].height_m.zip(pair[1].height_m);
        heights.map_or(0.0, |(low_m, high_m)| high_m - low_m)
    };
    let length_m = |pair: &[Corner]| pair[0].place.distance_m(pair[1].place).hypot(up_m(pair));
    let along_m = share * course.corners.windows(2).map(length_m).sum::<f64>();
    let mut flown_m = 0.0;
    for pair in course.corners.windows(2) {
        let piece_m = length_m(pair);
        if piece_m > 0.0 && along_m <= flown_m + piece_m {
            let part = (along_m - flown_m) / piece_m;
            let height_m = pair[0].height_m.map(|low_m| low_m + up_m(pair) * part);
            return (pair[0].place.towards(pair[1].place, part), height_m);
        }
        flown_m += piece_m;
    }
    let last = course.corners.last().expect("a corner");
    (last.place, last.height_m)
}

/// Whether two places on two segments are too near for two drones, beyond 50 m of nodes that both segments have.
fn is_too_near(
    topology: &Topology,
    segments: [SegmentIx; 2],
    places: [(Point, Option<f64>); 2],
    horizontal_m: f64,
) -> bool {
    let [one, other] = segments.map(|segment| topology.segment(segment));
    let shared: Vec<NodeIx> = [one.from, one.to]
        .into_iter()
        .filter(|node| [other.from, other.to].contains(node))
        .collect();
    let is_at_node = shared
        .iter()
        .any(|&node| topology.position(node).distance_m(places[0].0) <= 50.0);
    let heights = places[0].1.zip(places[1].1);
    let above_m = heights.map_or(0.0, |(one_m, other_m)| (one_m - other_m).abs());
    !is_at_node && places[0].0.distance_m(places[1].0) < horizontal_m && above_m < 10.0
}

#[test]
fn wherever_two_drones_would_be_too_near_their_segments_cross() {
    let (mut near, mut found) = (0, 0);
    for seed in 0..40 {
        let horizontal_m = if seed % 4 == 3 { 60.0 } else { 20.0 };
        let World {
            topology, rules, ..
        } = world(seed, Kind::Continuous);
        let vertical = Vertical::of(&topology, rules.unknown_climb_m);
        let crossings = Crossings::of(&topology, &vertical, horizontal_m);
        let courses: Vec<LegCourse> = topology
            .segments()
            .map(|segment| {
                let ends = topology.segment(segment);
                LegCourse::of(&topology, ends.from, ends.to, segment)
            })
            .collect();
        for one in topology.segments() {
            found += crossings.on(one).len();
            for other in topology.segments().filter(|&other| other != one) {
                for step in 0..=200 {
                    for other_step in 0..=200 {
                        let shares = [f64::from(step) / 200.0, f64::from(other_step) / 200.0];
                        let places = [
                            place(&courses[one.at()], shares[0]),
                            place(&courses[other.at()], shares[1]),
                        ];
                        if !is_too_near(&topology, [one, other], places, horizontal_m) {
                            continue;
                        }
                        near += 1;
                        let crossing = crossings.on(one).iter().find(|it| it.other == other);
                        let holds = crossing.is_some_and(|it| {
                            it.own.enters <= shares[0]
                                && shares[0] <= it.own.leaves
                                && it.others.enters <= shares[1]
                                && shares[1] <= it.others.leaves
                        });
                        assert!(
                            holds,
                            "seed {seed}: {one:?} {other:?} {shares:?} {crossing:?}"
                        );
                    }
                }
            }
        }
    }
    assert!(near > 100 && found > 20, "{near} places, {found} crossings");
}

#[test]
fn others_at_nodes_and_crossings_change_answers() {
    let (mut by_node, mut by_crossing) = (0, 0);
    for seed in 0..150 {
        let all = crowded(seed, world(seed, Kind::Continuous));
        let value = |node_headway_s: f64, crossing_m: f64| {
            let mut world = all.clone();
            world.rules.node_headway_s = node_headway_s;
            world.rules.crossing_m = crossing_m;
            world.answer(Objective::Time, false).value
        };
        by_node += usize::from(value(5.0, 0.0) != value(0.0, 0.0));
        by_crossing += usize::from(value(0.0, 20.0) != value(0.0, 0.0));
    }
    assert!(
        by_node > 10 && by_crossing > 3,
        "{by_node} by nodes, {by_crossing} by crossings"
    );
}
