//! What every store does with documents, messages and what edges tell: cases of the suite that runs on each engine.

use crate::contract::{Case, Open, cases};
use crate::positions::position;
use crate::{messages, positions};
use skyway::registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, FailureCount, FailureRow, Message,
    NewsMark, Seen, Unless,
};
use skyway::registry::store::{KeptReply, ReplyKey, Store};
use std::sync::Arc;

cases! {
    a_document_is_kept_in_its_newest_version,
    of_commits_on_one_version_one_is_done,
    what_a_commit_must_not_find_keeps_it_out,
    an_answer_is_kept_with_its_commit,
    answers_about_what_is_not_to_be_told_are_dropped,
    documents_come_in_pages,
    messages::come_in_order,
    messages::are_settled_on_what_was_seen,
    messages::behind_one_that_waits_are_put_off,
    messages::behind_one_that_is_sent_again_are_not_late,
    news_are_taken_once,
    positions::are_kept_once,
    what_is_old_is_dropped,
}

pub(crate) const DAY_MS: i64 = 24 * 60 * 60 * 1000;

fn document(kind: DocumentKind, id: &str, tenant: &str, version: u64) -> Document {
    Document {
        kind,
        id: id.to_owned(),
        tenant: tenant.to_owned(),
        party: String::new(),
        state: String::new(),
        version,
        changed_ms: 7,
        body: format!("{{\"id\":\"{id}\",\"ü\":\"\\u0000 '%_\"}}"),
    }
}

fn delivery(id: &str, version: u64) -> Document {
    document(DocumentKind::Delivery, id, "shop", version)
}

fn seen(document: &Document, version: Option<u64>) -> Seen {
    Seen {
        kind: document.kind,
        id: document.id.clone(),
        version,
    }
}

/// The commit of a document in place of the version before it.
fn putting(document: Document) -> Commit {
    let before = (document.version > 1).then(|| document.version - 1);
    Commit {
        seen: vec![seen(&document, before)],
        puts: vec![document],
        ..Commit::default()
    }
}

pub(crate) async fn done(store: &dyn Store, commit: &Commit) {
    let committed = store.commit(commit).await.expect("answers");
    assert_eq!(committed, Committed::Done);
}

async fn put_all(store: &dyn Store, documents: &[Document]) {
    let puts = documents.to_vec();
    let commit = Commit {
        puts,
        ..Commit::default()
    };
    done(store, &commit).await;
}

pub(crate) fn message(id: &str, subject: &str, number: u64, due_ms: i64) -> Message {
    Message {
        id: id.to_owned(),
        webhook: "hook".to_owned(),
        subject: subject.to_owned(),
        number,
        event: "delivery.delivered".to_owned(),
        body: "{}".to_owned(),
        created_ms: due_ms,
        due_ms,
        attempts: 0,
        state: "pending".to_owned(),
        last_outcome: None,
    }
}

pub(crate) fn telling(messages: &[Message]) -> Commit {
    Commit {
        messages: messages.to_vec(),
        ..Commit::default()
    }
}

async fn a_document_is_kept_in_its_newest_version(open: Open) {
    let store = open().await;
    // Nor under what PostgreSQL takes for no text.
    for id in ["d", "d\0"] {
        let found = store.document(DocumentKind::Delivery, id).await;
        assert_eq!(found.expect("answers"), None);
    }
    done(&*store, &putting(delivery("d", 1))).await;
    let mut second = delivery("d", 2);
    second.party = "acme".to_owned();
    second.state = "created".to_owned();
    done(&*store, &putting(second.clone())).await;
    store.close().await;

    let store = open().await;
    let found = store.document(DocumentKind::Delivery, "d").await;
    assert_eq!(found.expect("answers"), Some(second.clone()));
    let of_other_kind = store.document(DocumentKind::Quote, "d").await;
    assert_eq!(of_other_kind.expect("answers"), None);
    // What was decided on a version that is no longer there is not written, nor anything beside it.
    let stale = Commit {
        puts: vec![delivery("d", 2), delivery("beside", 1)],
        messages: vec![message("m", "d", 1, 1)],
        ..putting(delivery("d", 2))
    };
    let moved = store.commit(&stale).await.expect("answers");
    assert_eq!(moved, Committed::Moved);
    let beside = store.document(DocumentKind::Delivery, "beside").await;
    assert_eq!(beside.expect("answers"), None);
    assert_eq!(store.message("m").await.expect("answers"), None);
    let gone = Commit {
        seen: vec![seen(&second, Some(2))],
        deletes: vec![(DocumentKind::Delivery, "d".to_owned())],
        ..Commit::default()
    };
    done(&*store, &gone).await;
    let moved = store.commit(&gone).await.expect("answers");
    assert_eq!(moved, Committed::Moved);
    store.close().await;
}

