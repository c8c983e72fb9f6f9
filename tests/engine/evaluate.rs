//! The experiments: what is drawn, what is measured, and that wrong answers do not pass.

use skyway::evaluate::record::NetworkFacts;
use skyway::evaluate::{
    Approach, CellRows, Design, Draw, Failed, Inside, Measured, Method, Oracle, Placing,
    Repetitions, Sought, Span, Subject, Timer, draw, fail, measure, read_failures, read_rows,
    write_failures, write_rows,
};
use skyway::formats::write_network;
use skyway::network::{Generated, Joining};
use skyway::recompose::{AreaTest, Parameters, Request, Scratch, Strategy, World, recompose};
use skyway::routing::Searcher;

const SEED: u64 = 11;

/// A clock of its own: every act takes a microsecond longer than the one before.
#[derive(Default)]
struct Ticks(f64);

impl Timer for Ticks {
    fn time<T>(&mut self, act: impl FnOnce() -> T) -> (T, f64) {
        self.0 += 1.0;
        (act(), self.0)
    }
}

fn text(nodes: usize, seed: u64) -> String {
    let network = Generated {
        nodes,
        max_neighbours: 6,
        map_size_m: 1_000.0,
        reach_fraction: 0.3,
        joining: Joining::Nearest,
        seed,
    };
    write_network(&network.network().expect("variables of Table 1"))
}

fn subject(nodes: usize, seed: u64) -> Subject {
    let design = Design::of_network("test".to_owned(), text(nodes, seed), true, Some(1));
    Subject::load("test", &design.cells[0].networks[0]).expect("a network")
}

fn failures(subject: &Subject, seed: u64, count: usize) -> Vec<Failed> {
    let mut searcher = Searcher::new(subject.topology());
    let draws = draw(subject, seed, "test", count);
    let failed = draws
        .iter()
        .enumerate()
        .map(|(number, drawn)| fail(subject, number, drawn, &mut searcher));
    failed
        .map(|failed| failed.expect("one component"))
        .collect()
}

fn measured(subject: &Subject, failures: &[Failed]) -> Measured {
    let repetitions = Repetitions {
        most: 3,
        budget_us: 1e9,
    };
    measure(
        subject,
        0,
        failures,
        repetitions,
        &mut Ticks::default(),
        |_| {},
    )
    .expect("optimal answers")
}

#[test]
fn draws_are_those_of_their_seed_and_uniform() {
    let subject = subject(40, 1);
    let count = 8_000;
    let draws = draw(&subject, SEED, "test", count);
    assert_eq!(draws.len(), Placing::ALL.len() * count);
    assert_eq!(draws, draw(&subject, SEED, "test", count));
    assert_ne!(draws, draw(&subject, SEED, "another cell", count));
    assert_ne!(draws, draw(&subject, SEED + 1, "test", count));
    assert!(draws.iter().all(|drawn| drawn.source != drawn.destination));
    let nodes = subject.component.len();
    let expected = count as f64 / nodes as f64;
    for end in [
        |drawn: &Draw| drawn.source,
        |drawn: &Draw| drawn.destination,
    ] {
        // Pearson's statistic; its mean is the number of nodes - 1, its deviation sqrt(2 (nodes - 1)).
        let statistic: f64 = subject
            .component
            .iter()
            .map(|&node| {
                let seen = draws.iter().step_by(Placing::ALL.len());
                let seen = seen.filter(|drawn| end(drawn) == node).count() as f64;
                (seen - expected).powi(2) / expected
            })
            .sum();
        let freedom = (nodes - 1) as f64;
        let limit = freedom + 4.0 * (2.0 * freedom).sqrt();
        assert!(statistic < limit, "{statistic} against {limit}");
    }
    let mean = draws.iter().map(|drawn| drawn.share).sum::<f64>() / draws.len() as f64;
    assert!((mean - 0.5).abs() < 0.02, "{mean}");
}

#[test]
fn a_failure_lies_on_its_plan_which_is_the_shortest_way_but_where_the_network_is_drawn_from() {
    let subject = subject(60, 2);
    let topology = subject.topology();
    let draws = draw(&subject, SEED, "test", 50);
    for (failed, drawn) in failures(&subject, SEED, 50).iter().zip(&draws) {
        assert_eq!(failed.rest[0], failed.leg.0);
        assert_eq!(failed.rest[1], failed.leg.1);
        assert_eq!(failed.rest.last(), Some(&drawn.destination));
        let legs = failed.rest.windows(2);
        let rest_m: f64 = legs
            .map(|ends| {
                let segment = topology.segment_between(ends[0], ends[1]);
                topology.segment(segment.expect("a segment")).length_m
            })
            .sum();
        let planned_m = failed.flown_m + rest_m;
        let intact = shortest_m(&subject, drawn);
        let is_shortest = (planned_m - intact).abs() < 1e-6;
        match drawn.placing {
            Placing::Path | Placing::Length => assert!(is_shortest, "{planned_m}, {intact}"),
            Placing::Network => assert!(planned_m > intact - 1e-6, "{planned_m}, {intact}"),
        }
        if drawn.placing == Placing::Network {
            continue;
        }
        if let Some(detour_m) = failed.optima_m[1] {
            assert!(detour_m >= rest_m - 1e-6, "{detour_m} against {rest_m}");
        }
    }
}

