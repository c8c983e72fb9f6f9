//! Edges whose registry lies, or is reached over a line that breaks, or that leads to another registry: what was good
//! stays in service, nothing false is taken over, and it is over when the line is good again.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::false_registry::FalseRegistry;
use crate::outcome::Came;
use crate::party::Party;
use crate::proxy::Line;
use crate::rounds::{Chance, rounds, seed};
use crate::stage::Stage;
use std::time::{Duration, Instant};

/// How many lies are told for each round that was asked for.
const LIES: usize = 20;
/// Of a hundred answers.
const LIES_OF_A_HUNDRED: u64 = 80;
/// Edges that are lied to at once: each asks again after a pause only.
const LIED_TO: [&str; 8] = [
    "east", "inner", "lower", "north", "outer", "south", "upper", "west",
];
/// Asked often, so that stories are short.
const HURRIED: [&str; 1] = ["registry.retry_within=100ms"];
/// How long a line is in one state: at least, at most.
const WHILE: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(150)];
const LINES: [Line; 6] = [
    Line::Good,
    Line::BlackHole,
    Line::Reset,
    Line::Cut,
    Line::Bent,
    Line::Slow,
];

/// How many lies were told, and of which kinds.
struct Lied(Came, String);

async fn lied_to(bug: Option<&'static str>, lies: usize) -> Lied {
    let mut between = None;
    let mut stage = Stage::behind(&LIED_TO, bug, &HURRIED, async |registry| {
        let chance = Chance::of(seed(), 9_000);
        let liar = FalseRegistry::before(registry, chance).await;
        between.insert(liar).address.clone()
    })
    .await;
    let liar = between.expect("it stands there");
    let party = Party::gather(&stage, 1);
    party.recorder.goes_on(0).await;
    liar.liar().of_a_hundred = LIES_OF_A_HUNDRED;
    let begun = Instant::now();
    while liar.count() < lies && begun.elapsed() < crate::daemon::WAIT_AT_MOST * 4 {
        tokio::time::sleep(WHILE[0]).await;
    }
    liar.liar().of_a_hundred = 0;
    let told = format!("{} lies:{}", liar.count(), liar.liar());
    let came = party.judge(&mut stage, true).await;
    assert!(liar.count() >= lies, "too few: {told}");
    Lied(came, told)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_false_is_taken_over() {
    let lies = rounds(10) * LIES;
    let Lied(came, told) = lied_to(None, lies).await;
    println!("{told}");
    came.is_right(&format!("{} edges lied to", LIED_TO.len()), 20);
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bugs_are_found() {
    let bugs = [
        "accept-bad-checksum",
        "accept-older-revision",
        "delete-from-bad-page",
    ];
    for bug in bugs {
        let lies = rounds(20).min(20) * LIES;
        lied_to(Some(bug), lies).await.0.finds(bug);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn edges_follow_over_lines_that_break() {
    let mut stage = Stage::set(&["north", "south"], None, &HURRIED).await;
    let party = Party::gather(&stage, 1);
    let mut chance = Chance::of(seed(), 7_000);
    let states = rounds(20);
    for _ in 0..states {
        let edge = usize::try_from(chance.below(2)).unwrap_or_default();
        let line = usize::try_from(chance.below(LINES.len() as u64)).unwrap_or_default();
        stage.edges[edge].line.becomes(LINES[line]);
        tokio::time::sleep(chance.between(WHILE[0], WHILE[1])).await;
    }
    let came = party.judge(&mut stage, true).await;
    came.is_right(&format!("two edges over lines in {states} states"), states);
}