async fn of_commits_on_one_version_one_is_done(open: Open) {
    const WRITERS: usize = 8;
    let store = open().await;
    done(&*store, &putting(delivery("d", 1))).await;
    // Two stores, as two processes have them.
    let stores = [store.clone(), open().await];
    let writers = (0..WRITERS).map(|writer| {
        let store = stores[writer % 2].clone();
        tokio::spawn(async move {
            let mut wanted = putting(delivery("d", 2));
            wanted.puts[0].body = writer.to_string();
            let drone = document(DocumentKind::Drone, "acme:1", "acme", 1);
            wanted.seen.push(seen(&drone, None));
            wanted.puts.push(drone);
            wanted.messages = vec![message(&format!("m-{writer}"), "d", 2, 5)];
            store.commit(&wanted).await.expect("answers")
        })
    });
    let writers: Vec<_> = writers.collect();
    let mut winners = Vec::new();
    for (number, writer) in writers.into_iter().enumerate() {
        match writer.await.expect("a writer") {
            Committed::Done => winners.push(number),
            other => assert_eq!(other, Committed::Moved),
        }
    }
    assert_eq!(winners.len(), 1, "{winners:?}");
    let kept = store.document(DocumentKind::Delivery, "d").await;
    let kept = kept.expect("answers").expect("a document");
    assert_eq!((kept.version, kept.body), (2, winners[0].to_string()));
    let due = store.due_messages(5, 10, &[]).await.expect("answers");
    let ids: Vec<String> = due.into_iter().map(|message| message.id).collect();
    assert_eq!(ids, [format!("m-{}", winners[0])]);
    for store in stores {
        store.close().await;
    }
}

async fn what_a_commit_must_not_find_keeps_it_out(open: Open) {
    let store = open().await;
    let kept: Vec<Document> = (0..5)
        .map(|number| Document {
            state: if number < 4 { "created" } else { "failed" }.to_owned(),
            ..delivery(&format!("d{number}"), 1)
        })
        .collect();
    put_all(&*store, &kept).await;
    let service = document(DocumentKind::Service, "s", "acme", 1);
    put_all(&*store, std::slice::from_ref(&service)).await;
    let deleting = |of: &str, id: &str| Commit {
        seen: vec![seen(&service, Some(1))],
        unless: Some(Unless {
            query: DocumentQuery {
                kind: DocumentKind::Delivery,
                of: Some(of.to_owned()),
                states: vec!["created".to_owned()],
                after: None,
                limit: 2,
                is_newest_first: false,
            },
            member: ("id", id.to_owned()),
        }),
        deletes: vec![(DocumentKind::Service, "s".to_owned())],
        ..Commit::default()
    };
    for id in ["d0", "d3"] {
        let committed = store.commit(&deleting("shop", id)).await;
        assert_eq!(committed, Ok(Committed::Moved), "{id}");
    }
    let found = store.document(DocumentKind::Service, "s").await;
    assert_eq!(found, Ok(Some(service.clone())));
    for (of, id) in [("shop", "d4"), ("mall", "d0"), ("shop", "d")] {
        done(&*store, &deleting(of, id)).await;
        put_all(&*store, std::slice::from_ref(&service)).await;
    }
    store.close().await;
}

async fn an_answer_is_kept_with_its_commit(open: Open) {
    let store = open().await;
    let reply = KeptReply {
        created: true,
        etag: Some("\"1\"".to_owned()),
        id: "d".to_owned(),
        body: "{\"ordered\":true}".to_owned(),
    };
    let key = ReplyKey {
        subject: "shop/desk".to_owned(),
        key: "k".to_owned(),
        fingerprint: "f".to_owned(),
        at_ms: 7,
    };
    let ordering = |id: &str, key: ReplyKey| Commit {
        reply: Some((key, reply.clone())),
        ..putting(delivery(id, 1))
    };
    assert_eq!(store.kept_reply("shop/desk", "k").await, Ok(None));
    let first = ordering("d", key.clone());
    done(&*store, &first).await;
    store.close().await;

    let store = open().await;
    let kept = store.kept_reply("shop/desk", "k").await;
    assert_eq!(kept, Ok(Some(("f".to_owned(), reply.clone()))));
    let again = ordering("e", key.clone());
    let repeated = Committed::Repeated {
        fingerprint: "f".to_owned(),
        reply: reply.clone(),
    };
    assert_eq!(store.commit(&again).await, Ok(repeated));
    let not_done = store.document(DocumentKind::Delivery, "e").await;
    assert_eq!(not_done, Ok(None));
    let other_subject = ReplyKey {
        subject: "mall/desk".to_owned(),
        ..key
    };
    done(&*store, &ordering("e", other_subject)).await;
    store.close().await;
}

