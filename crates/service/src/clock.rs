//! The clock: the only part of the service that asks what time it is.
//!
//! It is the machine's, or a simulation's with a start and a rate of its own, or one that a client moves, or a test by
//! hand. Code that needs the time is handed a [`Clock`]; a copy of it is cheap and tells the same time.
//!
//! The machine's wall clock is judged by its time that only goes forward: while it has stepped away from that and
//! no operator has confirmed it, the time goes on as it went before.

mod stepped;
#[cfg(test)]
mod tests;

pub use stepped::{Reading, STEP, SteppedClock};

use crate::wire::ClockKind;
use jiff::{SignedDuration, Timestamp};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::watch;

/// No wait is longer, as the machine's clock may be set while one waits.
const LONGEST_WAIT: Duration = Duration::from_secs(30);

#[expect(
    clippy::disallowed_types,
    reason = "the door to the clock: time that only goes forward"
)]
type Monotonic = std::time::Instant;

/// What tells the time.
#[derive(Clone, Debug)]
pub struct Clock(Source);

#[derive(Clone, Debug)]
enum Source {
    Real(Arc<Machine>),
    Simulated(Simulation),
    Runtime(RuntimeTime),
    External(Arc<watch::Sender<Timestamp>>),
    ByHand(watch::Receiver<Timestamp>),
    Manual(Arc<Judged<watch::Receiver<Times>>>),
}

/// The wall clock's time, and that of a clock that only goes forward.
#[derive(Clone, Copy, Debug)]
struct Times {
    wall: Timestamp,
    monotonic: Duration,
}

/// The machine's two clocks.
type Machine = Judged<Monotonic>;

/// Two clocks, one judged by the other.
#[derive(Debug)]
struct Judged<C> {
    clocks: C,
    judge: Mutex<SteppedClock>,
}

/// Where times are read.
trait TwoClocks {
    fn times(&self) -> Times;
}

/// The machine's, counted from an instant on.
impl TwoClocks for Monotonic {
    fn times(&self) -> Times {
        Times {
            wall: machine_now(),
            monotonic: monotonic_since(*self),
        }
    }
}

impl TwoClocks for watch::Receiver<Times> {
    fn times(&self) -> Times {
        *self.borrow()
    }
}

impl<C: TwoClocks> Judged<C> {
    fn new(clocks: C) -> Self {
        let Times { wall, monotonic } = clocks.times();
        let judge = Mutex::new(SteppedClock::new(wall, monotonic));
        Self { clocks, judge }
    }

    fn reading(&self) -> Reading {
        // Read under the lock, so that no reading is judged after a later one.
        let mut judge = self.lock();
        let Times { wall, monotonic } = self.clocks.times();
        judge.read(wall, monotonic)
    }

    fn confirm(&self) -> Option<SignedDuration> {
        let mut judge = self.lock();
        let Times { wall, monotonic } = self.clocks.times();
        judge.confirm(wall, monotonic)
    }

    // The judge is whole after every call, so a panic elsewhere cannot spoil it.
    fn lock(&self) -> MutexGuard<'_, SteppedClock> {
        self.judge.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Time that began at an instant of its own and passes at a rate of its own.
#[derive(Clone, Copy, Debug)]
struct Simulation {
    start: Timestamp,
    rate: f64,
    began: Monotonic,
}

impl Simulation {
    /// The simulated instant once so much real time has passed; beyond the calendar, its last.
    fn after(&self, elapsed: Duration) -> Timestamp {
        let passed_s = elapsed.as_secs_f64() * self.rate;
        let passed = SignedDuration::try_from_secs_f64(passed_s).ok();
        passed
            .and_then(|passed| self.start.checked_add(passed).ok())
            .unwrap_or(Timestamp::MAX)
    }
}

/// Time that began at an instant of its own and passes as that of the runtime, which a simulation pauses.
#[derive(Clone, Copy, Debug)]
struct RuntimeTime {
    start: Timestamp,
    began: tokio::time::Instant,
}

impl RuntimeTime {
    fn now(&self) -> Timestamp {
        let elapsed = SignedDuration::try_from(self.began.elapsed()).ok();
        elapsed
            .and_then(|elapsed| self.start.checked_add(elapsed).ok())
            .unwrap_or(Timestamp::MAX)
    }
}

impl Clock {
    /// The machine's clock.
    pub fn real() -> Self {
        Self(Source::Real(Arc::new(Judged::new(monotonic_now()))))
    }

    /// A clock that shows `start` now and runs `rate` times as fast as the machine's. A rate that is not a
    /// positive number counts as 1; the configuration refuses it before.
    pub fn simulated(start: Timestamp, rate: f64) -> Self {
        let is_rate = rate.is_finite() && rate > 0.0;
        Self(Source::Simulated(Simulation {
            start,
            rate: if is_rate { rate } else { 1.0 },
            began: monotonic_now(),
        }))
    }

