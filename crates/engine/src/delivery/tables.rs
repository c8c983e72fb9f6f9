//! The tables of the destinations asked for, kept for all kinds of drones in all winds.

use crate::flight::FlightLegs;
use crate::itinerary::{FlightSetting, Objective, Potentials};
use crate::network::NodeIx;
use rustc_hash::FxHashMap;
use std::mem;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Potentials by table of legs, destination and objective, so that what is in the way may change while they stay.
///
/// They are of two generations: those asked for since the last change of generations, and those that were before. Once the
/// younger takes half of the room, the older is dropped.
#[derive(Debug)]
pub struct FlightTables {
    capacity_bytes: usize,
    kept: Mutex<Generations>,
}

#[derive(Debug, Default)]
struct Generations {
    young: FxHashMap<Goal, Kept>,
    young_bytes: usize,
    old: FxHashMap<Goal, Kept>,
}

/// Where a table of legs is in memory, and what a flight on it is to do.
type Goal = (usize, NodeIx, &'static str);

#[derive(Clone, Debug)]
struct Kept {
    potentials: Arc<Potentials>,
    /// Holds the place in memory, not what is there: no other table of legs can be in the same place.
    _legs: Weak<FlightLegs>,
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
        let legs = setting.legs();
        let goal = (Arc::as_ptr(legs).addr(), destination, objective.name());
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept().find(&goal, self.capacity_bytes);
        if let Some(potentials) = found {
            return potentials;
        }
        // Outside the lock: two threads may do the same work, but none waits for another one's.
        let potentials = Arc::new(setting.potentials(destination, objective));
        let one = Kept {
            potentials: potentials.clone(),
            _legs: Arc::downgrade(legs),
        };
        kept().add(goal, one, self.capacity_bytes);
        potentials
    }
}

impl Generations {
    fn find(&mut self, goal: &Goal, capacity_bytes: usize) -> Option<Arc<Potentials>> {
        if let Some(found) = self.young.get(goal) {
            return Some(found.potentials.clone());
        }
        let found = self.old.remove(goal)?;
        let potentials = found.potentials.clone();
        self.add(*goal, found, capacity_bytes);
        Some(potentials)
    }

    fn add(&mut self, goal: Goal, one: Kept, capacity_bytes: usize) {
        let bytes = one.potentials.bytes();
        if self.young_bytes + bytes > capacity_bytes / 2 {
            self.old = mem::take(&mut self.young);
            self.young_bytes = 0;
        }
        self.young_bytes += bytes;
        self.young.insert(goal, one);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{Airframe, FlightRules, Situation, WindField};
    use crate::network::{Generated, Joining, Topology};

    const NODES: u32 = 60;

    fn setting(topology: &Arc<Topology>, payload_kg: f64) -> FlightSetting {
        let situation = Situation::default();
        FlightSetting::new(
            topology.clone(),
            Airframe::phantom3(),
            payload_kg,
            WindField::default(),
            FlightRules::default(),
            &situation,
        )
    }

    /// Kinds of drones share the room: what one asked for is not what another gets, and what is asked for again and again stays.
    #[test]
    fn tables_are_of_the_kind_that_asks_and_the_ones_in_use_stay() {
        let generated = Generated {
            nodes: NODES as usize,
            max_neighbours: 5,
            map_size_m: 4_000.0,
            reach_fraction: 0.3,
            joining: Joining::Delaunay,
            seed: 3,
        };
        let draft = generated.network().expect("in range");
        let topology = Arc::new(Topology::build(draft, [0; 32]).expect("a network"));
        let settings = [setting(&topology, 0.0), setting(&topology, 0.5)];
        let goal = (NodeIx(7), Objective::Energy);
        let each = settings[0].potentials(goal.0, goal.1).bytes();
        let tables = FlightTables::new(8 * each);
        let often = tables.get(&settings[0], goal.0, goal.1);
        for node in (0..NODES).map(NodeIx) {
            for setting in &settings {
                let found = tables.get(setting, node, goal.1);
                let expected = setting.potentials(node, goal.1);
                let far = NodeIx((node.0 + 31) % NODES);
                assert_eq!(found.destination(), node);
                assert_eq!(found.least_weight(far), expected.least_weight(far));
            }
            let again = tables.get(&settings[0], goal.0, goal.1);
            assert!(Arc::ptr_eq(&often, &again), "worked out again at {node:?}");
            let kept = tables.kept.lock().expect("no panic");
            assert!(kept.young.len() <= 4 && kept.old.len() <= 4);
        }
    }
}
