//! The engine against the naive oracle: area, stage, searches and lengths agree node for node, on any network.

use super::oracle::generate::{Draw, closures, failed_leg, generate};
use super::oracle::{self, OracleAnswer, OracleNetwork, Report};
use skyway::airspace::{Airspace, Change, Closure};
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology};
use skyway::recompose::{
    CellArea, Outcome, Parameters, Recomposition, Request, Scope, Scratch, Strategy, World,
    recompose,
};
use skyway::routing::{Baseline, TreeCache};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Networks per run; `SKYWAY_CASES` multiplies it.
const NETWORKS: u64 = 1_500;

/// A network on both sides, with what is closed on it.
struct Case {
    seed: u64,
    network: OracleNetwork,
    topology: Arc<Topology>,
    airspace: Airspace,
    closed_nodes: BTreeSet<usize>,
    closed_segments: BTreeSet<usize>,
    leg: (usize, usize),
    destination: usize,
}

pub(crate) fn cases() -> u64 {
    let factor = std::env::var("SKYWAY_CASES").ok();
    factor.and_then(|factor| factor.parse().ok()).unwrap_or(1)
}

pub(crate) fn topology_of(network: &OracleNetwork) -> Topology {
    let draft = NetworkDraft {
        nodes: network
            .nodes
            .iter()
            .map(|node| NodeDraft {
                id: node.id.clone(),
                position: [node.x, node.y],
                ..NodeDraft::default()
            })
            .collect(),
        segments: network
            .segments
            .iter()
            .map(|segment| SegmentDraft {
                from: network.nodes[segment.a].id.clone(),
                to: network.nodes[segment.b].id.clone(),
                length_m: Some(segment.length_m),
                ..SegmentDraft::default()
            })
            .collect(),
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("a generated network is valid")
}

impl Case {
    fn draw(seed: u64) -> Option<Self> {
        let (_, network) = generate(seed);
        let mut draw = Draw::new(seed ^ 0x5eed);
        let shares = [(0.0, 0.0), (0.1, 0.1), (0.25, 0.2)][(seed / 7 % 3) as usize];
        let closed = closures(&mut draw, &network, shares.0, shares.1);
        let leg = failed_leg(&mut draw, &network);
        let destination = draw.below(network.nodes.len());
        let topology = Arc::new(topology_of(&network));
        let node = |index: &usize| {
            topology
                .node(&network.nodes[*index].id)
                .expect("same nodes")
        };
        let segment = |index: &usize| segment_of(&topology, &network, *index);
        let closure = Closure::of_operator(
            "closed".to_owned(),
            "drawn".to_owned(),
            closed.nodes.iter().map(node).collect(),
            closed.segments.iter().map(segment).collect(),
        );
        let now = jiff::Timestamp::UNIX_EPOCH;
        let open = Airspace::open(
            topology.clone(),
            1,
            now,
            jiff::SignedDuration::from_mins(60),
        );
        let airspace = open.apply(&[Change::Put(Arc::new(closure))], now);
        Some(Self {
            seed,
            topology: topology.clone(),
            airspace,
            closed_nodes: closed.nodes,
            closed_segments: closed.segments,
            leg,
            destination,
            network,
        })
    }

    fn node(&self, index: usize) -> NodeIx {
        let id = &self.network.nodes[index].id;
        self.topology.node(id).expect("same nodes")
    }

    fn report(&self) -> Report<'_> {
        Report {
            network: &self.network,
            standing_closed_nodes: self.closed_nodes.clone(),
            standing_closed_segments: self.closed_segments.clone(),
            failed: self.leg,
            destination: self.destination,
        }
    }

    fn request(&self, plan: Option<&[usize]>, strategy: Strategy) -> Request {
        let nodes = |plan: &[usize]| plan.iter().map(|&index| self.node(index)).collect();
        Request {
            strategy,
            optimum: true,
            explain: true,
            ..Request::exact(FailureReport {
                failure: FailureType::Navigational,
                leg: (self.node(self.leg.0), self.node(self.leg.1)),
                location: Location::LegStart,
                cause_location: None,
                destination: self.node(self.destination),
                remaining_path: plan.map(nodes),
            })
        }
    }

    /// What to print when something differs: the case as data.
    fn describe(&self, what: &str) -> String {
        let nodes: Vec<String> = self
            .network
            .nodes
            .iter()
            .map(|node| format!("{} ({}, {})", node.id, node.x, node.y))
            .collect();
        let segments: Vec<String> = self
            .network
            .segments
            .iter()
            .map(|segment| format!("{}-{} {}", segment.a, segment.b, segment.length_m))
            .collect();
        format!(
            "{what}, seed {}: nodes {nodes:?}, segments by place {segments:?}, closed nodes {:?}, closed segments {:?}, leg {:?}, destination {}",
            self.seed, self.closed_nodes, self.closed_segments, self.leg, self.destination
        )
    }

    /// The path is a walk in the network over what is open, as long as it claims to be.
    fn assert_flyable(&self, answer: &Recomposition, what: &str) {
        let way = &answer.path;
        assert_eq!(
            way.nodes.len(),
            way.segments.len() + 1,
            "{}",
            self.describe(what)
        );
        let mut length_m = 0.0;
        for (place, &segment) in way.segments.iter().enumerate() {
            let (from, to) = (way.nodes[place], way.nodes[place + 1]);
            let ends = self.topology.segment(segment);
            let joins = (ends.from, ends.to) == (from, to) || (ends.from, ends.to) == (to, from);
            assert!(joins, "{}", self.describe(what));
            let closed = self.airspace.closed();
            let failed = self
                .topology
                .segment_between(self.node(self.leg.0), self.node(self.leg.1));
            let is_open = !closed.closes_segment(segment)
                && !closed.closes_node(to)
                && (place == 0 || !closed.closes_node(from))
                && Some(segment) != failed;
            assert!(is_open, "crosses something closed: {}", self.describe(what));
            length_m += ends.length_m;
        }
        assert_close(answer.remaining_length_m, Some(length_m), &|| {
            self.describe(what)
        });
    }
}

