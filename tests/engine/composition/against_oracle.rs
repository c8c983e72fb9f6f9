//! Compositions against the naive oracle: lengths are the optimum's, contingencies fly over what is open.

use super::super::oracle::generate::{Draw, closures, generate};
use super::super::oracle::{self, OracleNetwork, Report, shortest};
use super::super::strategies::cases;
use super::{AIRSPEED_MPS, open_airspace, topology_with_pads};
use skyway::airspace::{Airspace, Change, Closure};
use skyway::compose::{Composition, Leg, compose, with_contingencies};
use skyway::network::{NodeIx, SegmentIx, Topology};
use skyway::recompose::{Outcome, Scratch, World};
use skyway::routing::TreeCache;
use std::collections::BTreeSet;
use std::sync::Arc;

const NETWORKS: u64 = 600;

/// A network on both sides, with what is closed on it and a delivery.
struct Case {
    seed: u64,
    network: OracleNetwork,
    topology: Arc<Topology>,
    open: Airspace,
    airspace: Airspace,
    closed_nodes: BTreeSet<usize>,
    closed_segments: BTreeSet<usize>,
    source: usize,
    destination: usize,
}

/// What the cases came to, so that none of it is missed.
#[derive(Debug, Default)]
struct Seen {
    rejoined_early: usize,
    diverted: usize,
    no_route: usize,
    safe_elsewhere: usize,
}

impl Case {
    fn draw(seed: u64) -> Self {
        let (_, network) = generate(seed);
        let mut draw = Draw::new(seed ^ 0xc0de);
        let shares = [(0.0, 0.0), (0.05, 0.05), (0.2, 0.15)][(seed / 7 % 3) as usize];
        let closed = closures(&mut draw, &network, shares.0, shares.1);
        let (source, destination) = (
            draw.below(network.nodes.len()),
            draw.below(network.nodes.len()),
        );
        let topology = Arc::new(topology_with_pads(&network, &[]));
        let node = |index: usize| -> NodeIx {
            let found = topology.node(&network.nodes[index].id);
            found.expect("same nodes")
        };
        let segment = |index: &usize| -> SegmentIx {
            let ends = &network.segments[*index];
            let found = topology.segment_between(node(ends.a), node(ends.b));
            found.expect("same segments")
        };
        let closure = Closure::of_operator(
            "closed".to_owned(),
            "drawn".to_owned(),
            closed.nodes.iter().map(|&index| node(index)).collect(),
            closed.segments.iter().map(segment).collect(),
        );
        let open = open_airspace(&topology);
        let airspace = open.apply(&[Change::Put(Arc::new(closure))], open.as_of());
        Self {
            seed,
            topology: topology.clone(),
            open,
            airspace,
            closed_nodes: closed.nodes,
            closed_segments: closed.segments,
            source,
            destination,
            network,
        }
    }

    fn node(&self, index: usize) -> NodeIx {
        let found = self.topology.node(&self.network.nodes[index].id);
        found.expect("same nodes")
    }

    fn index(&self, node: NodeIx) -> usize {
        let id = self.topology.node_id(node);
        let place = self.network.nodes.iter().position(|node| node.id == id);
        place.expect("same nodes")
    }

    fn indices(&self, nodes: &[NodeIx]) -> Vec<usize> {
        nodes.iter().map(|&node| self.index(node)).collect()
    }

    /// The world before a failure, and with the leg closed.
    fn worlds(&self, failed: (usize, usize)) -> (oracle::World<'_>, oracle::World<'_>) {
        let report = Report {
            network: &self.network,
            standing_closed_nodes: self.closed_nodes.clone(),
            standing_closed_segments: self.closed_segments.clone(),
            failed,
            destination: self.destination,
        };
        (report.world_before(), report.world_now())
    }

    /// The way to the nearest open node with pads, in metres.
    fn nearest_safe_m(&self, world: &oracle::World<'_>, from: usize) -> Option<f64> {
        let nodes = 0..self.network.nodes.len();
        let safe = nodes
            .filter(|node| self.network.nodes[*node].pads > 0 && !self.closed_nodes.contains(node));
        let lengths_m = safe.filter_map(|node| shortest(world, from, node, None));
        lengths_m
            .map(|(length_m, _)| length_m)
            .min_by(f64::total_cmp)
    }

    #[track_caller]
    fn assert_close(&self, ours_m: Option<f64>, oracle_m: Option<f64>, what: &str) {
        let same = match (ours_m, oracle_m) {
            (Some(ours_m), Some(oracle_m)) => {
                (ours_m - oracle_m).abs() <= 1e-9 * oracle_m.abs().max(1_000.0)
            }
            (None, None) => true,
            _ => false,
        };
        assert!(
            same,
            "seed {}, {what}: {ours_m:?} m against the oracle's {oracle_m:?} m; closed nodes {:?}, closed segments {:?}, {} to {}",
            self.seed, self.closed_nodes, self.closed_segments, self.source, self.destination
        );
    }

    /// Every leg of a plan, in the world with closures.
    fn check_legs(&self, plan: &Composition, seen: &mut Seen) {
        for (place, leg) in plan.legs.iter().enumerate() {
            self.check_detour(plan, place, leg, seen);
            self.check_alternate(leg, seen);
        }
    }

