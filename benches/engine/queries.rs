//! One failure: exact, warm and without a table, beside the textbook searches and the paper's strategies.

use crate::oracle::{Peer, assert_same};
use crate::percentiles::{Percentiles, print_head};
use crate::workload::{Failure, Workload, at};
use criterion::Criterion;
use skyway::airspace::{Closed, RequestClosures};
use skyway::recompose::{Request, Scope, Scratch, Strategy, World, recompose};
use skyway::routing::{Baseline, Searcher};
use std::hint::black_box;

/// petgraph's Dijkstra takes too long on a large network for more queries than this.
const SLOW_QUERIES: usize = 100;

/// A search for one failure, its leg closed beforehand: what a prototype of a search is timed on.
struct Search<'a> {
    workload: &'a Workload,
    closures: RequestClosures,
}

impl<'a> Search<'a> {
    fn new(workload: &'a Workload) -> Self {
        let closures = RequestClosures::new(&workload.topology);
        Self { workload, closures }
    }

    fn closed(&mut self, failure: &Failure) -> Closed<'_> {
        let topology = &self.workload.topology;
        let standing = self.workload.open.closed();
        self.closures.reset();
        if let Some(segment) = topology.segment_between(failure.leg.0, failure.leg.1) {
            self.closures.close_segment(segment, standing);
        }
        Closed::new(topology, standing, &self.closures)
    }
}

fn exact_m(
    workload: &Workload,
    search: &mut Search<'_>,
    searcher: &mut Searcher,
    index: usize,
) -> Option<f64> {
    let failure = &workload.failures[index];
    let destination = failure.request.report.destination;
    let tree = workload
        .trees
        .get(destination, workload.open_world().standing())?;
    let closed = search.closed(failure);
    let arrival = searcher.exact(&closed, &[at(failure.leg.0)], &tree)?;
    Some(arrival.length_m)
}

fn baseline_m(
    workload: &Workload,
    search: &mut Search<'_>,
    searcher: &mut Searcher,
    baseline: Baseline,
    index: usize,
) -> Option<f64> {
    let failure = &workload.failures[index];
    let closed = search.closed(failure);
    let start = [at(failure.leg.0)];
    let goal = failure.request.report.destination;
    let arrival = searcher.shortest(&closed, &start, goal, baseline, None)?;
    Some(arrival.length_m)
}

const DIJKSTRA: Baseline = Baseline::Dijkstra { full_tree: false };

/// Checks every query against petgraph, then prints percentiles.
pub(crate) fn measure(workload: &Workload) {
    let mut search = Search::new(workload);
    let mut searcher = Searcher::new(&workload.topology);
    let mut scratch = Scratch::new(&workload.topology);
    let peer = Peer::new(&workload.topology);
    let count = workload.failures.len();
    let slow = count.min(if workload.topology.node_count() > 50_000 {
        SLOW_QUERIES
    } else {
        count
    });
    check(workload, &peer);
    settled(workload, &mut search, &mut searcher);

    print_head("global, one failure, no closure before");
    let warm = Percentiles::of(count, |index| {
        exact_m(workload, &mut search, &mut searcher, index)
    });
    warm.print("exact, table in memory, search alone");
    let world = workload.open_world();
    let whole = Percentiles::of(count, |index| {
        recompose(&world, &workload.failures[index].request, &mut scratch)
    });
    whole.print("exact, table in memory, whole recomposition");
    let cold_world = World {
        trees: None,
        ..world
    };
    let cold = Percentiles::of(count, |index| {
        recompose(&cold_world, &workload.failures[index].request, &mut scratch)
    });
    cold.print("exact, no table (A*), whole recomposition");
    let astar = Percentiles::of(count, |index| {
        baseline_m(workload, &mut search, &mut searcher, Baseline::AStar, index)
    });
    astar.print("compact A*");
    let dijkstra = Percentiles::of(count, |index| {
        baseline_m(workload, &mut search, &mut searcher, DIJKSTRA, index)
    });
    dijkstra.print("compact Dijkstra");
    let their_astar = Percentiles::of(slow, |index| {
        let failure = &workload.failures[index];
        let closed = search.closed(failure);
        peer.astar_m(&closed, failure.leg.0, failure.request.report.destination)
    });
    their_astar.print("petgraph A*");
    let their_dijkstra = Percentiles::of(slow, |index| {
        let failure = &workload.failures[index];
        let closed = search.closed(failure);
        peer.dijkstra_m(&closed, failure.leg.0, failure.request.report.destination)
    });
    their_dijkstra.print("petgraph Dijkstra");
    println!(
        "\nexact, search alone, is {:.0} times as fast as the compact Dijkstra, {:.0} times as fast as petgraph's (p50)",
        dijkstra.at_us(0.5) / warm.at_us(0.5),
        their_dijkstra.at_us(0.5) / warm.at_us(0.5)
    );
    measure_strategies(workload, &mut scratch);
}

