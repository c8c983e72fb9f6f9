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

/// Trees that the zones are worked into.
const TREES_TAKEN_IN: usize = 5;

/// Checks every search around a zone, then prints percentiles.
pub fn measure(workload: &Workload) {
    let mut searcher = Searcher::new(&workload.topology);
    let nothing = RequestClosures::new(&workload.topology);
    let peer = Peer::new(&workload.topology);
    let count = workload.passages.len();
    if count == 0 {
        println!("no way runs through a zone on this network");
        return;
    }
    let intact = |index: usize| {
        let passage = &workload.passages[index];
        workload
            .trees
            .get(passage.destination, standing(&workload.open))
    };
    let closed = |index: usize| {
        let airspace = &workload.airspaces[workload.passages[index].zone];
        Closed::new(&workload.topology, airspace.closed(), &nothing)
    };
    let checked = count.min(200);
    for index in 0..checked {
        let passage = &workload.passages[index];
        let tree = intact(index).expect("every destination has its tree");
        let found = searcher.exact(&closed(index), &[at(passage.source)], &tree);
        let oracle_m = peer.dijkstra_m(&closed(index), passage.source, passage.destination);
        assert_same(
            "around a zone",
            found.map(|arrival| arrival.length_m),
            oracle_m,
        );
        let taken_in =
            searcher.tree_taking_in(&tree, &closed(index), blocked(workload, passage.zone));
        let found = searcher.exact(&closed(index), &[at(passage.source)], &taken_in);
        assert_same(
            "after taking it in",
            found.map(|arrival| arrival.length_m),
            oracle_m,
        );
    }
    println!(
        "checked {checked} ways around zones against petgraph's Dijkstra, before and after tables took them in"
    );

    print_head("a zone of 1 % of the map, its hits known");
    let first = Percentiles::of(count, |index| {
        let tree = intact(index)?;
        searcher.exact(
            &closed(index),
            &[at(workload.passages[index].source)],
            &tree,
        )
    });
    first.print("exact, first request");
    let some = count.min(TREES_TAKEN_IN * workload.zones.len());
    let trees: Vec<DestinationTree> = (0..some)
        .filter_map(|index| {
            let tree = intact(index)?;
            let zone = workload.passages[index].zone;
            Some(searcher.tree_taking_in(&tree, &closed(index), blocked(workload, zone)))
        })
        .collect();
    let after = Percentiles::of(trees.len(), |index| {
        searcher.exact(
            &closed(index),
            &[at(workload.passages[index].source)],
            &trees[index],
        )
    });
    after.print("exact, the zone taken in");
    let taking = Percentiles::of(some, |index| {
        let tree = intact(index)?;
        let zone = workload.passages[index].zone;
        Some(searcher.tree_taking_in(&tree, &closed(index), blocked(workload, zone)))
    });
    taking.print("taking it in, per destination");
    let building = Percentiles::of(some.min(10), |index| {
        searcher.tree(&workload.topology, workload.passages[index].destination)
    });
    building.print("building a table, per destination");
    measure_changes(workload);
}

fn blocked(
    workload: &Workload,
    zone: usize,
) -> impl Iterator<Item = skyway::network::SegmentIx> + '_ {
    workload.airspaces[zone].closed().blocked_segments()
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
pub fn criterion(workload: &Workload, criterion: &mut Criterion) {
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