    fn check_detour(&self, plan: &Composition, place: usize, leg: &Leg, seen: &mut Seen) {
        let from = self.index(leg.from);
        let (_, world) = self.worlds((from, self.index(leg.to)));
        let what = format!("detour of leg {place}");
        let detour = leg.if_closed.as_ref().expect("worked out");
        let best_m = shortest(&world, from, self.destination, None).map(|(length_m, _)| length_m);
        let found = detour.outcome == Outcome::Rerouted;
        assert_eq!(found, best_m.is_some(), "seed {}, {what}", self.seed);
        let mut route = self.indices(&detour.nodes);
        let Some(rejoins) = detour.rejoins else {
            let safe_m = self.nearest_safe_m(&world, from);
            self.assert_close(detour.remaining_length_m, best_m.or(safe_m), &what);
            let flown_m = world.path_length_m(&route).filter(|_| !route.is_empty());
            self.assert_close(flown_m, safe_m, &what);
            seen.diverted += usize::from(detour.outcome == Outcome::Diverted);
            seen.no_route += usize::from(detour.outcome == Outcome::NoRoute);
            return;
        };
        // No shortest way comes to a node twice, so the place to go on from is the only one.
        let nodes = &plan.way.nodes;
        let joined = nodes.iter().rposition(|&node| node == rejoins);
        let joined = joined.expect("it meets the plan on the plan");
        assert!(
            joined > place && detour.nodes.last() == Some(&rejoins),
            "seed {}, {what}",
            self.seed
        );
        if let [.., before, _] = detour.nodes[..] {
            assert_ne!(
                before,
                nodes[joined - 1],
                "seed {}, {what} rejoins too late",
                self.seed
            );
        }
        route.extend(self.indices(&nodes[joined + 1..]));
        let flown_m = world.path_length_m(&route);
        self.assert_close(flown_m, best_m, &format!("{what}, flown"));
        self.assert_close(detour.remaining_length_m, best_m, &what);
        let rest_m: f64 = plan.legs[place..].iter().map(|leg| leg.length_m).sum();
        let extra_m = best_m.map(|best_m| best_m - rest_m);
        self.assert_close(detour.extra_m, extra_m, &format!("{what}, extra"));
        seen.rejoined_early += usize::from(joined + 1 < nodes.len());
    }

    fn check_alternate(&self, leg: &Leg, seen: &mut Seen) {
        let from = self.index(leg.from);
        let (world, _) = self.worlds((from, self.index(leg.to)));
        let nearest_m = self.nearest_safe_m(&world, from);
        let length_m = leg.safe.as_ref().map(|safe| safe.length_m);
        if self.closed_nodes.contains(&from) {
            // Out of a closed node a drone flies its leg on, where that is open, rather than any other.
            let (ours_m, nearest_m) = (
                length_m.unwrap_or(f64::INFINITY),
                nearest_m.unwrap_or(f64::INFINITY),
            );
            assert!(ours_m >= nearest_m * (1.0 - 1e-12), "seed {}", self.seed);
        } else {
            self.assert_close(length_m, nearest_m, "alternate");
        }
        let Some(safe) = &leg.safe else { return };
        assert_eq!(
            (safe.nodes.first(), safe.nodes.last()),
            (Some(&leg.from), Some(&safe.node))
        );
        assert!(self.topology.pads(safe.node) > 0, "seed {}", self.seed);
        let flown_m = world.path_length_m(&self.indices(&safe.nodes));
        self.assert_close(Some(safe.length_m), flown_m, "way to the alternate");
        seen.safe_elsewhere += usize::from(safe.nodes.len() > 1);
    }
}

#[test]
fn plans_and_their_contingencies_agree_with_the_oracle() {
    let mut seen = Seen::default();
    for seed in 0..NETWORKS * cases() {
        let case = Case::draw(seed);
        let mut scratch = Scratch::new(&case.topology);
        let tables = TreeCache::new(1 << 20);
        let world = World {
            airspace: &case.airspace,
            trees: (seed % 2 == 0).then_some(&tables),
        };
        let (source, destination) = (case.node(case.source), case.node(case.destination));
        let plan = compose(&world, source, destination, AIRSPEED_MPS, &mut scratch);
        let (before, _) = case.worlds((case.source, case.source));
        let best = shortest(&before, case.source, case.destination, None);
        let length_m = plan.as_ref().map(|plan| plan.length_m);
        case.assert_close(length_m, best.map(|(length_m, _)| length_m), "plan");
        if let Some(plan) = plan {
            let way = case.indices(&plan.way.nodes);
            case.assert_close(before.path_length_m(&way), length_m, "way");
            case.check_legs(&plan, &mut seen);
        }
    }
    assert!(seen.rejoined_early > 200, "{seen:?}");
    assert!(seen.diverted > 100 && seen.no_route > 10, "{seen:?}");
    assert!(seen.safe_elsewhere > 100, "{seen:?}");
}

/// A plan made before the closures: legs of it are closed, and detours lead around those too.
#[test]
fn a_plan_that_closures_have_hit_is_equipped_all_the_same() {
    let mut seen = Seen::default();
    for seed in 0..NETWORKS * cases() {
        let case = Case::draw(seed ^ 0xff_0000);
        let mut scratch = Scratch::new(&case.topology);
        let tables = TreeCache::new(1 << 20);
        let trees = (seed % 2 == 0).then_some(&tables);
        let world = |airspace| World { airspace, trees };
        let (source, destination) = (case.node(case.source), case.node(case.destination));
        let composed = compose(
            &world(&case.open),
            source,
            destination,
            AIRSPEED_MPS,
            &mut scratch,
        );
        let Some(Composition { way, .. }) = composed else {
            continue;
        };
        let now = world(&case.airspace);
        let plan = with_contingencies(
            &now,
            way.clone(),
            0.0,
            destination,
            AIRSPEED_MPS,
            &mut scratch,
        );
        assert_eq!(plan.way, way, "seed {}", case.seed);
        case.check_legs(&plan, &mut seen);
    }
    assert!(seen.rejoined_early > 200 && seen.diverted > 100, "{seen:?}");
}
