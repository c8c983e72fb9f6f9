//! The tables of the destinations asked for, kept for one drone in one wind.

use crate::itinerary::{FlightSetting, Objective, Potentials};
use crate::network::NodeIx;
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Potentials by destination and objective, for settings that share one table of legs.
///
/// What is in the way may change, airframe, payload and wind may not. Past its bound all are worked out again.
#[derive(Debug)]
pub struct FlightTables {
    capacity_bytes: usize,
    kept: Mutex<CachedTables>,
}

#[derive(Debug, Default)]
struct CachedTables {
    by_goal: FxHashMap<(NodeIx, &'static str), Arc<Potentials>>,
    bytes: usize,
}

impl FlightTables {
    /// An empty cache that holds about this much at most.
    pub fn new(capacity_bytes: usize) -> Self {
        Self {
            capacity_bytes,
            kept: Mutex::default(),
        }
    }

    /// The table of a destination under an objective, worked out where it is not there yet.
    pub fn get(
        &self,
        setting: &FlightSetting,
        destination: NodeIx,
        objective: Objective,
    ) -> Arc<Potentials> {
        let goal = (destination, objective.name());
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept().by_goal.get(&goal).cloned();
        if let Some(table) = found {
            return table;
        }
        // Outside the lock: two threads may do the same work, but none waits for another one's.
        let table = Arc::new(setting.potentials(destination, objective));
        let mut kept = kept();
        if kept.bytes + table.bytes() > self.capacity_bytes {
            *kept = CachedTables::default();
        }
        kept.bytes += table.bytes();
        kept.by_goal.insert(goal, table.clone());
        table
    }
}
