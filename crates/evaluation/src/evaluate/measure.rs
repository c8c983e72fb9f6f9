//! Answers every failure of a network by every method, checks the answers and times them.
//!
//! Everything runs on the caller's thread. The methods take turns: each repetition goes once through all of them,
//! beginning with another one every time, so that no method always finds the memory warm from the one before it. What is
//! timed is the one call that also `skyway compare` times, the construction of search areas and the writing of the answer
//! included.

use super::bellman_ford::QueueBellmanFord;
use super::cells::FailureRow;
use super::failures::Failed;
use super::method::{Approach, Inside, Method, Span};
use super::network::Subject;
use super::oracle::same_m;
use super::rows::{Row, rounded};
use super::statistics::quantile;
use crate::compose::prepare_table;
use crate::network::{NodeIx, Topology};
use crate::recompose::{Recomposition, Request, Scratch, StageRecord, World, recompose};
use crate::routing::{Area, TreeCache};
use std::hint::black_box;
use thiserror::Error;

/// Room for the tables of the destinations that are measured together, in bytes.
const TABLE_BYTES: usize = 512 << 20;
/// What a table takes for one node, in bytes, at most.
const TABLE_BYTES_PER_NODE: usize = 48;

/// Who knows the time.
pub trait Timer {
    /// Does something and tells how many microseconds it took.
    fn time<T>(&mut self, act: impl FnOnce() -> T) -> (T, f64);
}

/// How often a method is timed on one failure: until one of the bounds is reached, and at least once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repetitions {
    /// No more often than this.
    pub most: usize,
    /// No more than this in all, in microseconds.
    pub budget_us: f64,
}

/// What was measured in a cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// The failures that have a detour.
    pub failures: Vec<FailureRow>,
    /// One row per failure and method, by failure.
    pub rows: Vec<Row>,
    /// Lengths found equal to the oracle's.
    pub distances_checked: usize,
}

/// An answer is not what the oracle says it must be.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "failure {failure}, {method}: {}, but the shortest way is {optimum_m} m; this is a defect, please report it",
    .answered_m.map_or_else(|| "no way".to_owned(), |length_m| format!("{length_m} m"))
)]
pub struct NotOptimal {
    /// The failure's number.
    pub failure: usize,
    /// The method.
    pub method: String,
    /// The length of its answer, in metres.
    pub answered_m: Option<f64>,
    /// The length of the shortest way, in metres.
    pub optimum_m: f64,
}

/// Measures the failures of a network that have a detour; `number` is that of the network in its cell, and `done` is
/// told how many are finished.
///
/// # Errors
/// [`NotOptimal`] where `exact` or a baseline has not the oracle's distance, or any method a shorter one.
pub fn measure<T: Timer>(
    subject: &Subject,
    number: usize,
    failures: &[Failed],
    repetitions: Repetitions,
    timer: &mut T,
    mut done: impl FnMut(usize),
) -> Result<Measured, NotOptimal> {
    let topology = subject.topology();
    let mut bench = Bench {
        subject,
        number,
        queue: QueueBellmanFord::new(topology),
        scratch: Scratch::new(topology),
        tables: TreeCache::new(TABLE_BYTES),
        methods: Method::all(),
        repetitions,
        timer,
        measured: Measured::default(),
    };
    let with_detour: Vec<&Failed> = failures
        .iter()
        .filter(|failed| failed.has_detour())
        .collect();
    let table_bytes = topology.node_count() * TABLE_BYTES_PER_NODE;
    let together = (TABLE_BYTES / table_bytes.max(1)).max(1);
    let mut finished = 0;
    for group in with_detour.chunks(together) {
        // All tables first: a request in service finds the table of its destination among many others.
        let tables_us: Vec<f64> = group.iter().map(|failed| bench.table_us(failed)).collect();
        for (&failed, table_us) in group.iter().zip(tables_us) {
            bench.measure(failed, table_us)?;
            finished += 1;
            done(finished);
        }
    }
    Ok(bench.measured)
}

/// One network under measurement.
struct Bench<'a, T> {
    subject: &'a Subject,
    number: usize,
    queue: QueueBellmanFord,
    scratch: Scratch,
    tables: TreeCache,
    methods: Vec<Method>,
    repetitions: Repetitions,
    timer: &'a mut T,
    measured: Measured,
}

