//! Computes a cell: its failures on several threads, its times on one.

use crate::cli::clock;
use crate::cli::stop::Stop;
use crate::evaluate::record::NetworkFacts;
use crate::evaluate::{
    CellPlan, CellRows, Failed, Repetitions, Subject, Timer, draw, fail, measure, median,
};
use crate::routing::Searcher;
use rayon::ThreadPool;
use rayon::prelude::*;

/// The clock of the process.
struct Clock;

impl Timer for Clock {
    fn time<T>(&mut self, act: impl FnOnce() -> T) -> (T, f64) {
        let (outcome, elapsed) = clock::timed(act);
        (outcome, clock::microseconds(elapsed))
    }
}

/// Draws, answers, checks and times all failures of a cell; `progress` is told how many are done.
pub(super) fn compute(
    plan: &CellPlan,
    seed: u64,
    repetitions: Repetitions,
    pool: &ThreadPool,
    progress: impl FnMut(usize),
) -> Result<CellRows, Stop> {
    let subject = Subject::load(plan).map_err(Stop::failed)?;
    let failures = drawn(plan, seed, &subject, pool);
    let wrong = |error| Stop::failed(format!("cell {}: {error}", plan.name));
    let measured =
        measure(&subject, &failures, repetitions, &mut Clock, progress).map_err(wrong)?;
    let mut lengths_m: Vec<f64> = measured
        .failures
        .iter()
        .map(|failure| failure.segment_m)
        .collect();
    let topology = subject.topology();
    let facts = NetworkFacts {
        name: plan.name.clone(),
        nodes: topology.node_count(),
        segments: topology.segment_count(),
        component_nodes: subject.component.len(),
        failures: failures.len(),
        without_detour: failures
            .iter()
            .filter(|failed| !failed.has_detour())
            .count(),
        distances_checked: measured.distances_checked,
        median_failed_segment_m: match lengths_m.is_empty() {
            true => 0.0,
            false => median(&mut lengths_m),
        },
    };
    CellRows::sorted(facts, measured.failures, measured.rows).ok_or_else(|| {
        Stop::failed(format!(
            "cell {}: a method left a failure unanswered",
            plan.name
        ))
    })
}

fn drawn(plan: &CellPlan, seed: u64, subject: &Subject, pool: &ThreadPool) -> Vec<Failed> {
    let draws = draw(subject, seed, &plan.name, plan.failures);
    pool.install(|| {
        let numbered = draws.par_iter().enumerate();
        let failed = numbered.map_init(
            || Searcher::new(subject.topology()),
            |searcher, (number, drawn)| fail(subject, number, drawn, searcher),
        );
        failed.flatten().collect()
    })
}
