//! Zone queries through what is written in Rust: finding what the zone closes, closing it, and the way around.

use crate::oracle::assert_same;
use crate::queries::{Passage, Queries, at};
use crate::times::{Effort, Row, Times};
use skyway::airspace::{Closed, Hits, RequestClosures};
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::recompose::{BroughtZone, Recomposition, Request, Scratch, World, recompose};
use skyway::routing::{Arrival, Baseline, Searcher};

const DIJKSTRA: Baseline = Baseline::Dijkstra { full_tree: false };

/// Measures zone queries.
pub(crate) fn measure(queries: &Queries, effort: Effort, times: &mut Times) {
    let mut bench = Bench {
        queries,
        effort,
        rows: &mut times.rows,
    };
    bench.recompositions("exact, table in memory", queries.warm_world());
    bench.searches(
        "exact, table in memory, search alone",
        |searcher, closed, passage| {
            let (source, destination) = passage.ends();
            let tree = queries.table(destination)?;
            searcher.exact(closed, &[at(source)], &tree)
        },
    );
    bench.recompositions("exact, no table", queries.cold_world());
    let baselines = [
        ("compact A*, search alone", Baseline::AStar),
        ("compact Dijkstra, search alone", DIJKSTRA),
    ];
    for (engine, baseline) in baselines {
        bench.searches(engine, |searcher, closed, passage| {
            let (source, destination) = passage.ends();
            searcher.shortest(closed, &[at(source)], destination, baseline, None)
        });
    }
    bench.petgraph("petgraph A*", |closed, passage| {
        let (source, destination) = passage.ends();
        queries.peer.astar_m(closed, source, destination)
    });
    bench.petgraph("petgraph Dijkstra", |closed, passage| {
        let (source, destination) = passage.ends();
        queries.peer.dijkstra_m(closed, source, destination)
    });
}

struct Bench<'a> {
    queries: &'a Queries,
    effort: Effort,
    rows: &'a mut Vec<Row>,
}

impl Bench<'_> {
    /// Whole recompositions with their answers; the report brings the zone along and closes nothing else.
    fn recompositions(&mut self, engine: &'static str, world: World<'_>) {
        let queries = self.queries;
        let mut scratch = Scratch::new(&queries.topology);
        let mut requests: Vec<Request> = queries.passages.iter().map(request).collect();
        let times_ns = self.effort.times_ns(
            queries.passages.len(),
            |index| {
                let mut nodes = Vec::new();
                let zone = queries.passages[index].zone.clone();
                queries.close_nodes(&zone, |node| nodes.push(node));
                let hits = Hits::new(Vec::new(), nodes);
                requests[index].zone = Some(BroughtZone { zone, hits });
                recompose(&world, &requests[index], &mut scratch)
            },
            |index, answer: Recomposition| {
                let shortest_m = queries.passages[index].around.length_m;
                assert_same(engine, answer.remaining_length_m, Some(shortest_m));
            },
        );
        self.add(engine, times_ns);
    }

    fn searches(
        &mut self,
        engine: &'static str,
        mut search: impl FnMut(&mut Searcher, &Closed<'_>, &Passage) -> Option<Arrival>,
    ) {
        let queries = self.queries;
        let mut searcher = Searcher::new(&queries.topology);
        let mut closures = RequestClosures::new(&queries.topology);
        let times_ns = self.effort.times_ns(
            queries.passages.len(),
            |index| {
                let passage = &queries.passages[index];
                let closed = closing(queries, passage, &mut closures);
                search(&mut searcher, &closed, passage)
            },
            |index, arrival| {
                let length_m = arrival.map(|arrival| arrival.length_m);
                let shortest_m = queries.passages[index].around.length_m;
                assert_same(engine, length_m, Some(shortest_m));
            },
        );
        self.add(engine, times_ns);
    }

    fn petgraph(
        &mut self,
        engine: &'static str,
        search: impl Fn(&Closed<'_>, &Passage) -> Option<f64>,
    ) {
        let queries = self.queries;
        let mut closures = RequestClosures::new(&queries.topology);
        let times_ns = self.effort.times_ns(
            queries.passages.len(),
            |index| {
                let passage = &queries.passages[index];
                search(&closing(queries, passage, &mut closures), passage)
            },
            |index, length_m| {
                let shortest_m = queries.passages[index].around.length_m;
                assert_same(engine, length_m, Some(shortest_m));
            },
        );
        self.add(engine, times_ns);
    }

    fn add(&mut self, engine: &'static str, times_ns: Vec<u64>) {
        self.rows.push(Row {
            kind: "zone",
            engine,
            times_ns,
            mean_excess: 0.0,
        });
    }
}

fn closing<'a>(
    queries: &'a Queries,
    passage: &Passage,
    closures: &'a mut RequestClosures,
) -> Closed<'a> {
    closures.reset();
    let standing = queries.open.closed();
    queries.close_nodes(&passage.zone, |node| {
        closures.close_node(node, &queries.topology, standing);
    });
    Closed::new(&queries.topology, standing, closures)
}

fn request(passage: &Passage) -> Request {
    let (_, destination) = passage.ends();
    Request::exact(FailureReport {
        failure: FailureType::ServiceLevel,
        leg: (passage.plan[0], passage.plan[1]),
        location: Location::LegStart,
        cause_location: None,
        destination,
        remaining_path: Some(passage.plan.clone()),
    })
}
