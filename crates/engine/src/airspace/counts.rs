//! How many causes close each thing, shared between snapshots except where they differ.

use std::sync::Arc;

const CHUNK: usize = 512;

/// A counter per index, copied on write in chunks: a change copies what it touches, not the network.
#[derive(Clone, Debug)]
pub(super) struct Counts {
    chunks: Vec<Arc<[u32; CHUNK]>>,
}

impl Counts {
    /// All counters at 0; they share one chunk until they differ.
    pub(super) fn zero(length: usize) -> Self {
        let chunk = Arc::new([0; CHUNK]);
        Self {
            chunks: vec![chunk; length.div_ceil(CHUNK)],
        }
    }

    /// Counts one cause more; true for the first.
    pub(super) fn raise(&mut self, index: u32) -> bool {
        let counter = self.counter(index);
        *counter += 1;
        *counter == 1
    }

    /// Counts one cause less; true when none is left.
    pub(super) fn lower(&mut self, index: u32) -> bool {
        let counter = self.counter(index);
        debug_assert!(*counter > 0, "a cause that ends has begun");
        *counter = counter.saturating_sub(1);
        *counter == 0
    }

    fn counter(&mut self, index: u32) -> &mut u32 {
        let (chunk, place) = (index as usize / CHUNK, index as usize % CHUNK);
        &mut Arc::make_mut(&mut self.chunks[chunk])[place]
    }
}