    /// A clock that shows `start` now and goes on with the time of the runtime: where that is paused, it moves only
    /// when nothing else can happen.
    pub fn of_runtime(start: Timestamp) -> Self {
        Self(Source::Runtime(RuntimeTime {
            start,
            began: tokio::time::Instant::now(),
        }))
    }

    /// A clock that shows `start` until a client moves it. How long something takes is still measured on the machine's.
    pub fn external(start: Timestamp) -> Self {
        Self(Source::External(Arc::new(watch::Sender::new(start))))
    }

    /// A clock that shows `start` until its hand is moved.
    pub fn by_hand(start: Timestamp) -> (Self, ManualClock) {
        let (hand, clock) = watch::channel(start);
        (Self(Source::ByHand(clock)), ManualClock(hand))
    }

    /// A clock as the machine's, of which both the wall clock and the time that only goes forward are moved by hand.
    pub fn by_two_hands(start: Timestamp) -> (Self, ManualClocks) {
        let (hands, clocks) = watch::channel(Times {
            wall: start,
            monotonic: Duration::ZERO,
        });
        let clock = Self(Source::Manual(Arc::new(Judged::new(clocks))));
        (clock, ManualClocks(hands))
    }

    /// The time now.
    pub fn now(&self) -> Timestamp {
        self.reading().now
    }

    /// The time now, and whether the wall clock has stepped away from it.
    pub fn reading(&self) -> Reading {
        match &self.0 {
            Source::Real(machine) => machine.reading(),
            Source::Manual(clocks) => clocks.reading(),
            Source::Simulated(simulation) => {
                Reading::of(simulation.after(monotonic_since(simulation.began)))
            }
            Source::Runtime(time) => Reading::of(time.now()),
            Source::External(clock) => Reading::of(*clock.borrow()),
            Source::ByHand(clock) => Reading::of(*clock.borrow()),
        }
    }

    /// Moves a clock that clients move, forward only; every other one goes on as it does.
    pub fn move_to(&self, instant: Timestamp) {
        if let Source::External(clock) = &self.0 {
            clock.send_modify(|now| *now = instant.max(*now));
        }
    }

    /// Goes on from when its edge ended: a clock that clients move stands there, and a wall clock that is behind it, or that
    /// was so far ahead and not confirmed, has stepped.
    pub fn resume(&self, known: Timestamp, apart: Option<SignedDuration>) {
        match &self.0 {
            Source::External(clock) => {
                clock.send_replace(known);
            }
            Source::Real(machine) => machine.lock().resume(known, apart),
            Source::Manual(clocks) => clocks.lock().resume(known, apart),
            Source::Simulated(_) | Source::Runtime(_) | Source::ByHand(_) => {}
        }
    }

    /// Believes the wall clock from now on; tells how far it had stepped, if it had.
    pub fn confirm(&self) -> Option<SignedDuration> {
        match &self.0 {
            Source::Real(machine) => machine.confirm(),
            Source::Manual(clocks) => clocks.confirm(),
            Source::Simulated(_) | Source::Runtime(_) | Source::External(_) | Source::ByHand(_) => {
                None
            }
        }
    }

    /// What answers say of this clock. One moved by hand is no more real than a simulator's.
    pub fn kind(&self) -> ClockKind {
        match &self.0 {
            Source::Real(_) | Source::Manual(_) => ClockKind::Real,
            Source::Simulated(_) | Source::Runtime(_) | Source::ByHand(_) => ClockKind::Simulated,
            Source::External(_) => ClockKind::External,
        }
    }

    /// How many of its seconds pass in one of the machine's; 0 for one that stands still until it is moved.
    pub fn rate(&self) -> f64 {
        match &self.0 {
            Source::Real(_) | Source::Runtime(_) => 1.0,
            Source::Simulated(simulation) => simulation.rate,
            Source::External(_) | Source::ByHand(_) | Source::Manual(_) => 0.0,
        }
    }

    /// Starts to measure how long something takes: on the machine's time that only goes forward, or on
    /// the hand's.
    pub fn stopwatch(&self) -> Stopwatch {
        match &self.0 {
            Source::Real(_) | Source::Simulated(_) | Source::External(_) | Source::Manual(_) => {
                Stopwatch(Began::Machine(monotonic_now()))
            }
            Source::Runtime(_) => Stopwatch(Began::Runtime(tokio::time::Instant::now())),
            Source::ByHand(clock) => {
                let start = *clock.borrow();
                Stopwatch(Began::ByHand(clock.clone(), start))
            }
        }
    }

