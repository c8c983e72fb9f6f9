//! Lists by index, in one piece of memory.

use crate::airspace::Bits;

/// For every index below a length, a list that is mostly empty.
#[derive(Clone, Debug)]
pub(super) struct Grouped<T> {
    present: Bits,
    first: Vec<u32>,
    items: Vec<T>,
}

impl<T> Grouped<T> {
    /// Groups pairs of an index below `length` and an item; items of one index keep their order.
    pub(super) fn of(length: usize, pairs: Vec<(u32, T)>) -> Self {
        let mut present = Bits::empty(length);
        let mut first = vec![0_u32; length + 1];
        for &(index, _) in &pairs {
            present.insert(index);
            first[index as usize + 1] += 1;
        }
        for place in 1..first.len() {
            first[place] += first[place - 1];
        }
        // By counting: each change of the airspace groups all that is closed.
        let mut next = first.clone();
        let mut items: Vec<Option<T>> = pairs.iter().map(|_| None).collect();
        for (index, item) in pairs {
            let place = &mut next[index as usize];
            items[*place as usize] = Some(item);
            *place += 1;
        }
        Self {
            present,
            first,
            items: items.into_iter().flatten().collect(),
        }
    }

    /// True when the index has items.
    #[inline]
    pub(super) fn has(&self, index: u32) -> bool {
        self.present.contains(index)
    }

    /// The items of an index.
    #[inline]
    pub(super) fn of_index(&self, index: u32) -> &[T] {
        let index = index as usize;
        &self.items[self.first[index] as usize..self.first[index + 1] as usize]
    }

    /// The indices that have items, rising.
    pub(super) fn indices(&self) -> impl Iterator<Item = u32> + '_ {
        self.present.iter()
    }
}
