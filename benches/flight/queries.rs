//! The rows of the table: every list of requests by every objective, and the baseline.

use crate::percentiles::Percentiles;
use crate::workload::{Query, Workload};
use skyway::flight::Situation;
use skyway::itinerary::{
    FlightAnswer, FlightWorld, ItineraryScratch, Objective, Obstacles, PadTimes, Step, find,
    find_plainly,
};
use skyway::verify::{FlightPremises, verify_flight};

/// Requests that plain label-setting is measured on.
const PLAIN_REQUESTS: usize = 20;

/// The p50 and p99, in microseconds, that a row has to reach on a network of a size.
const TARGETS: &[(usize, &str, f64, f64)] = &[
    (5_000, "distance, two", 20.0, 400.0),
    (5_000, "distance, easy", 5.0, 30.0),
    (5_000, "distance, reroute", 20.0, 200.0),
    (
        5_000,
        "distance, easy, nothing in the way",
        5.0,
        f64::INFINITY,
    ),
    (50_000, "distance, two", 30.0, 600.0),
    (5_000, "time, two", 3_000.0, 30_000.0),
    (5_000, "time, easy", 5.0, 2_000.0),
    (5_000, "time, reroute", 1_500.0, 10_000.0),
];

/// Checks and measures everything.
pub(crate) fn measure(workload: &Workload, objectives: &[Objective]) {
    println!(
        "\n| request | p50 µs | p99 µs | mean µs | target p50 / p99 µs | proved | ended by walk / hovering / earlier / exact | most labels |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    for &objective in objectives {
        for (name, queries) in [
            ("two", &workload.two),
            ("easy", &workload.easy),
            ("reroute", &workload.reroute),
        ] {
            let title = format!("{}, {name}", objective.name());
            let world = workload.world();
            row(workload, &world, objective, queries, &title, true);
        }
    }
    let nothing = Situation::default();
    let obstacles = Obstacles::of(&workload.topology, &nothing);
    let pads = PadTimes::of(&workload.topology, &nothing);
    let open = FlightWorld {
        obstacles: &obstacles,
        pads: &pads,
        ..workload.world()
    };
    row(
        workload,
        &open,
        Objective::Distance,
        &workload.easy,
        "distance, easy, nothing in the way",
        false,
    );
    plain(workload);
}

fn row(
    workload: &Workload,
    world: &FlightWorld<'_>,
    objective: Objective,
    queries: &[Query],
    title: &str,
    is_checked: bool,
) {
    if queries.is_empty() {
        return;
    }
    let mut scratch = ItineraryScratch::new(&workload.topology);
    let tables = &workload.potentials[objective as usize];
    let mut answer = |index: usize| {
        let query = &queries[index];
        let request = workload.request(query, objective);
        find(world, &request, &tables[query.destination], &mut scratch)
    };
    let answers: Vec<FlightAnswer> = (0..queries.len()).map(&mut answer).collect();
    if is_checked {
        for (query, answer) in queries.iter().zip(&answers) {
            check(workload, query, objective, answer);
        }
    }
    let times = Percentiles::of(queries.len(), answer);
    print_row(workload, title, &times, &answers);
}

fn print_row(workload: &Workload, title: &str, times: &Percentiles, answers: &[FlightAnswer]) {
    let count = |wanted: &dyn Fn(&&FlightAnswer) -> bool| answers.iter().filter(wanted).count();
    let by_step = |step: Step| count(&|answer| answer.step == step);
    let labels = answers.iter().map(|answer| answer.effort.labels).max();
    let nodes = workload.topology.node_count();
    let target = TARGETS
        .iter()
        .find(|target| (target.0, target.1) == (nodes, title))
        .map_or(String::new(), |target| match target.3.is_finite() {
            true => format!("{} / {}", target.2, target.3),
            false => format!("{} / -", target.2),
        });
    println!(
        "| {title} | {:.2} | {:.2} | {:.2} | {target} | {} of {} | {} / {} / {} / {} | {} |",
        times.at_us(0.5),
        times.at_us(0.99),
        times.mean_us(),
        count(&|answer| answer.proved),
        answers.len(),
        by_step(Step::Walk),
        by_step(Step::Hovering),
        by_step(Step::Earlier),
        by_step(Step::Exact),
        labels.unwrap_or_default(),
    );
}

fn check(workload: &Workload, query: &Query, objective: Objective, answer: &FlightAnswer) {
    let Some(plan) = &answer.plan else {
        return;
    };
    let request = workload.request(query, objective);
    let premises = FlightPremises {
        topology: &workload.topology,
        airframe: &workload.airframe,
        payload_kg: workload.payload_kg(),
        wind: &workload.wind,
        rules: &workload.rules,
        situation: &workload.situation,
        starts: request.starts,
        destination: request.destination,
        began_s: request.began_s,
        deadline_s: request.deadline_s,
        reserve: request.reserve,
        closed_segments: request.closed_segments,
    };
    if let Err(fault) = verify_flight(plan, &premises) {
        panic!("{fault}: {query:?}");
    }
}

fn plain(workload: &Workload) {
    let queries = &workload.two[..workload.two.len().min(PLAIN_REQUESTS)];
    if queries.is_empty() {
        return;
    }
    let mut scratch = ItineraryScratch::new(&workload.topology);
    let tables = &workload.potentials[Objective::Distance as usize];
    let world = workload.world();
    let mut answer = |index: usize| {
        let query = &queries[index];
        let request = workload.request(query, Objective::Distance);
        find_plainly(&world, &request, &tables[query.destination], &mut scratch)
    };
    let answers: Vec<FlightAnswer> = (0..queries.len()).map(&mut answer).collect();
    let times = Percentiles::of(queries.len(), answer);
    let title = format!(
        "plain label-setting, distance, the first {} of two",
        queries.len()
    );
    print_row(workload, &title, &times, &answers);
}
