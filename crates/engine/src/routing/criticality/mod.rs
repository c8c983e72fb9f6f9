//! What each segment, node and pad of a network costs the deliveries that are asked for if it fails.
//!
//! Exact, for one failure at a time and routes without a clock. Segments and nodes are measured on shortest
//! routes; pads on the quickest routes whose stretches between pads are no longer than the drones' range.

mod replacement;

use crate::network::{NodeIx, Topology};
use replacement::{Edge, Graph, Replacements, Tree};
use std::collections::BTreeMap;

/// Deliveries that are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Where they begin.
    pub from: NodeIx,
    /// Where they go.
    pub to: NodeIx,
    /// How many there are.
    pub deliveries: f64,
}

/// The drones that fly them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fleet {
    /// The longest stretch between two pads, in metres.
    pub range_m: f64,
    /// Speed over ground, in metres per second.
    pub speed_mps: f64,
    /// What a stop at a pad takes, in minutes.
    pub stop_minutes: f64,
}

/// What a failure costs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Deliveries whose route leads through it and that have another.
    pub rerouted: f64,
    /// Deliveries to it, which have to land elsewhere.
    pub diverted: f64,
    /// Deliveries from it, which cannot begin.
    pub grounded: f64,
    /// Deliveries between others that have no other route.
    pub lost: f64,
    /// What the rerouted fly more, in metres; 0 for pads, where time decides.
    pub extra_m: f64,
    /// What the rerouted take longer, in minutes.
    pub extra_minutes: f64,
}

/// What every failure costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Criticality {
    /// All deliveries that are asked for.
    pub deliveries: f64,
    /// Of these, those without a route on the intact network.
    pub without_route: f64,
    /// Of these, those without a route within the range, all pads being there.
    pub out_of_range: f64,
    /// What all routes measure on the intact network, in metres.
    pub total_m: f64,
    /// By segment.
    pub segments: Vec<Cost>,
    /// By node.
    pub nodes: Vec<Cost>,
    /// By node: the loss of all its pads, which leaves it to be flown over and landed at.
    pub pads: Vec<Cost>,
}

/// One delivery from every node to every other.
pub fn uniform_demand(topology: &Topology) -> Vec<Demand> {
    let from_all = topology.nodes().flat_map(|from| {
        let others = topology.nodes().filter(move |&to| to != from);
        others.map(move |to| Demand {
            from,
            to,
            deliveries: 1.0,
        })
    });
    from_all.collect()
}

/// Measures every failure, by one search from each node that deliveries begin or end at.
///
/// Memory grows with the number of such nodes times that of all nodes.
pub fn criticality(topology: &Topology, demand: &[Demand], fleet: &Fleet) -> Criticality {
    let pairs = Pairs::of(demand);
    let nodes = topology.node_count();
    let mut found = Criticality {
        // A sum of no numbers is -0.
        deliveries: demand.iter().fold(0.0, |sum, one| sum + one.deliveries),
        without_route: 0.0,
        out_of_range: 0.0,
        total_m: 0.0,
        segments: vec![Cost::default(); topology.segment_count()],
        nodes: vec![Cost::default(); nodes],
        pads: vec![Cost::default(); nodes],
    };
    let network = network_graph(topology);
    let trees = pairs.trees(&network);
    let mut ways = Replacements::new(nodes);
    let minutes_per_m = 1.0 / (60.0 * fleet.speed_mps);
    for (ends, both) in &pairs.0 {
        let (from, to) = (&trees[&ends.0], &trees[&ends.1]);
        if !ways.follow(from, to) {
            found.without_route += both.all();
            continue;
        }
        ways.work_out(&network, from, to);
        let length_m = from.distance(ends.1);
        found.total_m += both.all() * length_m;
        let cost = |without_m: f64| both.cost(without_m - length_m, minutes_per_m);
        for (&segment, &without_m) in ways.edges.iter().zip(&ways.without_edge) {
            found.segments[segment as usize].add(cost(without_m));
        }
        for (&node, &without_m) in inner(&ways.nodes).iter().zip(inner(&ways.without_node)) {
            found.nodes[node as usize].add(cost(without_m));
        }
        let ended = |grounded: f64, diverted: f64| Cost {
            grounded,
            diverted,
            ..Cost::default()
        };
        found.nodes[ends.0 as usize].add(ended(both.there, both.back));
        found.nodes[ends.1 as usize].add(ended(both.back, both.there));
    }
    measure_pads(topology, &network, &pairs, fleet, &mut found);
    found
}

