//! The failure reports that are sent: drawn with a seed over shortest ways of the bundled Sydney network.

use crate::Result;
use crate::pairs::Recorded;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use skyway::airspace::{Airspace, Closed, RequestClosures};
use skyway::formats::{load_network, node_id};
use skyway::network::bundled::{SYDNEY_CBD, SYDNEY_CBD_NAME};
use skyway::network::{Components, NodeIx, Topology};
use skyway::routing::{Path, Searcher, Start};
use skyway::wire::{DroneFacts, FailureReport, FailureType, Id, Place, Service};
use std::sync::Arc;

const SEED: u64 = 1;

/// What is sent to every server.
pub(crate) struct Workload {
    topology: Arc<Topology>,
    pub(crate) reports: Vec<FailureReport>,
}

impl Workload {
    /// Sources and destinations uniform in the largest component, the failed leg uniform on the shortest path.
    pub(crate) fn sydney(count: usize) -> Result<Self> {
        let loaded = load_network(SYDNEY_CBD).map_err(|error| error.lines().join("\n"))?;
        let topology = Arc::new(loaded.topology);
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let connected: Vec<NodeIx> = Components::of(&topology).largest().collect();
        let mut below = |count: usize| (random.next_u64() % count as u64) as usize;
        let mut reports = Vec::with_capacity(count);
        while reports.len() < count {
            let source = connected[below(connected.len())];
            let destination = connected[below(connected.len())];
            let Some(way) = shortest_way(&topology, source, destination) else {
                continue;
            };
            if way.segments.is_empty() {
                continue;
            }
            let place = below(way.segments.len());
            let drone = format!("drone-{}", reports.len());
            reports.push(report(&topology, &way.nodes[place..], drone));
        }
        Ok(Self { topology, reports })
    }

    /// Prints what is measured, as the title of the tables.
    pub(crate) fn describe(&self, is_pinned: bool, recorded: &Recorded) {
        println!(
            "### {SYDNEY_CBD_NAME}, {} nodes, {} segments; {} failures, dry runs, seed {SEED}; profile {}\n",
            self.topology.node_count(),
            self.topology.segment_count(),
            self.reports.len(),
            match cfg!(debug_assertions) {
                true => "with debug assertions",
                false => "without debug assertions",
            },
        );
        println!(
            "{:.1} % of the answers are `rerouted`; an answer in JSON has {:.0} bytes on average. {}",
            100.0 * recorded.rerouted_share,
            recorded.mean_bytes,
            match is_pinned {
                true => "Servers run on the first core, the load on the second.",
                false => "Servers and load share all cores, so that ratios say little.",
            }
        );
    }
}

fn shortest_way(topology: &Arc<Topology>, source: NodeIx, destination: NodeIx) -> Option<Path> {
    let now = jiff::Timestamp::UNIX_EPOCH;
    let horizon = jiff::SignedDuration::from_mins(60);
    let airspace = Airspace::open(topology.clone(), 1, now, horizon);
    let nothing = RequestClosures::new(topology);
    let closed = Closed::new(topology, airspace.closed(), &nothing);
    let mut searcher = Searcher::new(topology);
    let tree = searcher.tree(topology, destination);
    let start = Start {
        node: source,
        offset_m: 0.0,
    };
    let arrival = searcher.exact(&closed, &[start], &tree)?;
    let mut way = Path::default();
    searcher.append_way(arrival, Some(&tree), &mut way);
    Some(way)
}

/// The report of a drone at the start of the first leg, which it cannot fly.
fn report(topology: &Topology, ahead: &[NodeIx], drone: String) -> FailureReport {
    let id = |node: NodeIx| -> Id<'static> { node_id(topology, node).into_owned() };
    FailureReport {
        failure: Some(FailureType::Navigational),
        service: Some(Service {
            from: Some(id(ahead[0])),
            to: Some(id(ahead[1])),
            ..Service::default()
        }),
        location: Some(Place::Node(id(ahead[0]))),
        drone: Some(DroneFacts {
            id: Some(drone),
            battery_fraction: Some(0.62),
            ..DroneFacts::default()
        }),
        remaining_path: Some(ahead.iter().map(|&node| id(node)).collect()),
        destination: ahead.last().map(|&node| id(node)),
        dry_run: Some(true),
        ..FailureReport::default()
    }
}
