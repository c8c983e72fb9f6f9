//! Runs a scenario in one dialect: servers, fleet, capacity, phases; again and again, and in turns with the echo.

use crate::Result;
use crate::fleet::{self, Fleet};
use crate::load::{self, Flow, Pace, Stop};
use crate::mix::Mix;
use crate::report::{PhaseReport, RunReport, ScenarioReport};
use crate::scenario::{Dialect, Event, Phase, Ramp, Scenario};
use crate::servers::{Installed, Server};
use crate::stage::{Stage, followed};
use crate::transport::Connections;
use crate::watch::Watch;
use skyway::wire::RegistryRevision;
use std::cell::Cell;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;
use tokio::task::spawn_local;

/// Into how many parts plots divide a phase, and how long a part is at least.
const INTERVALS: u32 = 60;
const INTERVAL_LEAST: Duration = Duration::from_millis(100);
/// Seeds of different things in a repetition are apart.
const SEEDS_PER_REPETITION: u64 = 1000;

/// What is measured.
#[derive(Clone, Debug)]
pub(crate) enum Target {
    /// This binary, started anew for every repetition.
    Program(PathBuf),
    /// An edge that somebody else has started.
    Address(SocketAddr),
}

/// How everything is run.
#[derive(Clone, Debug)]
pub(crate) struct RunOptions {
    pub(crate) target: Target,
    /// The load has a core of its own.
    pub(crate) is_pinned: bool,
    pub(crate) is_quick: bool,
}

/// A server under load.
struct Loaded {
    name: &'static str,
    connections: Rc<Connections>,
    pid: Option<u32>,
    report: RunReport,
}

/// A repetition: what is loaded, with what.
struct Repetition<'a> {
    scenario: &'a Scenario,
    manner: &'a RunOptions,
    dialect: Dialect,
    number: usize,
    mix: Rc<Mix>,
    stage: Option<Stage>,
    /// The edge, and the echo where there is one.
    loaded: Vec<Loaded>,
}

/// Runs a scenario in one dialect.
///
/// # Errors
/// Where servers do not start, or what is asked of them before anything is measured is refused.
pub(crate) async fn scenario(
    scenario: &Scenario,
    dialect: Dialect,
    manner: &RunOptions,
) -> Result<ScenarioReport> {
    let mut runs = Vec::new();
    for number in 0..scenario.repetitions {
        runs.extend(repetition(scenario, dialect, manner, number).await?);
    }
    let judged = scenario.objectives.iter();
    Ok(ScenarioReport {
        name: scenario.name.clone(),
        title: scenario.title.clone(),
        dialect: dialect.title().to_owned(),
        seed: scenario.seed,
        arrivals: scenario.client.arrivals.name().to_owned(),
        judgements: judged.map(|objective| objective.judge(&runs)).collect(),
        runs,
    })
}

async fn repetition(
    scenario: &Scenario,
    dialect: Dialect,
    manner: &RunOptions,
    number: usize,
) -> Result<Vec<RunReport>> {
    let folder = tempfile::tempdir()?;
    let seed = scenario.seed + number as u64 * SEEDS_PER_REPETITION;
    let stage = match &manner.target {
        Target::Address(_) => None,
        Target::Program(program) => {
            let installed = Installed {
                program: program.clone(),
                folder: folder.path().to_owned(),
            };
            Some(Stage::set(installed, &scenario.servers).await?)
        }
    };
    let address = match &manner.target {
        Target::Address(address) => *address,
        Target::Program(_) => stage.as_ref().ok_or("no edge")?.edge.address,
    };
    let control = Connections::new(address, 1, 1);
    let fleet = Fleet::compose(&control, &scenario.fleet, seed).await?;
    let answers = fleet.warm(&control, manner.is_quick).await?;
    let echo = match (&stage, scenario.echo) {
        (Some(stage), true) => {
            let file = folder.path().join("answers.jsonl");
            std::fs::write(&file, &answers)?;
            Some(stage.installed().echo(dialect, &file).await?)
        }
        _ => None,
    };
    let pid = stage.as_ref().map(|stage| stage.edge.pid());
    let mut repetition = Repetition {
        scenario,
        manner,
        dialect,
        number,
        mix: Rc::new(Mix::new(dialect, &scenario.mix, fleet, seed)),
        stage,
        loaded: vec![Loaded::new(scenario, number, "edge", address, pid)],
    };
    if let Some(echo) = &echo {
        repetition.add_echo(echo, fleet::rerouted_share(&answers));
    }
    repetition.measure(seed).await?;
    Ok(repetition
        .loaded
        .into_iter()
        .map(|loaded| loaded.report)
        .collect())
}

