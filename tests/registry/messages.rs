//! What every store does with messages that wait to be sent: cases of the suite that runs on each engine.

use crate::contract::Open;
use crate::documents::{done, message, telling};
use skyway::registry::documents::{Message, Settlement};
use skyway::registry::store::Store;

async fn try_to_settle(store: &dyn Store, message: &Message, attempts_before: Option<u32>) -> bool {
    let settlement = Settlement {
        message: message.clone(),
        attempts_before,
    };
    let noted = store.settle_messages(&[settlement]).await;
    let noted = noted.expect("answers");
    assert_eq!(noted.len(), 1);
    noted[0]
}

async fn settle(store: &dyn Store, message: &Message, attempts_before: Option<u32>) {
    assert!(try_to_settle(store, message, attempts_before).await);
}

/// A message after another attempt, due then.
fn attempted(before: &Message, due_ms: i64) -> Message {
    Message {
        attempts: before.attempts + 1,
        due_ms,
        ..before.clone()
    }
}

fn standing(before: &Message, state: &str, due_ms: i64) -> Message {
    Message {
        state: state.to_owned(),
        due_ms,
        ..before.clone()
    }
}

async fn due_ms(store: &dyn Store, id: &str) -> i64 {
    let found = store.message(id).await.expect("answers");
    found.expect("a message").due_ms
}

pub(crate) async fn come_in_order(open: Open) {
    let store = open().await;
    assert_eq!(store.next_due().await, Ok(None));
    let all = [
        message("a2", "a", 2, 10),
        message("a1", "a", 1, 30),
        message("b1", "b", 1, 20),
        message("c1", "c", 1, 90),
    ];
    done(&*store, &telling(&all)).await;
    // A message that is there already stays as it is.
    done(&*store, &telling(&[message("b1", "b", 1, 5)])).await;
    let ids = async |now_ms| -> Vec<String> {
        let due = store.due_messages(now_ms, 10, &[]).await.expect("answers");
        due.into_iter().map(|message| message.id).collect()
    };
    assert_eq!(store.next_due().await, Ok(Some(20)));
    assert_eq!(ids(19).await, Vec::<String>::new(), "a2 waits for a1");
    assert_eq!(ids(50).await, ["b1", "a1"]);
    let first = store.due_messages(50, 1, &[]).await.expect("answers");
    assert_eq!(first[0].id, "b1");
    let mut tried = all[1].clone();
    tried.attempts = 1;
    tried.due_ms = 70;
    tried.last_outcome = Some("503".to_owned());
    settle(&*store, &tried, Some(0)).await;
    assert_eq!(store.message("a1").await, Ok(Some(tried.clone())));
    assert_eq!(ids(50).await, ["b1"]);
    assert_eq!(ids(70).await, ["b1", "a1"]);
    tried.state = "delivered".to_owned();
    settle(&*store, &tried, Some(1)).await;
    assert_eq!(ids(70).await, ["a2", "b1"], "nothing is before a2");
    let mut elsewhere = message("z1", "z", 1, 60);
    elsewhere.webhook = "slow".to_owned();
    done(&*store, &telling(&[elsewhere.clone()])).await;
    let without = async |webhooks: &[&str]| -> Vec<String> {
        let webhooks: Vec<String> = webhooks.iter().map(|&name| name.to_owned()).collect();
        let due = store.due_messages(70, 10, &webhooks).await;
        let due = due.expect("answers").into_iter();
        due.map(|message| message.id).collect()
    };
    assert_eq!(without(&["none"]).await, ["a2", "b1", "z1"]);
    assert_eq!(without(&["slow", "none"]).await, ["a2", "b1"]);
    assert_eq!(without(&["hook", "slow"]).await, Vec::<String>::new());
    let mut two = [all[2].clone(), elsewhere];
    for message in &mut two {
        message.attempts = 1;
        message.due_ms = 200;
    }
    let settled = two.clone().map(|message| Settlement {
        message,
        attempts_before: Some(0),
    });
    let noted = store.settle_messages(&settled).await;
    assert_eq!(noted, Ok(vec![true, true]));
    for message in two {
        let found = store.message(&message.id).await;
        assert_eq!(found, Ok(Some(message)));
    }
    assert_eq!(without(&[]).await, ["a2"]);
    let listed = async |before, limit| -> Vec<String> {
        let found = store.messages("hook", before, limit).await;
        let found = found.expect("answers").into_iter();
        found.map(|message| message.id).collect()
    };
    assert_eq!(listed(None, 2).await, ["c1", "a1"]);
    let before = Some((30, "a1".to_owned()));
    assert_eq!(listed(before, 9).await, ["b1", "a2"]);
    let others = store.messages("other", None, 9).await;
    assert_eq!(others, Ok(Vec::new()));
    store.close().await;
}