fn segment_of(topology: &Topology, network: &OracleNetwork, index: usize) -> SegmentIx {
    let segment = &network.segments[index];
    let node = |index: usize| topology.node(&network.nodes[index].id).expect("same nodes");
    topology
        .segment_between(node(segment.a), node(segment.b))
        .expect("same segments")
}

fn assert_close(ours_m: Option<f64>, oracle_m: Option<f64>, describe: &dyn Fn() -> String) {
    let same = match (ours_m, oracle_m) {
        (Some(ours_m), Some(oracle_m)) => (ours_m - oracle_m).abs() <= 1e-9 * oracle_m.max(1.0),
        (None, None) => true,
        _ => false,
    };
    assert!(
        same,
        "{ours_m:?} m against the oracle's {oracle_m:?} m: {}",
        describe()
    );
}

fn compare(case: &Case, what: &str, ours: &Recomposition, oracle: &OracleAnswer) {
    let describe = || case.describe(what);
    let found = matches!(ours.outcome, Outcome::Rerouted | Outcome::Unaffected);
    assert_eq!(found, oracle.path.is_some(), "{}", describe());
    assert_close(
        ours.remaining_length_m,
        oracle.remaining_length_m,
        &describe,
    );
    assert_close(
        ours.recomposed_length_m,
        oracle.recomposed_length_m,
        &describe,
    );
    let stage = serde_json::to_value(ours.stage).expect("a stage has a name");
    let figures = (
        stage.as_str().unwrap_or_default(),
        ours.searches as usize,
        ours.area_nodes,
        ours.area_segments,
    );
    let oracle_figures = (
        oracle.stage,
        oracle.searches,
        oracle.area.len(),
        oracle.area_segments,
    );
    assert_eq!(
        figures,
        oracle_figures,
        "stage, searches, area nodes and segments: {}",
        describe()
    );
    let used_exact = ours.strategy_used == Strategy::Exact;
    assert_eq!(
        used_exact,
        oracle.strategy_used == oracle::Strategy::Exact,
        "{}",
        describe()
    );
    if found {
        case.assert_flyable(ours, what);
    }
    if let (Some(last), [only]) = (ours.stages.last(), oracle.repairs.as_slice()) {
        let ids = |nodes: &[NodeIx]| -> BTreeSet<String> {
            nodes
                .iter()
                .map(|&node| case.topology.node_id(node).to_owned())
                .collect()
        };
        let oracle_ids = only
            .answer
            .area
            .iter()
            .map(|&node| case.network.nodes[node].id.clone());
        assert_eq!(
            ids(&last.nodes),
            oracle_ids.collect(),
            "last area: {}",
            describe()
        );
        let ours: Vec<(String, bool, usize, bool)> = ours
            .stages
            .iter()
            .map(|stage| {
                let name = serde_json::to_value(stage.stage).expect("a stage has a name");
                (
                    name.as_str().unwrap_or_default().to_owned(),
                    stage.skipped,
                    stage.nodes.len(),
                    stage.path_found,
                )
            })
            .collect();
        let oracle: Vec<(String, bool, usize, bool)> = only
            .answer
            .stages
            .iter()
            .map(|stage| {
                (
                    stage.stage.to_owned(),
                    stage.skipped,
                    stage.nodes.len(),
                    stage.path_found,
                )
            })
            .collect();
        assert_eq!(ours, oracle, "stages: {}", describe());
    }
}

