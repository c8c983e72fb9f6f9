//! Entries under keys of subjects, bounded in number, bytes and age.

use crate::settings::Settings;
use jiff::{SignedDuration, Timestamp};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What replies may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// The most entries.
    pub(crate) count: usize,
    /// And about the most bytes.
    pub(crate) bytes: usize,
    /// For so long.
    pub(crate) age: SignedDuration,
}

impl Bounds {
    pub(crate) fn of(settings: &Settings) -> Self {
        Self {
            count: settings.idempotency_max,
            bytes: settings.idempotency_bytes_max,
            age: settings.idempotency_age,
        }
    }
}

/// An entry under its key.
#[derive(Debug)]
struct Held<V> {
    serial: u64,
    bytes: usize,
    value: V,
}

/// The entries of a subject, the oldest first, and what they take.
#[derive(Debug, Default)]
struct Share {
    serials: BTreeSet<u64>,
    bytes: usize,
}

/// Entries by subject and key, bounded in number, bytes and age. Beyond the bytes the oldest of the subject that takes the
/// most goes, so that none drives out what a lesser one has. An entry counts at least its part of the bytes, which so bound
/// the number, too.
#[derive(Debug)]
pub(super) struct Aging<K, V> {
    bounds: Bounds,
    bytes: usize,
    by_key: BTreeMap<(Arc<str>, K), Held<V>>,
    /// By serial, which is the order in which they came.
    order: BTreeMap<u64, (Timestamp, (Arc<str>, K))>,
    shares: BTreeMap<Arc<str>, Share>,
    /// Subjects by what they take.
    by_bytes: BTreeSet<(usize, Arc<str>)>,
    next: u64,
}

impl<K: Ord + Clone, V: Clone> Aging<K, V> {
    pub(super) fn new(bounds: Bounds) -> Self {
        Self {
            bounds,
            bytes: 0,
            by_key: BTreeMap::new(),
            order: BTreeMap::new(),
            shares: BTreeMap::new(),
            by_bytes: BTreeSet::new(),
            next: 0,
        }
    }

    pub(super) fn get(&mut self, key: &(Arc<str>, K), now: Timestamp) -> Option<V> {
        self.forget(now);
        self.by_key.get(key).map(|held| held.value.clone())
    }

    pub(super) fn put(
        &mut self,
        key: (Arc<str>, K),
        (value, bytes): (V, usize),
        now: Timestamp,
    ) -> u64 {
        let bytes = self.counted(bytes);
        if let Some(before) = self.by_key.get(&key).map(|before| before.serial) {
            self.remove(&key, before);
        }
        self.next += 1;
        let serial = self.next;
        let held = Held {
            serial,
            bytes,
            value,
        };
        self.by_key.insert(key.clone(), held);
        self.charge(&key.0, |share| {
            share.serials.insert(serial);
            share.bytes += bytes;
        });
        self.order.insert(serial, (now, key));
        self.forget(now);
        serial
    }

    fn counted(&self, bytes: usize) -> usize {
        bytes.max(self.bounds.bytes / self.bounds.count.max(1))
    }

    /// Changes what a subject has.
    fn charge(&mut self, subject: &Arc<str>, change: impl FnOnce(&mut Share)) {
        let share = self.shares.entry(subject.clone()).or_default();
        self.by_bytes.remove(&(share.bytes, subject.clone()));
        self.bytes -= share.bytes;
        change(share);
        self.bytes += share.bytes;
        if share.serials.is_empty() {
            self.shares.remove(subject);
        } else {
            self.by_bytes.insert((share.bytes, subject.clone()));
        }
    }

    /// Says what an entry weighs now.
    pub(super) fn weigh(
        &mut self,
        key: &(Arc<str>, K),
        bytes: usize,
        now: Timestamp,
        is_it: impl Fn(&V) -> bool,
    ) {
        let bytes = self.counted(bytes);
        if let Some(held) = self.by_key.get_mut(key).filter(|held| is_it(&held.value)) {
            let before = std::mem::replace(&mut held.bytes, bytes);
            self.charge(&key.0, |share| share.bytes = share.bytes + bytes - before);
        }
        self.forget(now);
    }

    /// Removes an entry, unless another one has taken its key.
    pub(super) fn remove(&mut self, key: &(Arc<str>, K), serial: u64) {
        let is_it = |held: &&Held<V>| held.serial == serial;
        let Some(bytes) = self.by_key.get(key).filter(is_it).map(|held| held.bytes) else {
            return;
        };
        self.by_key.remove(key);
        self.order.remove(&serial);
        self.charge(&key.0, |share| {
            share.serials.remove(&serial);
            share.bytes -= bytes;
        });
    }

    fn forget(&mut self, now: Timestamp) {
        loop {
            let oldest = self.order.first_key_value();
            let aged = oldest.filter(|(_, (at, _))| now.duration_since(*at) > self.bounds.age);
            let serial = match aged {
                Some((serial, _)) => Some(*serial),
                None if self.bytes > self.bounds.bytes => self.oldest_of_heaviest(),
                None => None,
            };
            let gone = serial.and_then(|serial| Some((serial, self.order.get(&serial)?)));
            let Some((serial, (_, key))) = gone else {
                return;
            };
            let key = key.clone();
            self.remove(&key, serial);
        }
    }

    fn oldest_of_heaviest(&self) -> Option<u64> {
        let (_, subject) = self.by_bytes.last()?;
        self.shares.get(subject)?.serials.first().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subject_drives_out_its_own_alone() {
        let bounds = Bounds {
            count: 100,
            bytes: 10_000,
            age: SignedDuration::from_hours(1),
        };
        let mut kept: Aging<u32, ()> = Aging::new(bounds);
        let key = |subject: &str, number: u32| (Arc::from(subject), number);
        let now = Timestamp::UNIX_EPOCH;
        for number in 0..4 {
            kept.put(key("quiet", number), ((), 1), now);
        }
        for number in 0..200 {
            kept.put(key("many", number), ((), 1), now);
            kept.put(key("large", number % 2), ((), 3_000), now);
        }
        let mut has = |subject, number, at| kept.get(&key(subject, number), at).is_some();
        assert!((0..4).all(|number| has("quiet", number, now)));
        assert!(has("many", 199, now) && !has("many", 100, now));
        assert!(has("large", 1, now) && !has("large", 0, now));
        let later = now + SignedDuration::from_hours(2);
        assert!((0..4).all(|number| !has("quiet", number, later)));
    }
}
