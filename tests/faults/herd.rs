//! A hundred edges, each a process of its own, that follow one registry: all have a zone soon after it was posted, and
//! do not come all at once when the registry is back.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::edge::Edge;
use crate::history::Act;
use crate::registry_client::Answer;
use crate::rounds::seed;
use crate::stage::Stage;
use serde_json::Value;
use std::sync::Arc;
use std::time::{Duration, Instant};

const EDGES: usize = 100;
/// How soon all have a zone that was posted.
const AT_THE_HEAD: Duration = Duration::from_secs(5);
/// How long the registry is away: long enough for waits to have grown.
const AWAY: Duration = Duration::from_secs(3);
/// Edges that may ask within [`WINDOW`] when it is back.
const ASKED_MAX: usize = EDGES / 2;
const WINDOW: Duration = Duration::from_millis(100);
/// Waits as they are far from a restart, and as long as this story may take.
const SETTINGS: [&str; 2] = ["registry.retry_within=10s", "registry.poll_wait=10s"];
/// From one look at an edge to the next: a hundred that are asked all the time would keep the machine busy.
const LOOK: Duration = Duration::from_millis(100);
/// How often it is posted.
const POSTS: usize = 3;

/// Waits until an edge has a number of zones.
async fn has_zones(edge: Arc<Edge>, count: usize) -> Instant {
    loop {
        let status = edge.status().await.unwrap_or_default();
        if status["zones"].as_u64() == Some(count as u64) {
            return Instant::now();
        }
        tokio::time::sleep(LOOK).await;
    }
}

/// Posts a zone at the registry, and tells how long it took until the first, the middle and the last edge had it.
async fn posted(stage: &Stage, number: usize) -> [Duration; 3] {
    let tag = format!("herd-{number}");
    let act = Act::Put {
        id: format!("zone-{tag}"),
        tag,
    };
    let waiting = stage.edges.iter().cloned();
    let waiting = waiting.map(|edge| tokio::spawn(has_zones(edge, number)));
    let waiting: Vec<_> = waiting.collect();
    let (outcome, ..) = stage.client.act(&act, None, None).await;
    let begun = Instant::now();
    assert!(
        matches!(outcome, crate::history::Outcome::Done(_)),
        "{outcome:?}"
    );
    let mut took = Vec::new();
    for waiting in waiting {
        let had = tokio::time::timeout(crate::daemon::WAIT_AT_MOST, waiting).await;
        let had = had
            .expect("every edge has the zone")
            .expect("it waits well");
        took.push(had.saturating_duration_since(begun));
    }
    took.sort_unstable();
    [took[0], took[took.len() / 2], took[took.len() - 1]]
}

/// The most that was asked within a window, and when that began.
fn most_within(asked: &[Instant], window: Duration) -> (usize, Option<Instant>) {
    let within = |place: usize| {
        let end = asked[place] + window;
        asked.partition_point(|it| *it < end) - place
    };
    let most = (0..asked.len()).max_by_key(|place| within(*place));
    most.map_or((0, None), |place| (within(place), Some(asked[place])))
}

/// What was asked by all edges since an instant, in order.
fn asked_since(stage: &Stage, begun: Instant) -> Vec<Instant> {
    let all = stage.edges.iter().flat_map(|edge| edge.line.asked());
    let mut asked: Vec<Instant> = all.filter(|it| *it >= begun).collect();
    asked.sort_unstable();
    asked
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_hundred_edges_are_no_herd() {
    let names: Vec<String> = (0..EDGES).map(|number| format!("edge-{number}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let begun = Instant::now();
    let mut stage = Stage::set(&names, None, &SETTINGS).await;
    println!("{EDGES} edges are ready after {:?}", begun.elapsed());
    for number in 1..=POSTS {
        let [first, middle, last] = posted(&stage, number).await;
        println!(
            "a posted zone is in force at the first edge after {first:?}, at half of them {middle:?}, at all {last:?}"
        );
        assert!(last < AT_THE_HEAD, "{last:?}");
    }
    stage.kill_registry();
    tokio::time::sleep(AWAY).await;
    let back = Instant::now();
    stage.start_registry().await;
    let [_, middle, last] = posted(&stage, POSTS + 1).await;
    let asked = asked_since(&stage, back);
    let (most, _) = most_within(&asked, WINDOW);
    let (in_a_second, _) = most_within(&asked, Duration::from_secs(1));
    // Of each edge the first thing that it asked.
    let firsts = stage.edges.iter().filter_map(|edge| {
        let asked = edge.line.asked();
        asked.into_iter().find(|it| *it >= back)
    });
    let mut firsts: Vec<Instant> = firsts.collect();
    firsts.sort_unstable();
    let (returned, _) = most_within(&firsts, WINDOW);
    let spread = firsts[firsts.len() - 1] - firsts[0];
    println!(
        "the registry was away for {AWAY:?}: {EDGES} edges came back within {spread:?}, at most {returned} of them in {WINDOW:?}; \
         at most {most} requests in {WINDOW:?} and {in_a_second} in a second; half of them have a new zone after {middle:?}, all after {last:?} (seed {})",
        seed()
    );
    assert_eq!(firsts.len(), EDGES);
    assert!(returned < ASKED_MAX, "{returned} edges at once");
    edges_are_heard(&stage).await;
}

/// The registry knows all of them.
async fn edges_are_heard(stage: &Stage) {
    let path = "GET /v1/edges";
    let Answer::Came { status, body, .. } = stage.client.ask(path, &[], &Value::Null).await else {
        panic!("the registry does not answer");
    };
    let told: Value = serde_json::from_str(&body).unwrap_or_default();
    let count = told["edges"].as_array().map(Vec::len);
    assert_eq!((status, count), (200, Some(EDGES)), "{body}");
}
