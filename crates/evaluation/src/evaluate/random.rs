//! Seeded random numbers of the evaluation: the same draws from the same seed, on every machine.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};

/// 2 to the power -53: the step of doubles below 1 that have all the bits drawn.
const STEP: f64 = 1.0 / (1_u64 << 53) as f64;

/// A stream of numbers for one purpose.
pub(super) struct Random(ChaCha8Rng);

impl Random {
    /// The stream of a seed for a purpose, such as the name of a cell; other purposes draw other numbers.
    pub(super) fn new(seed: u64, purpose: &str) -> Self {
        let mut hasher = Sha256::new();
        hasher.update(seed.to_le_bytes());
        hasher.update(purpose.as_bytes());
        Self(ChaCha8Rng::from_seed(hasher.finalize().into()))
    }

    /// A number in `0..1`.
    pub(super) fn share(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * STEP
    }

    /// A whole number below `count`, which is above 0.
    pub(super) fn below(&mut self, count: usize) -> usize {
        // The upper half of a product maps 32 bits evenly enough: the bias is below 1 in a hundred thousand.
        ((u64::from(self.0.next_u32()) * count as u64) >> 32) as usize
    }
}
