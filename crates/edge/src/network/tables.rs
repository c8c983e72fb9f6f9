//! The tables of destinations in use, made and kept current beside the requests.
//!
//! A request whose destination has no table is answered by A* at once and asks for one. After every change
//! of the airspace the standing closures are worked into the tables anew. One thread does both; it is
//! bounded by its queue and by the bytes of the cache, and steps back behind all that somebody waits for: every change of the
//! airspace is worked into all tables, which with many destinations takes as long as hundreds of answers.

use crate::background::{Background, begin_turn, give_way};
use skyway_engine::airspace::Airspace;
use skyway_engine::compose::prepare_table;
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::World;
use skyway_engine::routing::{Searcher, TreeCache};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// At most this many jobs wait; more are dropped, and come again with the next request.
const QUEUE: usize = 256;

/// Something for the maker of tables to do.
#[derive(Debug)]
enum TreeJob {
    /// A destination on the network of a topology revision has no table.
    Table(NodeIx, u64),
    /// The airspace has changed.
    Renewal,
}

/// The tables, and where they are asked for.
#[derive(Clone, Debug)]
pub(crate) struct Tables {
    trees: Arc<TreeCache>,
    jobs: SyncSender<TreeJob>,
}

/// Who makes them. Dropped before it is started, it makes none: every search is answered by A*.
#[derive(Debug)]
pub(crate) struct TableMaker {
    trees: Arc<TreeCache>,
    inbox: Receiver<TreeJob>,
}

impl TableMaker {
    /// Starts the thread, which asks for the airspace in service. It ends when the last handle to the tables is dropped.
    pub(crate) fn start(
        self,
        in_service: impl Fn() -> Arc<Airspace> + Send + 'static,
    ) -> std::io::Result<()> {
        let builder = std::thread::Builder::new().name("skyway-tables".to_owned());
        builder.spawn(move || {
            Background::Tables.step_back();
            work(&self.inbox, &in_service, &self.trees);
        })?;
        Ok(())
    }
}

impl Tables {
    /// Tables up to this size in bytes.
    pub(crate) fn new(capacity_bytes: usize) -> (Self, TableMaker) {
        let trees = Arc::new(TreeCache::new(capacity_bytes));
        let (jobs, inbox) = sync_channel(QUEUE);
        let tables = Self {
            trees: trees.clone(),
            jobs,
        };
        (tables, TableMaker { trees, inbox })
    }

    /// Those that there are.
    pub(crate) fn trees(&self) -> &TreeCache {
        &self.trees
    }

    /// Asks for a destination's table, unless it is there.
    pub(crate) fn want(&self, destination: NodeIx, world: &World<'_>) {
        let topology_revision = world.airspace.topology_revision();
        let trees = world.trees;
        if !trees.is_some_and(|trees| trees.holds(destination, topology_revision)) {
            // A full queue means that tables are being made as fast as can be.
            let job = TreeJob::Table(destination, topology_revision);
            let _ = self.jobs.try_send(job);
        }
    }

    /// Asks for the standing closures to be worked in anew.
    pub(crate) fn renew(&self) {
        // With a full queue the next table is made on the newest snapshot anyhow.
        let _ = self.jobs.try_send(TreeJob::Renewal);
    }
}

/// What tables are made with: for one network, and made anew for the next.
struct TreeBuilder {
    topology: Arc<Topology>,
    topology_revision: u64,
    searcher: Searcher,
}

impl TreeBuilder {
    fn on(airspace: &Airspace) -> Self {
        Self {
            topology: airspace.topology().clone(),
            topology_revision: airspace.topology_revision(),
            searcher: Searcher::new(airspace.topology()),
        }
    }

    /// The destinations on another network that had tables on this one.
    fn destinations_on(&self, other: &Topology, trees: &TreeCache) -> Vec<NodeIx> {
        if trees.topology() != self.topology_revision {
            return Vec::new();
        }
        let destinations = trees.destinations().into_iter();
        let ids = destinations.map(|destination| self.topology.node_id(destination));
        ids.filter_map(|id| other.node(id)).collect()
    }
}

fn work(inbox: &Receiver<TreeJob>, in_service: &dyn Fn() -> Arc<Airspace>, trees: &TreeCache) {
    let mut workbench: Option<TreeBuilder> = None;
    while let Ok(first) = inbox.recv() {
        begin_turn();
        let mut jobs = Vec::new();
        let mut is_renewal = false;
        for job in std::iter::once(first).chain(inbox.try_iter().take(QUEUE)) {
            match job {
                TreeJob::Table(destination, on) => jobs.push((destination, on)),
                TreeJob::Renewal => is_renewal = true,
            }
        }
        let airspace = &in_service();
        let current = airspace.topology_revision();
        // A caller on a network that is gone asks again on the next.
        let jobs = jobs.into_iter().filter(|&(_, on)| on == current);
        let mut wanted: Vec<NodeIx> = jobs.map(|(destination, _)| destination).collect();
        let is_outdated = |bench: &TreeBuilder| !Arc::ptr_eq(&bench.topology, airspace.topology());
        if let Some(outdated) = workbench.take_if(|bench| is_outdated(bench)) {
            wanted.extend(outdated.destinations_on(airspace.topology(), trees));
        }
        let bench = workbench.get_or_insert_with(|| TreeBuilder::on(airspace));
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|&destination| !trees.holds(destination, current));
        make(&wanted, airspace, trees, &mut bench.searcher);
        if is_renewal && trees.topology() == current {
            make(&trees.destinations(), airspace, trees, &mut bench.searcher);
        }
    }
}

fn make(destinations: &[NodeIx], airspace: &Airspace, trees: &TreeCache, searcher: &mut Searcher) {
    let world = World {
        airspace,
        trees: Some(trees),
    };
    for &destination in destinations {
        prepare_table(&world, destination, searcher);
        give_way();
    }
}
