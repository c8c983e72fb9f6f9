//! Where drones were, on its way to the registry: kept in memory until it is taken, and thinned where that takes long.
//!
//! The path of telemetry only appends. Where there are too many, every second position of each drone in the older half
//! goes, so that a long time without a registry leaves fewer positions and no hole.

use crate::locks::lock;
use skyway_contract::{PositionBatch, PositionEntry};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Mutex;

/// The most positions that wait.
const POSITIONS_MAX: usize = 100_000;

/// Positions that the registry has yet to be told.
#[derive(Debug, Default)]
pub(crate) struct Positions {
    waiting: Mutex<Waiting>,
}

#[derive(Debug, Default)]
struct Waiting {
    /// The oldest first.
    entries: VecDeque<PositionEntry>,
    /// How many were left out that the registry has not been told of.
    left_out: u64,
    /// And since the start.
    left_out_ever: u64,
}

impl Positions {
    /// Takes where a drone was.
    pub(crate) fn add(&self, entry: PositionEntry) {
        self.add_up_to(entry, POSITIONS_MAX);
    }

    fn add_up_to(&self, entry: PositionEntry, most: usize) {
        let mut waiting = lock(&self.waiting);
        if waiting.entries.len() >= most {
            waiting.thin(most);
        }
        waiting.entries.push_back(entry);
    }

    /// Takes the oldest, up to a number, with how many were left out; `None` where nothing waits.
    pub(crate) fn take(&self, most: usize) -> Option<PositionBatch> {
        let mut waiting = lock(&self.waiting);
        let count = waiting.entries.len().min(most);
        if count == 0 {
            return None;
        }
        Some(PositionBatch {
            positions: waiting.entries.drain(..count).collect(),
            left_out: std::mem::take(&mut waiting.left_out),
        })
    }

    /// Puts a batch back that was not taken.
    pub(crate) fn put_back(&self, batch: PositionBatch) {
        let mut waiting = lock(&self.waiting);
        waiting.left_out += batch.left_out;
        for entry in batch.positions.into_iter().rev() {
            waiting.entries.push_front(entry);
        }
        if waiting.entries.len() > POSITIONS_MAX {
            waiting.thin(POSITIONS_MAX);
        }
    }

    /// The registry will never take a batch.
    pub(crate) fn give_up(&self, batch: &PositionBatch) {
        let mut waiting = lock(&self.waiting);
        waiting.left_out += batch.left_out;
        waiting.leave_out(batch.positions.len());
    }

    /// How many wait, and how many were left out since the start.
    pub(crate) fn figures(&self) -> (usize, u64) {
        let waiting = lock(&self.waiting);
        (waiting.entries.len(), waiting.left_out_ever)
    }
}

impl Waiting {
    /// Leaves out every second position of each drone in the older half; of drones that have only one there, the oldest
    /// go until there is room.
    fn thin(&mut self, most: usize) {
        let before = self.entries.len();
        let newer = self.entries.split_off(before / 2);
        let mut is_kept = BTreeMap::new();
        let mut older = std::mem::take(&mut self.entries);
        older.retain(|entry| {
            let keeps = is_kept.entry(entry.drone_id.clone()).or_insert(true);
            std::mem::replace(keeps, !*keeps)
        });
        older.extend(newer);
        let surplus = (older.len() + 1).saturating_sub(most);
        older.drain(..surplus);
        self.entries = older;
        self.leave_out(before - self.entries.len());
    }

    fn leave_out(&mut self, count: usize) {
        let count = u64::try_from(count).unwrap_or(u64::MAX);
        self.left_out += count;
        self.left_out_ever += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position(drone: &str, at_ms: i64) -> PositionEntry {
        PositionEntry {
            drone_id: drone.to_owned(),
            at_ms,
            lon: 0.0,
            lat: 0.0,
            altitude_m: None,
            battery_fraction: None,
            speed_mps: None,
        }
    }

    fn told(batch: &PositionBatch) -> Vec<(&str, i64)> {
        let positions = batch.positions.iter();
        positions
            .map(|entry| (&*entry.drone_id, entry.at_ms))
            .collect()
    }

    #[test]
    fn the_older_half_is_thinned_evenly_for_every_drone() {
        let positions = Positions::default();
        for at_ms in 0..4 {
            for drone in ["a", "b"] {
                positions.add_up_to(position(drone, at_ms), 8);
            }
        }
        positions.add_up_to(position("a", 4), 8);
        let batch = positions.take(100).expect("positions");
        let kept = [
            ("a", 0),
            ("b", 0),
            ("a", 2),
            ("b", 2),
            ("a", 3),
            ("b", 3),
            ("a", 4),
        ];
        assert_eq!(told(&batch), kept);
        assert_eq!(batch.left_out, 2);
        assert_eq!(positions.take(100), None);
        assert_eq!(positions.figures(), (0, 2));
    }

    #[test]
    fn of_drones_seen_once_the_oldest_make_room() {
        let positions = Positions::default();
        for number in 0..5 {
            positions.add_up_to(position(&format!("d{number}"), number), 4);
        }
        let batch = positions.take(2).expect("positions");
        assert_eq!(told(&batch), [("d1", 1), ("d2", 2)]);
        assert_eq!(batch.left_out, 1);
    }

    #[test]
    fn what_was_not_taken_comes_first_again() {
        let positions = Positions::default();
        for at_ms in 0..3 {
            positions.add_up_to(position("a", at_ms), 100);
        }
        let batch = positions.take(2).expect("positions");
        positions.put_back(batch);
        let batch = positions.take(2).expect("positions");
        assert_eq!(told(&batch), [("a", 0), ("a", 1)]);
        positions.give_up(&batch);
        let batch = positions.take(2).expect("positions");
        assert_eq!((told(&batch), batch.left_out), (vec![("a", 2)], 2));
    }
}
