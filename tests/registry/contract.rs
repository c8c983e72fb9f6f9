//! What every store has to do: one list of cases, run on each engine.

use crate::drafts::{NETWORK, commit, creation, expecting, found, gone, put, write, zone};
use crate::{keeping, pages};
use skyway::registry::store::{Appended, ChangesQuery, ObjectsQuery, Store, Version};
use skyway::wire::{ChangeOperation, ObjectKind};
use std::pin::Pin;
use std::sync::Arc;

type Opened = Pin<Box<dyn Future<Output = Arc<dyn Store>> + Send>>;
/// Opens the same store, again and again.
pub(crate) type Open = Arc<dyn Fn() -> Opened + Send + Sync>;
type Run = fn(Open) -> Pin<Box<dyn Future<Output = ()> + Send>>;

/// A case, and its name.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) run: Run,
}

pub(crate) fn opener(open: impl Fn() -> Opened + Send + Sync + 'static) -> Open {
    Arc::new(open)
}

macro_rules! cases {
    ($($case:path,)*) => {
        pub(crate) const CASES: &[Case] = &[$(Case {
            name: stringify!($case),
            run: |open| Box::pin($case(open)),
        },)*];
    };
}
pub(crate) use cases;

cases! {
    a_new_store_has_an_identity_that_stays,
    revisions_are_consecutive,
    a_write_is_decided_on_what_is_there,
    bounds_are_kept,
    pages::never_split_a_transaction,
    pages::end_where_they_are_told_to,
    a_snapshot_stays_at_its_revision,
    what_is_gone_leaves_a_tombstone,
    keeping::compaction_keeps_what_holds,
    keeping::a_patched_network_is_put_together,
    keeping::answers_are_kept_and_forgotten,
    keeping::a_new_epoch_cuts_off_those_who_follow,
    keeping::edges_are_kept,
    keeping::writes_at_once_get_a_revision_each,
    keeping::what_is_committed_is_there_again,
}

pub(crate) fn objects(at: Option<u64>) -> ObjectsQuery {
    ObjectsQuery {
        network: NETWORK.to_owned(),
        at,
        kind: None,
        after: None,
        limit: 100,
        bytes: 1 << 20,
    }
}

pub(crate) fn changes(after: u64) -> ChangesQuery {
    ChangesQuery {
        network: NETWORK.to_owned(),
        after,
        changes: 100,
        bytes: 1 << 20,
    }
}

pub(crate) async fn holding(store: &dyn Store, at: Option<u64>) -> Vec<(String, String)> {
    let read = found(store.objects(&objects(at)).await);
    let held = read.objects.into_iter();
    held.map(|object| (object.id, object.body.expect("a body")))
        .collect()
}

fn pair(id: &str, body: &str) -> (String, String) {
    (id.to_owned(), body.to_owned())
}

async fn a_new_store_has_an_identity_that_stays(open: Open) {
    let store = open().await;
    let identity = store.identity().await.expect("answers");
    assert_eq!((identity.registry_id.len(), identity.epoch), (16, 1));
    assert_eq!(store.networks().await.expect("answers"), []);
    assert_eq!(store.network(NETWORK).await.expect("answers"), None);
    assert_eq!(store.changes(&changes(0)).await.expect("answers"), None);
    assert_eq!(store.objects(&objects(None)).await.expect("answers"), None);
    store.close().await;
    let again = open().await;
    assert_eq!(again.identity().await.expect("answers"), identity);
    again.close().await;
}

async fn revisions_are_consecutive(open: Open) {
    let store = open().await;
    let version = |revision| Version { epoch: 1, revision };
    assert_eq!(commit(&*store, creation(NETWORK)).await, version(1));
    assert_eq!(commit(&*store, creation("other")).await, version(1));
    let several = vec![
        zone("a", "1"),
        zone("b", "2"),
        put(ObjectKind::Weather, "", "3"),
    ];
    assert_eq!(commit(&*store, write(NETWORK, several)).await, version(2));
    assert_eq!(
        commit(&*store, write(NETWORK, vec![zone("a", "4")])).await,
        version(3)
    );
    let state = found(store.network(NETWORK).await);
    assert_eq!((state.head, state.oldest, state.zones), (3, 0, 2));
    assert_eq!(state.topology, version(1));
    let read = found(store.changes(&changes(1)).await);
    let changed: Vec<(u64, &str)> = read
        .changes
        .iter()
        .map(|change| (change.revision, change.id.as_str()))
        .collect();
    assert_eq!(changed, [(2, "a"), (2, "b"), (2, ""), (3, "a")]);
    assert!(
        read.changes
            .iter()
            .all(|change| change.sha256 == change.digest(NETWORK))
    );
    let nothing = found(store.changes(&changes(3)).await);
    assert_eq!(nothing.changes, []);
    store.close().await;
}