impl<T: Timer> Bench<'_, T> {
    /// Makes the table of a failure's destination, and tells how long that took.
    fn table_us(&mut self, failed: &Failed) -> f64 {
        let destination = destination(failed);
        let world = World {
            airspace: &self.subject.airspace,
            trees: Some(&self.tables),
        };
        let searcher = self.scratch.searcher();
        // Another failure may have had the same destination, whose table would be there.
        self.tables.remove(destination);
        let act = || prepare_table(black_box(&world), black_box(destination), searcher);
        self.timer.time(act).1
    }

    fn measure(&mut self, failed: &Failed, table_us: f64) -> Result<(), NotOptimal> {
        let (Some(local_optimum_m), Some(optimum_m)) = (failed.optima_m[0], failed.optima_m[1])
        else {
            return Ok(());
        };
        let mut rows = Vec::with_capacity(self.methods.len());
        for method in self.methods.clone() {
            rows.push(self.answer(method, failed, local_optimum_m, optimum_m)?);
        }
        let times = self.times_us(failed);
        for (row, mut times_us) in rows.iter_mut().zip(times) {
            let mut at = |share| rounded(quantile(&mut times_us, share), 3);
            (row.lower_us, row.time_us, row.upper_us) = (at(0.25), at(0.5), at(0.75));
            row.repetitions = times_us.len();
        }
        self.measured.rows.extend(rows);
        let topology = self.subject.topology();
        let id = |node| topology.node_id(node).to_owned();
        let segment = topology.segment_between(failed.leg.0, failed.leg.1);
        self.measured.failures.push(FailureRow {
            failure: failed.number,
            network: self.number,
            placing: failed.placing,
            nodes: topology.node_count(),
            segments: topology.segment_count(),
            source: id(failed.source),
            from: id(failed.leg.0),
            to: id(failed.leg.1),
            destination: id(destination(failed)),
            segment_m: rounded(segment.map_or(0.0, |ix| topology.segment(ix).length_m), 6),
            flown_m: rounded(failed.flown_m, 6),
            local_optimum_m: rounded(local_optimum_m, 6),
            optimum_m: rounded(optimum_m, 6),
            table_us: rounded(table_us, 3),
        });
        Ok(())
    }

    /// Answers once, untimed, and checks the answer.
    fn answer(
        &mut self,
        method: Method,
        failed: &Failed,
        local_optimum_m: f64,
        optimum_m: f64,
    ) -> Result<Row, NotOptimal> {
        // What runs inside an area does not change it.
        let tells_stages = method.approach.has_areas() && method.inside == Inside::AStar;
        let request = Request {
            explain: tells_stages,
            ..self.request(method, failed)
        };
        let world = world(self.subject, &self.tables, method);
        let answer = recompose(&world, &request, &mut self.scratch);
        self.measured.distances_checked += check(method, failed, &answer)?;
        if method.approach == Approach::QueueBellmanFord {
            self.check_queue(method, failed)?;
        }
        // The same way added up in another order differs in its last digits: that is no overhead.
        let like = |length_m: Option<f64>, best_m: f64| match same_m(length_m, Some(best_m)) {
            true => best_m,
            false => length_m.unwrap_or(f64::NAN),
        };
        let part_optimum_m = match method.span {
            Span::Leg => local_optimum_m,
            Span::Route => optimum_m,
        };
        let skipped = answer.stages.iter().filter(|stage| stage.skipped);
        let skipped: Vec<String> = skipped.map(stage_name_of_record).collect();
        let topology = self.subject.topology();
        let searched = match method.approach.has_areas() {
            true => tells_stages.then(|| searched_extent(topology, &answer.stages)),
            false => {
                let settled = self.scratch.searcher().settled_nodes(topology);
                let seen = settled.map(|(node, _)| topology.arcs(node).len()).sum();
                // A segment that is looked at from both its ends counts as one.
                Some((answer.settled_nodes, topology.segment_count().min(seen)))
            }
        };
        Ok(Row {
            failure: failed.number,
            method,
            time_us: 0.0,
            lower_us: 0.0,
            upper_us: 0.0,
            repetitions: 0,
            recomposed_m: rounded(like(answer.recomposed_length_m, part_optimum_m), 6),
            remaining_m: rounded(like(answer.remaining_length_m, optimum_m), 6),
            area_nodes: answer.area_nodes,
            area_segments: answer.area_segments,
            searches: answer.searches,
            settled_nodes: answer.settled_nodes,
            stage: stage_name(&answer.stage),
            skipped: skipped.join("+"),
            searched_nodes: searched.map(|(nodes, _)| nodes),
            searched_segments: searched.map(|(_, segments)| segments),
        })
    }

    /// The times of every method on a failure, in microseconds.
    fn times_us(&mut self, failed: &Failed) -> Vec<Vec<f64>> {
        let requests: Vec<Request> = self
            .methods
            .iter()
            .map(|&method| self.request(method, failed))
            .collect();
        let Repetitions { most, budget_us } = self.repetitions;
        let count = self.methods.len();
        let mut times: Vec<Vec<f64>> = vec![Vec::with_capacity(most); count];
        let mut totals_us = vec![0.0; count];
        for round in 0..most {
            for turn in 0..count {
                let at = (turn + round + failed.number) % count;
                if round > 0 && totals_us[at] >= budget_us {
                    continue;
                }
                let method = self.methods[at];
                let elapsed_us = match method.approach {
                    Approach::QueueBellmanFord => {
                        let (topology, goal) = (self.subject.topology(), goal(method, failed));
                        let queue = &mut self.queue;
                        let act = || queue.distance_m(black_box(topology), failed.leg, goal);
                        let (length_m, elapsed_us) = self.timer.time(act);
                        black_box(length_m);
                        elapsed_us
                    }
                    _ => {
                        let world = world(self.subject, &self.tables, method);
                        let (request, scratch) = (&requests[at], &mut self.scratch);
                        let act = || recompose(black_box(&world), black_box(request), scratch);
                        let (answer, elapsed_us) = self.timer.time(act);
                        black_box(&answer);
                        elapsed_us
                    }
                };
                times[at].push(elapsed_us);
                totals_us[at] += elapsed_us;
            }
        }
        times
    }

    fn request(&self, method: Method, failed: &Failed) -> Request {
        let usual_cell_m = self.subject.topology().density().cell_size_m();
        method.request(failed.leg, &failed.rest, usual_cell_m)
    }

    /// The queue has the distance that the rounds have, which was held against the oracle before.
    fn check_queue(&mut self, method: Method, failed: &Failed) -> Result<(), NotOptimal> {
        let topology = self.subject.topology();
        let found_m = self
            .queue
            .distance_m(topology, failed.leg, goal(method, failed));
        let optimum_m = match method.span {
            Span::Leg => failed.optima_m[0],
            Span::Route => failed.optima_m[1],
        };
        match same_m(found_m, optimum_m) {
            true => Ok(()),
            false => Err(NotOptimal {
                failure: failed.number,
                method: method.id(),
                answered_m: found_m,
                optimum_m: optimum_m.unwrap_or(f64::INFINITY),
            }),
        }
    }
}