/// By length a segment fails as often as it is long, uniform in the network all alike.
#[test]
fn segments_fail_by_their_lengths_or_alike() {
    let subject = subject(30, 9);
    let topology = subject.topology();
    let segment_m = |failed: &Failed| {
        let segment = topology.segment_between(failed.leg.0, failed.leg.1);
        topology.segment(segment.expect("a segment")).length_m
    };
    let failures = failures(&subject, SEED, 3_000);
    let mean_m = |placing: Placing| {
        let of = failures.iter().filter(|failed| failed.placing == placing);
        let lengths_m: Vec<f64> = of.map(segment_m).collect();
        lengths_m.iter().sum::<f64>() / lengths_m.len() as f64
    };
    assert!(mean_m(Placing::Length) > 1.05 * mean_m(Placing::Path));
    let all_m = topology.segments().map(|ix| topology.segment(ix).length_m);
    let all_m: Vec<f64> = all_m.collect();
    let network_m = all_m.iter().sum::<f64>() / all_m.len() as f64;
    assert!((mean_m(Placing::Network) / network_m - 1.0).abs() < 0.03);
}

fn shortest_m(subject: &Subject, drawn: &Draw) -> f64 {
    let mut searcher = Searcher::new(subject.topology());
    let tree = searcher.tree(subject.topology(), drawn.destination);
    tree.distance_m(drawn.source)
}

#[test]
fn every_method_is_timed_on_every_failure_and_exact_is_never_longer() {
    let subject = subject(80, 3);
    let failures = failures(&subject, SEED, 12);
    let measured = measured(&subject, &failures);
    let with_detour = failures.iter().filter(|failed| failed.has_detour()).count();
    assert_eq!(measured.failures.len(), with_detour);
    assert_eq!(measured.rows.len(), with_detour * Method::all().len());
    assert!(measured.rows.iter().all(|row| row.repetitions == 3));
    for row in &measured.rows {
        let failure = measured
            .failures
            .iter()
            .find(|failure| failure.failure == row.failure)
            .expect("a failure");
        let (length_m, best_m) = match row.method.span {
            Span::Leg => (row.recomposed_m, failure.local_optimum_m),
            Span::Route => (row.remaining_m, failure.optimum_m),
        };
        match row.method.approach.has_areas() {
            true => assert!(length_m >= best_m, "{row:?}"),
            false => assert_eq!(length_m, best_m, "{row:?}"),
        }
    }
    // Two of exact, and five baselines over either span.
    assert_eq!(measured.distances_checked, with_detour * 12);
}

#[test]
fn an_answer_that_is_not_the_oracles_stops_the_run() {
    let honest = subject(60, 4);
    let mut failures = failures(&honest, SEED, 10);
    let longer = failures.iter_mut().find(|failed| failed.has_detour());
    let optimum = longer.and_then(|failed| failed.optima_m[1].as_mut());
    *optimum.expect("a detour") *= 1.0 - 1e-6;
    let repetitions = Repetitions {
        most: 1,
        budget_us: 1.0,
    };
    let outcome = measure(
        &honest,
        0,
        &failures,
        repetitions,
        &mut Ticks::default(),
        |_| {},
    );
    let error = outcome
        .expect_err("the engine is not shorter than its optimum")
        .to_string();
    assert!(error.contains("exact_warm.route"), "{error}");
}

#[test]
fn the_oracle_reads_the_networks_own_text() {
    let planar = r#"{"type":"FeatureCollection","skyway":{"format":1,"coordinates":"planar"},"features":[
        {"type":"Feature","id":1,"geometry":{"type":"Point","coordinates":[0,0]},"properties":{"kind":"node"}},
        {"type":"Feature","id":2,"geometry":{"type":"Point","coordinates":[3,4]},"properties":{"kind":"node"}},
        {"type":"Feature","id":"c","geometry":{"type":"Point","coordinates":[3,0]},"properties":{"kind":"node"}},
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[0,0],[3,4]]},"properties":{"kind":"segment","from":1,"to":2}},
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[0,0],[3,0]]},"properties":{"kind":"segment","from":1,"to":"c"}},
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[3,0],[3,4]]},"properties":{"kind":"segment","from":"c","to":2,"length_m":5.5}}
    ]}"#;
    let sought = |from: &str, to: &str, destination: &str| Sought {
        from: from.to_owned(),
        to: to.to_owned(),
        destination: destination.to_owned(),
    };
    let oracle = Oracle::read(planar).expect("a graph");
    assert_eq!(
        oracle.distances_m(&sought("1", "2", "c")),
        [Some(8.5), Some(3.0)]
    );
    assert_eq!(
        oracle.distances_m(&sought("1", "c", "2")),
        [Some(10.5), Some(5.0)]
    );
    let geographic = planar.replace("planar", "geographic");
    assert!(Oracle::read(&geographic).is_err(), "a length in degrees");
}

