//! The suite on the store in memory that simulations use, and how often a registry asks a store.

use crate::contract::{self, Case};
use crate::drafts::{NETWORK, commit, creation, write, zone};
use crate::memory_store::MemoryPlace;
use skyway::clock::Clock;
use skyway::registry::{Follow, Opening, Registry, Settings};
use std::sync::Arc;
use std::time::Duration;

/// So long someone waits for news that do not come.
const WAIT: Duration = Duration::from_millis(100);

/// Another process has written, or a commit is not told yet: the store is ahead of what was last heard of it.
#[tokio::test]
async fn who_has_all_and_waits_asks_a_few_times_only() {
    let place = MemoryPlace::new("0123456789abcdef");
    let registry = open_registry(&place).await;
    let store = place.open();
    commit(&*store, creation(NETWORK)).await;
    let follow = async |after| {
        let follow = Follow {
            after,
            wait: WAIT,
            ..Follow::default()
        };
        let page = registry.changes(NETWORK, &follow, std::future::pending());
        page.await.expect("a page").changes.len()
    };
    assert_eq!(follow(1).await, 0);
    commit(&*store, write(NETWORK, vec![zone("a", "1")])).await;
    let before = place.questions();
    assert_eq!(follow(2).await, 0);
    let questions = place.questions() - before;
    assert!(questions <= 3, "the store was asked {questions} times");
    assert_eq!(follow(1).await, 1);
}

async fn open_registry(place: &MemoryPlace) -> Arc<Registry> {
    let registry = Registry::open(Opening {
        store: place.open(),
        settings: Settings::default(),
        clock: Clock::real(),
        high_water: None,
        new_epoch: false,
    });
    registry.await.expect("a registry")
}

#[tokio::test]
async fn the_contract_holds() {
    for Case { name, run } in contract::CASES {
        let place = MemoryPlace::new("0123456789abcdef");
        let open = contract::opener(move || {
            let place = place.clone();
            Box::pin(async move { place.open() })
        });
        let ran = tokio::spawn(run(open)).await;
        ran.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}