async fn a_write_is_decided_on_what_is_there(open: Open) {
    let store = open().await;
    let moved = async |append| {
        let appended = store.append(&append).await.expect("answers");
        assert_eq!(appended, Appended::Moved);
    };
    moved(write(NETWORK, vec![zone("a", "1")])).await;
    commit(&*store, creation(NETWORK)).await;
    moved(creation(NETWORK)).await;
    let new = || expecting(write(NETWORK, vec![zone("a", "1")]), "a", None);
    let first = commit(&*store, new()).await;
    moved(new()).await;
    let next = |version| expecting(write(NETWORK, vec![zone("a", "2")]), "a", Some(version));
    let second = commit(&*store, next(first)).await;
    moved(next(first)).await;
    let other_epoch = Version { epoch: 2, ..second };
    moved(next(other_epoch)).await;
    let mut elsewhere = next(second);
    elsewhere.head = Some(second.revision - 1);
    moved(elsewhere).await;
    let removal = expecting(write(NETWORK, vec![gone("a")]), "a", Some(second));
    let third = commit(&*store, removal).await;
    moved(next(third)).await;
    commit(&*store, new()).await;
    let state = found(store.network(NETWORK).await);
    assert_eq!(
        (state.head, state.zones),
        (5, 1),
        "what is refused leaves no trace"
    );
    store.close().await;
}

async fn bounds_are_kept(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    let bounded = |id: &str| {
        let mut append = write(NETWORK, vec![zone(id, "1")]);
        append.zones_max = 2;
        append
    };
    commit(&*store, bounded("a")).await;
    commit(&*store, bounded("b")).await;
    let full = Appended::Bounded {
        kind: ObjectKind::Zone,
        limit: 2,
    };
    assert_eq!(store.append(&bounded("c")).await.expect("answers"), full);
    // What is there may still be changed, also where the bound has been lowered since.
    let mut change = bounded("a");
    change.zones_max = 1;
    commit(&*store, change).await;
    let mut third = creation("third");
    third.creates = Some(1);
    let full = Appended::Bounded {
        kind: ObjectKind::Network,
        limit: 1,
    };
    assert_eq!(store.append(&third).await.expect("answers"), full);
    store.close().await;
}

async fn a_snapshot_stays_at_its_revision(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    for id in ["a", "b", "c", "d"] {
        commit(
            &*store,
            write(NETWORK, vec![zone(id, &format!("\"{id}\""))]),
        )
        .await;
    }
    let first_page = ObjectsQuery {
        limit: 2,
        ..objects(None)
    };
    let first = found(store.objects(&first_page).await);
    let ids = |read: &skyway::registry::store::ObjectsRead| -> Vec<String> {
        read.objects
            .iter()
            .map(|object| object.id.clone())
            .collect()
    };
    assert_eq!(
        (ids(&first), first.has_more),
        (vec!["a".to_owned(), "b".to_owned()], true)
    );
    assert_eq!((first.at, first.count, first.restrictions), (5, 4, 4));
    let meanwhile = vec![zone("c", "\"new\""), gone("d"), zone("bb", "1")];
    commit(&*store, write(NETWORK, meanwhile)).await;
    let second_page = ObjectsQuery {
        at: Some(first.at),
        after: Some((ObjectKind::Zone, "b".to_owned())),
        ..objects(None)
    };
    let second = found(store.objects(&second_page).await);
    assert_eq!(
        (ids(&second), second.has_more),
        (vec!["c".to_owned(), "d".to_owned()], false)
    );
    assert_eq!(second.objects[0].body.as_deref(), Some("\"c\""));
    assert_eq!(holding(&*store, Some(1)).await, []);
    // By their bytes, too, but never none.
    let small = ObjectsQuery {
        bytes: 1,
        ..objects(None)
    };
    let small = found(store.objects(&small).await);
    assert_eq!((small.objects.len(), small.has_more), (1, true));
    store.close().await;
}

async fn what_is_gone_leaves_a_tombstone(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    commit(&*store, write(NETWORK, vec![zone("a", "1")])).await;
    commit(&*store, write(NETWORK, vec![gone("a")])).await;
    let read = found(store.changes(&changes(2)).await);
    let [tombstone] = read.changes.as_slice() else {
        panic!("{:?}", read.changes);
    };
    assert_eq!(tombstone.operation, ChangeOperation::Delete);
    assert_eq!((tombstone.id.as_str(), &tombstone.body), ("a", &None));
    assert_eq!(holding(&*store, None).await, []);
    assert_eq!(holding(&*store, Some(2)).await, [pair("a", "1")]);
    let object = store
        .object(NETWORK, ObjectKind::Zone, "a")
        .await
        .expect("answers");
    assert_eq!(object, None);
    commit(&*store, write(NETWORK, vec![zone("a", "2")])).await;
    assert_eq!(holding(&*store, None).await, [pair("a", "2")]);
    let state = found(store.network(NETWORK).await);
    assert_eq!(state.zones, 1);
    store.close().await;
}
