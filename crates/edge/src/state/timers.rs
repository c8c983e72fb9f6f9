//! What is to happen by itself, and when. A timer that comes due is checked against the state then, so none is ever cancelled.

use jiff::{SignedDuration, Timestamp};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is due.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Due {
    /// The life of a closure that no zone causes.
    Closure(Arc<str>),
    /// A proposal that no operator decided.
    Proposal(u64),
    /// The acknowledgement of a proposed version.
    Acknowledgement { plan: Arc<str>, version: u32 },
    /// The departure of a plan.
    Departure(Arc<str>),
    /// The take-off of a drone that holds until then.
    TakeOff(Arc<str>),
    /// The end of a quote.
    Quote(Arc<str>),
    /// A plan should have ended.
    Arrival { plan: Arc<str>, version: u32 },
    /// A plan that has not ended was not heard of for long.
    Silence(Arc<str>),
    /// A drone in flight should have given a sign.
    Sign(Arc<str>),
    /// A plan without a way is looked at again: others have flown on, and pads are free.
    Way(Arc<str>),
}

/// Timers by their instant; of the same instant in the order they were set.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    by_instant: BTreeMap<(Timestamp, u64), Due>,
    set: u64,
}

impl Timers {
    pub(crate) fn set(&mut self, at: Timestamp, due: Due) {
        self.set += 1;
        self.by_instant.insert((at, self.set), due);
    }

    /// The first instant at which anything is due.
    pub(crate) fn next(&self) -> Option<Timestamp> {
        self.by_instant.keys().next().map(|&(instant, _)| instant)
    }

    /// Takes the first timer that is due by now.
    pub(crate) fn pop(&mut self, now: Timestamp) -> Option<Due> {
        let (&key, _) = self.by_instant.first_key_value()?;
        (key.0 <= now)
            .then(|| self.by_instant.remove(&key))
            .flatten()
    }
}

/// What was last heard of the clock.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HeardClock {
    /// How far the wall clock is ahead of the time, while it is doubted.
    pub(crate) apart: Option<SignedDuration>,
    pub(crate) confirmations: u64,
    /// Whether windows have to be looked at though no time has passed.
    pub(crate) has_turned: bool,
}

impl HeardClock {
    /// How far the stepped clock is behind the time, as a negative span; zero where it is not.
    pub(crate) fn behind(&self) -> SignedDuration {
        self.apart.unwrap_or_default().min(SignedDuration::ZERO)
    }
}
