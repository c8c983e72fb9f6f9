//! Searches allocate nothing, and a recomposition only its answer: counted, not claimed.
//!
//! Alone in its binary, for it counts every allocation of the thread.

use allocation_counter::measure;
use skyway::airspace::{Airspace, Closed, RequestClosures};
use skyway::checked::{Known, check_answer};
use skyway::flight::{
    Airframe, FailureReport, FailureType, FlightLegs, FlightRules, FlightStart, Location,
    SharedCrossings, Situation, Vertical, WindField,
};
use skyway::itinerary::{
    FlightRequest, FlightWorld, ItineraryScratch, Limits, Objective, Obstacles, PadTimes,
    Potentials, find,
};
use skyway::network::{Components, Generated, Joining, NodeIx, Topology};
use skyway::recompose::{Outcome, Request, Scope, Scratch, Strategy, World, recompose};
use skyway::routing::{Baseline, Searcher, Start, TreeCache};
use std::hint::black_box;
use std::sync::Arc;

struct Setting {
    topology: Arc<Topology>,
    airspace: Airspace,
    trees: TreeCache,
    destination: NodeIx,
    legs: Vec<(NodeIx, NodeIx)>,
}

fn setting() -> Setting {
    let generated = Generated {
        nodes: 2_000,
        max_neighbours: 10,
        map_size_m: 10_000.0,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed: 3,
    };
    let draft = generated.network().expect("valid parameters");
    let topology = Arc::new(Topology::build(draft, [0; 32]).expect("a valid network"));
    let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
    let destination = connected[connected.len() / 2];
    let now = jiff::Timestamp::UNIX_EPOCH;
    let airspace = Airspace::open(
        topology.clone(),
        1,
        now,
        jiff::SignedDuration::from_mins(60),
    );
    let trees = TreeCache::new(1 << 26);
    let tree = Searcher::new(&topology).tree(&topology, destination);
    let mut legs = Vec::new();
    for source in connected.iter().step_by(97) {
        if let Some((next, _)) = tree.next(*source) {
            legs.push((*source, next));
        }
    }
    trees.insert(Arc::new(tree), 1);
    Setting {
        topology,
        airspace,
        trees,
        destination,
        legs,
    }
}

fn request(setting: &Setting, leg: (NodeIx, NodeIx), strategy: Strategy) -> Request {
    Request {
        strategy,
        scope: Scope::Local,
        ..Request::exact(FailureReport {
            failure: FailureType::Navigational,
            leg,
            location: Location::LegStart,
            cause_location: None,
            destination: setting.destination,
            remaining_path: None,
        })
    }
}

#[test]
fn a_search_allocates_nothing() {
    let setting = setting();
    let nothing = RequestClosures::new(&setting.topology);
    let closed = Closed::new(&setting.topology, setting.airspace.closed(), &nothing);
    let tree = Searcher::new(&setting.topology).tree(&setting.topology, setting.destination);
    let mut searcher = Searcher::new(&setting.topology);
    let baselines = [
        Baseline::Dijkstra { full_tree: false },
        Baseline::Dijkstra { full_tree: true },
        Baseline::AStar,
        Baseline::BellmanFord,
    ];
    for &(source, _) in &setting.legs {
        let start = [Start {
            node: source,
            offset_m: 0.0,
        }];
        let exact = measure(|| {
            black_box(searcher.exact(&closed, &start, &tree));
        });
        assert_eq!(exact.count_total, 0, "exact from {source:?}");
        for baseline in baselines {
            let counted = measure(|| {
                black_box(searcher.shortest(&closed, &start, setting.destination, baseline, None));
            });
            assert_eq!(counted.count_total, 0, "{baseline:?} from {source:?}");
        }
    }
}