    /// How long to wait, in the machine's time, before it is worth asking whether `instant` has come: zero
    /// when it has, and never more than 30 s, as the machine's clock may be set meanwhile. None for a
    /// clock that is moved, which says nothing; [`Clock::sleep_until`] waits for that.
    pub fn real_duration_until(&self, instant: Timestamp) -> Option<Duration> {
        let left = instant.duration_since(self.now());
        let Ok(left) = Duration::try_from(left) else {
            return Some(Duration::ZERO);
        };
        if left.is_zero() {
            return Some(left);
        }
        match &self.0 {
            Source::Real(_) => Some(left.min(LONGEST_WAIT)),
            Source::Simulated(simulation) => Some(scaled(left, simulation.rate)),
            Source::Runtime(_) => Some(left),
            Source::External(_) | Source::ByHand(_) | Source::Manual(_) => None,
        }
    }

    /// Waits until `instant` has come.
    pub async fn sleep_until(&self, instant: Timestamp) {
        let moved = match &self.0 {
            Source::External(clock) => Some(clock.subscribe()),
            Source::ByHand(clock) => Some(clock.clone()),
            _ => None,
        };
        if let Some(mut clock) = moved {
            let has_come = clock.wait_for(|now| *now >= instant).await.is_ok();
            if !has_come {
                // Without its hand this clock stands still.
                std::future::pending::<()>().await;
            }
            return;
        }
        if let Source::Manual(clocks) = &self.0 {
            let mut moved = clocks.clocks.clone();
            while self.now() < instant {
                if moved.changed().await.is_err() {
                    std::future::pending::<()>().await;
                }
            }
            return;
        }
        while self.now() < instant {
            let wait = self.real_duration_until(instant);
            tokio::time::sleep(wait.unwrap_or(LONGEST_WAIT)).await;
        }
    }
}

/// Simulated time in the machine's.
fn scaled(left: Duration, rate: f64) -> Duration {
    let real_s = left.as_secs_f64() / rate;
    // Rounded up, so that whoever waits does not wake a nanosecond early and waits again for nothing.
    let real = Duration::try_from_secs_f64(real_s).unwrap_or(LONGEST_WAIT);
    real.saturating_add(Duration::from_nanos(1))
        .min(LONGEST_WAIT)
}

/// What moves a clock by hand.
#[derive(Debug)]
pub struct ManualClock(watch::Sender<Timestamp>);

impl ManualClock {
    /// Sets the clock, forward or back.
    pub fn set(&self, now: Timestamp) {
        self.0.send_replace(now);
    }

    /// Moves the clock on, to the end of the calendar at most.
    pub fn advance(&self, by: SignedDuration) {
        self.0.send_modify(|now| {
            *now = now.checked_add(by).unwrap_or(Timestamp::MAX);
        });
    }
}

/// What moves both clocks by hand.
#[derive(Debug)]
pub struct ManualClocks(watch::Sender<Times>);

impl ManualClocks {
    /// Lets time pass on both.
    pub fn advance(&self, by: Duration) {
        self.0.send_modify(|times| {
            times.monotonic = times.monotonic.saturating_add(by);
            let by = SignedDuration::try_from(by).unwrap_or(SignedDuration::MAX);
            times.wall = times.wall.checked_add(by).unwrap_or(Timestamp::MAX);
        });
    }

    /// Sets the wall clock forward or back, as somebody does who adjusts it.
    pub fn step(&self, by: SignedDuration) {
        self.0.send_modify(|times| {
            times.wall = times.wall.saturating_add(by).unwrap_or(times.wall);
        });
    }
}

/// Measures how long something takes.
#[derive(Clone, Debug)]
pub struct Stopwatch(Began);

#[derive(Clone, Debug)]
enum Began {
    Machine(Monotonic),
    Runtime(tokio::time::Instant),
    ByHand(watch::Receiver<Timestamp>, Timestamp),
}

impl Stopwatch {
    /// How long since it was started.
    pub fn elapsed(&self) -> Duration {
        match &self.0 {
            Began::Machine(began) => monotonic_since(*began),
            Began::Runtime(began) => began.elapsed(),
            Began::ByHand(clock, start) => {
                let elapsed = clock.borrow().duration_since(*start);
                // A hand moved back measures nothing.
                Duration::try_from(elapsed).unwrap_or_default()
            }
        }
    }

    /// The same in microseconds, as answers tell it.
    pub fn elapsed_us(&self) -> f64 {
        self.elapsed().as_nanos() as f64 / 1e3
    }
}

/// What the wall clock of the machine shows, whatever clock a daemon goes by.
#[expect(
    clippy::disallowed_methods,
    reason = "the door to the clock: the time of the world"
)]
pub fn machine_now() -> Timestamp {
    Timestamp::now()
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to the clock: time that only goes forward"
)]
fn monotonic_now() -> Monotonic {
    Monotonic::now()
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to the clock: time that only goes forward"
)]
fn monotonic_since(began: Monotonic) -> Duration {
    began.elapsed()
}