/// Where a method's search ends.
fn goal(method: Method, failed: &Failed) -> NodeIx {
    match method.span {
        Span::Leg => failed.leg.1,
        Span::Route => destination(failed),
    }
}

/// The world as a method sees it: the tables are there for `exact`, warm, alone.
fn world<'a>(subject: &'a Subject, tables: &'a TreeCache, method: Method) -> World<'a> {
    let is_warm = method.approach == Approach::Exact { warm: true };
    World {
        airspace: &subject.airspace,
        trees: is_warm.then_some(tables),
    }
}

fn destination(failed: &Failed) -> NodeIx {
    failed.rest.last().copied().unwrap_or(failed.leg.1)
}

/// Holds an answer against the oracle; gives how many lengths it found equal that had to be.
fn check(method: Method, failed: &Failed, answer: &Recomposition) -> Result<usize, NotOptimal> {
    let [local_optimum_m, optimum_m] = failed.optima_m;
    let wrong = |answered_m: Option<f64>, optimum_m: Option<f64>| NotOptimal {
        failure: failed.number,
        method: method.id(),
        answered_m,
        optimum_m: optimum_m.unwrap_or(f64::INFINITY),
    };
    let (answered_m, best_m) = match method.span {
        Span::Leg => (answer.recomposed_length_m, local_optimum_m),
        Span::Route => (answer.remaining_length_m, optimum_m),
    };
    let is_same = same_m(answered_m, best_m);
    if !method.approach.has_areas() {
        return match is_same {
            true => Ok(1),
            false => Err(wrong(answered_m, best_m)),
        };
    }
    let is_shorter = |length_m: Option<f64>, best_m: Option<f64>| {
        !same_m(length_m, best_m) && length_m.is_none_or(|length_m| Some(length_m) < best_m)
    };
    if is_shorter(answered_m, best_m) {
        return Err(wrong(answered_m, best_m));
    }
    match is_shorter(answer.remaining_length_m, optimum_m) {
        true => Err(wrong(answer.remaining_length_m, optimum_m)),
        false => Ok(0),
    }
}

fn stage_name(stage: &crate::recompose::Stage) -> String {
    // The name on the wire, of which there is one table.
    serde_json::to_value(stage)
        .ok()
        .and_then(|name| name.as_str().map(str::to_owned))
        .unwrap_or_default()
}

fn stage_name_of_record(record: &StageRecord) -> String {
    stage_name(&record.stage)
}

/// Nodes and segments of all areas that were searched, added up.
fn searched_extent(topology: &Topology, stages: &[StageRecord]) -> (usize, usize) {
    let (mut nodes, mut segments) = (0, 0);
    if stages.is_empty() {
        return (nodes, segments);
    }
    let mut area = Area::new(topology);
    for stage in stages.iter().filter(|stage| stage.searched) {
        area.clear();
        for &node in &stage.nodes {
            area.insert(node);
        }
        nodes += stage.nodes.len();
        let arcs = stage.nodes.iter().flat_map(|&node| topology.arcs(node));
        let inside = arcs.filter(|arc| area.contains(arc.to)).count() / 2;
        // A and B are in every area, and the segment between them is the one that failed.
        segments += inside.saturating_sub(1);
    }
    (nodes, segments)
}
