//! Zones: what one closes, how long a change takes, and searches around it before and after the tables took it in.

use crate::oracle::{Peer, assert_same};
use crate::percentiles::{Percentiles, print_head};
use crate::workload::{Random, Workload, at, standing, zone};
use criterion::Criterion;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use skyway::airspace::{Change, Closed, Hits, RequestClosures, Zone};
use skyway::geo::Point;
use skyway::routing::{DestinationTree, Searcher};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::sync::Arc;

/// Ways that are checked against the oracle, which takes its time.
const CHECKED: usize = 200;
/// Trees that each zone is worked into.
const TREES_TAKEN_IN: usize = 5;

/// Ways through zones, with the tables they are searched by.
struct Passages<'a> {
    workload: &'a Workload,
    nothing: RequestClosures,
}

impl Passages<'_> {
    fn count(&self) -> usize {
        self.workload.passages.len()
    }

    fn closed(&self, index: usize) -> Closed<'_> {
        let airspace = &self.workload.airspaces[self.workload.passages[index].zone];
        Closed::new(&self.workload.topology, airspace.closed(), &self.nothing)
    }

    fn intact(&self, index: usize) -> Arc<DestinationTree> {
        let destination = self.workload.passages[index].destination;
        let tree = self
            .workload
            .trees
            .get(destination, standing(&self.workload.open));
        tree.expect("every destination has its tree")
    }

    fn repaired(&self, index: usize, searcher: &mut Searcher) -> DestinationTree {
        let zone = self.workload.passages[index].zone;
        let blocked = self.workload.airspaces[zone].closed().blocked_segments();
        searcher.tree_taking_in(&self.intact(index), &self.closed(index), blocked)
    }

    fn length_m(
        &self,
        index: usize,
        tree: &DestinationTree,
        searcher: &mut Searcher,
    ) -> Option<f64> {
        let start = [at(self.workload.passages[index].source)];
        let arrival = searcher.exact(&self.closed(index), &start, tree)?;
        Some(arrival.length_m)
    }

    /// Every way around a zone is as long as petgraph's Dijkstra finds it, before and after its table took it in.
    fn check(&self, searcher: &mut Searcher) {
        let peer = Peer::new(&self.workload.topology);
        let checked = self.count().min(CHECKED);
        for index in 0..checked {
            let passage = &self.workload.passages[index];
            let oracle_m =
                peer.dijkstra_m(&self.closed(index), passage.source, passage.destination);
            let before_m = self.length_m(index, &self.intact(index), searcher);
            assert_same("around a zone", before_m, oracle_m);
            let repaired = self.repaired(index, searcher);
            let after_m = self.length_m(index, &repaired, searcher);
            assert_same("after taking it in", after_m, oracle_m);
        }
        println!(
            "\nchecked {checked} ways around zones against petgraph's Dijkstra, before and after tables took them in"
        );
    }
}

/// Checks every search around a zone, then prints percentiles.
pub(crate) fn measure(workload: &Workload) {
    let mut searcher = Searcher::new(&workload.topology);
    let passages = Passages {
        workload,
        nothing: RequestClosures::new(&workload.topology),
    };
    if passages.count() == 0 {
        println!("no way runs through a zone on this network");
        return;
    }
    passages.check(&mut searcher);

    print_head("a zone of 1 % of the map, its hits known");
    let first = Percentiles::of(passages.count(), |index| {
        passages.length_m(index, &passages.intact(index), &mut searcher)
    });
    first.print("exact, first request");
    let some = passages.count().min(TREES_TAKEN_IN * workload.zones.len());
    let trees: Vec<DestinationTree> = (0..some)
        .map(|index| passages.repaired(index, &mut searcher))
        .collect();
    let after = Percentiles::of(some, |index| {
        passages.length_m(index, &trees[index], &mut searcher)
    });
    after.print("exact, the zone taken in");
    let taking = Percentiles::of(some, |index| passages.repaired(index, &mut searcher));
    taking.print("taking it in, per destination");
    let mut recomputed = 0;
    for index in 0..some {
        passages.repaired(index, &mut searcher);
        recomputed += searcher.settled();
    }
    let nodes = workload.topology.node_count();
    let mean = recomputed as f64 / some as f64;
    println!("| taking it in, nodes recomputed, mean {mean:.0} of {nodes} | | | |");
    let building = Percentiles::of(some.min(10), |index| {
        searcher.tree(&workload.topology, workload.passages[index].destination)
    });
    building.print("building a table, per destination");
    measure_changes(workload);
}

fn measure_changes(workload: &Workload) {
    print_head("what a zone closes, and applying it");
    for vertices in [20, 1_000] {
        let zones = wavy_zones(workload, vertices);
        let found = Hits::of(&workload.topology, &zones[0]);
        let times = Percentiles::of(zones.len(), |index| {
            Hits::of(&workload.topology, &zones[index])
        });
        times.print(&format!(
            "hits of a 1 % zone, {vertices} vertices ({} segments for the first)",
            found.segments.len()
        ));
    }
    let now = workload.open.as_of();
    let apply = Percentiles::of(workload.zones.len(), |index| {
        let change = Change::Put(workload.zones[index].clone());
        workload.open.apply(&[change], now)
    });
    apply.print("applying a zone whose hits are known");
    let lift = Percentiles::of(workload.zones.len(), |index| {
        let change = Change::Lift(workload.zones[index].id.clone());
        workload.airspaces[index].apply(&[change], now)
    });
    lift.print("lifting it");
}

/// Round zones of 1 % of the map with a wavy outline.
fn wavy_zones(workload: &Workload, vertices: usize) -> Vec<Zone> {
    let mut random = Random(ChaCha8Rng::seed_from_u64(7));
    let bounds = workload.topology.bounds();
    let radius_m = (0.01 * bounds.width_m() * bounds.height_m() / std::f64::consts::PI).sqrt();
    (0..20)
        .map(|index| {
            let within = |share: f64, low: f64, high: f64| {
                low + 1.2 * radius_m + share * (high - low - 2.4 * radius_m)
            };
            let centre = Point::new(
                within(random.share(), bounds.min.x, bounds.max.x),
                within(random.share(), bounds.min.y, bounds.max.y),
            );
            let corner = |place: usize| {
                let angle = TAU * place as f64 / (vertices - 1) as f64;
                let reach_m = radius_m * (1.0 + 0.1 * (7.0 * angle).sin());
                [
                    centre.x + reach_m * angle.cos(),
                    centre.y + reach_m * angle.sin(),
                ]
            };
            let mut ring: Vec<[f64; 2]> = (0..vertices - 1).map(corner).collect();
            ring.push(ring[0]);
            zone(&format!("wavy-{index}"), ring, &workload.topology)
        })
        .collect()
}

/// Criterion's estimates of hits and of applying a change.
pub(crate) fn criterion(workload: &Workload, criterion: &mut Criterion) {
    let mut group =
        criterion.benchmark_group(format!("airspace/{}", workload.topology.node_count()));
    group.sample_size(20);
    for vertices in [20, 1_000] {
        let zones = wavy_zones(workload, vertices);
        let mut next = (0..zones.len()).cycle();
        group.bench_function(format!("hits, {vertices} vertices"), |bencher| {
            bencher.iter(|| {
                Hits::of(
                    &workload.topology,
                    &zones[black_box(next.next().unwrap_or(0))],
                )
            });
        });
    }
    let now = workload.open.as_of();
    let change = [Change::Put(workload.zones[0].clone())];
    group.bench_function("apply a zone", |bencher| {
        bencher.iter(|| workload.open.apply(black_box(&change), now));
    });
    group.finish();
}
