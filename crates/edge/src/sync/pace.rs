//! How long to wait before the registry is asked again: full jitter after failures, a budget for hurried retries,
//! and polls that never fall into step with those of other edges.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::time::Duration;

/// The longest wait after the first failure; it doubles with each further one.
const FIRST: Duration = Duration::from_millis(100);
/// Retries that may be hurried in a row.
const BUDGET: f64 = 10.0;
/// What a success adds to the budget.
const EARNED: f64 = 0.1;
/// By how much polls are spread, to both sides.
const SPREAD: f64 = 0.2;
/// 2 to the power -53: the step of doubles below 1 that have all the bits drawn.
const STEP: f64 = 1.0 / (1_u64 << 53) as f64;

/// The pace of one loop.
#[derive(Debug)]
pub(super) struct Pace {
    random: ChaCha8Rng,
    most: Duration,
    failures: u32,
    budget: f64,
}

impl Pace {
    pub(super) fn new(seed: u64, most: Duration) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        Self {
            random: ChaCha8Rng::from_seed(key),
            most: most.max(FIRST),
            failures: 0,
            budget: BUDGET,
        }
    }

    fn unit(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 * STEP
    }

    /// It has worked.
    pub(super) fn succeeded(&mut self) {
        self.failures = 0;
        self.budget = (self.budget + EARNED).min(BUDGET);
    }

    /// It has failed: how long to wait, anything up to a bound that doubles, or about the longest bound once the
    /// budget is used up.
    pub(super) fn failed(&mut self) -> Duration {
        let doublings = self.failures.min(20);
        self.failures += 1;
        if self.budget < 1.0 {
            let share = 0.5 + self.unit() / 2.0;
            return self.most.mul_f64(share);
        }
        self.budget -= 1.0;
        let bound = FIRST.saturating_mul(1 << doublings).min(self.most);
        let share = self.unit();
        bound.mul_f64(share)
    }

    /// About so long, a fifth more or less.
    pub(super) fn spread(&mut self, about: Duration) -> Duration {
        let share = 1.0 - SPREAD + 2.0 * SPREAD * self.unit();
        about.mul_f64(share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: Duration = Duration::from_mins(1);

    #[test]
    fn waits_grow_to_the_bound_and_never_beyond() {
        for seed in 0..200 {
            let mut pace = Pace::new(seed, MOST);
            for attempt in 0..10_u32 {
                let bound = FIRST.saturating_mul(1 << attempt).min(MOST);
                assert!(pace.failed() <= bound, "seed {seed}, attempt {attempt}");
            }
            // The budget is used up: no request hurries any more.
            let patient = pace.failed();
            assert!(patient >= MOST / 2 && patient <= MOST, "seed {seed}");
            pace.succeeded();
            assert!(
                pace.failed() >= MOST / 2,
                "one success earns no retry, seed {seed}"
            );
            for _ in 0..20 {
                pace.succeeded();
            }
            assert!(pace.failed() <= FIRST, "seed {seed}");
        }
    }

    #[test]
    fn polls_are_spread_by_a_fifth() {
        let about = Duration::from_secs(10);
        let mut pace = Pace::new(7, MOST);
        let waits: Vec<Duration> = (0..1_000).map(|_| pace.spread(about)).collect();
        let (least, most) = (waits.iter().min(), waits.iter().max());
        assert!(least.is_some_and(|least| *least >= Duration::from_secs(8)));
        assert!(most.is_some_and(|most| *most <= Duration::from_secs(12)));
        assert!(waits.iter().any(|wait| *wait < Duration::from_secs(9)));
        assert!(waits.iter().any(|wait| *wait > Duration::from_secs(11)));
    }
}
