//! What rounds of a search may take of the limits of a request.

use super::request::{Effort, Limits};

/// As often a plan that meets others is looked for again with those that it meets, before all others count.
const ROUNDS_AMONG_FEW: usize = 12;
/// For at most one part in so many of the labels and checks.
const SHARE_AMONG_FEW: usize = 2;
/// And as many checks at most where so many are left that a search among all others most often ends: in dense traffic each round
/// meets others again.
const CHECKS_AMONG_FEW: usize = 10_000;
const CHECKS_AMONG_ALL: usize = 100_000;
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

/// Whether all others count from the next round on.
pub(super) fn is_last_of_few(round: usize, effort: Effort, limits: Limits<'_>) -> bool {
    let may_end_among_all = limits.checks >= effort.checks + CHECKS_AMONG_ALL;
    let has_tried = may_end_among_all && effort.checks >= CHECKS_AMONG_FEW;
    has_tried || has_spent(round, effort, limits)
}

/// Whether rounds have taken all that they may.
pub(super) fn has_spent(round: usize, effort: Effort, limits: Limits<'_>) -> bool {
    round >= ROUNDS_AMONG_FEW
        || effort.checks >= limits.checks / SHARE_AMONG_FEW
        || effort.labels >= limits.labels / SHARE_AMONG_FEW
}
