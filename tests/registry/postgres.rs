//! The suite on PostgreSQL: a private cluster that the test starts on a socket of its own, and ends.

use crate::cluster::cluster;
use crate::contract::{self, Case};
use crate::documents;
use crate::drafts::{NETWORK, commit, creation, found, write, zone};
use skyway::registry::PostgresStore;
use skyway::registry::store::Store;
use std::sync::Arc;
use std::time::Duration;

/// Longer than anything takes, so that a test that hangs fails.
const WAIT_AT_MOST: Duration = Duration::from_secs(60);

async fn open(url: &str) -> Arc<dyn Store> {
    let opened = PostgresStore::open(url, "0123456789abcdef").await;
    Arc::new(opened.expect("a store"))
}

#[tokio::test]
async fn the_contract_holds() {
    let Some(cluster) = cluster() else {
        return;
    };
    let cases = contract::CASES.iter().chain(documents::CASES);
    for (number, Case { name, run }) in cases.enumerate() {
        let url = cluster.database(&format!("case_{number}"));
        let open = contract::opener(move || {
            let url = url.clone();
            Box::pin(async move { open(&url).await })
        });
        let ran = tokio::spawn(run(open)).await;
        ran.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// Two processes over one database: neither gets in the way of the other, and each hears of the other's writes.
#[tokio::test]
async fn two_registries_share_a_database() {
    let Some(cluster) = cluster() else {
        return;
    };
    let url = cluster.database("shared");
    // Both make the tables at once.
    let (first, second) = tokio::join!(open(&url), open(&url));
    commit(&*first, creation(NETWORK)).await;
    let identities = (first.identity().await, second.identity().await);
    assert_eq!(identities.0, identities.1);
    let heard = {
        let second = second.clone();
        tokio::spawn(async move { second.hint().await })
    };
    let writes = [&first, &second].map(|store| {
        let store = store.clone();
        tokio::spawn(async move {
            for number in 0..20 {
                let id = format!("{:p}-{number}", Arc::as_ptr(&store));
                commit(&*store, write(NETWORK, vec![zone(&id, "{}")])).await;
            }
        })
    });
    for write in writes {
        write.await.expect("written");
    }
    let state = found(first.network(NETWORK).await);
    assert_eq!((state.head, state.zones), (41, 40));
    let told = tokio::time::timeout(WAIT_AT_MOST, async {
        let mut number = 0;
        while !heard.is_finished() {
            number += 1;
            let id = format!("again-{number}");
            commit(&*first, write(NETWORK, vec![zone(&id, "{}")])).await;
            tokio::task::yield_now().await;
        }
    });
    told.await.expect("the second hears of the first");
    first.close().await;
    second.close().await;
}

/// Who asks may go away at any moment, as clients do that hang up: nothing of that is left to those who ask afterwards.
#[tokio::test]
async fn questions_that_are_given_up_spoil_no_connection() {
    let Some(cluster) = cluster() else {
        return;
    };
    let store = open(&cluster.database("given_up")).await;
    commit(&*store, creation(NETWORK)).await;
    let later = async |turns: u64| {
        for _ in 0..turns {
            tokio::task::yield_now().await;
        }
    };
    // Each is given up a little later than the one before, until they are answered; then again.
    for number in 0..150 {
        tokio::select! {
            biased;
            told = store.network(NETWORK) => drop(told.expect("answers")),
            () = later(40 * (number % 75)) => {}
        }
        let id = format!("z{number}");
        commit(&*store, write(NETWORK, vec![zone(&id, "{}")])).await;
        let state = store.network(NETWORK).await.expect("answers");
        let zones = state.expect("a network").zones;
        assert_eq!(zones, number + 1, "what was written is seen");
    }
    store.close().await;
}
