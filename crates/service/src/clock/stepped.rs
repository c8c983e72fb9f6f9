//! Whether the wall clock can be believed: judged by a clock that only goes forward, which it must not leave at once.
//!
//! The judge is pure: it is handed readings of both clocks. While the wall clock is followed it tells the time; once
//! it has stepped away, the time goes on as before it, and the wall clock is doubted until somebody confirms it or it
//! comes back.

use jiff::{SignedDuration, Timestamp};
use std::time::Duration;

/// A wall clock that is farther than this from where it should be has stepped.
pub const STEP: SignedDuration = SignedDuration::from_secs(5);
/// Of the time that has passed, at most one part in this many is put down to a clock that is being adjusted. Daemons
/// that adjust clocks stay below one in twelve.
const FOLLOWED: i32 = 10;

/// What both clocks say at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// The time.
    pub now: Timestamp,
    /// How far the wall clock is ahead of it, where it has stepped and no operator has confirmed that.
    pub apart: Option<SignedDuration>,
    /// How often the wall clock has stepped so far.
    pub steps: u64,
    /// How often a step was confirmed.
    pub confirmations: u64,
}

impl Reading {
    /// The reading of a clock that never steps.
    pub fn of(now: Timestamp) -> Self {
        Self {
            now,
            apart: None,
            steps: 0,
            confirmations: 0,
        }
    }
}

/// The judge of a wall clock.
#[derive(Clone, Debug)]
pub struct SteppedClock {
    /// Where the wall clock should have been when it was last read.
    steady: Timestamp,
    /// The other clock's time then.
    read_at: Duration,
    is_doubted: bool,
    steps: u64,
    confirmations: u64,
}

impl SteppedClock {
    /// Believes the wall clock as it is now; `monotonic` is the time of the clock that only goes forward.
    pub fn new(wall: Timestamp, monotonic: Duration) -> Self {
        Self {
            steady: wall,
            read_at: monotonic,
            is_doubted: false,
            steps: 0,
            confirmations: 0,
        }
    }

    /// Goes on after a restart from when the time was last known: it does not go back behind that, and a wall clock that was
    /// so far ahead and not confirmed still is, unless it shows that it was set right meanwhile.
    pub fn resume(&mut self, known: Timestamp, apart: Option<SignedDuration>) {
        let wall = self.steady;
        let apart = apart.filter(|&apart| match apart.is_negative() {
            true => wall < known,
            false => known.saturating_add(apart).is_ok_and(|ahead| ahead <= wall),
        });
        let steady = apart.and_then(|apart| wall.saturating_sub(apart).ok());
        self.steady = steady.unwrap_or(wall).max(known);
    }

    /// Judges a reading of both clocks.
    pub fn read(&mut self, wall: Timestamp, monotonic: Duration) -> Reading {
        let elapsed = monotonic.saturating_sub(self.read_at);
        let elapsed = SignedDuration::try_from(elapsed).unwrap_or(SignedDuration::MAX);
        self.read_at = self.read_at.max(monotonic);
        self.steady = self
            .steady
            .saturating_add(elapsed)
            .unwrap_or(Timestamp::MAX);
        let apart = wall.duration_since(self.steady);
        if apart.abs() <= STEP {
            self.is_doubted = false;
            let most = elapsed / FOLLOWED;
            let followed = apart.clamp(-most, most);
            self.steady = self.steady.saturating_add(followed).unwrap_or(self.steady);
            return self.reading(wall, None);
        }
        self.steps += u64::from(!self.is_doubted);
        self.is_doubted = true;
        self.reading(self.steady, Some(apart))
    }

    /// Believes the wall clock from now on; tells how far it had stepped, if it had.
    pub fn confirm(&mut self, wall: Timestamp, monotonic: Duration) -> Option<SignedDuration> {
        let apart = self.read(wall, monotonic).apart?;
        self.steady = wall;
        self.is_doubted = false;
        self.confirmations += 1;
        Some(apart)
    }

