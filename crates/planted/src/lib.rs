//! Bugs that are built in on purpose, so that the tests of faults can show that they would find them.
//!
//! One build has all of them, and one of them is chosen at run time. Without the feature `planted` there are none:
//! [`is`] is false before the program runs, and whatever asks it is compiled to nothing.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// With [`Bug::AcknowledgeBeforeCommit`] a write is committed so long after its answer: a kill finds it in between on any
/// machine.
pub const COMMITS_LATER: Duration = Duration::from_millis(20);

/// A bug.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bug {
    /// A write is answered before it is committed.
    AcknowledgeBeforeCommit,
    /// A write is committed in two halves.
    HalfBatch,
    /// A deletion is left out of what followers are told.
    SkipTombstone,
    /// A registry that was restored from a backup, or an edge that starts again, goes on in its old epoch.
    KeepEpoch,
    /// What comes from the disk is not checked against its digest.
    TrustTheDisk,
    /// After a failed commit the write is acknowledged as if it had not failed.
    IgnoreFailedCommit,
    /// An edge forgets what it has not forwarded yet when it starts again.
    DropOutbox,
    /// An edge follows a registry of another id.
    AcceptForeignId,
    /// An edge takes a page of an older revision.
    AcceptOlderRevision,
    /// An edge does not check the checksum of what it is sent.
    AcceptBadChecksum,
    /// An edge applies the deletions of a page that it refuses.
    DeleteFromBadPage,
    /// An edge moves its cursor before what it stands for is in force.
    CursorFirst,
    /// An edge answers from before the zones that its stated revision has.
    StaleAnswer,
    /// An edge looks at all plans that a change meets before it enforces the change.
    PlansFirst,
    /// An edge commits what was found for a plan though a closure that came since meets it.
    ClosedBetween,
    /// An edge passes over the deletions of the pages that it follows.
    PassOverTombstone,
    /// The figures of one way back into the network beside the path of another.
    SwappedStart,
    /// What closes the leg of a drone is forgotten where its ways back are looked for.
    DroppedCause,
    /// A leg that the network does not have counts as open.
    RemovedLegOpen,
    /// The margin of a window is that of the entry to a leg, whenever the drone leaves it.
    MarginAtEntry,
    /// The battery that a drone reports is passed over for that of its plan.
    PlansBattery,
    /// The first stretch is left out of an answer.
    StretchForgotten,
    /// Every answer says that it leaves a zone.
    FlagWithoutGround,
    /// Pads that other plans have reserved count as free.
    PadTwice,
    /// Ways back lead to closed nodes, too.
    ClosedNodeEntered,
    /// A drone on the ground in a zone is answered as one in the air.
    GroundSentUp,
}

impl Bug {
    /// All of them.
    pub const ALL: [Self; 26] = [
        Self::AcknowledgeBeforeCommit,
        Self::HalfBatch,
        Self::SkipTombstone,
        Self::KeepEpoch,
        Self::TrustTheDisk,
        Self::IgnoreFailedCommit,
        Self::DropOutbox,
        Self::AcceptForeignId,
        Self::AcceptOlderRevision,
        Self::AcceptBadChecksum,
        Self::DeleteFromBadPage,
        Self::CursorFirst,
        Self::StaleAnswer,
        Self::PlansFirst,
        Self::ClosedBetween,
        Self::PassOverTombstone,
        Self::SwappedStart,
        Self::DroppedCause,
        Self::RemovedLegOpen,
        Self::MarginAtEntry,
        Self::PlansBattery,
        Self::StretchForgotten,
        Self::FlagWithoutGround,
        Self::PadTwice,
        Self::ClosedNodeEntered,
        Self::GroundSentUp,
    ];

