//! Random numbers for generated networks: the same from the same seed, on every machine and in
//! every version.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// 2 to the power -53: the step of doubles below 1 that have all the bits drawn.
const STEP: f64 = 1.0 / (1_u64 << 53) as f64;

/// A stream of numbers that a seed determines.
///
/// ChaCha8, keyed by the seed in little-endian order and zeros. The mapping to doubles is written
/// out here because those of the `rand` crates change between their versions.
pub struct Seeded(ChaCha8Rng);

impl Seeded {
    /// The stream of this seed.
    pub fn new(seed: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        Self(ChaCha8Rng::from_seed(key))
    }

    /// A number in `0..1`: the upper 53 bits of the next 64.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * STEP
    }

    /// A number in `lower..upper`.
    pub fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.unit()
    }

    /// A whole number in `0..count`.
    pub fn below(&mut self, count: u16) -> u16 {
        (self.unit() * f64::from(count)) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_numbers_for_ever() {
        let mut seeded = Seeded::new(1);
        let drawn = [seeded.unit(), seeded.unit()];
        assert_eq!(drawn, [0.381489413238261, 0.2949273257816749]);
        assert!((0..1000).all(|_| (0.0..1.0).contains(&seeded.unit())));
    }
}
