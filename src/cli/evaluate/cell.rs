//! Computes a cell: its networks and failures on several threads, its times on one.

use crate::cli::clock;
use crate::cli::stop::Stop;
use crate::evaluate::record::NetworkFacts;
use crate::evaluate::{
    CellPlan, CellRows, Failed, Network, Repetitions, Subject, Timer, draw, fail, measure,
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
    mut progress: impl FnMut(usize),
) -> Result<CellRows, Stop> {
    // Networks are made and failures drawn before anything is timed, which then has the machine to itself.
    let prepare = |(number, network)| prepared(plan, number, network, seed);
    let prepared: Result<Vec<_>, Stop> =
        pool.install(|| plan.networks.par_iter().enumerate().map(prepare).collect());
    let mut facts = NetworkFacts {
        name: plan.name.clone(),
        networks: plan.networks.len(),
        nodes: 0,
        segments: 0,
        component_nodes: 0,
        failures: 0,
        without_detour: 0,
        distances_checked: 0,
    };
    let (mut failures, mut rows) = (Vec::new(), Vec::new());
    for (number, (subject, failed)) in prepared?.into_iter().enumerate() {
        let before = facts.failures;
        let done = |finished| progress(before + finished);
        let measured = measure(&subject, number, &failed, repetitions, &mut Clock, done);
        let measured =
            measured.map_err(|error| Stop::failed(format!("cell {}: {error}", plan.name)))?;
        let topology = subject.topology();
        facts.nodes = plan.generated_nodes().unwrap_or(topology.node_count());
        facts.segments += topology.segment_count();
        facts.component_nodes += subject.component.len();
        facts.failures += failed.len();
        facts.without_detour += failed.iter().filter(|one| !one.has_detour()).count();
        facts.distances_checked += measured.distances_checked;
        failures.extend(measured.failures);
        rows.extend(measured.rows);
    }
    CellRows::sorted(facts, failures, rows).ok_or_else(|| {
        Stop::failed(format!(
            "cell {}: a method left a failure unanswered",
            plan.name
        ))
    })
}

/// A network with the failures on it, numbered through the cell.
fn prepared(
    plan: &CellPlan,
    number: usize,
    network: &Network,
    seed: u64,
) -> Result<(Subject, Vec<Failed>), Stop> {
    let subject = Subject::load(&plan.name, network).map_err(Stop::failed)?;
    let name = format!("{} {number}", plan.name);
    let draws = draw(&subject, seed, &name, plan.failures);
    let first = number * draws.len();
    let mut searcher = Searcher::new(subject.topology());
    let failed = draws.iter().enumerate();
    let failed = failed
        .filter_map(|(place, drawn)| fail(&subject, first + place, drawn, &mut searcher))
        .collect();
    Ok((subject, failed))
}
