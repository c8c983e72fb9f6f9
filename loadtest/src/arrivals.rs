//! When requests are meant to be sent: decided beforehand, whatever the server does.

use crate::scenario::Arrivals;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::time::Duration;

/// Numbers at random, the same for the same seed.
pub(crate) struct Chance(ChaCha8Rng);

impl Chance {
    pub(crate) fn of(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// From 0 up to, but not, 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of this many; 0 where there is none.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

/// A schedule without end.
pub(crate) struct Schedule {
    arrivals: Arrivals,
    gap_s: f64,
    chance: Chance,
    number: u64,
    at_s: f64,
}

impl Schedule {
    pub(crate) fn new(arrivals: Arrivals, rate_per_s: f64, seed: u64) -> Self {
        Self {
            arrivals,
            gap_s: 1.0 / rate_per_s,
            chance: Chance::of(seed),
            number: 0,
            at_s: 0.0,
        }
    }

    /// When the next request is due, from the start of the schedule.
    pub(crate) fn next_offset(&mut self) -> Duration {
        self.number += 1;
        self.at_s = match self.arrivals {
            // By the number and not by adding up, which would drift.
            Arrivals::Constant => self.number as f64 * self.gap_s,
            Arrivals::Poisson => self.at_s - (1.0 - self.chance.unit()).ln() * self.gap_s,
        };
        Duration::from_secs_f64(self.at_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offsets(mut schedule: Schedule) -> impl Iterator<Item = Duration> {
        std::iter::repeat_with(move || schedule.next_offset())
    }

    fn count_until(schedule: Schedule, seconds: u64) -> usize {
        let end = Duration::from_secs(seconds);
        offsets(schedule).take_while(|at| *at < end).count()
    }

    #[test]
    fn both_kinds_keep_their_rate() {
        let constant = Schedule::new(Arrivals::Constant, 1000.0, 1);
        assert_eq!(count_until(constant, 10), 9_999);
        let poisson = count_until(Schedule::new(Arrivals::Poisson, 1000.0, 1), 100);
        // Three standard deviations of a Poisson count are 3 * sqrt(100,000).
        assert!((99_051..=100_949).contains(&poisson), "{poisson}");
    }

    #[test]
    fn gaps_of_poisson_arrivals_are_exponential() {
        let times: Vec<Duration> = offsets(Schedule::new(Arrivals::Poisson, 1.0, 7))
            .take(100_000)
            .collect();
        let gaps_s = times
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).as_secs_f64());
        let longer_than_mean = gaps_s.filter(|gap_s| *gap_s > 1.0).count() as f64 / 1e5;
        let expected = (-1.0_f64).exp();
        assert!(
            (longer_than_mean - expected).abs() < 0.01,
            "{longer_than_mean}"
        );
    }

    #[test]
    fn the_same_seed_gives_the_same_times() {
        let times = |seed| -> Vec<Duration> {
            offsets(Schedule::new(Arrivals::Poisson, 50.0, seed))
                .take(100)
                .collect()
        };
        assert_eq!(times(3), times(3));
        assert_ne!(times(3), times(4));
    }
}
