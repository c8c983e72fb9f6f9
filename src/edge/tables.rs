//! The tables of destinations in use, made and kept current beside the requests.
//!
//! A request whose destination has no table is answered by A* at once and asks for one. After every change
//! of the airspace the standing closures are worked into the tables anew. One thread does both; it is
//! bounded by its queue and by the bytes of the cache.

use super::snapshot::Snapshot;
use crate::airspace::Airspace;
use crate::compose::prepare_table;
use crate::network::NodeIx;
use crate::recompose::World;
use crate::routing::{Searcher, TreeCache};
use arc_swap::ArcSwap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// At most this many wishes wait; more are dropped, and come again with the next request.
const QUEUE: usize = 256;

/// Something for the maker of tables to do.
#[derive(Debug)]
enum Wish {
    /// A destination has no table.
    Table(NodeIx),
    /// The airspace has changed.
    Renewal,
}

/// Where tables are asked for.
#[derive(Clone, Debug)]
pub(super) struct Tables {
    wishes: SyncSender<Wish>,
}

impl Tables {
    /// Starts the thread. It ends when the last handle to it is dropped.
    pub(super) fn start(
        world: Arc<ArcSwap<Snapshot>>,
        trees: Arc<TreeCache>,
    ) -> std::io::Result<Self> {
        let (wishes, inbox) = sync_channel(QUEUE);
        let builder = std::thread::Builder::new().name("skyway-tables".to_owned());
        builder.spawn(move || work(&inbox, &world, &trees))?;
        Ok(Self { wishes })
    }

    /// Asks for a destination's table, unless it is there.
    pub(super) fn want(&self, destination: NodeIx, world: &World<'_>) {
        let is_there = world
            .trees
            .is_some_and(|trees| trees.holds(destination, world.airspace.topology_revision()));
        if !is_there {
            // A full queue means that tables are being made as fast as can be.
            let _ = self.wishes.try_send(Wish::Table(destination));
        }
    }

    /// Asks for the standing closures to be worked in anew.
    pub(super) fn renew(&self) {
        // With a full queue the next table is made on the newest snapshot anyhow.
        let _ = self.wishes.try_send(Wish::Renewal);
    }
}

fn work(inbox: &Receiver<Wish>, world: &ArcSwap<Snapshot>, trees: &TreeCache) {
    let mut searcher: Option<Searcher> = None;
    while let Ok(first) = inbox.recv() {
        let mut wanted = Vec::new();
        let mut is_renewal = false;
        for wish in std::iter::once(first).chain(inbox.try_iter().take(QUEUE)) {
            match wish {
                Wish::Table(destination) => wanted.push(destination),
                Wish::Renewal => is_renewal = true,
            }
        }
        wanted.sort_unstable();
        wanted.dedup();
        let snapshot = world.load_full();
        let airspace = snapshot.airspace();
        let searcher = searcher.get_or_insert_with(|| Searcher::new(airspace.topology()));
        wanted.retain(|&destination| !trees.holds(destination, airspace.topology_revision()));
        make(&wanted, airspace, trees, searcher);
        if is_renewal {
            make(&trees.destinations(), airspace, trees, searcher);
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
    }
}