/// The paper's strategies and the local baselines, by the entry that everyone uses.
fn measure_strategies(workload: &Workload, scratch: &mut Scratch) {
    let world = workload.open_world();
    let count = workload.failures.len();
    print_head("local, one failure, whole recomposition");
    for strategy in [
        Strategy::TwoPhased,
        Strategy::CellDensity,
        Strategy::Radius,
        Strategy::Astar,
        Strategy::Dijkstra,
    ] {
        let requests: Vec<Request> = workload
            .failures
            .iter()
            .map(|failure| Request {
                strategy,
                scope: Scope::Local,
                ..failure.request.clone()
            })
            .collect();
        let times = Percentiles::of(count, |index| recompose(&world, &requests[index], scratch));
        times.print(strategy.name());
    }
}

/// Every way of answering gives petgraph's distance.
fn check(workload: &Workload, peer: &Peer) {
    let mut search = Search::new(workload);
    let mut searcher = Searcher::new(&workload.topology);
    let mut scratch = Scratch::new(&workload.topology);
    for (index, failure) in workload.failures.iter().enumerate() {
        let closed = search.closed(failure);
        let oracle_m = peer.dijkstra_m(&closed, failure.leg.0, failure.request.report.destination);
        let ours_m = exact_m(workload, &mut search, &mut searcher, index);
        assert_same("exact search", ours_m, oracle_m);
        let answer = recompose(&workload.open_world(), &failure.request, &mut scratch);
        assert_same("recomposition", answer.remaining_length_m, oracle_m);
        for baseline in [Baseline::AStar, DIJKSTRA] {
            let ours_m = baseline_m(workload, &mut search, &mut searcher, baseline, index);
            assert_same("baseline", ours_m, oracle_m);
        }
        let closed = search.closed(failure);
        let their_astar_m =
            peer.astar_m(&closed, failure.leg.0, failure.request.report.destination);
        assert_same("petgraph A*", their_astar_m, oracle_m);
    }
    println!(
        "checked {} queries against petgraph's Dijkstra: 0 % longer",
        workload.failures.len()
    );
}

fn settled(workload: &Workload, search: &mut Search<'_>, searcher: &mut Searcher) {
    let count = workload.failures.len();
    let mut mean = |run: &mut dyn FnMut(&mut Search<'_>, &mut Searcher, usize)| {
        let mut sum = 0;
        for index in 0..count {
            run(search, searcher, index);
            sum += searcher.settled();
        }
        sum as f64 / count as f64
    };
    let exact = mean(&mut |search, searcher, index| {
        exact_m(workload, search, searcher, index);
    });
    let astar = mean(&mut |search, searcher, index| {
        baseline_m(workload, search, searcher, Baseline::AStar, index);
    });
    let dijkstra = mean(&mut |search, searcher, index| {
        baseline_m(workload, search, searcher, DIJKSTRA, index);
    });
    println!("nodes settled, mean: exact {exact:.1}, A* {astar:.1}, Dijkstra {dijkstra:.1}");
}

/// Criterion's estimates of the same calls, requests interleaved.
pub(crate) fn criterion(workload: &Workload, criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group(format!("global/{}", workload.topology.node_count()));
    let count = workload.failures.len();
    let mut search = Search::new(workload);
    let mut searcher = Searcher::new(&workload.topology);
    let mut scratch = Scratch::new(&workload.topology);
    let mut next = (0..count).cycle();
    let mut index = || next.next().unwrap_or(0);
    group.bench_function("exact search", |bencher| {
        bencher.iter(|| exact_m(workload, &mut search, &mut searcher, black_box(index())));
    });
    let world = workload.open_world();
    group.bench_function("exact recomposition", |bencher| {
        bencher.iter(|| recompose(&world, &workload.failures[index()].request, &mut scratch));
    });
    group.bench_function("compact A*", |bencher| {
        bencher.iter(|| {
            baseline_m(
                workload,
                &mut search,
                &mut searcher,
                Baseline::AStar,
                black_box(index()),
            )
        });
    });
    group.bench_function("compact Dijkstra", |bencher| {
        bencher.iter(|| {
            baseline_m(
                workload,
                &mut search,
                &mut searcher,
                DIJKSTRA,
                black_box(index()),
            )
        });
    });
    group.finish();
}