    fn reading(&self, now: Timestamp, apart: Option<SignedDuration>) -> Reading {
        Reading {
            now,
            apart,
            steps: self.steps,
            confirmations: self.confirmations,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Timestamp {
        "2026-05-04T08:00:00Z".parse().expect("an instant")
    }

    fn s(seconds: i64) -> SignedDuration {
        SignedDuration::from_secs(seconds)
    }

    fn at(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn a_step_is_doubted_until_it_is_confirmed() {
        for by in [3_600, -3_600] {
            let mut judge = SteppedClock::new(start(), at(100));
            assert_eq!(judge.read(start() + s(10), at(110)).apart, None);
            let read = judge.read(start() + s(20 + by), at(120));
            assert_eq!(
                (read.now, read.apart, read.steps),
                (start() + s(20), Some(s(by)), 1)
            );
            let read = judge.read(start() + s(50 + by), at(150));
            assert_eq!(
                (read.now, read.apart, read.steps),
                (start() + s(50), Some(s(by)), 1)
            );
            assert_eq!(judge.confirm(start() + s(51 + by), at(151)), Some(s(by)));
            let read = judge.read(start() + s(60 + by), at(160));
            assert_eq!((read.now, read.apart), (start() + s(60 + by), None));
            assert_eq!((read.steps, read.confirmations), (1, 1));
            assert_eq!(judge.confirm(read.now, at(160)), None);
        }
    }

    #[test]
    fn the_time_does_not_go_back_over_a_restart() {
        let mut judge = SteppedClock::new(start() - s(3_600), at(0));
        judge.resume(start(), None);
        let read = judge.read(start() - s(3_590), at(10));
        assert_eq!(
            (read.now, read.apart, read.steps),
            (start() + s(10), Some(s(-3_600)), 1)
        );
    }

    #[test]
    fn a_step_that_was_not_confirmed_is_doubted_over_a_restart() {
        for by in [7_200, -7_200] {
            // Two minutes after the time was last known.
            let mut judge = SteppedClock::new(start() + s(120 + by), at(0));
            judge.resume(start(), Some(s(by)));
            let read = judge.read(start() + s(121 + by), at(1));
            assert_eq!((read.now, read.apart), (start() + s(121), Some(s(by))));
        }
        // Set right meanwhile.
        for by in [7_200, -7_200] {
            let mut judge = SteppedClock::new(start() + s(600), at(0));
            judge.resume(start(), Some(s(by)));
            let read = judge.read(start() + s(601), at(1));
            assert_eq!((read.now, read.apart), (start() + s(601), None));
        }
    }

    #[test]
    fn a_clock_that_comes_back_is_believed_again() {
        let mut judge = SteppedClock::new(start(), at(0));
        assert!(judge.read(start() + s(3_600), at(1)).apart.is_some());
        let back = judge.read(start() + s(4), at(2));
        assert_eq!(
            (back.now, back.apart, back.steps),
            (start() + s(4), None, 1)
        );
    }

    #[test]
    fn small_differences_are_followed_and_do_not_add_up() {
        let mut judge = SteppedClock::new(start(), at(0));
        // Adjusted by one second in twelve for an hour.
        let mut ahead_s = 0;
        for second in 1..=3_600_u64 {
            ahead_s = (second / 12) as i64;
            let wall = start() + s(second as i64 + ahead_s);
            assert_eq!(judge.read(wall, at(second)).apart, None, "{second}");
        }
        assert_eq!(ahead_s, 300);
    }

    #[test]
    fn many_small_steps_are_one_large_one() {
        let mut judge = SteppedClock::new(start(), at(0));
        let mut steps = (1..=3).map(|second: u64| {
            let wall = start() + s(second as i64 * 5);
            judge.read(wall, at(second)).apart
        });
        assert_eq!(steps.next(), Some(None));
        assert!(steps.next().flatten().is_some());
    }
}
