//! The second half of the contract: what is dropped, what is kept, and what happens at once.

use crate::contract::{Open, changes, holding, objects};
use crate::drafts::{
    NETWORK, commit, creation, expecting, found, gone, keyed, put, square, write, zone,
};
use skyway::registry::store::{Appended, Compaction, EdgeHeard, Version};
use skyway::wire::{ChangeOperation, Nack, ObjectKind};

pub(crate) async fn compaction_keeps_what_holds(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    for body in ["1", "2", "3"] {
        commit(&*store, write(NETWORK, vec![zone("a", body)])).await;
    }
    commit(&*store, write(NETWORK, vec![zone("b", "1")])).await;
    commit(&*store, write(NETWORK, vec![gone("b"), zone("c", "1")])).await;
    commit(&*store, write(NETWORK, vec![zone("a", "4")])).await;
    let before = [
        holding(&*store, Some(6)).await,
        holding(&*store, None).await,
    ];
    let compaction = Compaction {
        network: NETWORK.to_owned(),
        oldest: 6,
        base_revision: 1,
        base: square(),
    };
    store.compact(&compaction).await.expect("compacts");
    let after = [
        holding(&*store, Some(6)).await,
        holding(&*store, None).await,
    ];
    assert_eq!(before, after);
    let state = found(store.network(NETWORK).await);
    assert_eq!((state.oldest, state.head), (6, 7));
    let read = found(store.changes(&changes(6)).await);
    assert_eq!(read.changes.len(), 1);
    let too_old = found(store.changes(&changes(5)).await);
    assert_eq!(
        too_old.changes,
        [],
        "what came after is not all there any more"
    );
    let gone = found(store.objects(&objects(Some(5))).await);
    assert_eq!((gone.objects, gone.count), (vec![], 0));
    // Again, and backwards: nothing more happens.
    store.compact(&compaction).await.expect("compacts");
    let backwards = Compaction {
        oldest: 3,
        ..compaction
    };
    store.compact(&backwards).await.expect("compacts");
    assert_eq!(holding(&*store, None).await, before[1]);
    store.close().await;
}

pub(crate) async fn a_patched_network_is_put_together(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    let mut patch = put(ObjectKind::Network, "", "{\"removed_segments\":[\"a-b\"]}");
    patch.operation = ChangeOperation::Patch;
    let patched = commit(&*store, write(NETWORK, vec![patch])).await;
    commit(&*store, write(NETWORK, vec![zone("a", "1")])).await;
    let read = found(store.network_parts(NETWORK, None).await);
    let operations = |parts: &[skyway::wire::LoggedChange]| -> Vec<ChangeOperation> {
        parts.iter().map(|part| part.operation).collect()
    };
    assert_eq!(
        operations(&read.parts),
        [ChangeOperation::Put, ChangeOperation::Patch]
    );
    assert_eq!(read.state.topology, patched);
    let first = store
        .network_parts(NETWORK, Some(1))
        .await
        .expect("answers");
    assert_eq!(
        operations(&first.expect("a network").parts),
        [ChangeOperation::Put]
    );
    let compaction = Compaction {
        network: NETWORK.to_owned(),
        oldest: 3,
        base_revision: patched.revision,
        base: "\"whole\"".to_owned(),
    };
    store.compact(&compaction).await.expect("compacts");
    let read = found(store.network_parts(NETWORK, None).await);
    assert_eq!(operations(&read.parts), [ChangeOperation::Put]);
    assert_eq!(read.parts[0].body.as_deref(), Some("\"whole\""));
    assert_eq!(read.parts[0].revision, patched.revision);
    store.close().await;
}

pub(crate) async fn answers_are_kept_and_forgotten(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    let first = store
        .append(&keyed(write(NETWORK, vec![zone("a", "1")]), "k", 10))
        .await;
    let Appended::Done { reply, .. } = first.expect("answers") else {
        panic!("not committed");
    };
    let again = store
        .append(&keyed(write(NETWORK, vec![zone("b", "1")]), "k", 20))
        .await;
    let repeated = Appended::Repeated {
        fingerprint: "f".to_owned(),
        reply: reply.clone(),
    };
    assert_eq!(again.expect("answers"), repeated);
    let kept = store.reply("test", "k").await.expect("answers");
    assert_eq!(kept, Some(("f".to_owned(), reply)));
    assert_eq!(store.reply("another", "k").await.expect("answers"), None);
    let state = found(store.network(NETWORK).await);
    assert_eq!(state.head, 2, "a repetition writes nothing");
    commit(
        &*store,
        keyed(write(NETWORK, vec![zone("c", "1")]), "l", 30),
    )
    .await;
    store.forget_replies(20, 1 << 20).await.expect("forgets");
    assert_eq!(store.reply("test", "k").await.expect("answers"), None);
    assert!(store.reply("test", "l").await.expect("answers").is_some());
    // Later and more than what the other one has.
    for number in 0..20 {
        let made = write(NETWORK, vec![zone(&format!("flood-{number}"), "1")]);
        let mut of_another = keyed(made, &format!("f{number}"), 40 + number);
        let key = of_another.key.as_mut().expect("a key");
        key.subject = "another".to_owned();
        commit(&*store, of_another).await;
    }
    let kept = store.reply("test", "l").await.expect("answers");
    let bytes = kept.expect("a reply").1.body.len() as u64;
    store.forget_replies(0, 4 * bytes).await.expect("forgets");
    for (subject, key, is_kept) in [
        ("test", "l", true),
        ("another", "f19", true),
        ("another", "f0", false),
    ] {
        let reply = store.reply(subject, key).await.expect("answers");
        assert_eq!(reply.is_some(), is_kept, "{subject} {key}");
    }
    store.forget_replies(0, 1).await.expect("forgets");
    assert_eq!(store.reply("test", "l").await.expect("answers"), None);
    store.close().await;
}

