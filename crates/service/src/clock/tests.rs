//! Clocks of every kind: what they show, and when they wake who sleeps.

use super::*;
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

fn start() -> Timestamp {
    "2026-05-04T08:00:00Z".parse().expect("an instant")
}

#[test]
fn a_clock_by_hand_moves_when_its_hand_does() {
    let (clock, hand) = Clock::by_hand(start());
    let stopwatch = clock.stopwatch();
    assert_eq!(clock.now(), start());
    assert_eq!(clock.kind(), ClockKind::Simulated);
    hand.advance(SignedDuration::from_millis(90));
    assert_eq!(
        clock.clone().now(),
        start() + SignedDuration::from_millis(90)
    );
    assert_eq!(stopwatch.elapsed_us(), 90_000.0);
    hand.set(start() - SignedDuration::from_secs(1));
    assert_eq!(stopwatch.elapsed(), Duration::ZERO);
    hand.advance(SignedDuration::MAX);
    assert_eq!(clock.now(), Timestamp::MAX);
}

#[test]
fn who_sleeps_wakes_when_the_hand_reaches_the_instant_and_not_before() {
    let (clock, hand) = Clock::by_hand(start());
    let noon = start() + SignedDuration::from_hours(4);
    assert_eq!(clock.real_duration_until(noon), None);
    let mut sleep = pin!(clock.sleep_until(noon));
    let mut context = Context::from_waker(Waker::noop());
    assert_eq!(sleep.as_mut().poll(&mut context), Poll::Pending);
    hand.set(noon - SignedDuration::from_nanos(1));
    assert_eq!(sleep.as_mut().poll(&mut context), Poll::Pending);
    hand.set(noon);
    assert_eq!(sleep.as_mut().poll(&mut context), Poll::Ready(()));
    assert_eq!(clock.real_duration_until(noon), Some(Duration::ZERO));
    // The hand does not move any more: an instant ahead never comes.
    drop(hand);
    let mut never = pin!(clock.sleep_until(noon + SignedDuration::from_secs(1)));
    assert_eq!(never.as_mut().poll(&mut context), Poll::Pending);
}

#[test]
fn a_clock_that_clients_move_goes_forward_only() {
    let clock = Clock::external(start());
    assert_eq!((clock.kind(), clock.rate()), (ClockKind::External, 0.0));
    let noon = start() + SignedDuration::from_hours(4);
    assert_eq!(clock.real_duration_until(noon), None);
    let other = clock.clone();
    clock.move_to(noon);
    clock.move_to(start());
    assert_eq!(other.now(), noon);
    other.resume(start(), None);
    assert_eq!(clock.now(), start());
}

#[test]
fn simulated_time_passes_at_its_rate() {
    let simulation = |rate| Simulation {
        start: start(),
        rate,
        began: monotonic_now(),
    };
    let minute = Duration::from_secs(60);
    let after = |rate| simulation(rate).after(minute);
    assert_eq!(after(1.0), start() + SignedDuration::from_mins(1));
    assert_eq!(after(60.0), start() + SignedDuration::from_hours(1));
    assert_eq!(after(0.5), start() + SignedDuration::from_secs(30));
    assert_eq!(after(1e30), Timestamp::MAX);
    assert_eq!(scaled(minute, 60.0), Duration::new(1, 1));
    assert_eq!(scaled(minute, 0.001), LONGEST_WAIT);
    assert_eq!(scaled(Duration::MAX, 1e-300), LONGEST_WAIT);
}

#[test]
fn a_simulated_clock_starts_where_it_is_told_and_says_what_it_is() {
    let clock = Clock::simulated(start(), 10.0);
    let first = clock.now();
    assert!(first >= start() && clock.now() >= first, "{first}");
    assert_eq!(clock.kind(), ClockKind::Simulated);
    assert_eq!(clock.real_duration_until(start()), Some(Duration::ZERO));
    let standing = Clock::simulated(start(), f64::NAN);
    assert!(standing.now() < start() + SignedDuration::from_hours(1));
}

#[test]
fn no_wait_for_the_machine_is_long() {
    let clock = Clock::real();
    assert_eq!(clock.kind(), ClockKind::Real);
    let wait = |instant| clock.real_duration_until(instant);
    assert_eq!(wait(Timestamp::MAX), Some(LONGEST_WAIT));
    assert_eq!(wait(Timestamp::MIN), Some(Duration::ZERO));
}