impl Loaded {
    fn new(
        scenario: &Scenario,
        number: usize,
        name: &'static str,
        address: SocketAddr,
        pid: Option<u32>,
    ) -> Self {
        let client = &scenario.client;
        let connections =
            Connections::new(address, client.rest_connections, client.grpc_connections);
        Self {
            name,
            connections: Rc::new(connections),
            pid,
            report: RunReport {
                repetition: number,
                server: name.to_owned(),
                capacity_per_s: None,
                ramp_per_s: None,
                phases: Vec::new(),
            },
        }
    }
}

impl Repetition<'_> {
    fn add_echo(&mut self, echo: &Server, rerouted_share: f64) {
        eprintln_line(&format!(
            "{}: the echo tells what the edge has answered; {:.1} % of that is rerouted",
            self.label("echo"),
            rerouted_share * 100.0
        ));
        let pid = Some(echo.pid());
        let loaded = Loaded::new(self.scenario, self.number, "echo", echo.address, pid);
        self.loaded.push(loaded);
    }

    fn label(&self, what: &str) -> String {
        format!(
            "{} {} {}/{} {what}",
            self.scenario.name,
            self.dialect.name(),
            self.number + 1,
            self.scenario.repetitions
        )
    }

    /// The servers, now the one first and now the other: a machine that grows slower is no advantage to either.
    fn turns(&self) -> Vec<usize> {
        let mut turns: Vec<usize> = (0..self.loaded.len()).collect();
        if self.number.is_multiple_of(2) {
            turns.reverse();
        }
        turns
    }

    async fn measure(&mut self, seed: u64) -> Result<()> {
        let scenario = self.scenario;
        if let Some(capacity) = &scenario.capacity {
            let phase = Phase {
                name: "capacity".to_owned(),
                rate_per_s: None,
                of_capacity: None,
                warm_up_s: capacity.warm_up_s,
                measured_s: capacity.measured_s,
                event: None,
            };
            for turn in self.turns() {
                let report = self
                    .phase(turn, &phase, Flow::Full, capacity.in_flight, None)
                    .await?;
                self.loaded[turn].report.capacity_per_s = Some(report.all.goodput_per_s);
                self.loaded[turn].report.phases.push(report);
            }
        }
        if let Some(ramp) = &scenario.ramp {
            for turn in self.turns() {
                self.ramp(turn, ramp, seed).await?;
            }
        }
        for (place, phase) in (1_u64..).zip(&scenario.phases) {
            let bounds = self.mix.fleet().bounds;
            let until = match &mut self.stage {
                Some(stage) => stage.happen(phase.event, bounds, seed + place).await?,
                None => None,
            };
            // Both at the rate that is told in parts of what the edge can do.
            let capacity = self.loaded[0].report.capacity_per_s.unwrap_or_default();
            let part = phase.of_capacity.map(|part| part * capacity);
            let rate = phase.rate_per_s.or(part).unwrap_or(1.0).max(1.0);
            let flow = self.open(rate, seed + place);
            for turn in self.turns() {
                let in_flight = scenario.client.in_flight;
                let report = self.phase(turn, phase, flow, in_flight, until).await?;
                self.loaded[turn].report.phases.push(report);
            }
        }
        Ok(())
    }

    fn open(&self, rate_per_s: f64, seed: u64) -> Flow {
        Flow::Open {
            arrivals: self.scenario.client.arrivals,
            rate_per_s,
            seed,
        }
    }

    /// Grows the rate step by step until a step is not kept up with.
    async fn ramp(&mut self, turn: usize, ramp: &Ramp, seed: u64) -> Result<()> {
        let mut rate = ramp.from_per_s;
        while rate <= ramp.to_per_s {
            let phase = Phase {
                name: format!("{rate:.0}/s"),
                rate_per_s: Some(rate),
                of_capacity: None,
                warm_up_s: ramp.step_s / 4.0,
                measured_s: ramp.step_s,
                event: None,
            };
            let in_flight = self.scenario.client.in_flight;
            let report = self
                .phase(turn, &phase, self.open(rate, seed), in_flight, None)
                .await?;
            let answered_share = report.all.answered as f64 / report.all.scheduled.max(1) as f64;
            let is_kept = report.all.p99_ms <= ramp.p99_ms && answered_share >= ramp.answered_share;
            let run = &mut self.loaded[turn].report;
            run.phases.push(report);
            if !is_kept {
                break;
            }
            run.ramp_per_s = Some(rate);
            rate *= ramp.factor;
        }
        Ok(())
    }

    async fn phase(
        &self,
        turn: usize,
        phase: &Phase,
        flow: Flow,
        in_flight: usize,
        until: Option<RegistryRevision>,
    ) -> Result<PhaseReport> {
        let loaded = &self.loaded[turn];
        let measured = Duration::from_secs_f64(phase.measured_s);
        let pace = Pace {
            flow,
            warm_up: Duration::from_secs_f64(phase.warm_up_s),
            measured,
            in_flight,
            timeout: Duration::from_secs_f64(self.scenario.client.timeout_s),
            interval: (measured / INTERVALS).max(INTERVAL_LEAST),
            spins: self.manner.is_pinned,
        };
        let label = self.label(&format!("{} '{}'", loaded.name, phase.name));
        let mut watch = Watch::new(label, loaded.pid);
        let stop = Stop::new(Cell::new(false));
        let following = match (&self.stage, until) {
            (Some(stage), Some(until)) => {
                let (edge, stop) = (stage.edge.address, stop.clone());
                let is_quick = self.manner.is_quick;
                Some(spawn_local(async move {
                    let took = followed(edge, until)
                        .await
                        .map_err(|error| error.to_string());
                    // A quick storm is over before anything could be asked during it.
                    stop.set(!is_quick);
                    took
                }))
            }
            _ => None,
        };
        let connections = loaded.connections.clone();
        let ran = load::run(self.mix.clone(), connections, pace, stop, &mut watch).await;
        let mut report = PhaseReport::new(&phase.name, &ran, &watch);
        if let Some(following) = following {
            report.followed_s = Some(following.await??.as_secs_f64());
        }
        Ok(report)
    }
}

