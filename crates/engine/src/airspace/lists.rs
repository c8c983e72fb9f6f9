//! Lists by index, copied on write: a change copies the lists that it touches, not the network.

use super::bits::Bits;
use std::sync::Arc;

/// So many lists are copied, as pointers, where one of them changes.
const CHUNK: usize = 32;

type Chunk<T> = [Option<Arc<[T]>>; CHUNK];

/// For every index below a length, a list that is mostly empty. A copy shares all lists until they differ.
#[derive(Clone, Debug)]
pub struct Lists<T> {
    present: Bits,
    chunks: Vec<Arc<Chunk<T>>>,
}

impl<T: Clone> Lists<T> {
    /// Empty lists for `0..length`; they share one chunk until they differ.
    pub fn empty(length: usize) -> Self {
        let chunk = Arc::new(std::array::from_fn(|_| None));
        Self {
            present: Bits::empty(length),
            chunks: vec![chunk; length.div_ceil(CHUNK)],
        }
    }

    /// True when the list of an index has items.
    #[inline]
    pub fn has(&self, index: u32) -> bool {
        self.present.contains(index)
    }

    /// The items of an index, in the order in which they were added.
    #[inline]
    pub fn of_index(&self, index: u32) -> &[T] {
        let (chunk, place) = (index as usize / CHUNK, index as usize % CHUNK);
        self.chunks[chunk][place].as_deref().unwrap_or_default()
    }

    /// The indices whose lists have items, one bit each.
    pub fn indices(&self) -> &Bits {
        &self.present
    }

    /// Adds items to the lists of their indices.
    pub fn add(&mut self, mut items: Vec<(u32, T)>) {
        items.sort_by_key(|&(index, _)| index);
        for new in items.chunk_by(|one, other| one.0 == other.0) {
            let index = new[0].0;
            let there = self
                .of_index(index)
                .iter()
                .chain(new.iter().map(|(_, item)| item));
            let list = there.cloned().collect();
            self.put(index, list);
        }
    }

    /// Removes from the list of an index the items that are meant.
    pub fn remove(&mut self, index: u32, is_meant: impl Fn(&T) -> bool) {
        let there = self.of_index(index).iter();
        let list = there.filter(|item| !is_meant(item)).cloned().collect();
        self.put(index, list);
    }

    fn put(&mut self, index: u32, list: Arc<[T]>) {
        let (chunk, place) = (index as usize / CHUNK, index as usize % CHUNK);
        match list.is_empty() {
            true => self.present.remove(index),
            false => self.present.insert(index),
        };
        let list = (!list.is_empty()).then_some(list);
        Arc::make_mut(&mut self.chunks[chunk])[place] = list;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_keeps_the_lists_that_another_one_changes() {
        let mut lists = Lists::empty(100);
        lists.add(vec![(70, 'b'), (3, 'a'), (70, 'c')]);
        let before = lists.clone();
        lists.remove(70, |item| *item == 'b');
        lists.remove(3, |item| *item == 'a');
        lists.add(vec![(70, 'd')]);
        assert_eq!(lists.of_index(70), ['c', 'd']);
        assert!(!lists.has(3) && lists.of_index(3).is_empty());
        assert_eq!(before.of_index(70), ['b', 'c']);
        assert_eq!(before.indices().iter().collect::<Vec<_>>(), [3, 70]);
    }
}