pub(crate) async fn a_new_epoch_cuts_off_those_who_follow(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    commit(&*store, write(NETWORK, vec![zone("a", "1")])).await;
    let identity = store.begin_epoch(4).await.expect("begins");
    assert_eq!(identity.epoch, 5);
    let read = found(store.changes(&changes(1)).await);
    assert_eq!((read.state.oldest, read.changes), (2, vec![]));
    let version = commit(&*store, write(NETWORK, vec![zone("b", "1")])).await;
    assert_eq!(
        version,
        Version {
            epoch: 5,
            revision: 3
        }
    );
    let old = store
        .object(NETWORK, ObjectKind::Zone, "a")
        .await
        .expect("answers");
    assert_eq!(old.expect("a zone").epoch, 1);
    store.close().await;
    assert_eq!(open().await.identity().await.expect("answers"), identity);
}

pub(crate) async fn edges_are_kept(open: Open) {
    let store = open().await;
    let heard = |edge: &str, revision, nack: Option<Nack>| EdgeHeard {
        network: NETWORK.to_owned(),
        edge: edge.to_owned(),
        epoch: 1,
        revision,
        heard_ms: 70,
        nack,
        url: None,
    };
    let nack = Nack {
        revision: 9,
        code: "zone_invalid".to_owned(),
        object: Some("zone 'ü'".to_owned()),
        reason: "it has no shape".to_owned(),
    };
    let mut first = [heard("e2", 1, None), heard("e1", 2, Some(nack))];
    first[0].url = Some("https://e2.example".to_owned());
    store.keep_edges(&first, 0).await.expect("kept");
    store
        .keep_edges(&[heard("e2", 3, None)], 0)
        .await
        .expect("kept");
    let found = store.edges().await.expect("answers");
    let mut second = heard("e2", 3, None);
    // Nothing was said of where it is reached.
    second.url = first[0].url.clone();
    assert_eq!(found, [first[1].clone(), second.clone()]);
    second.url = Some(String::new());
    store.keep_edges(&[second.clone()], 0).await.expect("kept");
    assert_eq!(store.edges().await.expect("answers")[1], second);
    let mut third = heard("e3", 1, None);
    third.heard_ms = 80;
    store.keep_edges(&[third.clone()], 75).await.expect("kept");
    assert_eq!(store.edges().await, Ok(vec![third]));
    store.close().await;
}

pub(crate) async fn writes_at_once_get_a_revision_each(open: Open) {
    const WRITERS: usize = 8;
    const WRITES: usize = 10;
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    let writers = (0..WRITERS).map(|writer| {
        let store = store.clone();
        tokio::spawn(async move {
            let mut revisions = Vec::new();
            for number in 0..WRITES {
                let id = format!("{writer}-{number}");
                let version = commit(&*store, write(NETWORK, vec![zone(&id, "1")])).await;
                revisions.push(version.revision);
            }
            // All want the same zone, and only one can have it.
            let wanted = expecting(write(NETWORK, vec![zone("one", "1")]), "one", None);
            let had = store.append(&wanted).await.expect("answers");
            (revisions, matches!(had, Appended::Done { .. }))
        })
    });
    let writers: Vec<_> = writers.collect();
    let (mut revisions, mut winners) = (Vec::new(), 0);
    for writer in writers {
        let (own, has_won) = writer.await.expect("a writer");
        revisions.extend(own);
        winners += usize::from(has_won);
    }
    revisions.sort_unstable();
    revisions.dedup();
    assert_eq!(revisions.len(), WRITERS * WRITES);
    assert_eq!(winners, 1);
    let state = found(store.network(NETWORK).await);
    assert_eq!(state.head as usize, 1 + WRITERS * WRITES + 1);
    assert_eq!(state.zones as usize, WRITERS * WRITES + 1);
    store.close().await;
}

pub(crate) async fn what_is_committed_is_there_again(open: Open) {
    let store = open().await;
    commit(&*store, creation(NETWORK)).await;
    commit(
        &*store,
        write(NETWORK, vec![zone("ü '%_", "{\"a\":\"\\u0000 é\"}")]),
    )
    .await;
    let before = store.changes(&changes(0)).await.expect("answers");
    store.close().await;
    let again = open().await;
    assert_eq!(again.changes(&changes(0)).await.expect("answers"), before);
    again.close().await;
}
