//! The write-ahead log of a store, cut and bent where chance will have it: what opens is what was there at some commit,
//! or it says that it is damaged. Bodies that are bent in the file itself are never served.

#![expect(
    clippy::disallowed_methods,
    reason = "tests of faults damage the files of stores"
)]

use crate::daemon::Plan;
use crate::history::{Holding, Logged, holding_at};
use crate::registry_client::{All, Client, NETWORK};
use crate::rounds::{Chance, rounds, seed};
use crate::store_file;
use crate::writers::Crowd;
use skyway::registry::open_store;
use skyway::registry::store::{ChangesQuery, ObjectsQuery, Store, StoreError};
use skyway::wire::{LoggedChange, ObjectKind};
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

const WRITERS: u64 = 3;
/// How long is written before the store is torn.
pub(crate) const WHILE: Duration = Duration::from_millis(400);
/// How many tears are made for each round that was asked for.
pub(crate) const TEARS: usize = 10;
/// What stands before each page in the write-ahead log, and at its beginning, in bytes.
const FRAME_HEAD: u64 = 24;
const LOG_HEAD: u64 = 32;
pub(crate) const PAGE: u64 = 4_096;

/// A store with something in its write-ahead log, and what a registry says is in it.
async fn made() -> (TempDir, All) {
    let folder = TempDir::new().expect("a folder");
    let store = folder.path().join("registry.db").display().to_string();
    let plan = Plan::registry(folder.path(), &store, &[]);
    let daemon = plan.start().await;
    let client = Client::new(&plan.address);
    client.put_network().await;
    let crowd = Crowd::gather(&plan.address, seed(), WRITERS);
    tokio::time::sleep(WHILE).await;
    crowd.end().await;
    let all = client.read_log().await.expect("a log");
    daemon.kill();
    (folder, all)
}

/// How a file is damaged.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tear {
    /// What follows is not there.
    Cut(u64),
    /// One bit of this byte is another.
    Flip(u64),
    /// From there on there are zeros, as after a power failure.
    Zeros(u64),
}

impl Tear {
    /// Near the borders of frames, or anywhere.
    pub(crate) fn draw(chance: &mut Chance, length: u64) -> Self {
        let frames = length.saturating_sub(LOG_HEAD) / (FRAME_HEAD + PAGE);
        let border = LOG_HEAD + chance.below(frames + 1) * (FRAME_HEAD + PAGE);
        let place = match chance.below(2) {
            0 => (border + chance.below(FRAME_HEAD + 8)).saturating_sub(4),
            _ => chance.below(length),
        };
        let place = place.min(length.saturating_sub(1));
        match chance.below(3) {
            0 => Self::Cut(place),
            1 => Self::Flip(place),
            _ => Self::Zeros(place),
        }
    }

    pub(crate) fn apply(self, file: &Path, chance: &mut Chance) {
        let mut bytes = std::fs::read(file).expect("read");
        let place = |place: u64| usize::try_from(place).expect("a place");
        match self {
            Self::Cut(at) => bytes.truncate(place(at)),
            Self::Flip(at) => bytes[place(at)] ^= 1 << chance.below(8),
            Self::Zeros(at) => bytes[place(at)..].fill(0),
        }
        std::fs::write(file, bytes).expect("written");
    }
}

/// What a store gives, read as followers read it.
struct Given {
    head: u64,
    changes: Vec<LoggedChange>,
    holding: Holding,
}

async fn read(store: &dyn Store) -> Result<Given, StoreError> {
    let mut given = Given {
        head: 0,
        changes: Vec::new(),
        holding: Holding::new(),
    };
    let Some(state) = store.network(NETWORK).await? else {
        return Ok(given);
    };
    given.head = state.head;
    let mut after = 0;
    while after < state.head {
        let query = ChangesQuery {
            network: NETWORK.to_owned(),
            after,
            changes: 100,
            bytes: 1 << 20,
        };
        let read = store.changes(&query).await?;
        let changes = read.map(|read| read.changes).unwrap_or_default();
        let Some(last) = changes.last() else {
            break;
        };
        after = last.revision;
        given.changes.extend(changes);
    }
    let query = ObjectsQuery {
        network: NETWORK.to_owned(),
        at: None,
        kind: Some(ObjectKind::Zone),
        after: None,
        limit: u64::MAX >> 1,
        bytes: u64::MAX >> 1,
    };
    let objects = store.objects(&query).await?.map(|read| read.objects);
    let objects = objects.into_iter().flatten();
    let tagged = objects.map(|it| (it.id, crate::square::tag_of(&it.body.unwrap_or_default())));
    given.holding = tagged.collect();
    Ok(given)
}