async fn answers_about_what_is_not_to_be_told_are_dropped(open: Open) {
    let store = open().await;
    for id in ["d", "e", "f"] {
        let reply = KeptReply {
            created: true,
            etag: None,
            id: id.to_owned(),
            body: "{}".to_owned(),
        };
        let key = ReplyKey {
            subject: "shop/desk".to_owned(),
            key: format!("k-{id}"),
            fingerprint: "f".to_owned(),
            at_ms: 7,
        };
        let ordering = Commit {
            reply: Some((key, reply)),
            ..putting(delivery(id, 1))
        };
        done(&*store, &ordering).await;
    }
    let dropping = |document: Document| Commit {
        untold: vec!["d".to_owned(), "f".to_owned(), "g".to_owned()],
        ..putting(document)
    };
    // A commit that is not done drops nothing.
    let moved = store.commit(&dropping(delivery("d", 3))).await;
    assert_eq!(moved, Ok(Committed::Moved));
    let is_kept = async |id: &str| {
        let kept = store.kept_reply("shop/desk", &format!("k-{id}")).await;
        kept.expect("answers").is_some()
    };
    assert!(is_kept("d").await);
    done(&*store, &dropping(delivery("d", 2))).await;
    for (id, kept) in [("d", false), ("e", true), ("f", false)] {
        assert_eq!(is_kept(id).await, kept, "{id}");
    }
    store.close().await;
}

async fn in_pages(store: &dyn Store, mut query: DocumentQuery) -> Vec<Document> {
    let mut found = Vec::new();
    loop {
        let page = store.documents(&query).await.expect("answers");
        assert!(page.len() as u64 <= query.limit);
        let Some(last) = page.last() else {
            return found;
        };
        query.after = Some(last.id.clone());
        found.extend(page);
    }
}

async fn documents_come_in_pages(open: Open) {
    let store = open().await;
    let mut all: Vec<Document> = (0..450)
        .map(|number| {
            let owners = ["shop", "mall", "acme"];
            let mut made = delivery(&format!("d{number:03}"), 1);
            made.tenant = owners[number % 3].to_owned();
            made.party = owners[(number / 3) % 3].to_owned();
            made.state = ["created", "assigned", "delivered", "failed"][number % 4].to_owned();
            made
        })
        .collect();
    all.push(document(DocumentKind::Quote, "d000", "shop", 1));
    put_all(&*store, &all).await;
    let states = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let open_states: Vec<String> = states(&["created", "assigned"]);
    for of in [None, Some("shop"), Some("nobody")] {
        for states in [Vec::new(), open_states.clone(), states(&["none"])] {
            let fits = |document: &&Document| {
                document.kind == DocumentKind::Delivery
                    && of.is_none_or(|of| document.tenant == of || document.party == of)
                    && (states.is_empty() || states.contains(&document.state))
            };
            let expected: Vec<Document> = all.iter().filter(fits).cloned().collect();
            let mut query = DocumentQuery {
                kind: DocumentKind::Delivery,
                of: of.map(str::to_owned),
                states: states.clone(),
                after: None,
                limit: 100,
                is_newest_first: false,
            };
            let found = in_pages(&*store, query.clone()).await;
            assert_eq!(found, expected, "{of:?} {states:?}");
            query.is_newest_first = true;
            let mut found = in_pages(&*store, query).await;
            found.reverse();
            assert_eq!(found, expected, "{of:?} {states:?}, the newest first");
        }
    }
    let count = |tenant| store.count_documents(DocumentKind::Delivery, tenant);
    assert_eq!(count(None).await, Ok(450));
    assert_eq!(count(Some("mall")).await, Ok(150));
    assert_eq!(count(Some("nobody")).await, Ok(0));
    for (states, expected) in [(&["created"][..], 38), (&["created", "assigned"][..], 76)] {
        let kind = DocumentKind::Delivery;
        let counted = store.count_standing(kind, "mall", states, None).await;
        assert_eq!(counted, Ok(expected), "{states:?}");
        // Of each twelve one is the mall's and stands in the first way, and one in the second.
        let counted = store.count_standing(kind, "mall", states, Some("d239"));
        assert_eq!(counted.await, Ok(expected - 20 * states.len() as u64));
    }
    let quotes = |state| store.count_standing(DocumentKind::Quote, "shop", state, None);
    assert_eq!(quotes(&["created"]).await, Ok(0));
    assert_eq!(quotes(&[""]).await, Ok(1));
    store.close().await;
}

