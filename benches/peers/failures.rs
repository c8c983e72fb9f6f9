//! Local and global queries through what is written in Rust.

use crate::oracle::assert_same;
use crate::queries::{Failure, Queries, Shortest, at};
use crate::times::{Effort, Row, Times};
use skyway::airspace::{Closed, RequestClosures};
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::network::NodeIx;
use skyway::recompose::{Recomposition, Request, Scope, Scratch, Strategy, World, recompose};
use skyway::routing::{Baseline, Searcher};

const DIJKSTRA: Baseline = Baseline::Dijkstra { full_tree: false };

/// Which end a query has.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Local,
    Global,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Local => "local",
            Self::Global => "global",
        }
    }

    fn goal(self, failure: &Failure) -> NodeIx {
        match self {
            Self::Local => failure.leg.1,
            Self::Global => failure.destination,
        }
    }

    fn shortest(self, failure: &Failure) -> Shortest {
        match self {
            Self::Local => failure.local,
            Self::Global => failure.global,
        }
    }
}

/// Measures local and global queries.
pub(crate) fn measure(queries: &Queries, effort: Effort, times: &mut Times) {
    times
        .preparations
        .push(("exact", "table, per destination", queries.table_s));
    times
        .preparations
        .push(("petgraph", "graph", queries.petgraph_s));
    let mut bench = Bench {
        queries,
        effort,
        scratch: Scratch::new(&queries.topology),
        rows: &mut times.rows,
    };
    bench.exactly(Kind::Local, "exact, no table", queries.cold_world());
    bench.exactly(Kind::Global, "exact, table in memory", queries.warm_world());
    bench.search_alone();
    bench.exactly(Kind::Global, "exact, no table", queries.cold_world());
    for kind in [Kind::Local, Kind::Global] {
        for strategy in [Strategy::TwoPhased, Strategy::CellDensity, Strategy::Radius] {
            bench.heuristically(kind, strategy);
        }
        bench.compact(kind, "compact A*, search alone", Baseline::AStar);
        bench.compact(kind, "compact Dijkstra, search alone", DIJKSTRA);
        bench.petgraph(kind);
    }
}

struct Bench<'a> {
    queries: &'a Queries,
    effort: Effort,
    scratch: Scratch,
    rows: &'a mut Vec<Row>,
}

