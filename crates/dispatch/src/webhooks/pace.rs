//! When a message is sent again: after waits that double up to a bound, for a day.

use std::time::Duration;

/// The wait after the first attempt.
const FIRST: Duration = Duration::from_secs(1);
/// The longest wait.
const LONGEST: Duration = Duration::from_mins(30);
/// By how much waits are spread, to both sides, so that what failed together is not sent again together.
const SPREAD: f64 = 0.2;
/// After this many attempts a message is given up; the waits between them come to a day.
pub(super) const ATTEMPTS_MAX: u32 = 59;

/// How long to wait after a number of attempts; `share` from 0 to 1 is where in the spread.
pub(super) fn wait_after(attempts: u32, share: f64) -> Duration {
    let doublings = attempts.saturating_sub(1).min(20);
    let wait = FIRST.saturating_mul(1 << doublings).min(LONGEST);
    wait.mul_f64(1.0 - SPREAD + 2.0 * SPREAD * share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_to_the_bound_and_come_to_a_day() {
        let waits: Vec<Duration> = (1..ATTEMPTS_MAX)
            .map(|made| wait_after(made, 0.5))
            .collect();
        assert_eq!(waits[..3], [1, 2, 4].map(Duration::from_secs));
        assert!(waits.iter().all(|wait| *wait <= LONGEST));
        let hours = waits.iter().sum::<Duration>().as_secs_f64() / 3600.0;
        assert!((24.0..25.0).contains(&hours), "{hours}");
        assert_eq!(wait_after(u32::MAX, 0.5), LONGEST);
    }

    #[test]
    fn waits_are_spread_to_both_sides() {
        assert_eq!(wait_after(1, 0.0), Duration::from_millis(800));
        assert_eq!(wait_after(1, 1.0), Duration::from_millis(1_200));
    }
}
