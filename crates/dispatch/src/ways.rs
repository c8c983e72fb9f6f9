//! How far it is over a network that the registry has: shortest ways on open skies. What is closed, edges know.

use super::Dispatch;
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::routing::{ClosureEpoch, DestinationTree, Searcher, TreeCache};
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Networks whose ways are kept; beyond it the first by id goes.
const NETWORKS_MAX: usize = 8;
/// The most memory of the ways of a network, in bytes.
const TREES_BYTES_MAX: usize = 64 << 20;
/// There are no closures here, and one topology.
const OPEN_SKIES: ClosureEpoch = ClosureEpoch {
    topology: 1,
    sequence: 0,
    opened_at: 0,
};

/// The ways over the networks asked for lately.
#[derive(Debug, Default)]
pub(super) struct KnownWays(Mutex<BTreeMap<String, Arc<Ways>>>);

/// The ways over a version of a network.
#[derive(Debug)]
pub(super) struct Ways {
    topology: Arc<Topology>,
    trees: TreeCache,
    searcher: Mutex<Searcher>,
}

impl Ways {
    fn new(topology: Arc<Topology>) -> Self {
        Self {
            trees: TreeCache::new(TREES_BYTES_MAX),
            searcher: Mutex::new(Searcher::new(&topology)),
            topology,
        }
    }

    /// The network.
    pub(super) fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The node of an id.
    pub(super) fn node(&self, id: &str) -> Option<NodeIx> {
        self.topology.node(id)
    }

    /// The shortest ways to a node. The first time a search of the whole network.
    fn tree(&self, destination: NodeIx) -> Arc<DestinationTree> {
        if let Some(tree) = self.trees.get(destination, OPEN_SKIES) {
            return tree;
        }
        // A search leaves nothing behind that the next one would mind.
        let mut searcher = self.searcher.lock().unwrap_or_else(PoisonError::into_inner);
        let tree = Arc::new(searcher.tree(&self.topology, destination));
        self.trees.insert(tree.clone(), OPEN_SKIES.topology);
        tree
    }

    /// The shortest ways to nodes, worked out where blocking is allowed.
    ///
    /// # Errors
    /// When the computation fails.
    pub(super) async fn trees(
        self: &Arc<Self>,
        nodes: Vec<NodeIx>,
    ) -> Result<Vec<Arc<DestinationTree>>, Refusal> {
        let ways = self.clone();
        let trees = move || nodes.into_iter().map(|node| ways.tree(node)).collect();
        let worked_out = tokio::task::spawn_blocking(trees).await;
        worked_out
            .map_err(|error| Refusal::new(Code::Internal, format!("a computation failed: {error}")))
    }
}

impl Dispatch {
    /// The ways over a network as it is now.
    ///
    /// # Errors
    /// When there is no such network, or the store does not answer.
    pub(super) async fn ways(&self, network: &str) -> Result<Arc<Ways>, Refusal> {
        let topology = self.registry.topology(network).await?;
        let mut known = self.ways.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |ways: &&Arc<Ways>| ways.topology.fingerprint() == topology.fingerprint();
        if let Some(ways) = known.get(network).filter(is_same) {
            return Ok(ways.clone());
        }
        if known.len() >= NETWORKS_MAX && !known.contains_key(network) {
            known.pop_first();
        }
        let ways = Arc::new(Ways::new(topology));
        known.insert(network.to_owned(), ways.clone());
        Ok(ways)
    }
}

/// A way from pickup to drop: the shortest ways to both.
#[derive(Debug)]
pub(super) struct Errand {
    pub(super) pickup: NodeIx,
    pub(super) drop: NodeIx,
    to_pickup: Arc<DestinationTree>,
    to_drop: Arc<DestinationTree>,
}

impl Errand {
    /// The errand between two nodes.
    ///
    /// # Errors
    /// When the computation fails.
    pub(super) async fn between(
        ways: &Arc<Ways>,
        pickup: NodeIx,
        drop: NodeIx,
    ) -> Result<Self, Refusal> {
        let trees: [Arc<DestinationTree>; 2] = ways
            .trees(vec![pickup, drop])
            .await?
            .try_into()
            .map_err(|_| Refusal::new(Code::Internal, "a way was not worked out"))?;
        let [to_pickup, to_drop] = trees;
        Ok(Self {
            pickup,
            drop,
            to_pickup,
            to_drop,
        })
    }

    /// From pickup to drop, in metres; none without a way.
    pub(super) fn length_m(&self) -> Option<f64> {
        finite(self.to_drop.distance_m(self.pickup))
    }

    /// From a node to the pickup, in metres; none without a way.
    pub(super) fn fetch_m(&self, home: NodeIx) -> Option<f64> {
        finite(self.to_pickup.distance_m(home))
    }

    /// From a node to the pickup, to the drop and back, in metres; none without a way. A way is as long in both directions.
    pub(super) fn round_m(&self, home: NodeIx) -> Option<f64> {
        let back_m = finite(self.to_drop.distance_m(home))?;
        Some(self.fetch_m(home)? + self.length_m()? + back_m)
    }
}

fn finite(length_m: f64) -> Option<f64> {
    length_m.is_finite().then_some(length_m)
}
