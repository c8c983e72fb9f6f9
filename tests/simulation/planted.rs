//! Bugs that have to be found: with each of them some seed ends badly.

use crate::rounds::seed;
use crate::run::run;
use skyway::planted::{Bug, here};

/// Seeds that may go by before a bug is found.
const SEEDS: u64 = 30;

#[track_caller]
fn is_found(bug: Bug) {
    let first = seed();
    for seed in first..first + SEEDS {
        let came = here(bug, || run(seed));
        if let Some(violation) = came.violations.first() {
            let (name, count) = (bug.name(), came.violations.len());
            println!("{name} is found by seed {seed}: {count} violations, the first: {violation}");
            return;
        }
    }
    panic!(
        "{} is not found by {SEEDS} seeds from {first} on",
        bug.name()
    );
}

#[test]
fn acknowledge_before_commit_is_found() {
    is_found(Bug::AcknowledgeBeforeCommit);
}

#[test]
fn skip_tombstone_is_found() {
    is_found(Bug::SkipTombstone);
}

#[test]
fn keep_epoch_is_found() {
    is_found(Bug::KeepEpoch);
}

#[test]
fn accept_foreign_id_is_found() {
    is_found(Bug::AcceptForeignId);
}

#[test]
fn accept_older_revision_is_found() {
    is_found(Bug::AcceptOlderRevision);
}

#[test]
fn accept_bad_checksum_is_found() {
    is_found(Bug::AcceptBadChecksum);
}

#[test]
fn delete_from_bad_page_is_found() {
    is_found(Bug::DeleteFromBadPage);
}

#[test]
fn cursor_first_is_found() {
    is_found(Bug::CursorFirst);
}

#[test]
fn stale_answer_is_found() {
    is_found(Bug::StaleAnswer);
}

#[test]
fn drop_outbox_is_found() {
    is_found(Bug::DropOutbox);
}

#[test]
fn pass_over_tombstone_is_found() {
    is_found(Bug::PassOverTombstone);
}
