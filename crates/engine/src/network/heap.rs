//! A 4-ary heap of nodes by key: the queue of every search.
//!
//! Four children to a parent make it half as deep as a binary heap, and they share a cache line.
//! Entries are never moved when a better key turns up; the stale one is skipped when it is taken.

use super::NodeIx;

const CHILDREN: usize = 4;

#[derive(Clone, Copy, Debug)]
struct Entry {
    key: f64,
    node: NodeIx,
}

/// Nodes waiting to be taken, smallest key first.
#[derive(Debug, Default)]
pub(crate) struct Heap {
    entries: Vec<Entry>,
}

impl Heap {
    /// A heap that never allocates while it holds at most `capacity` entries.
    ///
    /// The memory is only reserved: pages that no search has written take no room.
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            entries: Vec::with_capacity(capacity),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.entries.clear();
    }

    #[inline]
    pub(crate) fn push(&mut self, key: f64, node: NodeIx) {
        let mut place = self.entries.len();
        let entry = Entry { key, node };
        self.entries.push(entry);
        while place > 0 {
            let parent = (place - 1) / CHILDREN;
            if self.entries[parent].key <= key {
                break;
            }
            self.entries[place] = self.entries[parent];
            place = parent;
        }
        self.entries[place] = entry;
    }

    #[inline]
    pub(crate) fn pop(&mut self) -> Option<(f64, NodeIx)> {
        let last = self.entries.pop()?;
        let Some(&top) = self.entries.first() else {
            return Some((last.key, last.node));
        };
        self.sift_down(last);
        Some((top.key, top.node))
    }

    /// Puts `entry` in the place of the top and lets it sink.
    fn sift_down(&mut self, entry: Entry) {
        let entries = self.entries.as_mut_slice();
        let mut place = 0;
        loop {
            let first = place * CHILDREN + 1;
            let end = (first + CHILDREN).min(entries.len());
            if first >= end {
                break;
            }
            let mut smallest = first;
            let mut smallest_key = entries[first].key;
            for (offset, child) in entries[first..end].iter().enumerate().skip(1) {
                if child.key < smallest_key {
                    smallest = first + offset;
                    smallest_key = child.key;
                }
            }
            if entry.key <= smallest_key {
                break;
            }
            entries[place] = entries[smallest];
            place = smallest;
        }
        entries[place] = entry;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_come_out_by_rising_key() {
        let mut heap = Heap::with_capacity(0);
        let keys: Vec<u32> = (0..500).map(|step| step * 7919 % 503).collect();
        for &key in &keys {
            heap.push(f64::from(key), NodeIx(key));
        }
        let mut sorted = keys;
        sorted.sort_unstable();
        for key in sorted {
            assert_eq!(heap.pop(), Some((f64::from(key), NodeIx(key))));
        }
        assert_eq!(heap.pop(), None);
    }
}