/// What is wrong with a report of a quick run: times say nothing, but everything was to be answered.
pub(crate) fn faults_of_shape(scenario: &Scenario, report: &ScenarioReport) -> Vec<String> {
    let mut faults = Vec::new();
    for run in &report.runs {
        if run.phases.is_empty() {
            faults.push(format!("{}: nothing was measured", report.name));
        }
        for phase in &run.phases {
            let place = format!("{}, {}, '{}'", report.name, run.server, phase.name);
            for (operation, figures) in &phase.operations {
                let broken = figures.broken + figures.refused + figures.timed_out;
                if figures.answered == 0 || broken > 0 {
                    let problems = &figures.problems;
                    faults.push(format!(
                        "{place}, {operation}: {} answered, {broken} failed: {problems:?}",
                        figures.answered
                    ));
                }
            }
            if phase.operations.is_empty() {
                faults.push(format!("{place}: nothing was sent"));
            }
        }
    }
    let is_storm = |phase: &Phase| matches!(phase.event, Some(Event::ZoneStorm { .. }));
    for phase in scenario.phases.iter().filter(|phase| is_storm(phase)) {
        let phases = report.runs.iter().filter_map(|run| run.phase(&phase.name));
        if !phases.into_iter().any(|phase| phase.followed_s.is_some()) {
            faults.push(format!("{}: the storm was not taken over", report.name));
        }
    }
    faults
}

/// A line for the person who looks on.
pub(crate) fn eprintln_line(text: &str) {
    use std::io::Write;
    // A reader that is gone is no reason to stop measuring.
    let _ = writeln!(std::io::stderr(), "{text}");
}
