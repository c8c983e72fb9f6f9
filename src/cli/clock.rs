//! The clock: the only place that asks what time it is.

use jiff::Timestamp;
use std::time::Duration;

/// The time now.
#[expect(
    clippy::disallowed_methods,
    reason = "the door to the clock: which windows of zones count"
)]
pub(super) fn now() -> Timestamp {
    Timestamp::now()
}

/// Does something, and tells how long that took.
#[expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the door to the clock: how long an answer took"
)]
pub(super) fn timed<T>(act: impl FnOnce() -> T) -> (T, Duration) {
    let before = std::time::Instant::now();
    let outcome = act();
    (outcome, before.elapsed())
}

/// A duration in microseconds, as answers tell it.
pub(super) fn microseconds(duration: Duration) -> f64 {
    duration.as_nanos() as f64 / 1e3
}
