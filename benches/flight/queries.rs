//! The rows of the table: every list of requests by every objective, and the baseline.

use crate::percentiles::{Percentiles, print_head};
use crate::workload::{Query, Workload};
use skyway::flight::Situation;
use skyway::itinerary::{
    FlightAnswer, FlightWorld, ItineraryScratch, Objective, Obstacles, PadTimes, Step, find,
    find_plainly,
};
use skyway::verify::{FlightPremises, verify_flight};

/// Requests that plain label-setting is measured on.
const PLAIN_REQUESTS: usize = 20;

/// Checks and measures everything.
pub(crate) fn measure(workload: &Workload) {
    print_head("search over position, time and battery");
    for objective in Objective::ALL {
        for (name, queries) in [
            ("two", &workload.two),
            ("easy", &workload.easy),
            ("reroute", &workload.reroute),
        ] {
            let title = format!("{}, {name}", objective.name());
            row(
                workload,
                &workload.world(),
                objective,
                queries,
                &title,
                true,
            );
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
    let title = "distance, easy, nothing in the way";
    row(
        workload,
        &open,
        Objective::Distance,
        &workload.easy,
        title,
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
    Percentiles::of(queries.len(), answer).print(title);
    let count = |wanted: &dyn Fn(&&FlightAnswer) -> bool| answers.iter().filter(wanted).count();
    let by_step = |step: Step| count(&|answer| answer.step == step);
    let effort = answers.iter().map(|answer| answer.effort.labels).max();
    println!(
        "<!-- {title}: {} of {} with a plan, {} proved; walk {}, hovering {}, earlier {}, exact {}; at most {} labels -->",
        count(&|answer| answer.plan.is_some()),
        answers.len(),
        count(&|answer| answer.proved),
        by_step(Step::Walk),
        by_step(Step::Hovering),
        by_step(Step::Earlier),
        by_step(Step::Exact),
        effort.unwrap_or_default(),
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
    let plain = Percentiles::of(queries.len(), |index| {
        let query = &queries[index];
        let request = workload.request(query, Objective::Distance);
        find_plainly(&world, &request, &tables[query.destination], &mut scratch)
    });
    plain.print("plain label-setting, distance, two");
}
