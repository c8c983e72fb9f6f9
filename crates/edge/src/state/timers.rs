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

impl Due {
    /// Whether it opens something, or lets it go: not before both clocks say so, where one has stepped.
    fn frees(&self) -> bool {
        match self {
            Self::Closure(_)
            | Self::Proposal(_)
            | Self::Quote(_)
            | Self::Arrival { .. }
            | Self::Silence(_) => true,
            Self::Acknowledgement { .. }
            | Self::Departure(_)
            | Self::TakeOff(_)
            | Self::Sign(_)
            | Self::Way(_) => false,
        }
    }
}

type ByInstant = BTreeMap<(Timestamp, u64), Due>;

/// Timers by their instant; of the same instant in the order they were set.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    /// What frees nothing.
    prompt: ByInstant,
    /// What frees something.
    freeing: ByInstant,
    set: u64,
}

impl Timers {
    pub(crate) fn set(&mut self, at: Timestamp, due: Due) {
        self.set += 1;
        let timers = match due.frees() {
            true => &mut self.freeing,
            false => &mut self.prompt,
        };
        timers.insert((at, self.set), due);
    }

    /// The first instant at which anything is due, beside a clock that is so far behind, as a negative span.
    pub(crate) fn next(&self, behind: SignedDuration) -> Option<Timestamp> {
        let first = |timers: &ByInstant| timers.keys().next().map(|&(instant, _)| instant);
        let freeing = first(&self.freeing);
        let freeing = freeing.and_then(|due| due.saturating_sub(behind).ok());
        first(&self.prompt).into_iter().chain(freeing).min()
    }

    /// Takes the first timer that is due by now, with the instant that counts for it.
    pub(crate) fn pop(
        &mut self,
        now: Timestamp,
        behind: SignedDuration,
    ) -> Option<(Due, Timestamp)> {
        let both_now = now.saturating_add(behind).unwrap_or(now);
        let first = |timers: &ByInstant, now: Timestamp| {
            let key = timers.keys().next().copied();
            key.filter(|&(instant, _)| instant <= now)
        };
        let prompt = first(&self.prompt, now);
        let freeing = first(&self.freeing, both_now);
        match (prompt, freeing) {
            (Some(key), other) if other.is_none_or(|other| key < other) => {
                Some((self.prompt.remove(&key)?, now))
            }
            (_, Some(key)) => Some((self.freeing.remove(&key)?, both_now)),
            _ => None,
        }
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
