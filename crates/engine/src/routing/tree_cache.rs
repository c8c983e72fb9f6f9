//! The trees of the destinations in use, bounded in bytes and shared by all requests.
//!
//! A request asks with the [`ClosureEpoch`] of its snapshot and gets a tree that is a lower bound there:
//! the one with standing closures worked in while none of them has ended, else the intact one.

use super::tree::DestinationTree;
use crate::network::NodeIx;
use rustc_hash::FxHashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Which standing closures a snapshot has, as far as trees need to know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClosureEpoch {
    /// The topology revision; trees of another are useless.
    pub topology: u64,
    /// Rises with every change of the standing closures.
    pub sequence: u64,
    /// The sequence of the last change that opened anything.
    pub opened_at: u64,
}

impl ClosureEpoch {
    /// True when closures that stood at `sequence` all stand here too.
    fn still_has_all_of(&self, sequence: u64) -> bool {
        (self.opened_at..=self.sequence).contains(&sequence)
    }
}

#[derive(Debug)]
struct Entry {
    intact: Arc<DestinationTree>,
    repaired: Option<(u64, Arc<DestinationTree>)>,
    last_used: AtomicU64,
}

impl Entry {
    fn bytes(&self) -> usize {
        let copy = self.repaired.as_ref().map_or(0, |(_, tree)| tree.bytes());
        self.intact.bytes() + copy
    }
}

#[derive(Debug, Default)]
struct Entries {
    topology: u64,
    by_destination: FxHashMap<u32, Entry>,
    bytes: usize,
}

/// How a cache has done so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheFigures {
    /// Destinations held.
    pub destinations: usize,
    /// Bytes held.
    pub bytes: usize,
    /// Requests that found their tree.
    pub hits: u64,
    /// Requests that did not.
    pub misses: u64,
}

/// Trees by destination; the least recently used ones go first when the bound is reached.
#[derive(Debug)]
pub struct TreeCache {
    capacity_bytes: usize,
    entries: RwLock<Entries>,
    clock: AtomicU64,
    hits: AtomicU64,
    misses: AtomicU64,
}

impl TreeCache {
    /// An empty cache that holds at most `capacity_bytes`.
    pub fn new(capacity_bytes: usize) -> Self {
        Self {
            capacity_bytes,
            entries: RwLock::default(),
            clock: AtomicU64::new(0),
            hits: AtomicU64::new(0),
            misses: AtomicU64::new(0),
        }
    }

    /// A tree to `destination` that is a lower bound in the snapshot asked for, if there is one.
    pub fn get(&self, destination: NodeIx, standing: ClosureEpoch) -> Option<Arc<DestinationTree>> {
        let entries = self.read();
        let entry = match entries.topology == standing.topology {
            true => entries.by_destination.get(&destination.0),
            false => None,
        };
        let Some(entry) = entry else {
            self.misses.fetch_add(1, Ordering::Relaxed);
            return None;
        };
        self.hits.fetch_add(1, Ordering::Relaxed);
        let now = self.clock.fetch_add(1, Ordering::Relaxed);
        entry.last_used.store(now, Ordering::Relaxed);
        match &entry.repaired {
            Some((sequence, tree)) if standing.still_has_all_of(*sequence) => Some(tree.clone()),
            _ => Some(entry.intact.clone()),
        }
    }

    /// Whether there is a tree to `destination`; asking counts neither as a hit nor as a miss.
    pub fn holds(&self, destination: NodeIx, topology: u64) -> bool {
        let entries = self.read();
        entries.topology == topology && entries.by_destination.contains_key(&destination.0)
    }

    /// The intact tree to `destination`, if there is one; asking counts neither as a hit nor as a use.
    pub fn intact(&self, destination: NodeIx, topology: u64) -> Option<Arc<DestinationTree>> {
        let entries = self.read();
        let entry = entries.by_destination.get(&destination.0);
        let entry = entry.filter(|_| entries.topology == topology);
        entry.map(|entry| entry.intact.clone())
    }

    /// Keeps the intact tree of a destination; trees of an earlier topology revision are dropped.
    ///
    /// A tree of an earlier revision than those held comes from a request that is still under way on it, and is not kept.
    pub fn insert(&self, tree: Arc<DestinationTree>, topology: u64) {
        let mut entries = self.write();
        if topology < entries.topology {
            return;
        }
        if entries.topology != topology {
            *entries = Entries {
                topology,
                ..Entries::default()
            };
        }
        let entry = Entry {
            intact: tree.clone(),
            repaired: None,
            last_used: AtomicU64::new(self.clock.fetch_add(1, Ordering::Relaxed)),
        };
        entries.bytes += entry.bytes();
        let before = entries.by_destination.insert(tree.destination().0, entry);
        entries.bytes -= before.map_or(0, |entry| entry.bytes());
        self.evict(&mut entries);
    }

    /// Keeps a tree that has the closures of a snapshot worked in, beside the intact one of its destination.
    pub fn insert_repaired(&self, tree: Arc<DestinationTree>, standing: ClosureEpoch) {
        let mut entries = self.write();
        if entries.topology != standing.topology {
            return;
        }
        let Some(entry) = entries.by_destination.get_mut(&tree.destination().0) else {
            return;
        };
        let before = entry.bytes();
        entry.repaired = Some((standing.sequence, tree));
        let after = entry.bytes();
        entries.bytes = entries.bytes + after - before;
        self.evict(&mut entries);
    }

    /// Drops all trees of a destination.
    pub fn remove(&self, destination: NodeIx) {
        let mut entries = self.write();
        let removed = entries.by_destination.remove(&destination.0);
        entries.bytes -= removed.map_or(0, |entry| entry.bytes());
    }

    /// Drops the tree of a destination that has closures worked in, which stand no more.
    pub fn drop_taken_in(&self, destination: NodeIx) {
        let mut entries = self.write();
        let entry = entries.by_destination.get_mut(&destination.0);
        let dropped = entry.and_then(|entry| entry.repaired.take());
        entries.bytes -= dropped.map_or(0, |(_, tree)| tree.bytes());
    }

    /// The topology revision of the trees held.
    pub fn topology(&self) -> u64 {
        self.read().topology
    }

    /// The destinations held, in index order.
    pub fn destinations(&self) -> Vec<NodeIx> {
        let entries = self.read();
        let mut destinations: Vec<NodeIx> = entries
            .by_destination
            .keys()
            .map(|&node| NodeIx(node))
            .collect();
        destinations.sort_unstable();
        destinations
    }

    /// What the cache holds and how often it helped.
    pub fn figures(&self) -> CacheFigures {
        let entries = self.read();
        CacheFigures {
            destinations: entries.by_destination.len(),
            bytes: entries.bytes,
            hits: self.hits.load(Ordering::Relaxed),
            misses: self.misses.load(Ordering::Relaxed),
        }
    }

    fn evict(&self, entries: &mut Entries) {
        while entries.bytes > self.capacity_bytes {
            let oldest = entries
                .by_destination
                .iter()
                .min_by_key(|(_, entry)| entry.last_used.load(Ordering::Relaxed))
                .map(|(&destination, _)| destination);
            let Some(removed) = oldest.and_then(|node| entries.by_destination.remove(&node)) else {
                return;
            };
            entries.bytes -= removed.bytes();
        }
    }

    // Entries are whole after every statement that changes them, so a panic elsewhere cannot spoil them.
    fn read(&self) -> RwLockReadGuard<'_, Entries> {
        self.entries.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, Entries> {
        self.entries.write().unwrap_or_else(PoisonError::into_inner)
    }
}