async fn news_are_taken_once(open: Open) {
    let store = open().await;
    let mark = |before, through| NewsMark {
        network: "sydney".to_owned(),
        edge: "e1".to_owned(),
        lineage: u64::MAX - 1,
        before,
        through,
    };
    let failure = |number: u64, at_ms: i64, segment: &str, failure_type: &str| FailureRow {
        network: "sydney".to_owned(),
        edge: "e1".to_owned(),
        lineage: u64::MAX - 1,
        number,
        at_ms,
        failure_type: failure_type.to_owned(),
        segment: segment.to_owned(),
        outcome: "rerouted".to_owned(),
    };
    let hour_ms = 60 * 60 * 1000;
    let taking = |before, through, failures: &[FailureRow]| Commit {
        news: Some(mark(before, through)),
        failures: failures.to_vec(),
        ..Commit::default()
    };
    let first = [
        failure(1, 2 * hour_ms, "s", "environmental"),
        failure(2, DAY_MS + 2 * hour_ms, "s", "environmental"),
        failure(3, 3 * hour_ms, "", "navigational"),
    ];
    done(&*store, &taking(0, 3, &first)).await;
    let again = store.commit(&taking(0, 3, &first)).await;
    assert_eq!(again, Ok(Committed::Moved));
    done(
        &*store,
        &taking(3, 4, &[failure(4, 9 * DAY_MS, "s", "environmental")]),
    )
    .await;
    store.close().await;

    let store = open().await;
    let through = |lineage| store.news_through("sydney", "e1", lineage);
    assert_eq!(through(u64::MAX - 1).await, Ok(4));
    assert_eq!(through(u64::MAX).await, Ok(0), "another life of the edge");
    let counted = store
        .count_failures("sydney", 0, 8 * DAY_MS, 10)
        .await
        .expect("answers");
    let count = |segment: &str, hour, failure_type: &str, count| FailureCount {
        segment: segment.to_owned(),
        hour,
        failure_type: failure_type.to_owned(),
        count,
    };
    let expected = [
        count("s", 2, "environmental", 2),
        count("", 3, "navigational", 1),
    ];
    assert_eq!(counted, expected);
    let most = store.count_failures("sydney", 0, 8 * DAY_MS, 1).await;
    assert_eq!(most, Ok(vec![expected[0].clone()]));
    let elsewhere = store.count_failures("perth", 0, 99 * DAY_MS, 10).await;
    assert_eq!(elsewhere, Ok(Vec::new()));
    store.drop_before(0, DAY_MS).await.expect("dropped");
    let left = store.count_failures("sydney", 0, 99 * DAY_MS, 10).await;
    let left: u64 = left.expect("answers").iter().map(|kind| kind.count).sum();
    assert_eq!(left, 2);
    store.close().await;
}

async fn what_is_old_is_dropped(open: Open) {
    let store: Arc<dyn Store> = open().await;
    let mut old = document(DocumentKind::Quote, "old", "shop", 1);
    let mut kept = old.clone();
    (kept.id, kept.changed_ms) = ("kept".to_owned(), 3 * DAY_MS);
    old.changed_ms = DAY_MS;
    let order = delivery("order", 1);
    put_all(&*store, &[old, kept, order]).await;
    let mut settled = message("settled", "a", 1, DAY_MS);
    let mut late = message("late", "b", 1, 3 * DAY_MS);
    settled.state = "delivered".to_owned();
    late.state = "given_up".to_owned();
    let waits = message("waits", "c", 1, DAY_MS);
    done(&*store, &telling(&[settled, late, waits])).await;
    let flown = [position("acme:1", DAY_MS), position("acme:1", 3 * DAY_MS)];
    assert_eq!(store.keep_positions(&flown).await, Ok(2));
    store.drop_before(2 * DAY_MS, 0).await.expect("dropped");
    let found = store.positions("acme:1", 0, i64::MAX, 9).await;
    assert_eq!(found, Ok(flown[1..].to_vec()));
    let is_there = async |id| store.message(id).await.expect("answers").is_some();
    assert!(!is_there("settled").await);
    assert!(is_there("late").await && is_there("waits").await);
    for (kind, id, is_kept) in [
        (DocumentKind::Quote, "old", false),
        (DocumentKind::Quote, "kept", true),
        (DocumentKind::Delivery, "order", true),
    ] {
        let found = store.document(kind, id).await.expect("answers");
        assert_eq!(found.is_some(), is_kept, "{id}");
    }
    // A day that was dropped can be told again.
    assert_eq!(store.keep_positions(&flown).await, Ok(1));
    store.close().await;
}
