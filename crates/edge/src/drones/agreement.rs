//! What the positions of a drone say of its conformance (ASTM F3548): one says little, as receivers err by metres;
//! several in a row do.

use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// Of so many positions
const REMEMBERED: u32 = 5;
/// so many have to deviate,
const DEVIATING: u32 = 3;
/// or all for so long.
const DEVIATING_FOR: SignedDuration = SignedDuration::from_secs(5);

/// What of a position is not as planned, from the worst to the least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Deviation {
    /// It is beside its way.
    Lateral,
    /// It stands where it was not to land.
    Landed,
    /// It is above or below its way.
    Vertical,
    /// It is early or late.
    Time,
}

/// How the last positions of a drone agree with its plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Agreement {
    plan: Arc<str>,
    /// The newest in the lowest bit: whether each deviated.
    deviated: u32,
    count: u32,
    /// Since when all have.
    since: Option<Timestamp>,
    /// How the newest does.
    pub(crate) newest: Option<Deviation>,
}

/// What telemetry says of a drone's conformance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Conformance {
    Conforms,
    Deviates,
    /// Neither: too few positions agree.
    Unclear,
}

impl Agreement {
    /// The agreement with one position more.
    pub(crate) fn after(
        before: Option<&Self>,
        plan: &Arc<str>,
        seen_at: Timestamp,
        newest: Option<Deviation>,
    ) -> Self {
        let before = before.filter(|before| before.plan == *plan);
        let deviated = before.map_or(0, |before| before.deviated);
        let since = before.and_then(|before| before.since);
        Self {
            plan: plan.clone(),
            deviated: (deviated << 1 | u32::from(newest.is_some())) & ((1 << REMEMBERED) - 1),
            count: before.map_or(0, |before| before.count).min(REMEMBERED - 1) + 1,
            since: newest.and(since.or(Some(seen_at))),
            newest,
        }
    }

    pub(crate) fn is_of(&self, plan: &str) -> bool {
        *self.plan == *plan
    }

    /// What the positions so far say, at the time of the newest.
    pub(crate) fn conformance(&self, seen_at: Timestamp) -> Conformance {
        let deviates_for = self.since.map(|since| seen_at.duration_since(since));
        let is_long = deviates_for.is_some_and(|span| span >= DEVIATING_FOR);
        if is_long || self.deviated.count_ones() >= DEVIATING {
            return Conformance::Deviates;
        }
        let last = (1 << DEVIATING) - 1;
        match self.count >= DEVIATING && self.deviated & last == 0 {
            true => Conformance::Conforms,
            false => Conformance::Unclear,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(second: i64) -> Timestamp {
        Timestamp::from_second(second).expect("an instant")
    }

    /// What positions a second apart say, each deviating or not.
    fn said(deviating: &[bool], every_s: i64) -> Conformance {
        let plan: Arc<str> = Arc::from("p");
        let mut agreement = None;
        let mut seen_at = at(0);
        for deviates in deviating {
            seen_at = at(seen_at.as_second() + every_s);
            let newest = deviates.then_some(Deviation::Lateral);
            agreement = Some(Agreement::after(agreement.as_ref(), &plan, seen_at, newest));
        }
        agreement.map_or(Conformance::Unclear, |agreement| {
            agreement.conformance(seen_at)
        })
    }

    #[test]
    fn three_of_five_positions_or_five_seconds_deviate() {
        let (off, on) = (true, false);
        assert_eq!(said(&[off, off], 1), Conformance::Unclear);
        assert_eq!(said(&[off, on, off, on, off], 1), Conformance::Deviates);
        assert_eq!(
            said(&[off, on, on, on, on, off, on, off], 1),
            Conformance::Unclear
        );
        assert_eq!(said(&[off, off], 5), Conformance::Deviates);
        assert_eq!(said(&[off, off, off, on, on], 1), Conformance::Deviates);
        assert_eq!(said(&[off, off, off, on, on, on], 1), Conformance::Conforms);
        assert_eq!(said(&[on, on], 1), Conformance::Unclear);
    }
}
