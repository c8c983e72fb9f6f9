//! Closures that come while the writer looks at plans: between a look and the commit of what was found, and several at once.

use crate::stage::{Stage, circle, names};
use serde_json::json;
use skyway::edge::{Caller, Edge, Idempotency, Settings, WriterStep};
#[cfg(feature = "planted")]
use skyway::planted::{Bug, from_now_on};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::task::{Context, Poll, Waker};

fn id_of(node: &str) -> String {
    format!("crane-over-{node}")
}

/// Hands in a closure of a node, on the writer's thread: it is carried out before the writer looks at another plan.
fn close(edge: &Arc<Edge>, node: &str) {
    let caller = Caller::anyone();
    let draft = json!({"id": id_of(node), "nodes": [node], "reason": "crane"});
    let draft = serde_json::from_value(draft).expect("a closure");
    let mut closing = pin!(edge.close(&caller, draft, Idempotency::default()));
    let polled = closing
        .as_mut()
        .poll(&mut Context::from_waker(Waker::noop()));
    assert!(matches!(polled, Poll::Pending), "the writer is busy");
}

/// A zone over `a4` meets two plans, which one wave leads over `b4`; once the first is told, `b4` closes.
async fn closed_between(on_writer: impl Fn() + Send + Sync + 'static) -> Stage {
    let settings = Settings {
        closed_fraction_max: 0.5,
        ..Settings::default()
    };
    let looked = Arc::new(AtomicUsize::new(0));
    let seen = looked.clone();
    let stage = Stage::watched(settings, false, move |edge, step| {
        on_writer();
        if step == WriterStep::LookedAtPlan && seen.fetch_add(1, Ordering::Relaxed) == 0 {
            close(edge, "b4");
        }
    });
    // None of them needs contingencies before the zone comes.
    stage.compose("p0", "d0", "a0", "a7").await;
    stage.compose("p1", "d1", "a0", "a7").await;
    stage.settle().await;
    looked.store(0, Ordering::Relaxed);
    stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    stage.settle().await;
    assert!(
        looked.load(Ordering::Relaxed) > 2,
        "plans are looked at again"
    );
    for id in ["p0", "p1"] {
        let plan = stage.plan(id);
        let wanted = plan.wanted.as_ref();
        let nodes = wanted.map_or_else(Vec::new, |wanted| names(&wanted.path.nodes));
        assert!(!nodes.contains(&"b4".to_owned()), "{id}: {nodes:?}");
    }
    stage
}

#[tokio::test]
async fn what_was_found_before_a_closure_is_looked_at_again() {
    let stage = closed_between(|| ()).await;
    assert_eq!(stage.edge.status().checker_cases, 0);
}

/// The checker finds what is committed all the same, which the end of every story looks for.
#[cfg(feature = "planted")]
#[tokio::test]
#[should_panic(expected = "cases of the checker")]
async fn an_edge_that_commits_it_all_the_same_is_found() {
    drop(closed_between(|| from_now_on(Bug::ClosedBetween)).await);
}

/// The writer carries out in one batch what came while it was busy: each closure of it is in force, in one revision.
#[tokio::test]
async fn each_closure_of_a_batch_is_in_force() {
    const NODES: [&str; 3] = ["b2", "b4", "b6"];
    let settings = Settings {
        closed_fraction_max: 0.5,
        ..Settings::default()
    };
    let is_busy = Arc::new(AtomicBool::new(false));
    let begins = is_busy.clone();
    let stage = Stage::watched(settings, false, move |edge, step| {
        if step == WriterStep::LookedAtPlan && begins.swap(false, Ordering::Relaxed) {
            NODES.iter().for_each(|node| close(edge, node));
        }
    });
    stage.compose("p0", "d0", "a0", "a7").await;
    stage.settle().await;
    let before = stage.edge.snapshot().airspace().revision();
    is_busy.store(true, Ordering::Relaxed);
    stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    stage.settle().await;
    let snapshot = stage.edge.snapshot();
    let airspace = snapshot.airspace();
    assert_eq!(airspace.closed().closed_node_count(), 1 + NODES.len());
    for node in NODES {
        assert!(airspace.is_in_force(&id_of(node)), "{node}");
    }
    assert_eq!(airspace.revision(), before + 2, "the zone, then the batch");
}
