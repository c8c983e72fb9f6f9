//! Pages of the log: whole transactions in their order, whatever the bounds and whatever was written.

use crate::contract::Open;
use crate::drafts::{NETWORK, commit, creation, found, gone, write, zone};
use skyway::registry::store::{ChangesQuery, NewChange, Store};
use std::collections::BTreeMap;

/// A small generator of numbers (splitmix64): the same seed, the same numbers.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below a limit.
    fn below(&mut self, limit: u64) -> u64 {
        self.roll() % limit
    }
}

/// A transaction of one to six changes, each of another zone.
fn transaction(dice: &mut Dice) -> Vec<NewChange> {
    let mut zones = BTreeMap::new();
    for _ in 0..=dice.below(6) {
        let id = format!("z{}", dice.below(12));
        let change = match dice.below(3) {
            0 => gone(&id),
            _ => zone(
                &id,
                &"x".repeat(usize::try_from(dice.below(400)).unwrap_or(0)),
            ),
        };
        zones.insert(id, change);
    }
    zones.into_values().collect()
}

/// Random transactions, read back by pages of random bounds from random places: each page is whole transactions,
/// the pages together are the log, and replaying it gives what holds.
pub(crate) async fn never_split_a_transaction(open: Open) {
    const SEEDS: u64 = 6;
    let store = open().await;
    for seed in 1..=SEEDS {
        let network = format!("{NETWORK}-{seed}");
        let mut dice = Dice(seed);
        commit(&*store, creation(&network)).await;
        let mut written: BTreeMap<u64, usize> = BTreeMap::from([(1, 1)]);
        for _ in 0..20 {
            let changes = transaction(&mut dice);
            let count = changes.len();
            let version = commit(&*store, write(&network, changes)).await;
            written.insert(version.revision, count);
        }
        for _ in 0..10 {
            let start = dice.below(22);
            read_through(&*store, &network, start, &mut dice, &written, seed).await;
        }
        replay(&*store, &network, seed).await;
    }
    store.close().await;
}

async fn read_through(
    store: &dyn Store,
    network: &str,
    start: u64,
    dice: &mut Dice,
    written: &BTreeMap<u64, usize>,
    seed: u64,
) {
    let mut after = start;
    loop {
        let query = ChangesQuery {
            network: network.to_owned(),
            after,
            changes: 1 + dice.below(12),
            bytes: 1 + dice.below(1_500),
        };
        let read = found(store.changes(&query).await);
        let Some(last) = read.changes.last() else {
            assert_eq!(after, read.state.head, "seed {seed}: {query:?}");
            return;
        };
        let mut found: BTreeMap<u64, usize> = BTreeMap::new();
        for change in &read.changes {
            *found.entry(change.revision).or_default() += 1;
        }
        let expected: BTreeMap<u64, usize> = written
            .range(after + 1..=last.revision)
            .map(|(revision, count)| (*revision, *count))
            .collect();
        assert_eq!(found, expected, "seed {seed}: {query:?}");
        let bytes: usize = read
            .changes
            .iter()
            .filter_map(|change| change.body.as_ref())
            .map(String::len)
            .sum();
        let is_within = read.changes.len() as u64 <= query.changes && bytes as u64 <= query.bytes;
        assert!(is_within || found.len() == 1, "seed {seed}: {query:?}");
        after = last.revision;
    }
}

/// What a follower has that applies the whole log is what the store says holds.
async fn replay(store: &dyn Store, network: &str, seed: u64) {
    let query = ChangesQuery {
        network: network.to_owned(),
        after: 1,
        changes: 10_000,
        bytes: 1 << 30,
    };
    let read = found(store.changes(&query).await);
    let mut followed = BTreeMap::new();
    for change in read.changes {
        match change.body {
            Some(body) => followed.insert(change.id, body),
            None => followed.remove(&change.id),
        };
    }
    let query = skyway::registry::store::ObjectsQuery {
        network: network.to_owned(),
        at: None,
        kind: None,
        after: None,
        limit: 1_000,
        bytes: 1 << 30,
    };
    let read = found(store.objects(&query).await);
    let held = read.objects.into_iter();
    let held: BTreeMap<String, String> = held
        .map(|object| (object.id, object.body.unwrap_or_default()))
        .collect();
    assert_eq!(followed, held, "seed {seed}");
    assert_eq!(read.state.zones as usize, followed.len(), "seed {seed}");
}

pub(crate) async fn end_where_they_are_told_to(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    let three = || vec![zone("a", "1234"), zone("b", "1234"), zone("c", "1234")];
    for _ in 0..4 {
        commit(&*store, write(NETWORK, three())).await;
    }
    let ends = async |after, changes, bytes| {
        let query = ChangesQuery {
            network: NETWORK.to_owned(),
            after,
            changes,
            bytes,
        };
        let read = found(store.changes(&query).await);
        read.changes.last().map_or(after, |change| change.revision)
    };
    assert_eq!(ends(1, 1, 1 << 20).await, 2, "one whole revision at least");
    assert_eq!(ends(1, 6, 1 << 20).await, 3);
    assert_eq!(ends(1, 8, 1 << 20).await, 3, "and no half one more");
    assert_eq!(ends(1, 100, 1 << 20).await, 5);
    assert_eq!(ends(1, 100, 24).await, 3);
    assert_eq!(ends(1, 100, 1).await, 2);
    assert_eq!(ends(5, 1, 1).await, 5);
    assert_eq!(ends(9, 1, 1).await, 9);
    store.close().await;
}
