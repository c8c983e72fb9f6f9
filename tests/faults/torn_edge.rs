//! The write-ahead log of an edge's file, cut and bent where chance will have it: what opens is what the edge had after
//! some write, or it says that it is damaged. Bodies that are bent in the file itself are never taken for what was written.

#![expect(
    clippy::disallowed_methods,
    reason = "tests of faults damage the files of edges"
)]

use crate::failing_edge_disk::alone;
use crate::history::{Act, Holding, Outcome, Recorder};
use crate::registry_client::Client;
use crate::rounds::{Chance, rounds, seed};
use crate::square::tag_in;
use crate::store_file::copy_file;
use crate::torn_file::{PAGE, TEARS, Tear, WHILE, bodies};
use crate::writers::{Crowd, Habit};
use serde_json::Value;
use skyway::edge::{SqliteFile, StoreFault, StoreFile, Table};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The file of an edge that was killed, and what it had after each write.
struct Made {
    file: PathBuf,
    states: Vec<Holding>,
    _folder: TempDir,
}

async fn made() -> Made {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("edge.db");
    let plan = alone(folder.path(), &file);
    let daemon = plan.start().await;
    let client = Client::of_edge(&plan.address);
    let recorder = Recorder::default();
    // One after the other, so that each is a transaction of its own.
    let crowd = Crowd::of(&client, "w", Habit::AT_EDGE, (seed(), 1), &recorder);
    tokio::time::sleep(WHILE).await;
    crowd.end().await;
    daemon.kill();
    let mut states = vec![Holding::new()];
    for operation in recorder.operations() {
        let mut state = states.last().cloned().unwrap_or_default();
        match (&operation.act, &operation.outcome) {
            (Act::Put { id, tag }, Outcome::Done(_)) => state.insert(id.clone(), tag.clone()),
            (Act::Delete { id }, Outcome::Done(_)) => state.remove(id),
            (_, Outcome::Unknown) => panic!("no answer: {operation}"),
            _ => continue,
        };
        states.push(state);
    }
    Made {
        file,
        states,
        _folder: folder,
    }
}

/// What a file gives to an edge that starts.
async fn opened(file: &Path) -> Result<Holding, StoreFault> {
    let mut opened = SqliteFile::open(file).await?;
    let mut holding = Holding::new();
    for table in [Table::Zones, Table::Closures, Table::Plans] {
        for (id, body) in opened.load(table).await? {
            let body: Value = serde_json::from_str(&body).unwrap_or_default();
            let tag = match table {
                Table::Zones => tag_in(&body["zone"]),
                Table::Closures => {
                    tag_in(&serde_json::json!({"reason": body["closure"]["cause"]["operator"]}))
                }
                _ if body["ended_as"] == "cancelled" => continue,
                _ => tag_in(&body),
            };
            holding.insert(id, tag);
        }
    }
    Box::new(opened).close().await;
    Ok(holding)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_torn_log_is_a_beginning_or_an_error() {
    let made = made().await;
    let folder = TempDir::new().expect("a folder");
    let torn = folder.path().join("edge.db");
    let wal = folder.path().join("edge.db-wal");
    let whole = PathBuf::from(format!("{}-wal", made.file.display()));
    let length = std::fs::metadata(whole).map_or(0, |it| it.len());
    assert!(
        length > 20 * PAGE,
        "there is little to tear: {length} bytes"
    );
    copy_file(&made.file, &torn);
    let all = opened(&torn).await.expect("it is not torn yet");
    assert_eq!(Some(&all), made.states.last(), "seed {}", seed());
    let mut chance = Chance::of(seed(), 12_000);
    let (tears, mut loud, mut shorter) = (rounds(20) * TEARS, 0, 0);
    for number in 0..tears {
        copy_file(&made.file, &torn);
        let tear = Tear::draw(&mut chance, length);
        tear.apply(&wal, &mut chance);
        match opened(&torn).await {
            Err(_) => loud += 1,
            Ok(holding) if made.states.contains(&holding) => shorter += 1,
            Ok(holding) => panic!("seed {}, tear {number}, {tear:?}: {holding:?}", seed()),
        }
    }
    println!(
        "{tears} tears of {length} bytes with {} writes at an edge: {shorter} open as a beginning, {loud} say that they are damaged",
        made.states.len() - 1
    );
}

/// How many bent bodies were taken for what was written, out of how many.
async fn taken_bent(times: usize) -> usize {
    let made = made().await;
    let folder = TempDir::new().expect("a folder");
    let bent = folder.path().join("edge.db");
    // The process that closes it moves everything into the file itself.
    opened(&made.file).await.expect("a file");
    let mut chance = Chance::of(seed(), 13_000);
    let mut taken = 0;
    for _ in 0..times {
        copy_file(&made.file, &bent);
        let mut bytes = std::fs::read(&bent).expect("read");
        let places = bodies(&bytes);
        assert!(places.len() > 5, "there is little to bend");
        let drawn = usize::try_from(chance.below(places.len() as u64)).expect("a place");
        bytes[places[drawn]] ^= 1 << chance.below(3);
        std::fs::write(&bent, bytes).expect("written");
        // A body that stands in no row any more belongs to nothing.
        if let Ok(holding) = opened(&bent).await
            && Some(&holding) != made.states.last()
        {
            taken += 1;
        }
    }
    taken
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_bent_in_the_file_is_never_enforced() {
    let times = rounds(20);
    assert_eq!(taken_bent(times).await, 0, "seed {}", seed());
    println!("{times} bodies bent in the file of an edge, none taken");
}

#[cfg(feature = "planted")]
#[test]
fn its_bug_is_found() {
    use skyway::planted::{Bug, here};
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = runtime.enable_all().build().expect("a runtime");
    let taken = here(Bug::TrustTheDisk, || runtime.block_on(taken_bent(10)));
    println!("trust-the-disk is found: {taken} of 10 bent bodies were taken");
    assert!(taken > 0, "bent bodies were not found to be taken");
}
