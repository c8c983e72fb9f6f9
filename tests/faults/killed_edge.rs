//! Edges and their registry, killed again and again while zones, closures and plans are written at all of them: nothing
//! acknowledged is lost anywhere, nothing is done in halves or twice, no edge goes behind what it has stored, and in the
//! end all have the same.

use crate::edge_file;
use crate::outcome::Came;
use crate::party::Party;
use crate::rounds::{Chance, rounds, seed};
use crate::stage::Stage;
use std::time::Duration;

/// How long the one lives each time that is killed: at least, at most.
const LIFE: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(60)];
const WRITERS_EACH: u64 = 2;

async fn killed(bug: Option<&'static str>, kills: usize) -> Came {
    // The second is never killed: it learns of the zones of the first through the registry.
    let mut stage = Stage::set(&["north", "south"], bug, &[]).await;
    let party = Party::gather(&stage, WRITERS_EACH);
    let mut chance = Chance::of(seed(), 6_000);
    let (mut slowest, mut of_registry, mut acknowledged) = (Duration::ZERO, 0, 0);
    let mut faults = Vec::new();
    for _ in 0..kills {
        acknowledged = party.recorder.goes_on(acknowledged).await;
        tokio::time::sleep(chance.between(LIFE[0], LIFE[1])).await;
        if chance.below(4) == 0 {
            of_registry += 1;
            stage.kill_registry();
            stage.start_registry().await;
            continue;
        }
        stage.kill_edge(0);
        faults.extend(edge_file::faults(&stage.edges[0].store).await);
        slowest = slowest.max(stage.start_edge(0).await);
    }
    let mut came = party.judge(&mut stage, false).await;
    came.adds("in the file", faults);
    println!(
        "{kills} kills, {of_registry} of them of the registry, the slowest start of an edge {slowest:?}"
    );
    came
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_acknowledged_is_lost() {
    let kills = rounds(20);
    let came = killed(None, kills).await;
    came.is_right(&format!("edge and registry killed {kills} times"), kills);
}

#[cfg(feature = "planted")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_bugs_are_found() {
    let bugs = [
        "acknowledge-before-commit",
        "half-batch",
        "drop-outbox",
        "keep-epoch",
        "pass-over-tombstone",
        "cursor-first",
        "stale-answer",
    ];
    for bug in bugs {
        let kills = match bug {
            // A kill has to come between two commits, which takes some luck.
            "half-batch" => 120,
            _ => rounds(20).min(30),
        };
        killed(Some(bug), kills).await.finds(bug);
    }
}
