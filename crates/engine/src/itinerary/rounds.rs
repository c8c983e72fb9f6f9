//! What rounds of a search may take of the limits of a request.

use super::request::{Effort, Limits};

/// What is left of labels and checks for the search among all others, where one among fewer reaches a bound: one part in
/// so many.
const LAST_ROUND_SHARE: usize = 4;

/// How many labels and checks there may have been at the end of a round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Most {
    pub(super) labels: usize,
    pub(super) checks: usize,
    /// How many labels there were before it.
    pub(super) labels_before: usize,
}

impl Most {
    pub(super) fn of(limits: Limits<'_>) -> Self {
        Self {
            labels: limits.labels,
            checks: limits.checks,
            labels_before: 0,
        }
    }

    /// The last round may take all; any other leaves something for it.
    pub(super) fn in_round(limits: Limits<'_>, is_last: bool, before: Effort) -> Self {
        let most = |all: usize| match is_last {
            true => all,
            false => all - all / LAST_ROUND_SHARE,
        };
        Self {
            labels: most(limits.labels),
            checks: most(limits.checks),
            labels_before: before.labels,
        }
    }
}

/// Whether one part in so many of the labels or checks is spent.
pub(super) fn has_spent(effort: Effort, limits: Limits<'_>, share: usize) -> bool {
    effort.checks >= limits.checks / share || effort.labels >= limits.labels / share
}