pub(crate) async fn are_settled_on_what_was_seen(open: Open) {
    let store = open().await;
    let first = message("a1", "a", 1, 10);
    let second = message("a2", "a", 2, 10);
    done(&*store, &telling(&[first.clone(), second])).await;
    // Of two processes that found it due, one puts it off.
    let lease = attempted(&first, 30);
    assert!(try_to_settle(&*store, &lease, Some(0)).await);
    let late = attempted(&first, 40);
    assert!(!try_to_settle(&*store, &late, Some(0)).await);
    assert_eq!(store.message("a1").await, Ok(Some(lease.clone())));
    // Neither the same again, after it was delivered, nor what became of an attempt before undoes that.
    let delivered = standing(&lease, "delivered", 15);
    settle(&*store, &delivered, Some(1)).await;
    assert!(!try_to_settle(&*store, &lease, Some(0)).await);
    assert!(!try_to_settle(&*store, &standing(&lease, "pending", 50), Some(1)).await);
    assert_eq!(store.message("a1").await, Ok(Some(delivered.clone())));
    assert_eq!(due_ms(&*store, "a2").await, 10, "it was not put off");
    let due = store.due_messages(20, 10, &[]).await.expect("answers");
    assert_eq!(due[0].id, "a2");
    // Who asks for it gets it again, and what came of attempts before does not count.
    let again = Message {
        attempts: 0,
        ..standing(&delivered, "pending", 20)
    };
    settle(&*store, &again, None).await;
    assert!(!try_to_settle(&*store, &delivered, Some(1)).await);
    assert_eq!(store.message("a1").await, Ok(Some(again)));
    let nowhere = message("none", "a", 1, 10);
    assert!(!try_to_settle(&*store, &nowhere, None).await);
    assert_eq!(store.message("none").await, Ok(None));
    store.close().await;
}

pub(crate) async fn behind_one_that_waits_are_put_off(open: Open) {
    let store = open().await;
    let first = message("a1", "a", 1, 10);
    let mut elsewhere = message("z2", "a", 2, 10);
    elsewhere.webhook = "other".to_owned();
    let all = [
        first.clone(),
        message("a2", "a", 2, 11),
        message("a3", "a", 3, 900),
        message("b2", "b", 2, 12),
        elsewhere,
    ];
    done(&*store, &telling(&all)).await;
    let lease = attempted(&first, 60);
    settle(&*store, &lease, Some(0)).await;
    assert_eq!(due_ms(&*store, "a2").await, 11, "it is being sent");
    let put_off = standing(&lease, "pending", 500);
    settle(&*store, &put_off, Some(1)).await;
    let mut due = Vec::new();
    for id in ["a1", "a2", "a3", "b2", "z2"] {
        due.push(due_ms(&*store, id).await);
    }
    assert_eq!(due, [500, 500, 900, 12, 10]);
    // What came too late to be noted moves nothing.
    assert!(!try_to_settle(&*store, &standing(&lease, "pending", 700), Some(0)).await);
    assert_eq!(due_ms(&*store, "a2").await, 500);
    let given_up = standing(&put_off, "given_up", 510);
    settle(&*store, &given_up, Some(1)).await;
    assert_eq!(due_ms(&*store, "a2").await, 500);
    assert_eq!(due_ms(&*store, "a3").await, 510);
    let ids = store.due_messages(510, 10, &[]).await.expect("answers");
    let ids: Vec<String> = ids.into_iter().map(|message| message.id).collect();
    assert_eq!(ids, ["z2", "b2", "a2"]);
    store.close().await;
}

pub(crate) async fn behind_one_that_is_sent_again_are_not_late(open: Open) {
    let store = open().await;
    let first = message("a1", "a", 1, 10);
    let all = [first.clone(), message("a2", "a", 2, 11)];
    done(&*store, &telling(&all)).await;
    let lease = attempted(&first, 60);
    settle(&*store, &lease, Some(0)).await;
    settle(&*store, &standing(&lease, "pending", 9_000), Some(1)).await;
    assert_eq!(due_ms(&*store, "a2").await, 9_000);
    // Its owner asks for it long before, and it is taken.
    let again = Message {
        attempts: 0,
        ..standing(&lease, "pending", 100)
    };
    settle(&*store, &again, None).await;
    let lease = attempted(&again, 120);
    settle(&*store, &lease, Some(0)).await;
    settle(&*store, &standing(&lease, "delivered", 101), Some(1)).await;
    let due = store.due_messages(101, 10, &[]).await.expect("answers");
    let ids: Vec<String> = due.into_iter().map(|message| message.id).collect();
    assert_eq!(ids, ["a2"]);
    // Nor behind one that is taken before it was due: by a process whose clock is ahead.
    let second = message("c1", "c", 1, 10);
    done(
        &*store,
        &telling(&[second.clone(), message("c2", "c", 2, 11)]),
    )
    .await;
    settle(&*store, &attempted(&second, 9_000), Some(0)).await;
    let put_off = attempted(&second, 9_000);
    settle(&*store, &put_off, Some(1)).await;
    let taken = standing(&attempted(&put_off, 0), "delivered", 102);
    settle(&*store, &attempted(&put_off, 200), Some(1)).await;
    settle(&*store, &taken, Some(2)).await;
    assert_eq!(due_ms(&*store, "c2").await, 102);
    store.close().await;
}
