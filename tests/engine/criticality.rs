//! Criticality against the plain way: take everything out in turn and search again.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway::network::{NodeIx, Topology};
use skyway::routing::{Cost, Demand, Fleet, criticality, uniform_demand};

/// What is taken out.
#[derive(Clone, Copy, PartialEq)]
enum Out {
    Nothing,
    Segment(u32),
    Node(u32),
    Pads(u32),
}

/// All distances by Floyd and Warshall; infinite without a way.
fn distances(nodes: usize, edges: &[(usize, usize, f64)], passable: &[bool]) -> Vec<Vec<f64>> {
    let mut table = vec![vec![f64::INFINITY; nodes]; nodes];
    for &(one, other, length) in edges {
        table[one][other] = table[one][other].min(length);
        table[other][one] = table[one][other];
    }
    for (node, row) in table.iter_mut().enumerate() {
        row[node] = 0.0;
    }
    for through in (0..nodes).filter(|&node| passable[node]) {
        for from in 0..nodes {
            for to in 0..nodes {
                let length = table[from][through] + table[through][to];
                table[from][to] = table[from][to].min(length);
            }
        }
    }
    table
}

fn metres(topology: &Topology, out: Out) -> Vec<Vec<f64>> {
    let edges: Vec<(usize, usize, f64)> = topology
        .segments()
        .filter(|segment| out != Out::Segment(segment.0))
        .map(|segment| topology.segment(segment))
        .filter(|ends| out != Out::Node(ends.from.0) && out != Out::Node(ends.to.0))
        .map(|ends| (ends.from.at(), ends.to.at(), ends.length_m))
        .collect();
    let nodes = topology.node_count();
    distances(nodes, &edges, &vec![true; nodes])
}

fn minutes(topology: &Topology, fleet: &Fleet, out: Out) -> Vec<Vec<f64>> {
    let metres = metres(topology, Out::Nothing);
    let nodes = topology.node_count();
    let mut edges = Vec::new();
    for (from, row) in metres.iter().enumerate() {
        for (to, &length_m) in row.iter().enumerate().skip(from + 1) {
            if length_m <= fleet.range_m {
                let flying = length_m / (60.0 * fleet.speed_mps);
                edges.push((from, to, flying + fleet.stop_minutes));
            }
        }
    }
    let has_pads = |node: NodeIx| topology.pads(node) > 0 && out != Out::Pads(node.0);
    let passable: Vec<bool> = topology.nodes().map(has_pads).collect();
    distances(nodes, &edges, &passable)
}

/// What taking something out costs, from the two tables of distances.
fn cost(demand: &[Demand], before: &[Vec<f64>], after: &[Vec<f64>], out: Out) -> [f64; 4] {
    let [mut lost, mut diverted, mut grounded, mut extra] = [0.0; 4];
    for demand in demand {
        let (from, to) = (demand.from.at(), demand.to.at());
        if before[from][to].is_infinite() {
            continue;
        }
        if out == Out::Node(demand.to.0) {
            diverted += demand.deliveries;
        } else if out == Out::Node(demand.from.0) {
            grounded += demand.deliveries;
        } else if after[from][to].is_infinite() {
            lost += demand.deliveries;
        } else {
            extra += demand.deliveries * (after[from][to] - before[from][to]);
        }
    }
    [lost, diverted, grounded, extra]
}

fn agree(found: &Cost, extra: f64, expected: [f64; 4]) -> bool {
    let near = |one: f64, other: f64| (one - other).abs() <= 1e-6 * other.abs().max(1.0);
    let found = [found.lost, found.diverted, found.grounded, extra];
    found
        .into_iter()
        .zip(expected)
        .all(|(one, other)| near(one, other))
}

/// A network of few nodes and segments, some parts of which hang together by one segment or not at all.
fn network(random: &mut ChaCha8Rng) -> Topology {
    let mut below = |limit: u32| random.next_u32() % limit;
    let count = 4 + below(9) as usize;
    let nodes: Vec<(f64, f64, u16)> = (0..count)
        .map(|_| {
            let place = [below(1_000_000), below(1_000_000)].map(|steps| f64::from(steps) / 1e3);
            (place[0], place[1], below(3) as u16)
        })
        .collect();
    let mut ends: Vec<(usize, usize)> = (0..3 + below(23))
        .map(|_| (below(count as u32) as usize, below(count as u32) as usize))
        .filter(|(one, other)| one < other)
        .collect();
    ends.sort_unstable();
    ends.dedup();
    topology(&nodes, &ends)
}

fn topology(nodes: &[(f64, f64, u16)], ends: &[(usize, usize)]) -> Topology {
    let points = nodes.iter().enumerate().map(|(id, (x, y, pads))| {
        format!(
            r#"{{"type":"Feature","id":{id},"geometry":{{"type":"Point","coordinates":[{x},{y}]}},"properties":{{"kind":"node","pads":{pads}}}}}"#
        )
    });
    let lines = ends.iter().map(|&(from, to)| {
        let ((ax, ay, _), (bx, by, _)) = (nodes[from], nodes[to]);
        format!(
            r#"{{"type":"Feature","geometry":{{"type":"LineString","coordinates":[[{ax},{ay}],[{bx},{by}]]}},"properties":{{"kind":"segment","from":{from},"to":{to}}}}}"#
        )
    });
    let features: Vec<String> = points.chain(lines).collect();
    let text = format!(
        r#"{{"type":"FeatureCollection","skyway":{{"format":1,"coordinates":"planar"}},"features":[{}]}}"#,
        features.join(",")
    );
    skyway::formats::load_network(&text)
        .expect("a network")
        .topology
}

fn demand(topology: &Topology, random: &mut ChaCha8Rng) -> Vec<Demand> {
    let mut demand = uniform_demand(topology);
    for one in &mut demand {
        one.deliveries = f64::from(1 + random.next_u32() % 8) / 2.0;
    }
    demand
}

#[test]
fn every_failure_costs_what_searching_again_says() {
    for seed in 0..400 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let topology = network(&mut random);
        let demand = demand(&topology, &mut random);
        let fleet = Fleet {
            range_m: f64::from(200 + random.next_u32() % 1_300),
            speed_mps: 10.0,
            stop_minutes: 2.0,
        };
        let found = criticality(&topology, &demand, &fleet);
        let before = metres(&topology, Out::Nothing);
        let check = |out: Out, cost: &Cost, extra: f64, before: &[Vec<f64>], after: &[Vec<f64>]| {
            let expected = self::cost(&demand, before, after, out);
            assert!(
                agree(cost, extra, expected),
                "seed {seed}: {cost:?} {expected:?}"
            );
        };
        for segment in topology.segments() {
            let (out, cost) = (Out::Segment(segment.0), &found.segments[segment.at()]);
            check(out, cost, cost.extra_m, &before, &metres(&topology, out));
        }
        let quickest = minutes(&topology, &fleet, Out::Nothing);
        for node in topology.nodes() {
            let (out, cost) = (Out::Node(node.0), &found.nodes[node.at()]);
            check(out, cost, cost.extra_m, &before, &metres(&topology, out));
            let (out, cost) = (Out::Pads(node.0), &found.pads[node.at()]);
            let after = minutes(&topology, &fleet, out);
            check(out, cost, cost.extra_minutes, &quickest, &after);
        }
    }
}
