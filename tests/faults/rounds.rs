//! How much is done, and by what chance: a seed makes a run, except for what the machine's scheduler does.

#![expect(
    clippy::disallowed_methods,
    reason = "tests of faults are told by the environment how long they may take"
)]

use std::time::Duration;

/// How many rounds each story makes: `SKYWAY_FAULT_ROUNDS`, or a few.
pub(crate) fn rounds(few: usize) -> usize {
    let asked = std::env::var("SKYWAY_FAULT_ROUNDS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(few)
}

/// The seed of this run: `SKYWAY_FAULT_SEED`, or always the same.
pub(crate) fn seed() -> u64 {
    let asked = std::env::var("SKYWAY_FAULT_SEED").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(2026)
}

/// Random numbers (SplitMix64).
#[derive(Clone, Debug)]
pub(crate) struct Chance(u64);

impl Chance {
    /// The chance of one who takes part, by the seed and a number of its own.
    pub(crate) fn of(seed: u64, number: u64) -> Self {
        let mut chance = Self(seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        chance.next();
        chance
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number below a bound.
    pub(crate) fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound.max(1)
    }

    /// A time between two.
    pub(crate) fn between(&mut self, least: Duration, most: Duration) -> Duration {
        let span = u64::try_from((most - least).as_micros()).unwrap_or(u64::MAX);
        least + Duration::from_micros(self.below(span.max(1)))
    }
}