impl Bench<'_> {
    /// Whole recompositions with their answers.
    fn exactly(&mut self, kind: Kind, engine: &'static str, world: World<'_>) {
        let failures = &self.queries.failures;
        let requests: Vec<Request> = failures
            .iter()
            .map(|failure| Request::exact(report(failure, kind)))
            .collect();
        let times_ns = self.effort.times_ns(
            failures.len(),
            |index| recompose(&world, &requests[index], &mut self.scratch),
            |index, answer: Recomposition| {
                let shortest_m = kind.shortest(&failures[index]).length_m;
                assert_same(engine, answer.remaining_length_m, Some(shortest_m));
            },
        );
        self.add(kind, engine, times_ns, 0.0);
    }

    /// The search with the table of its destination, looked up and the segment closed, without the path.
    fn search_alone(&mut self) {
        let queries = self.queries;
        let mut searcher = Searcher::new(&queries.topology);
        let mut closures = RequestClosures::new(&queries.topology);
        let times_ns = self.effort.times_ns(
            queries.failures.len(),
            |index| {
                let failure = &queries.failures[index];
                let closed = closing(queries, failure, &mut closures);
                let tree = queries.table(failure.destination)?;
                searcher.exact(&closed, &[at(failure.leg.0)], &tree)
            },
            |index, arrival| {
                let length_m = arrival.map(|arrival| arrival.length_m);
                let shortest_m = queries.failures[index].global.length_m;
                assert_same("exact, search alone", length_m, Some(shortest_m));
            },
        );
        let engine = "exact, table in memory, search alone";
        self.add(Kind::Global, engine, times_ns, 0.0);
    }

    /// The paper's strategies, whose ways may be longer: whole recompositions with their answers.
    fn heuristically(&mut self, kind: Kind, strategy: Strategy) {
        let failures = &self.queries.failures;
        let requests: Vec<Request> = failures
            .iter()
            .map(|failure| Request {
                strategy,
                scope: Scope::Local,
                ..Request::exact(report(failure, kind))
            })
            .collect();
        let world = self.queries.warm_world();
        let mut excess = Vec::new();
        let times_ns = self.effort.times_ns(
            failures.len(),
            |index| recompose(&world, &requests[index], &mut self.scratch),
            |index, answer: Recomposition| {
                let shortest_m = kind.shortest(&failures[index]).length_m;
                let length_m = answer.remaining_length_m.unwrap_or(f64::NAN);
                assert!(
                    length_m >= shortest_m * (1.0 - 1e-9),
                    "{}: {length_m} where {shortest_m} is the shortest",
                    strategy.name()
                );
                if index == excess.len() {
                    excess.push(length_m / shortest_m - 1.0);
                }
            },
        );
        let mean_excess = excess.iter().sum::<f64>() / excess.len() as f64;
        self.add(kind, strategy.name(), times_ns, mean_excess);
    }

    /// The textbook searches on this engine's own arrays, without the path.
    fn compact(&mut self, kind: Kind, engine: &'static str, baseline: Baseline) {
        let queries = self.queries;
        let mut searcher = Searcher::new(&queries.topology);
        let mut closures = RequestClosures::new(&queries.topology);
        let times_ns = self.effort.times_ns(
            queries.failures.len(),
            |index| {
                let failure = &queries.failures[index];
                let closed = closing(queries, failure, &mut closures);
                let (start, goal) = ([at(failure.leg.0)], kind.goal(failure));
                searcher.shortest(&closed, &start, goal, baseline, None)
            },
            |index, arrival| {
                let length_m = arrival.map(|arrival| arrival.length_m);
                let shortest_m = kind.shortest(&queries.failures[index]).length_m;
                assert_same(engine, length_m, Some(shortest_m));
            },
        );
        self.add(kind, engine, times_ns, 0.0);
    }

    fn petgraph(&mut self, kind: Kind) {
        let queries = self.queries;
        let mut closures = RequestClosures::new(&queries.topology);
        let check = |index: usize, length_m: Option<f64>| {
            let failure: &Failure = &queries.failures[index];
            let shortest_m = kind.shortest(failure).length_m;
            assert_same("petgraph", length_m, Some(shortest_m));
        };
        let astar_ns = self.effort.times_ns(
            queries.failures.len(),
            |index| {
                let failure = &queries.failures[index];
                let closed = closing(queries, failure, &mut closures);
                queries
                    .peer
                    .astar_m(&closed, failure.leg.0, kind.goal(failure))
            },
            check,
        );
        self.add(kind, "petgraph A*", astar_ns, 0.0);
        let dijkstra_ns = self.effort.times_ns(
            queries.failures.len(),
            |index| {
                let failure = &queries.failures[index];
                let closed = closing(queries, failure, &mut closures);
                queries
                    .peer
                    .dijkstra_m(&closed, failure.leg.0, kind.goal(failure))
            },
            check,
        );
        self.add(kind, "petgraph Dijkstra", dijkstra_ns, 0.0);
    }

    fn add(&mut self, kind: Kind, engine: &'static str, times_ns: Vec<u64>, mean_excess: f64) {
        self.rows.push(Row {
            kind: kind.name(),
            engine,
            times_ns,
            mean_excess,
        });
    }
}

fn closing<'a>(
    queries: &'a Queries,
    failure: &Failure,
    closures: &'a mut RequestClosures,
) -> Closed<'a> {
    closures.reset();
    closures.close_segment(failure.segment, queries.open.closed());
    Closed::new(&queries.topology, queries.open.closed(), closures)
}

/// The report of a drone at the start of the leg that it cannot fly; a local one is on its way to the leg's end.
fn report(failure: &Failure, kind: Kind) -> FailureReport {
    let plan = match kind {
        Kind::Local => &failure.plan[..2],
        Kind::Global => &failure.plan,
    };
    FailureReport {
        failure: FailureType::Navigational,
        leg: failure.leg,
        location: Location::LegStart,
        cause_location: None,
        destination: kind.goal(failure),
        remaining_path: Some(plan.to_vec()),
    }
}