fn strategies(seed: u64) -> Vec<(Strategy, Scope, Parameters, oracle::Strategy)> {
    let plain = Parameters::default();
    let val_ratio = [0.5, 0.2, 1.0, 0.05][(seed % 4) as usize];
    let stage_skipping = !seed.is_multiple_of(5);
    let cell_m = [None, Some(90.0), Some(250.0)][(seed % 3) as usize];
    let inside = match seed % 2 {
        0 => Baseline::AStar,
        _ => Baseline::Dijkstra { full_tree: false },
    };
    let two_phased = Parameters {
        val_ratio,
        stage_skipping,
        inside,
        ..plain
    };
    let cell_area = [CellArea::Squares, CellArea::Slices][(seed % 2) as usize];
    let cells = Parameters {
        cell_size_m: cell_m,
        cell_area,
        inside,
        ..plain
    };
    let full_tree = Parameters {
        full_tree: true,
        ..plain
    };
    let (local, global) = (Scope::Local, Scope::Global);
    vec![
        (Strategy::Exact, global, plain, oracle::Strategy::Exact),
        (Strategy::Radius, global, plain, oracle::Strategy::Radius),
        (
            Strategy::CellDensity,
            global,
            cells,
            oracle::Strategy::CellDensity {
                cell_m,
                slices: cell_area == CellArea::Slices,
            },
        ),
        (
            Strategy::TwoPhased,
            global,
            two_phased,
            oracle::Strategy::TwoPhased {
                val_ratio,
                stage_skipping,
            },
        ),
        (
            Strategy::Dijkstra,
            local,
            plain,
            oracle::Strategy::LocalBaseline,
        ),
        (
            Strategy::Astar,
            local,
            plain,
            oracle::Strategy::LocalBaseline,
        ),
        (
            Strategy::BellmanFord,
            local,
            plain,
            oracle::Strategy::LocalBaseline,
        ),
        (
            Strategy::Dijkstra,
            global,
            full_tree,
            oracle::Strategy::GlobalBaseline,
        ),
        (
            Strategy::Astar,
            global,
            plain,
            oracle::Strategy::GlobalBaseline,
        ),
        (
            Strategy::BellmanFord,
            global,
            plain,
            oracle::Strategy::GlobalBaseline,
        ),
    ]
}

#[test]
fn every_strategy_agrees_with_the_oracle_node_for_node() {
    let mut with_path = 0;
    let mut stages = BTreeSet::new();
    for seed in 0..NETWORKS * cases() {
        let Some(case) = Case::draw(seed) else {
            continue;
        };
        let mut scratch = Scratch::new(&case.topology);
        let trees = TreeCache::new(1 << 20);
        if seed % 2 == 0 {
            let tree = scratch
                .searcher()
                .tree(&case.topology, case.node(case.destination));
            trees.insert(Arc::new(tree), 1);
        }
        let world = World {
            airspace: &case.airspace,
            trees: Some(&trees),
        };
        let plan = oracle::old_plan(&case.report());
        for (strategy, scope, parameters, oracle_strategy) in strategies(seed) {
            let request = Request {
                scope,
                parameters,
                ..case.request(plan.as_deref(), strategy)
            };
            let ours = recompose(&world, &request, &mut scratch);
            let theirs = oracle::recompose(&case.report(), plan.clone(), oracle_strategy);
            let what = format!("{} ({scope:?})", strategy.name());
            compare(&case, &what, &ours, &theirs);
            assert_close(ours.global_optimum_m, theirs.global_optimum_m, &|| {
                case.describe("global optimum")
            });
            with_path += usize::from(theirs.path.is_some());
            stages.insert((strategy.name(), theirs.stage));
        }
    }
    assert!(with_path > 1_000, "only {with_path} answers had a path");
    for reached in [
        ("radius", "circle"),
        ("radius", "global"),
        ("cell_density", "cells"),
        ("two_phased", "triangle"),
        ("two_phased", "rhombus"),
        ("two_phased", "rectangle"),
        ("two_phased", "grown"),
        ("two_phased", "global"),
    ] {
        assert!(stages.contains(&reached), "no case reached {reached:?}");
    }
}

#[test]
fn without_a_stated_plan_the_exact_answer_is_still_the_optimum() {
    for seed in 0..NETWORKS * cases() {
        let Some(case) = Case::draw(seed) else {
            continue;
        };
        let mut scratch = Scratch::new(&case.topology);
        let world = World {
            airspace: &case.airspace,
            trees: None,
        };
        for strategy in [
            Strategy::Exact,
            Strategy::TwoPhased,
            Strategy::Radius,
            Strategy::CellDensity,
        ] {
            let ours = recompose(&world, &case.request(None, strategy), &mut scratch);
            let theirs = oracle::recompose(&case.report(), None, oracle::Strategy::Exact);
            let what = format!("{} without a plan", strategy.name());
            assert_close(ours.remaining_optimum_m, theirs.remaining_length_m, &|| {
                case.describe(&what)
            });
            match strategy {
                Strategy::Exact => compare(&case, &what, &ours, &theirs),
                _ => assert!(
                    ours.remaining_length_m.unwrap_or(f64::INFINITY)
                        >= theirs.remaining_length_m.unwrap_or(f64::INFINITY) * (1.0 - 1e-12),
                    "a local strategy beats the optimum: {}",
                    case.describe(&what)
                ),
            }
        }
    }
}
