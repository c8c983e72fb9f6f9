//! Failure reports while the registry does not answer: they are answered as ever, and say how old that is.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::edge::Edge;
use crate::history::Recorder;
use crate::proxy::Line;
use crate::rounds::rounds;
use crate::stage::Stage;
use std::time::{Duration, Instant};

/// An edge that says soon that its registry is away.
const SETTINGS: [&str; 3] = [
    "registry.poll_wait=500ms",
    "freshness.stale_after=1s",
    "freshness.degraded_after=2s",
];
/// Reports one after the other, with the registry and without.
const REPORTS: usize = 300;
/// From an answer to the next look at what it states.
const LOOK: Duration = Duration::from_millis(10);

/// How long answers took, from report to answer.
#[derive(Debug, Default)]
struct Latencies(Vec<Duration>);

impl Latencies {
    async fn measure(&mut self, edge: &Edge) {
        let recorder = Recorder::default();
        for _ in 0..REPORTS {
            let begun = Instant::now();
            let route = edge.route(&recorder, ("n32", "n55")).await;
            self.0.push(begun.elapsed());
            assert!(route.is_some(), "a report is not answered");
        }
    }

    /// The middle, and the one that only a hundredth is above.
    fn told(&mut self) -> [Duration; 2] {
        self.0.sort_unstable();
        let at = |hundredths: usize| self.0[(self.0.len() - 1) * hundredths / 100];
        [at(50), at(99)]
    }
}

/// Waits until answers say that they are so current; gives the age that they state.
async fn until(edge: &Edge, freshness: &str) -> f64 {
    let begun = Instant::now();
    while begun.elapsed() < crate::daemon::WAIT_AT_MOST {
        let status = edge.status().await.unwrap_or_default();
        if status["freshness"] == freshness {
            return status["registry_age_s"].as_f64().unwrap_or_default();
        }
        tokio::time::sleep(LOOK).await;
    }
    panic!("it never became {freshness}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nobody_waits_for_a_registry_that_does_not_answer() {
    let stage = Stage::set(&["north"], None, &SETTINGS).await;
    let edge = &stage.edges[0];
    let times = rounds(20).div_ceil(20).min(5);
    for bad in [Line::BlackHole, Line::Slow] {
        let (mut with, mut without) = (Latencies::default(), Latencies::default());
        let mut slowest = Duration::ZERO;
        for _ in 0..times {
            until(edge, "fresh").await;
            with.measure(edge).await;
            edge.line.becomes(bad);
            let stale_s = until(edge, "stale").await;
            without.measure(edge).await;
            let degraded_s = until(edge, "degraded").await;
            assert!(
                1.0 <= stale_s && stale_s < degraded_s,
                "{stale_s} s, {degraded_s} s"
            );
            edge.line.becomes(Line::Good);
            let healed = Instant::now();
            until(edge, "fresh").await;
            slowest = slowest.max(healed.elapsed());
        }
        let ([with_50, with_99], [without_50, without_99]) = (with.told(), without.told());
        println!(
            "{bad:?}: {} reports answered, p50 {without_50:?} and p99 {without_99:?}, with the registry {with_50:?} and {with_99:?}; \
             fresh again after {slowest:?} at most",
            without.0.len()
        );
    }
}
