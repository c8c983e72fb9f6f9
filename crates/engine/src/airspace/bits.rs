//! A fixed set of small numbers, one bit each.

/// A set of indices below a length fixed when it is made.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Bits {
    words: Vec<u64>,
}

impl Bits {
    /// An empty set that can hold `0..length`.
    pub fn empty(length: usize) -> Self {
        Self {
            words: vec![0; length.div_ceil(64)],
        }
    }

    /// True when the set holds the index.
    #[inline]
    pub fn contains(&self, index: u32) -> bool {
        self.words[(index >> 6) as usize] >> (index & 63) & 1 == 1
    }

    /// Adds an index; true when it was not there.
    #[inline]
    pub fn insert(&mut self, index: u32) -> bool {
        let word = &mut self.words[(index >> 6) as usize];
        let bit = 1 << (index & 63);
        let is_new = *word & bit == 0;
        *word |= bit;
        is_new
    }

    /// The same where the length is not known before.
    pub fn insert_growing(&mut self, index: u32) -> bool {
        let needed = (index >> 6) as usize + 1;
        self.words.resize(self.words.len().max(needed), 0);
        self.insert(index)
    }

    /// True when the set holds the index, which may lie beyond its length.
    #[inline]
    pub fn holds(&self, index: u32) -> bool {
        let word = self.words.get((index >> 6) as usize);
        word.is_some_and(|word| word >> (index & 63) & 1 == 1)
    }

    /// Removes an index; true when it was there.
    #[inline]
    pub fn remove(&mut self, index: u32) -> bool {
        let word = &mut self.words[(index >> 6) as usize];
        let bit = 1 << (index & 63);
        let was_there = *word & bit != 0;
        *word &= !bit;
        was_there
    }

    /// The indices in the set, rising.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        self.words.iter().enumerate().flat_map(|(place, &word)| {
            let mut rest = word;
            std::iter::from_fn(move || {
                if rest == 0 {
                    return None;
                }
                let bit = rest.trailing_zeros();
                rest &= rest - 1;
                Some(place as u32 * 64 + bit)
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_inserted_and_not_removed() {
        let mut bits = Bits::empty(130);
        assert!(bits.insert(0) && bits.insert(64) && bits.insert(129));
        assert!(!bits.insert(64));
        assert!(bits.remove(0) && !bits.remove(0));
        assert_eq!(bits.iter().collect::<Vec<_>>(), [64, 129]);
        assert!(bits.contains(129) && !bits.contains(0));
        let mut growing = Bits::default();
        assert!(growing.insert_growing(200) && growing.holds(200) && !growing.holds(1_000));
    }
}