fn measure_pads(
    topology: &Topology,
    network: &Graph,
    pairs: &Pairs,
    fleet: &Fleet,
    found: &mut Criticality,
) {
    let stretches = pad_graph(topology, network, pairs, fleet);
    let trees = pairs.trees(&stretches);
    let mut ways = Replacements::new(topology.node_count());
    for (ends, both) in &pairs.0 {
        let (from, to) = (&trees[&ends.0], &trees[&ends.1]);
        if !ways.follow(from, to) {
            found.out_of_range += both.all();
            continue;
        }
        // Within range of each other they need no pad.
        if ways.edges.len() == 1 {
            continue;
        }
        ways.work_out(&stretches, from, to);
        let minutes = from.distance(ends.1);
        for (&node, &without) in inner(&ways.nodes).iter().zip(inner(&ways.without_node)) {
            let mut cost = both.cost(without - minutes, 1.0);
            cost.extra_m = 0.0;
            found.pads[node as usize].add(cost);
        }
    }
    found.out_of_range -= found.without_route;
}

/// All but the first and the last.
fn inner<T>(way: &[T]) -> &[T] {
    way.get(1..way.len() - 1).unwrap_or_default()
}

/// The network itself, every node of which can be flown through.
fn network_graph(topology: &Topology) -> Graph {
    let edges = topology.segments().map(|segment| {
        let segment = topology.segment(segment);
        Edge {
            ends: (segment.from.0, segment.to.0),
            length: segment.length_m,
        }
    });
    Graph::new(edges.collect(), vec![true; topology.node_count()])
}

/// Stretches within range between pads and the ends of deliveries, in minutes with the stop after each.
fn pad_graph(topology: &Topology, network: &Graph, pairs: &Pairs, fleet: &Fleet) -> Graph {
    let has_pads: Vec<bool> = topology
        .nodes()
        .map(|node| topology.pads(node) > 0)
        .collect();
    let ends = pairs.ends();
    let is_stop = |node: u32| has_pads[node as usize] || ends.binary_search(&node).is_ok();
    let nodes = topology.node_count() as u32;
    let mut edges = Vec::new();
    for from in (0..nodes).filter(|&node| is_stop(node)) {
        let tree = network.tree(from);
        for to in (from + 1..nodes).filter(|&node| is_stop(node)) {
            let length_m = tree.distance(to);
            if length_m <= fleet.range_m {
                edges.push(Edge {
                    ends: (from, to),
                    length: length_m / (60.0 * fleet.speed_mps) + fleet.stop_minutes,
                });
            }
        }
    }
    Graph::new(edges, has_pads)
}

/// Deliveries between two nodes: those from the first to the second, and those back.
#[derive(Clone, Copy, Debug, Default)]
struct BothWays {
    there: f64,
    back: f64,
}

impl BothWays {
    fn all(self) -> f64 {
        self.there + self.back
    }

    /// What it costs to fly so much farther, or not to get there at all.
    fn cost(self, extra: f64, minutes_per_unit: f64) -> Cost {
        if extra.is_infinite() {
            return Cost {
                lost: self.all(),
                ..Cost::default()
            };
        }
        // Two ways of the same length, added up in another order, may differ by less than nothing.
        let extra = extra.max(0.0) * self.all();
        Cost {
            rerouted: self.all(),
            extra_m: extra,
            extra_minutes: extra * minutes_per_unit,
            ..Cost::default()
        }
    }
}

/// The demand by pairs of nodes: a way is as long back as there.
struct Pairs(BTreeMap<(u32, u32), BothWays>);

impl Pairs {
    fn of(demand: &[Demand]) -> Self {
        let mut pairs: BTreeMap<(u32, u32), BothWays> = BTreeMap::new();
        for &Demand {
            from,
            to,
            deliveries,
        } in demand.iter().filter(|demand| demand.from != demand.to)
        {
            let pair = pairs.entry((from.0.min(to.0), from.0.max(to.0)));
            let both = pair.or_default();
            match from < to {
                true => both.there += deliveries,
                false => both.back += deliveries,
            }
        }
        Self(pairs)
    }

    /// The nodes that deliveries begin or end at, sorted.
    fn ends(&self) -> Vec<u32> {
        let mut ends: Vec<u32> = self
            .0
            .keys()
            .flat_map(|&(one, other)| [one, other])
            .collect();
        ends.sort_unstable();
        ends.dedup();
        ends
    }

    fn trees(&self, graph: &Graph) -> BTreeMap<u32, Tree> {
        let ends = self.ends().into_iter();
        ends.map(|end| (end, graph.tree(end))).collect()
    }
}

impl Cost {
    fn add(&mut self, other: Self) {
        self.rerouted += other.rerouted;
        self.diverted += other.diverted;
        self.grounded += other.grounded;
        self.lost += other.lost;
        self.extra_m += other.extra_m;
        self.extra_minutes += other.extra_minutes;
    }
}