#[test]
fn rows_come_back_as_they_were_written() {
    let subject = subject(50, 5);
    let measured = measured(&subject, &failures(&subject, SEED, 6));
    let rows = write_rows(&measured.rows).expect("CSV");
    assert_eq!(read_rows(&rows).expect("rows"), measured.rows);
    let failures = write_failures(&measured.failures).expect("CSV");
    assert_eq!(
        read_failures(&failures).expect("failures"),
        measured.failures
    );
    let sorted = |rows| CellRows::sorted(facts(), measured.failures.clone(), rows);
    assert!(sorted(measured.rows.clone()).is_some());
    assert!(
        sorted(measured.rows[1..].to_vec()).is_none(),
        "a row is missing"
    );
    let none = CellRows::sorted(facts(), Vec::new(), Vec::new());
    assert!(none.is_some(), "no failure has a detour");
}

fn facts() -> NetworkFacts {
    NetworkFacts {
        name: "test".to_owned(),
        networks: 1,
        nodes: 50,
        segments: 1,
        component_nodes: 50,
        failures: 6,
        without_detour: 0,
        distances_checked: 0,
    }
}

/// The size of the map is no variable: everything scales with it.
#[test]
fn a_larger_map_has_the_same_answers() {
    let of_map = |map_size_m: f64| {
        let network = Generated {
            nodes: 100,
            max_neighbours: 6,
            map_size_m,
            reach_fraction: 0.2,
            joining: Joining::Random,
            seed: 5,
        };
        let text = write_network(&network.network().expect("variables of Table 1"));
        let design = Design::of_network("test".to_owned(), text, true, Some(1));
        let subject = Subject::load("test", &design.cells[0].networks[0]).expect("a network");
        let measured = measured(&subject, &failures(&subject, SEED, 10));
        let scaled = |length_m: f64| (length_m / map_size_m * 1e6).round();
        let row = |row: &skyway::evaluate::Row| (scaled(row.remaining_m), row.area_nodes);
        measured.rows.iter().map(row).collect::<Vec<_>>()
    };
    assert_eq!(of_map(1_024.0), of_map(8_192.0));
}

/// Polygons and the leg's frame are two ways to say the same: random positions never lie within a millionth
/// of a metre of a boundary.
#[test]
fn areas_by_polygons_are_those_by_the_frame() {
    for seed in 0..30 {
        let subject = subject(120, seed);
        let mut scratch = Scratch::new(subject.topology());
        for failed in failures(&subject, seed, 20) {
            let mut answer = |val_ratio: f64, stage_skipping: bool, area_test: AreaTest| {
                let request = Request {
                    strategy: Strategy::TwoPhased,
                    parameters: Parameters {
                        val_ratio,
                        stage_skipping,
                        area_test,
                        ..Parameters::default()
                    },
                    explain: true,
                    ..request(&failed)
                };
                let world = World {
                    airspace: &subject.airspace,
                    trees: None,
                };
                recompose(&world, &request, &mut scratch)
            };
            for val_ratio in [0.5, 0.2, 1.5] {
                for skipping in [true, false] {
                    let frame = answer(val_ratio, skipping, AreaTest::Frame);
                    let polygons = answer(val_ratio, skipping, AreaTest::Polygon);
                    assert_eq!(polygons, frame, "seed {seed}, failure {}", failed.number);
                }
            }
        }
    }
}

fn request(failed: &Failed) -> Request {
    Request::exact(skyway::flight::FailureReport {
        failure: skyway::flight::FailureType::Navigational,
        leg: failed.leg,
        location: skyway::flight::Location::LegStart,
        cause_location: None,
        destination: failed.rest[failed.rest.len() - 1],
        remaining_path: Some(failed.rest.clone()),
    })
}

/// Areas about the rest of the route: what the strategy is told to bridge is A - destination.
#[test]
fn areas_can_be_spanned_over_the_route() {
    let subject = subject(100, 6);
    let measured = measured(&subject, &failures(&subject, SEED, 20));
    let method = |span| Method {
        approach: Approach::CellDensity,
        inside: Inside::AStar,
        span,
        variant: 0,
    };
    let nodes = |span: Span| -> usize {
        let rows = measured
            .rows
            .iter()
            .filter(|row| row.method == method(span));
        rows.map(|row| row.area_nodes).sum()
    };
    assert!(nodes(Span::Route) > nodes(Span::Leg));
    for row in measured
        .rows
        .iter()
        .filter(|row| row.method == method(Span::Route))
    {
        // Where a segment leads straight to the destination there is nothing to bridge.
        if row.searches > 0 {
            assert_eq!(row.recomposed_m, row.remaining_m, "{row:?}");
        }
    }
}