/// What is wrong with what a torn store gives, where it does not say that it is damaged itself.
async fn opened(folder: &Path, all: &All) -> Result<Vec<String>, StoreError> {
    let name = folder.join("registry.db").display().to_string();
    let store = open_store(&name).await?;
    let given = read(&*store).await;
    store.close().await;
    let given = given?;
    let mut wrong = Vec::new();
    if !all.changes.starts_with(&given.changes) {
        wrong.push("its changes are not those that were made".to_owned());
    }
    let last = given.changes.last().map_or(0, |change| change.revision);
    if last != given.head {
        wrong.push(format!("it ends with {last}, and says {}", given.head));
    }
    let log: Vec<Logged> = all.log();
    if given.holding != holding_at(&log, given.head) {
        wrong.push(format!("what holds is not that of revision {}", given.head));
    }
    Ok(wrong)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_torn_log_is_a_beginning_or_an_error() {
    let (folder, all) = made().await;
    let torn = TempDir::new().expect("a folder");
    let wal = torn.path().join("registry.db-wal");
    let length = std::fs::metadata(folder.path().join("registry.db-wal")).map_or(0, |it| it.len());
    assert!(
        length > 20 * PAGE,
        "there is little to tear: {length} bytes"
    );
    let mut chance = Chance::of(seed(), 3_000);
    let (tears, mut loud, mut shorter) = (rounds(20) * TEARS, 0, 0);
    for number in 0..tears {
        store_file::copy(folder.path(), torn.path());
        let tear = Tear::draw(&mut chance, length);
        tear.apply(&wal, &mut chance);
        match opened(torn.path(), &all).await {
            Err(_) => loud += 1,
            Ok(wrong) if wrong.is_empty() => shorter += 1,
            Ok(wrong) => panic!("seed {}, tear {number}, {tear:?}: {wrong:?}", seed()),
        }
    }
    println!(
        "{tears} tears of {length} bytes with {} revisions: {shorter} open as a beginning, {loud} say that they are damaged",
        all.head
    );
}

/// Where bodies of zones stand in the file.
pub(crate) fn bodies(bytes: &[u8]) -> Vec<usize> {
    let pattern = b"\"reason\":\"w";
    let starts = bytes.windows(pattern.len()).enumerate();
    let starts = starts.filter(|(_, window)| window == pattern);
    starts.map(|(place, _)| place + pattern.len() - 1).collect()
}

/// How many bent bodies were served out of how many.
async fn served_bent(times: usize) -> usize {
    let (folder, all) = made().await;
    let torn = TempDir::new().expect("a folder");
    let file = torn.path().join("registry.db");
    let mut chance = Chance::of(seed(), 4_000);
    // The last to close the store moves everything into the file itself.
    let name = folder.path().join("registry.db").display().to_string();
    open_store(&name).await.expect("a store").close().await;
    let mut served = 0;
    for _ in 0..times {
        store_file::copy(folder.path(), torn.path());
        let mut bytes = std::fs::read(&file).expect("read");
        let places = bodies(&bytes);
        assert!(places.len() > 20, "there is little to bend");
        let drawn = usize::try_from(chance.below(places.len() as u64)).expect("a place");
        bytes[places[drawn]] ^= 1 << chance.below(3);
        std::fs::write(&file, bytes).expect("written");
        // A body that stands in no row any more, or in a free page, belongs to nothing.
        if let Ok(wrong) = opened(torn.path(), &all).await
            && !wrong.is_empty()
        {
            served += 1;
        }
    }
    served
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_bent_in_the_file_is_never_served() {
    let times = rounds(20);
    assert_eq!(served_bent(times).await, 0, "seed {}", seed());
    println!("{times} bodies bent, none served");
}

#[cfg(feature = "planted")]
#[test]
fn its_bug_is_found() {
    use skyway::planted::{Bug, here};
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = runtime.enable_all().build().expect("a runtime");
    let served = here(Bug::TrustTheDisk, || runtime.block_on(served_bent(5)));
    println!("trust-the-disk is found: {served} of 5 bent bodies were served");
    assert!(served > 0, "bent bodies were not found to be served");
}