#[test]
fn an_exact_recomposition_allocates_its_answer_alone() {
    let setting = setting();
    let mut scratch = Scratch::new(&setting.topology);
    for trees in [Some(&setting.trees), None] {
        let world = World {
            airspace: &setting.airspace,
            trees,
        };
        // The first request makes room for the list of ways into the network.
        recompose(
            &world,
            &request(&setting, setting.legs[0], Strategy::Exact),
            &mut scratch,
        );
        for &leg in &setting.legs {
            let request = request(&setting, leg, Strategy::Exact);
            let mut answer = None;
            let counted = measure(|| answer = Some(recompose(&world, &request, &mut scratch)));
            let answer = answer.expect("it was computed");
            if answer.outcome != Outcome::Rerouted {
                continue;
            }
            let path = &answer.path;
            let bytes = size_of::<u32>() * (path.nodes.len() + path.segments.len());
            assert_eq!(
                counted.count_total, 2,
                "the nodes and the segments of the path"
            );
            assert_eq!(counted.bytes_total, bytes as u64, "to the byte");
            let known = Known::default();
            let checked = measure(|| {
                let passed = check_answer(&setting.airspace, &request, &known, &answer, None);
                black_box(passed).expect("it holds");
            });
            assert_eq!(checked.count_total, 0, "the check of an answer");
        }
    }
}

#[test]
fn a_local_recomposition_allocates_its_answer_and_the_record_of_its_repair() {
    let setting = setting();
    let mut scratch = Scratch::new(&setting.topology);
    let world = World {
        airspace: &setting.airspace,
        trees: Some(&setting.trees),
    };
    for strategy in [
        Strategy::TwoPhased,
        Strategy::CellDensity,
        Strategy::Radius,
        Strategy::Dijkstra,
    ] {
        // Lists that are kept between requests find their size.
        for &leg in &setting.legs {
            recompose(&world, &request(&setting, leg, strategy), &mut scratch);
        }
        for &leg in &setting.legs {
            let request = request(&setting, leg, strategy);
            let counted = measure(|| {
                black_box(recompose(&world, &request, &mut scratch));
            });
            let name = strategy.name();
            assert!(
                counted.count_total <= 5,
                "{name}: {} allocations",
                counted.count_total
            );
        }
    }
}

#[test]
fn a_search_with_time_and_battery_allocates_its_plan_alone() {
    let setting = setting();
    let topology: &Topology = &setting.topology;
    let (airframe, rules) = (Airframe::phantom3(), FlightRules::default());
    let legs = FlightLegs::of(topology, &airframe, 0.5, &WindField::default(), &rules);
    let situation = Situation::default();
    let world = FlightWorld {
        topology,
        legs: &legs,
        obstacles: &Obstacles::of(topology, &situation),
        pads: &PadTimes::of(topology, &situation),
        vertical: &Vertical::of(topology, rules.unknown_climb_m),
        crossings: &SharedCrossings::default(),
        rules: &rules,
        charging: airframe.charging(),
    };
    let (objective, destination) = (Objective::Distance, setting.destination);
    let potentials = Potentials::of(&legs, topology.node_count(), destination, objective);
    let mut scratch = ItineraryScratch::new(topology);
    for battery in [0.98, 0.4] {
        let mut counts = Vec::new();
        for &(source, _) in setting.legs.iter().chain(&setting.legs) {
            let start = FlightStart {
                node: source,
                at_s: 0.0,
                battery,
                on_ground: false,
                pad: None,
                flown_m: 0.0,
                drawn: 0.0,
                stretch: None,
            };
            let request = FlightRequest {
                starts: &[start],
                destination,
                objective,
                began_s: 0.0,
                deadline_s: 9_000.0,
                reserve: 0.2,
                closed_segments: &[],
                limits: Limits::THOROUGH,
            };
            let counted = measure(|| {
                black_box(find(&world, &request, &potentials, &mut scratch));
            });
            counts.push(counted.count_total);
        }
        // The second time lists that are kept between requests have found their size.
        let again = &counts[setting.legs.len()..];
        assert!(again.iter().all(|&count| count <= 4), "{again:?}");
    }
}