    /// The name by which it is chosen.
    pub fn name(self) -> &'static str {
        match self {
            Self::AcknowledgeBeforeCommit => "acknowledge-before-commit",
            Self::HalfBatch => "half-batch",
            Self::SkipTombstone => "skip-tombstone",
            Self::KeepEpoch => "keep-epoch",
            Self::TrustTheDisk => "trust-the-disk",
            Self::IgnoreFailedCommit => "ignore-failed-commit",
            Self::DropOutbox => "drop-outbox",
            Self::AcceptForeignId => "accept-foreign-id",
            Self::AcceptOlderRevision => "accept-older-revision",
            Self::AcceptBadChecksum => "accept-bad-checksum",
            Self::DeleteFromBadPage => "delete-from-bad-page",
            Self::CursorFirst => "cursor-first",
            Self::StaleAnswer => "stale-answer",
            Self::PlansFirst => "plans-first",
            Self::ClosedBetween => "closed-between",
            Self::PassOverTombstone => "pass-over-tombstone",
            Self::SwappedStart => "swapped-start",
            Self::DroppedCause => "dropped-cause",
            Self::RemovedLegOpen => "removed-leg-open",
            Self::MarginAtEntry => "margin-at-entry",
            Self::PlansBattery => "plans-battery",
            Self::StretchForgotten => "stretch-forgotten",
            Self::FlagWithoutGround => "flag-without-ground",
            Self::PadTwice => "pad-twice",
            Self::ClosedNodeEntered => "closed-node-entered",
            Self::GroundSentUp => "ground-sent-up",
        }
    }
}

/// There is no bug of this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownBug(String);

impl fmt::Display for UnknownBug {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = Bug::ALL.map(Bug::name).join(", ");
        write!(
            formatter,
            "there is no bug '{}': take one of {names}",
            self.0
        )
    }
}

impl std::error::Error for UnknownBug {}

impl FromStr for Bug {
    type Err = UnknownBug;

    fn from_str(name: &str) -> Result<Self, UnknownBug> {
        let found = Self::ALL.into_iter().find(|bug| bug.name() == name);
        found.ok_or_else(|| UnknownBug(name.to_owned()))
    }
}

/// Whether this is the bug that was chosen.
#[cfg(not(feature = "planted"))]
#[inline(always)]
pub const fn is(_bug: Bug) -> bool {
    false
}

/// Whether answers leave that the checker has not let pass: so that a judge from outside has faults to find.
#[cfg(not(feature = "planted"))]
#[inline(always)]
pub const fn is_unchecked() -> bool {
    false
}

#[cfg(feature = "planted")]
pub use chosen::{from_now_on, here, is, is_unchecked, leave_unchecked, plant};

/// The choice: one for the whole process, and one for each thread that makes its own.
#[cfg(feature = "planted")]
mod chosen {
    use super::Bug;
    use std::cell::Cell;
    use std::sync::OnceLock;

    static CHOSEN: OnceLock<Bug> = OnceLock::new();

    thread_local! {
        static HERE: Cell<Option<Bug>> = const { Cell::new(None) };
    }

    /// Chooses a bug for the whole process, once; later choices change nothing.
    pub fn plant(bug: Bug) {
        let _ = CHOSEN.set(bug);
    }

    /// Chooses a bug for this thread as long as `work` takes: for simulations, which live in one thread.
    pub fn here<T>(bug: Bug, work: impl FnOnce() -> T) -> T {
        HERE.set(Some(bug));
        let done = work();
        HERE.set(None);
        done
    }

    /// Chooses a bug for this thread as long as it lives: for one that an edge of its own has started.
    pub fn from_now_on(bug: Bug) {
        HERE.set(Some(bug));
    }

    static UNCHECKED: OnceLock<()> = OnceLock::new();

    /// Lets answers leave that the checker has not let pass, from now on.
    pub fn leave_unchecked() {
        let _ = UNCHECKED.set(());
    }

    /// Whether answers leave that the checker has not let pass.
    pub fn is_unchecked() -> bool {
        UNCHECKED.get().is_some()
    }

    /// Whether this is the bug that was chosen.
    pub fn is(bug: Bug) -> bool {
        HERE.get() == Some(bug) || CHOSEN.get() == Some(&bug)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bug_has_a_name_of_its_own() {
        for bug in Bug::ALL {
            assert_eq!(bug.name().parse(), Ok(bug));
        }
        assert!("typo".parse::<Bug>().is_err());
    }

    #[cfg(not(feature = "planted"))]
    #[test]
    fn nothing_is_planted_without_the_feature() {
        assert!(Bug::ALL.into_iter().all(|bug| !is(bug)));
    }
}
